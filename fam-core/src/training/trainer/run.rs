//! The loop: starts that are compared, and the steps of the best to its end.

use std::ops::ControlFlow;

use burn::tensor::backend::AutodiffBackend;

use super::{Step, Trainer, TrainingError};
use crate::training::state::{MOST_HALVINGS, State};

/// Gets the trainer as it is after a step, and the step.
type Observer<'a, B> = dyn FnMut(&Trainer<B>, &Step) -> ControlFlow<()> + 'a;

impl<B: AutodiffBackend> Trainer<B> {
    /// The rest of the training; before the first step that is the opening of every start, and then
    /// the best to its end; or until `observe` breaks off. One of [`Strategies::read_every`](crate::training::Strategies::read_every) steps is
    /// read and observed, and the last before starts are compared or training ends. Other steps of
    /// the opening have no ℓ_flat.
    ///
    /// Where a loss is not finite, training goes back some steps and on at half the learning rate, three
    /// times at most.
    ///
    /// # Errors
    /// As [`step`](Self::step), if it happens to all starts that are compared or to the best.
    pub fn run(
        &mut self,
        mut observe: impl FnMut(&Step) -> ControlFlow<()>,
    ) -> Result<(), TrainingError> {
        self.run_observed(|_, step| observe(step))
    }

    /// [`run`](Self::run), where `observe` also gets the trainer as it is after the step, for its
    /// [`checkpoint`](Self::checkpoint).
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_observed(
        &mut self,
        mut observe: impl FnMut(&Self, &Step) -> ControlFlow<()>,
    ) -> Result<(), TrainingError> {
        let is_fresh = self.done == 0 || self.starts.begun || self.starts.round > 0;
        if is_fresh && self.best_start(&mut observe)?.is_break() {
            return Ok(());
        }
        let rest = self.config.iterations.saturating_sub(self.state.iteration);
        self.steps(rest, &mut observe).map(|_| ())
    }

    /// Takes all starts through their rounds, and goes on from the one with the smallest loss.
    fn best_start(
        &mut self,
        observe: &mut Observer<'_, B>,
    ) -> Result<ControlFlow<()>, TrainingError> {
        let rounds = self.config.rounds();
        // Of all terms, and those that training ends with.
        let [weights, last_weights] = [
            self.config.weights.clone(),
            self.config.weights_at(self.config.iterations),
        ];
        while let Some(&(starts, until)) = rounds.get(self.starts.round) {
            let weights = match until > self.config.opening_iterations() {
                true => &last_weights,
                false => &weights,
            };
            let round = self.starts.round;
            let wanted = rounds.get(round + 1).map_or(1, |&(starts, _)| starts);
            let mut outcome = Ok(ControlFlow::Continue(()));
            while self.starts.start < starts {
                if !self.starts.begun && !self.begin(round)? {
                    break;
                }
                outcome = self.steps(until.saturating_sub(self.state.iteration), observe);
                match outcome {
                    Ok(ControlFlow::Continue(())) => {
                        let last = self.state.last.as_ref();
                        let loss = last.map_or(f32::INFINITY, |step| weights.sum(&step.terms));
                        self.starts.keep(loss, self.state.clone(), wanted);
                    }
                    Ok(ControlFlow::Break(())) => break,
                    Err(_) => {}
                }
                self.starts.start += 1;
                self.starts.begun = false;
            }
            if outcome == Ok(ControlFlow::Break(())) {
                return outcome;
            }
            let Some((_, best)) = self.starts.best.first() else {
                return outcome;
            };
            self.state = best.clone();
            self.safe = best.clone();
            self.starts.next_round();
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Begins the next start of a round; one that broke down in the round before is not among them.
    fn begin(&mut self, round: usize) -> Result<bool, TrainingError> {
        let start = self.starts.start;
        match (round, start) {
            (0, 0) => {}
            (0, _) => self.state = State::new(&self.config, start, &self.device)?,
            _ => match self.starts.kept.get(start) {
                Some(state) => self.state = state.clone(),
                None => return Ok(false),
            },
        }
        self.safe = self.state.clone();
        self.starts.begun = true;
        Ok(true)
    }

    fn steps(
        &mut self,
        count: usize,
        observe: &mut Observer<'_, B>,
    ) -> Result<ControlFlow<()>, TrainingError> {
        let every = self.strategies.read_every.max(1);
        let until = self.state.iteration + count;
        let mut done = 0_usize;
        while self.state.iteration < until {
            done += 1;
            let is_last = self.state.iteration + 1 == until;
            if !done.is_multiple_of(every) && !is_last {
                self.step_unread();
                continue;
            }
            match self.read_step(is_last) {
                Ok(step) => {
                    if observe(self, &step).is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                }
                Err(error) if self.safe.halvings >= MOST_HALVINGS => return Err(error),
                Err(_) => self.go_back(),
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Goes back to the last safe state, to go on at half the learning rate.
    fn go_back(&mut self) {
        self.safe.halvings += 1;
        let back = self.state.iteration.saturating_sub(self.safe.iteration);
        self.done = self.done.saturating_sub(back);
        self.state = self.safe.clone();
    }
}
