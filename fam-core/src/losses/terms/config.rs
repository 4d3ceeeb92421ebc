use std::sync::Arc;

use burn::tensor::backend::Backend;
use serde::{Deserialize, Serialize};

use fam_surface::{Normalization, Surface};

use super::{AddedTerm, Isometry, Landmarks, LossTerm, Mips};

/// Largest weight, that of all terms.
const LARGEST_WEIGHT: f64 = 1e6;

/// A term that a configuration adds to the objective.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermConfig {
    /// What it is multiplied by.
    pub weight: f64,
    /// Which term it is.
    #[serde(flatten)]
    pub kind: TermKind,
}

/// The terms that a configuration can name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum TermKind {
    /// [`Mips`].
    Mips,
    /// [`Isometry`].
    Isometry,
    /// [`Landmarks`].
    Landmarks(Landmarks),
}

impl TermConfig {
    /// The term of a surface.
    pub fn term<B: Backend>(
        &self,
        surface: &Surface,
        normalization: &Normalization,
    ) -> AddedTerm<B> {
        let term: Arc<dyn LossTerm<B>> = match &self.kind {
            TermKind::Mips => Arc::new(Mips),
            TermKind::Isometry => Arc::new(Isometry),
            TermKind::Landmarks(landmarks) => Arc::new(landmarks.on(surface, normalization)),
        };
        AddedTerm {
            weight: self.weight,
            term,
        }
    }

    /// As steps name it.
    pub(crate) fn name(&self) -> &'static str {
        match self.kind {
            TermKind::Mips => Mips::NAME,
            TermKind::Isometry => Isometry::NAME,
            TermKind::Landmarks(_) => Landmarks::NAME,
        }
    }

    /// What keeps it from being minimised, if anything.
    pub fn problem(&self) -> Option<&'static str> {
        if !(0.0..=LARGEST_WEIGHT).contains(&self.weight) {
            return Some("weights of terms must lie in 0..=1e6");
        }
        match &self.kind {
            TermKind::Landmarks(landmarks) => landmarks.problem(),
            TermKind::Mips | TermKind::Isometry => None,
        }
    }
}
