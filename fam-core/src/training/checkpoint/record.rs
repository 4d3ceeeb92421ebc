use serde::{Deserialize, Serialize};

use crate::losses::Term;
use crate::training::{Step, TrainingConfig, TrainingError};

/// A [`Step`], with terms by their names.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct StepRecord {
    iteration: usize,
    before: usize,
    total: f32,
    terms: Vec<(String, f32)>,
}

impl StepRecord {
    pub fn of(step: &Step) -> Self {
        let term = |(term, value): &(Term, f32)| (key(*term), *value);
        Self {
            iteration: step.iteration,
            before: step.before,
            total: step.total,
            terms: step.terms.iter().map(term).collect(),
        }
    }

    /// The step; `known` are terms beside those of the method.
    pub fn step(self, known: &[Term]) -> Step {
        let term = |(name, value): (String, f32)| Some((named(&name, known)?, value));
        Step {
            iteration: self.iteration,
            before: self.before,
            total: self.total,
            terms: self.terms.into_iter().filter_map(term).collect(),
        }
    }
}

/// Why the training of a component broke off.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ErrorRecord {
    term: String,
    /// The bits of the value, which JSON has no number for.
    value: u32,
    iteration: usize,
}

impl ErrorRecord {
    /// Of an error that does not end training of other components.
    pub fn of(error: &TrainingError) -> Option<Self> {
        match error {
            TrainingError::NonFiniteLoss {
                term,
                value,
                iteration,
            } => Some(Self {
                term: key(*term),
                value: value.to_bits(),
                iteration: *iteration,
            }),
            _ => None,
        }
    }

    pub fn error(&self, config: &TrainingConfig) -> Option<TrainingError> {
        Some(TrainingError::NonFiniteLoss {
            term: named(&self.term, &config.added_terms())?,
            value: f32::from_bits(self.value),
            iteration: self.iteration,
        })
    }
}

/// Names a term; those that were added by their place.
fn key(term: Term) -> String {
    match term {
        Term::Added { index, .. } => format!("added {index}"),
        _ => term.name().to_owned(),
    }
}

fn named(name: &str, known: &[Term]) -> Option<Term> {
    let mut all = Term::OF_METHOD.iter().chain(known);
    all.find(|term| key(**term) == name).copied()
}
