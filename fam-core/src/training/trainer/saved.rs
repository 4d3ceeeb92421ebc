//! Checkpoints of a trainer.

use burn::tensor::backend::AutodiffBackend;
use serde::{Deserialize, Serialize};

use super::Trainer;
use crate::losses::Term;
use crate::map::ModelFileError;
use crate::training::TrainingConfig;
use crate::training::checkpoint::{CheckpointError, Reader, Writer};
use crate::training::starts::{Starts, StartsRecord};
use crate::training::state::{State, StateRecord};
use fam_surface::Normalization;

/// What of a trainer is no tensor.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct TrainerRecord {
    config: TrainingConfig,
    /// The terms beside those of the method.
    added: Vec<(String, f64)>,
    normalization: Normalization,
    points: usize,
    done: usize,
    state: StateRecord,
    safe: StateRecord,
    starts: StartsRecord,
}

impl TrainerRecord {
    /// Whether training can have come there.
    fn is_possible(&self) -> bool {
        let most = self.config.iterations;
        let is_sane = |state: &StateRecord| state.is_possible(most);
        is_sane(&self.state)
            && is_sane(&self.safe)
            && self.safe.iteration <= self.state.iteration
            && self.state.iteration <= self.done
            && self.starts.states().all(is_sane)
    }
}

fn names_and_weights(terms: &[Term]) -> Vec<(String, f64)> {
    let added = |term: &Term| match term {
        Term::Added { name, weight, .. } => Some(((*name).to_owned(), *weight)),
        _ => None,
    };
    terms.iter().filter_map(added).collect()
}

impl<B: AutodiffBackend> Trainer<B> {
    /// The bytes from which [`resumed`](Self::resumed) goes on after the last step.
    ///
    /// # Errors
    /// The container refuses a tensor.
    pub fn checkpoint(&self) -> Result<Vec<u8>, ModelFileError> {
        let mut out = Writer::default();
        let record = self.write("", &mut out);
        out.finish(&record)
    }

    /// Writes its tensors under a prefix. Returns all else.
    pub(crate) fn write(&self, prefix: &str, out: &mut Writer) -> TrainerRecord {
        TrainerRecord {
            config: self.config.clone(),
            added: names_and_weights(&self.added_terms()),
            normalization: self.normalization,
            points: self.source.count(),
            done: self.done,
            state: self.state.write(&format!("{prefix}state"), out),
            safe: self.safe.write(&format!("{prefix}safe"), out),
            starts: self.starts.write(&format!("{prefix}starts"), out),
        }
    }

    /// This trainer, which has made no step, where [`checkpoint`](Self::checkpoint) left off.
    ///
    /// # Errors
    /// It is no checkpoint, or that of another version, surface or configuration. Of surfaces the size
    /// and the place are compared, not every point.
    pub fn resumed(self, checkpoint: &[u8]) -> Result<Self, CheckpointError> {
        let file = Reader::new(checkpoint)?;
        let record = file.record()?;
        self.restored(record, "", &file)
    }

    /// What [`write`](Self::write) wrote.
    pub(crate) fn restored(
        mut self,
        record: TrainerRecord,
        prefix: &str,
        file: &Reader,
    ) -> Result<Self, CheckpointError> {
        if record.config != self.config || record.added != names_and_weights(&self.added_terms()) {
            return Err(CheckpointError::Config);
        }
        if !record.is_possible() {
            return Err(CheckpointError::NotACheckpoint);
        }
        if record.normalization != self.normalization || record.points != self.source.count() {
            return Err(CheckpointError::Surface);
        }
        let (config, device) = (&self.config, &self.device);
        let added = self.added_terms();
        let state = |record, name: &str| {
            let name = format!("{prefix}{name}");
            State::read(config, record, &name, &added, file, device)
        };
        self.state = state(record.state, "state")?;
        self.safe = state(record.safe, "safe")?;
        let name = format!("{prefix}starts");
        self.starts = Starts::read(config, record.starts, &name, &added, file, device)?;
        self.done = record.done;
        Ok(self)
    }
}
