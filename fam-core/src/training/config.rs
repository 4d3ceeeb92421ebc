use serde::{Deserialize, Serialize};

use crate::jacobian::JacobianMode;
use crate::losses::{LossWeights, Objective};
use crate::networks::FlattenAnythingConfig;
use crate::sampling::Sampling;

/// A hundred times the paper's; each point takes part in every matrix of the networks.
const MAX_POINTS: usize = 1_000_000;

/// Sixteen times the paper's; memory grows with its square.
const MAX_WIDTH: usize = 8_192;

/// What the paper's ablations leave out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ablation {
    /// Nothing: the whole method.
    None,
    /// The 2D→3D→2D branch.
    DeformBranch,
    /// The 3D→2D→3D branch; UVs are then those of the nearest wrapped lattice point.
    UnwrapBranch,
    /// Cut-Net: P_cut is P.
    CutNet,
}

/// How a surface is trained on. [`TrainingConfig::paper`] and [`TrainingConfig::fast`] are the
/// two presets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct TrainingConfig {
    /// Points N per iteration, and (rounded up to a square) lattice points.
    pub points: usize,
    /// Optimiser steps.
    pub iterations: usize,
    /// Seed of everything random: weights, sampling.
    pub seed: u64,
    /// Where the points of a mesh come from.
    pub sampling: Sampling,
    /// Whether the surface's normals take part, where it has any.
    pub normals: bool,
    /// How Jacobians are computed.
    pub jacobian: JacobianMode,
    /// Which formulation of the losses is minimised.
    pub objective: Objective,
    /// What is left out.
    pub without: Ablation,
    /// Learning rate of the first iteration.
    pub learning_rate: f64,
    /// Learning rate of the last iteration, reached along a cosine.
    pub final_learning_rate: f64,
    /// Decoupled weight decay of AdamW.
    pub weight_decay: f32,
    /// Widths of the networks.
    pub networks: FlattenAnythingConfig,
    /// Weights of the loss terms.
    pub weights: LossWeights,
}

impl Default for TrainingConfig {
    fn default() -> Self {
        Self::paper()
    }
}

impl TrainingConfig {
    /// The paper's configuration: 10,000 points, 10,000 iterations, width 512.
    pub fn paper() -> Self {
        Self {
            points: 10_000,
            iterations: 10_000,
            seed: 0,
            sampling: Sampling::PoissonDisk,
            normals: true,
            jacobian: JacobianMode::DoubleBackward,
            objective: Objective::Paper,
            without: Ablation::None,
            learning_rate: 1e-3,
            final_learning_rate: 1e-5,
            weight_decay: 1e-8,
            networks: FlattenAnythingConfig::new(),
            weights: LossWeights::default(),
        }
    }

    /// A small model and a short schedule: half a minute on a CPU of two cores.
    ///
    /// So few steps want larger ones: with the paper's learning rate, the same schedule ends at
    /// a third more conformality error. ℓ_flat, which the paper does not have, takes away a fifth
    /// of the error; at four times its weight surfaces fold, and the error is larger again
    /// (docs/performance.md).
    pub fn fast() -> Self {
        Self {
            points: 1_000,
            iterations: 1_000,
            jacobian: JacobianMode::ForwardTangent,
            learning_rate: 5e-3,
            networks: FlattenAnythingConfig::new().with_width(64),
            weights: LossWeights {
                flattening: 0.005,
                ..LossWeights::default()
            },
            ..Self::paper()
        }
    }

    /// What keeps this configuration from being trained, if anything: a message that names
    /// the field.
    pub fn problem(&self) -> Option<&'static str> {
        let rates = [self.learning_rate, self.final_learning_rate];
        let weights = &self.weights;
        let weights = [
            weights.wrap,
            weights.unwrap,
            weights.cycle,
            weights.conformality,
            weights.flattening,
            f64::from(self.weight_decay),
        ];
        let widths = [self.networks.width, self.networks.latent];
        if !(16..=MAX_POINTS).contains(&self.points) {
            Some("points must lie in 16..=1000000")
        } else if self.iterations == 0 {
            Some("iterations must be at least 1")
        } else if !widths.iter().all(|w| (1..=MAX_WIDTH).contains(w)) {
            Some("networks.width and networks.latent must lie in 1..=8192")
        } else if !weights.iter().all(|w| (0.0..=1e6).contains(w)) {
            Some("weights and weight-decay must lie in 0..=1e6")
        } else if !rates.iter().all(|r| r.is_finite() && *r > 0.0 && *r <= 1.0) {
            Some("learning rates must lie in (0, 1]")
        } else if self.final_learning_rate > self.learning_rate {
            Some("final-learning-rate must not exceed learning-rate")
        } else {
            None
        }
    }
}
