use serde::{Deserialize, Serialize};

use crate::jacobian::JacobianMode;
use crate::losses::{LossWeights, Objective, Term, TermConfig};
use crate::networks::FlattenAnythingConfig;
use crate::sampling::Sampling;

use super::OptimizerKind;

/// A hundred times the paper's; each point takes part in every matrix of the networks.
const MAX_POINTS: usize = 1_000_000;

/// More would take longer than training itself several times over.
const MAX_STARTS: usize = 64;

/// What is left of the weight of ℓ_wrap when the surface is open. Until then it leads; after that it
/// stands in the way of the other terms (docs/experiments.md).
const WRAP_AFTER_OPENING: f64 = 0.03;

/// Share of the iterations in which it falls there, geometrically.
const WRAP_FALL: f64 = 0.2;

/// Starts that go on after the opening.
const FINALISTS: usize = 2;

/// Share of the iterations after which one of them does. By then ℓ_flat tells a surface that has
/// opened from one that has folded, which the loss after the opening does not always
/// (docs/experiments.md).
const FINALISTS_GO_ON: f64 = 0.15;

/// Share of the points that open the surface: its shape at large is what starts are compared by, and
/// maps do not end worse by it (docs/experiments.md).
const OPENING_POINTS: f64 = 0.35;

/// Fewer than that do not show a surface's shape.
const FEWEST_OPENING_POINTS: usize = 256;

/// The number of starts of configurations that name none.
fn one() -> usize {
    1
}

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
    /// Points N per iteration, and (rounded up to a square) lattice points; in the opening fewer
    /// ([`points_at`](Self::points_at)).
    pub points: usize,
    /// Optimiser steps of the map that is kept; see [`steps`](Self::steps) for all.
    pub iterations: usize,
    /// Share of the iterations that open the surface, in 0 … 1. In them ℓ_flat is not minimised; after
    /// them ℓ_wrap falls to a thirtieth of its weight ([`weights_at`](Self::weights_at)). With 0,
    /// weights are the same all the time.
    #[serde(default)]
    pub opening: f64,
    /// Fresh weights that training starts from. Those with the smallest loss go on: two after the
    /// opening, and a little later one of these ([`rounds`](Self::rounds)).
    #[serde(default = "one")]
    pub starts: usize,
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
    /// What makes steps of gradients.
    #[serde(default)]
    pub optimizer: OptimizerKind,
    /// Learning rate of the first iteration.
    pub learning_rate: f64,
    /// Learning rate of the last iteration, reached along a cosine.
    pub final_learning_rate: f64,
    /// Decoupled weight decay.
    pub weight_decay: f32,
    /// Widths of the networks.
    pub networks: FlattenAnythingConfig,
    /// Weights of the loss terms.
    pub weights: LossWeights,
    /// Terms beside those of the method.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<TermConfig>,
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
            opening: 0.0,
            starts: 1,
            seed: 0,
            sampling: Sampling::PoissonDisk,
            normals: true,
            jacobian: JacobianMode::DoubleBackward,
            objective: Objective::Paper,
            without: Ablation::None,
            optimizer: OptimizerKind::AdamW,
            learning_rate: 1e-3,
            final_learning_rate: 1e-5,
            weight_decay: 1e-8,
            networks: FlattenAnythingConfig::new().with_unwrap_factor(Some(1)),
            weights: LossWeights::default(),
            terms: Vec::new(),
        }
    }

    /// A small model and a short schedule: half a minute on a CPU of two cores.
    ///
    /// So few steps want larger ones, by an optimiser that makes more of each. Six starts open
    /// the surface, and the best go on. Only then does ℓ_flat set in, which the paper does not have,
    /// and ℓ_wrap steps back. docs/experiments.md has what each is worth.
    pub fn fast() -> Self {
        Self {
            points: 1_000,
            iterations: 1_000,
            opening: 0.1,
            starts: 6,
            jacobian: JacobianMode::ForwardTangent,
            optimizer: OptimizerKind::Soap,
            learning_rate: 5e-3,
            networks: FlattenAnythingConfig::new()
                .with_width(64)
                .with_unwrap_factor(Some(2)),
            weights: LossWeights {
                flattening: 0.02,
                ..LossWeights::default()
            },
            ..Self::paper()
        }
    }

    /// Iterations that open the surface.
    pub fn opening_iterations(&self) -> usize {
        let opening = (self.iterations as f64 * self.opening).ceil() as usize;
        opening.min(self.iterations)
    }

    /// The rounds in which several starts are compared: how many take part, and the iterations that
    /// each has behind it then. The best of the last round goes on. A single start has none.
    pub fn rounds(&self) -> Vec<(usize, usize)> {
        let opening = self.opening_iterations();
        let later = (self.iterations as f64 * FINALISTS_GO_ON).ceil() as usize;
        let finalists = (
            FINALISTS,
            self.iterations.min(opening.saturating_add(later)),
        );
        match self.starts {
            0 | 1 => Vec::new(),
            FINALISTS => vec![finalists],
            starts => vec![(starts, opening), finalists],
        }
    }

    /// Optimiser steps in all: those of the starts that are dropped included.
    pub fn steps(&self) -> usize {
        let mut dropped = 0usize;
        let mut before = 0;
        for (starts, until) in self.rounds() {
            dropped = dropped.saturating_add((starts - 1).saturating_mul(until - before));
            before = until;
        }
        self.iterations.saturating_add(dropped)
    }

    /// Those of them that open the surface, with fewer points than the others.
    pub fn opening_steps(&self) -> usize {
        let starts = self.starts.max(1);
        starts.saturating_mul(self.opening_iterations())
    }

    /// Points of an iteration (zero-based), where those after the opening have `points`.
    pub fn points_at(&self, iteration: usize, points: usize) -> usize {
        if iteration >= self.opening_iterations() {
            return points;
        }
        let few = (points as f64 * OPENING_POINTS).ceil() as usize;
        points.min(few.max(FEWEST_OPENING_POINTS))
    }

    /// The weights that an iteration (zero-based) minimises.
    pub fn weights_at(&self, iteration: usize) -> LossWeights {
        let mut weights = self.weights.clone();
        if self.opening == 0.0 {
            return weights;
        }
        if iteration < self.opening_iterations() {
            weights.flattening = 0.0;
        }
        let share = iteration as f64 / self.iterations as f64;
        let fallen = ((share - self.opening) / WRAP_FALL).clamp(0.0, 1.0);
        weights.wrap *= WRAP_AFTER_OPENING.powf(fallen);
        weights
    }

    /// The terms beside those of the method, as steps name them.
    pub(crate) fn added_terms(&self) -> Vec<Term> {
        let term = |(index, term): (usize, &TermConfig)| Term::Added {
            index,
            name: term.name(),
            weight: term.weight,
        };
        self.terms.iter().enumerate().map(term).collect()
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
        if !(16..=MAX_POINTS).contains(&self.points) {
            Some("points must lie in 16..=1000000")
        } else if self.iterations == 0 {
            Some("iterations must be at least 1")
        } else if !(0.0..=1.0).contains(&self.opening) {
            Some("opening must lie in 0..=1")
        } else if self.starts > 1 && self.opening == 0.0 {
            Some("several starts need an opening above 0, after which they are compared")
        } else if !(1..=MAX_STARTS).contains(&self.starts) {
            Some("starts must lie in 1..=64")
        } else if !self.networks.is_possible() {
            Some("networks.width, its product with unwrap_factor, and latent must lie in 1..=8192")
        } else if !weights.iter().all(|w| (0.0..=1e6).contains(w)) {
            Some("weights and weight-decay must lie in 0..=1e6")
        } else if !rates.iter().all(|r| r.is_finite() && *r > 0.0 && *r <= 1.0) {
            Some("learning rates must lie in (0, 1]")
        } else if self.final_learning_rate > self.learning_rate {
            Some("final-learning-rate must not exceed learning-rate")
        } else {
            self.problem_of_terms()
        }
    }
}

impl TrainingConfig {
    fn problem_of_terms(&self) -> Option<&'static str> {
        let is_repeated = |(i, term): (usize, &TermConfig)| {
            self.terms[..i]
                .iter()
                .any(|other| other.name() == term.name())
        };
        match self.terms.iter().enumerate().any(is_repeated) {
            true => Some("terms must be of different kinds"),
            false => self.terms.iter().find_map(TermConfig::problem),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_change_only_after_an_opening() {
        let paper = TrainingConfig::paper();
        assert_eq!((paper.opening_iterations(), paper.steps()), (0, 10_000));
        for iteration in [0, 1_000, 9_999] {
            assert_eq!(paper.weights_at(iteration), paper.weights);
        }
        let fast = TrainingConfig::fast();
        assert_eq!((fast.opening_iterations(), fast.steps()), (100, 1_650));
        assert_eq!((paper.opening_steps(), fast.opening_steps()), (0, 600));
        let at = |iteration| fast.weights_at(iteration);
        assert_eq!((at(99).flattening, at(99).wrap), (0.0, 1.0));
        assert_eq!((at(100).flattening, at(100).wrap), (0.02, 1.0));
        assert!((at(200).wrap - 0.03f64.sqrt()).abs() < 1e-9);
        for iteration in [300, 999] {
            assert!((at(iteration).wrap - 0.03).abs() < 1e-9);
        }
        assert_eq!(at(999).cycle, fast.weights.cycle);
    }

    #[test]
    fn starts_are_compared_twice() {
        let config = |starts: usize, opening: f64| TrainingConfig {
            starts,
            opening,
            ..TrainingConfig::fast()
        };
        for (starts, opening, rounds, steps) in [
            (1, 0.1, vec![], 1_000),
            (2, 0.1, vec![(2, 250)], 1_250),
            (6, 0.1, vec![(6, 100), (2, 250)], 1_650),
            (3, 0.95, vec![(3, 950), (2, 1_000)], 2_950),
            (3, 1.0, vec![(3, 1_000), (2, 1_000)], 3_000),
        ] {
            let config = config(starts, opening);
            assert_eq!((config.rounds(), config.steps()), (rounds, steps));
        }
        // In f64, they are one more.
        let endless = TrainingConfig {
            iterations: usize::MAX,
            ..config(3, 1.0)
        };
        assert_eq!(endless.steps(), usize::MAX);
    }

    #[test]
    fn few_points_open_the_surface() {
        let fast = TrainingConfig::fast();
        assert_eq!(fast.points_at(99, 1_000), 350);
        assert_eq!(fast.points_at(100, 1_000), 1_000);
        assert_eq!(fast.points_at(0, 400), 256);
        assert_eq!(fast.points_at(0, 100), 100);
        assert_eq!(TrainingConfig::paper().points_at(0, 10_000), 10_000);
    }

    #[test]
    fn starts_need_an_opening_to_be_compared_after() {
        let config = |opening: f64, starts: usize| TrainingConfig {
            opening,
            starts,
            ..TrainingConfig::fast()
        };
        assert_eq!(config(0.0, 1).problem(), None);
        assert_eq!(config(1.0, 64).problem(), None);
        for (opening, starts) in [
            (0.0, 2),
            (0.1, 0),
            (0.1, 65),
            (-0.1, 1),
            (1.1, 1),
            (f64::NAN, 1),
        ] {
            assert!(
                config(opening, starts).problem().is_some(),
                "{opening} {starts}"
            );
        }
    }
}
