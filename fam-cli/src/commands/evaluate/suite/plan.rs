//! What a suite tries, in which order.

use fam_core::training::{Ablation, TrainingConfig};

use super::surfaces::{self, Kind, SuiteSurface};
use crate::args::Suite;

/// Seeds of the suite `paper`: the fewest that show a spread.
const SEEDS: u64 = 3;

/// Noise on the points of clouds, in percent of the radius of the bounding sphere: the paper's.
const NOISE: [u32; 3] = [1, 2, 4];

/// The noise of the suite `quick`.
const QUICK_NOISE: u32 = 2;

/// The parts of the method that ablations leave out.
const ABLATIONS: [Ablation; 3] = [
    Ablation::DeformBranch,
    Ablation::UnwrapBranch,
    Ablation::CutNet,
];

/// One thing to try on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trial {
    /// A layout without networks.
    Direct,
    /// A training with this seed.
    Trained(Variant, u64),
}

/// What is trained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Variant {
    /// The whole method on the surface as it is.
    Whole,
    /// The method without one of its parts.
    Without(Ablation),
    /// The whole method on points with Gaussian noise, whose standard deviation is so many percent
    /// of the radius of the bounding sphere.
    Noise(u32),
}

/// A trial of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Task {
    pub surface: &'static SuiteSurface,
    pub trial: Trial,
}

impl Trial {
    /// The name in files and in the page's JSON.
    pub fn name(self) -> String {
        match self {
            Self::Direct => "direct".to_string(),
            Self::Trained(variant, _) => variant.name(),
        }
    }

    /// The seed, where anything is random.
    pub fn seed(self) -> Option<u64> {
        match self {
            Self::Direct => None,
            Self::Trained(_, seed) => Some(seed),
        }
    }

    /// The configuration of its training, made of that of the suite. None without training.
    pub fn config(self, suite: &TrainingConfig) -> Option<TrainingConfig> {
        let Self::Trained(variant, seed) = self else {
            return None;
        };
        let without = match variant {
            Variant::Without(part) => part,
            Variant::Whole | Variant::Noise(_) => Ablation::None,
        };
        Some(TrainingConfig {
            seed,
            without,
            ..suite.clone()
        })
    }
}

impl Variant {
    /// The name in files and in the page's JSON.
    pub fn name(self) -> String {
        match self {
            Self::Whole | Self::Without(Ablation::None) => "whole".to_string(),
            Self::Without(Ablation::DeformBranch) => "without-deform-branch".to_string(),
            Self::Without(Ablation::UnwrapBranch) => "without-unwrap-branch".to_string(),
            Self::Without(Ablation::CutNet) => "without-cut-net".to_string(),
            Self::Noise(percent) => format!("noise-{percent}"),
        }
    }

    /// The variants that the page has a column for, the whole method first.
    pub fn ablations() -> Vec<Self> {
        let parts = ABLATIONS.map(Self::Without);
        [Self::Whole].into_iter().chain(parts).collect()
    }

    /// The same for noise.
    pub fn noises() -> Vec<Self> {
        let noises = NOISE.map(Self::Noise);
        [Self::Whole].into_iter().chain(noises).collect()
    }
}

/// The tasks of a suite. The layouts without networks come first, then one seed after the other: whatever
/// ends the run early, all tables have rows.
pub fn tasks(suite: Suite) -> Vec<Task> {
    let surfaces: Vec<&'static SuiteSurface> = surfaces::all()
        .iter()
        .filter(|surface| suite == Suite::Paper || surface.quick)
        .collect();
    let task = |surface, trial| Task { surface, trial };
    let meshes = surfaces
        .iter()
        .filter(|surface| surface.kind != Kind::Cloud);
    let mut tasks: Vec<Task> = meshes.map(|surface| task(surface, Trial::Direct)).collect();
    let (seeds, noises) = match suite {
        Suite::Quick => (1, &[QUICK_NOISE][..]),
        Suite::Paper => (SEEDS, &NOISE[..]),
    };
    for seed in 0..seeds {
        for surface in &surfaces {
            tasks.push(task(surface, Trial::Trained(Variant::Whole, seed)));
        }
        for surface in surfaces.iter().filter(|surface| surface.noise(suite)) {
            let noises = noises.iter().map(|&percent| Variant::Noise(percent));
            tasks.extend(noises.map(|noise| task(surface, Trial::Trained(noise, seed))));
        }
        for surface in surfaces.iter().filter(|surface| surface.ablations(suite)) {
            let parts = ABLATIONS.map(Variant::Without);
            tasks.extend(parts.map(|part| task(surface, Trial::Trained(part, seed))));
        }
    }
    tasks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The name of a task.
    fn key(task: &Task) -> (&'static str, String, Option<u64>) {
        (task.surface.name, task.trial.name(), task.trial.seed())
    }

    #[test]
    fn no_task_is_done_twice() {
        for suite in [Suite::Quick, Suite::Paper] {
            let mut keys: Vec<_> = tasks(suite).iter().map(key).collect();
            let count = keys.len();
            keys.sort();
            keys.dedup();
            assert_eq!(keys.len(), count);
        }
    }

    #[test]
    fn quick_has_all_kinds_of_trials_in_few_trainings() {
        let tasks = tasks(Suite::Quick);
        let trained = |task: &&Task| task.trial != Trial::Direct;
        assert!(tasks.iter().filter(trained).count() <= 15);
        for name in ["direct", "whole", "without-cut-net", "noise-2"] {
            assert!(tasks.iter().any(|task| task.trial.name() == name), "{name}");
        }
    }

    #[test]
    fn a_trial_changes_its_seed_and_its_part_of_the_configuration_alone() {
        let suite = TrainingConfig::fast();
        let trial = Trial::Trained(Variant::Without(Ablation::CutNet), 2);
        let expected = TrainingConfig {
            seed: 2,
            without: Ablation::CutNet,
            ..suite.clone()
        };
        assert_eq!(trial.config(&suite), Some(expected));
        assert_eq!(Trial::Direct.config(&suite), None);
    }
}
