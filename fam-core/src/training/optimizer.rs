use burn::optim::adaptor::OptimizerAdaptor;
use burn::optim::{AdamW, AdamWConfig, GradientsParams, Optimizer as _};
use burn::tensor::backend::AutodiffBackend;
use serde::{Deserialize, Serialize};

use super::soap::Soap;
use crate::networks::FlattenAnything;

/// What makes steps of gradients.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OptimizerKind {
    /// AdamW, as in the paper.
    #[default]
    AdamW,
    /// [`Soap`]: Adam in a basis that turns with the gradients of each matrix, on the host.
    Soap,
}

/// An optimiser of the whole model with its state.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "a trainer has a single one")]
pub(super) enum Optimizer<B: AutodiffBackend> {
    AdamW(OptimizerAdaptor<AdamW, FlattenAnything<B>, B>),
    Soap(Soap),
}

impl<B: AutodiffBackend> Optimizer<B> {
    pub fn new(kind: OptimizerKind, weight_decay: f32) -> Self {
        match kind {
            OptimizerKind::AdamW => {
                let config = AdamWConfig::new()
                    .with_weight_decay(weight_decay)
                    .with_epsilon(1e-8);
                Self::AdamW(config.init())
            }
            OptimizerKind::Soap => Self::Soap(Soap::new(weight_decay)),
        }
    }

    pub fn step(
        &mut self,
        rate: f64,
        model: FlattenAnything<B>,
        gradients: GradientsParams,
    ) -> FlattenAnything<B> {
        match self {
            Self::AdamW(optimizer) => optimizer.step(rate, model, gradients),
            Self::Soap(optimizer) => optimizer.step(rate, model, gradients),
        }
    }
}
