use burn::tensor::backend::AutodiffBackend;
use serde::{Deserialize, Serialize};

use super::TrainingConfig;
use super::checkpoint::{CheckpointError, Reader, Writer};
use super::state::{State, StateRecord};
use crate::losses::Term;

/// Where the comparison of starts is.
#[derive(Clone)]
pub(super) struct Starts<B: AutodiffBackend> {
    /// Of [`TrainingConfig::rounds`].
    pub round: usize,
    /// The one that is trained, in this round.
    pub start: usize,
    /// Whether it has begun.
    pub begun: bool,
    /// Those that take part in this round; of the first, none is there before it has begun.
    pub kept: Vec<State<B>>,
    /// The best of this round so far, each with its loss.
    pub best: Vec<(f32, State<B>)>,
}

/// What of [`Starts`] is no tensor.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StartsRecord {
    round: usize,
    start: usize,
    begun: bool,
    kept: Vec<StateRecord>,
    /// With the bits of their losses: one may be infinite, which JSON has no number for.
    best: Vec<(u32, StateRecord)>,
}

impl StartsRecord {
    pub fn states(&self) -> impl Iterator<Item = &StateRecord> {
        let best = self.best.iter().map(|(_, state)| state);
        self.kept.iter().chain(best)
    }
}

impl<B: AutodiffBackend> Default for Starts<B> {
    fn default() -> Self {
        Self {
            round: 0,
            start: 0,
            begun: false,
            kept: Vec::new(),
            best: Vec::new(),
        }
    }
}

impl<B: AutodiffBackend> Starts<B> {
    /// Keeps a start that came to the end of its round, if it is one of the best.
    pub fn keep(&mut self, loss: f32, state: State<B>, wanted: usize) {
        self.best.push((loss, state));
        self.best.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        self.best.truncate(wanted);
    }

    /// Goes on to the next round, with the best of this one.
    pub fn next_round(&mut self) {
        let best = std::mem::take(&mut self.best);
        *self = Self {
            round: self.round + 1,
            kept: best.into_iter().map(|(_, state)| state).collect(),
            ..Self::default()
        };
    }

    /// Writes its tensors. Returns all else.
    pub fn write(&self, name: &str, out: &mut Writer) -> StartsRecord {
        let kept = self.kept.iter().enumerate();
        let kept = kept.map(|(i, state)| state.write(&format!("{name}.kept-{i}"), out));
        let kept = kept.collect();
        let best = self.best.iter().enumerate();
        let best = best.map(|(i, (loss, state))| {
            let record = state.write(&format!("{name}.best-{i}"), out);
            (loss.to_bits(), record)
        });
        StartsRecord {
            round: self.round,
            start: self.start,
            begun: self.begun,
            kept,
            best: best.collect(),
        }
    }

    /// What [`write`](Self::write) wrote.
    pub fn read(
        config: &TrainingConfig,
        record: StartsRecord,
        name: &str,
        added: &[Term],
        file: &Reader,
        device: &B::Device,
    ) -> Result<Self, CheckpointError> {
        let read = |record, name: String| State::read(config, record, &name, added, file, device);
        let mut starts = Self {
            round: record.round,
            start: record.start,
            begun: record.begun,
            ..Self::default()
        };
        for (i, state) in record.kept.into_iter().enumerate() {
            starts.kept.push(read(state, format!("{name}.kept-{i}"))?);
        }
        for (i, (loss, state)) in record.best.into_iter().enumerate() {
            starts.best.push((
                f32::from_bits(loss),
                read(state, format!("{name}.best-{i}"))?,
            ));
        }
        Ok(starts)
    }
}
