//! Training that is planned to end on time.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::{self, Division};
use fam_core::surface::Surface;
use fam_core::training::{Strategies, TrainingConfig};

use crate::backend::Job;
use crate::failure::Failure;
use crate::surface::Parting;

/// Share of the time that is left to finishing. On the meshes of docs/finishing.md it takes up to
/// two fifths of what training takes at the fast preset; it stops when the time is up.
const FINISHING_SHARE: f64 = 0.3;

/// Share of the time that is left to seams, pictures and files.
const WRITING_SHARE: f64 = 0.05;

/// Steps that are measured, beside two that are not.
const PROBE: usize = 10;

/// Iterations that are always made, and the most, which are the paper's.
const ITERATIONS: std::ops::RangeInclusive<usize> = 50..=10_000;

/// Widths and points of larger trainings, in the proportion of the preset `fast`. There is more in
/// them than in more steps: docs/performance.md.
const LARGER: [(usize, usize); 6] = [
    (96, 1_500),
    (128, 2_000),
    (192, 3_000),
    (256, 4_000),
    (384, 6_000),
    (512, 8_000),
];

/// With fewer steps than this there is a single start.
const FEW_STEPS: usize = 300;

/// A year, in seconds.
const LONGEST: f64 = 366.0 * 86_400.0;

/// When to stop.
#[derive(Clone, Copy)]
pub struct Stop<'a> {
    /// Set when the user interrupts.
    pub interrupt: &'a AtomicBool,
    /// When the time is up.
    pub deadline: Option<Instant>,
}

impl Stop<'_> {
    /// Whether it is time.
    pub fn now(&self) -> bool {
        let late = |deadline: Instant| Instant::now() >= deadline;
        self.interrupt.load(Ordering::Relaxed) || self.deadline.is_some_and(late)
    }
}

/// When layouts are no longer refined, so that files are written in time.
pub fn deadline(started: Instant, budget: Duration) -> Instant {
    started + budget.mul_f64(1.0 - WRITING_SHARE)
}

/// A length of time as the command line has it: `90`, `90s`, `2m`, `1.5h`.
pub fn duration(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) => (number, &text[number.len()..]),
        None => (text, "s"),
    };
    let factor = match unit {
        "h" => 3600.0,
        "m" => 60.0,
        _ => 1.0,
    };
    let seconds = number.parse::<f64>().ok().map(|n| n * factor);
    seconds
        .filter(|seconds| *seconds > 0.0 && *seconds <= LONGEST)
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .ok_or_else(|| "a time is a number above 0 and s, m or h, such as 30s".to_owned())
}

/// Measures some steps and chooses what a time allows: the iterations and, of the preset `fast`, the
/// width and the points.
pub struct Plan<'a> {
    pub config: &'a TrainingConfig,
    pub surface: &'a Surface,
    pub parting: &'a Parting,
    /// Whether the map is finished.
    pub finished: bool,
    pub budget: Duration,
    pub interrupt: &'a AtomicBool,
}

impl Job for Plan<'_> {
    type Output = Result<TrainingConfig, Failure>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let started = Instant::now();
        let reserved = match self.finished {
            true => FINISHING_SHARE + WRITING_SHARE,
            false => WRITING_SHARE,
        };
        let training = self.budget.as_secs_f64() * (1.0 - reserved);
        let steps = |config: &TrainingConfig| {
            let pace = self.pace::<B>(config, device, &strategies)?;
            let left = training - started.elapsed().as_secs_f64() - pace.start;
            Ok::<f64, Failure>(left / pace.step)
        };
        let mut chosen = (self.config.clone(), steps(self.config)?);
        for larger in larger(self.config) {
            // Of a larger training each step takes longer, by the number of points at least.
            let most = chosen.1 * chosen.0.points as f64 / larger.points as f64;
            if most < larger.steps() as f64 {
                break;
            }
            let steps = steps(&larger)?;
            if steps < larger.steps() as f64 {
                break;
            }
            chosen = (larger, steps);
        }
        if self.interrupt.load(Ordering::Relaxed) {
            // What was measured is worth nothing.
            return Ok(self.config.clone());
        }
        Ok(planned(&chosen.0, chosen.1))
    }
}

/// How fast training is, in seconds.
struct Pace {
    step: f64,
    /// What it takes beside its steps.
    start: f64,
}

impl Plan<'_> {
    fn pace<B: AutodiffBackend>(
        &self,
        config: &TrainingConfig,
        device: &B::Device,
        strategies: &Strategies<B>,
    ) -> Result<Pace, Failure> {
        let seconds =
            |iterations: usize| {
                let config = TrainingConfig {
                    iterations,
                    starts: 1,
                    ..config.clone()
                };
                let division = Division {
                    labels: &self.parting.labels,
                    squares: &self.parting.squares,
                };
                let before = Instant::now();
                let strategies = strategies.clone();
                atlas::flatten::<B>(&config, self.surface, division, device, strategies, |_| {
                    match self.interrupt.load(Ordering::Relaxed) {
                        true => ControlFlow::Break(()),
                        false => ControlFlow::Continue(()),
                    }
                })
                .map_err(Failure::input)?;
                Ok::<f64, Failure>(before.elapsed().as_secs_f64())
            };
        // The first steps allocate, and on a graphics adapter compile.
        seconds(2)?;
        let (few, many) = (seconds(2)?, seconds(2 + PROBE)?);
        let step = ((many - few) / PROBE as f64).max(1e-6);
        Ok(Pace {
            step,
            start: (few - 2.0 * step).max(0.0),
        })
    }
}

/// Larger trainings than the preset `fast`; none if the width or the points are not its own.
fn larger(config: &TrainingConfig) -> impl Iterator<Item = TrainingConfig> {
    let fast = TrainingConfig::fast();
    let own = config.networks.width == fast.networks.width && config.points == fast.points;
    let sizes = LARGER.into_iter().filter(move |_| own);
    sizes.map(|(width, points)| TrainingConfig {
        points,
        networks: config.networks.clone().with_width(width),
        ..config.clone()
    })
}

/// The configuration that takes about so many steps.
fn planned(config: &TrainingConfig, steps: f64) -> TrainingConfig {
    let most = *ITERATIONS.end() * config.starts;
    let steps = steps.clamp(1.0, most as f64);
    let starts = match steps < FEW_STEPS as f64 {
        true => 1,
        false => config.starts,
    };
    let mut planned = TrainingConfig {
        starts,
        iterations: steps as usize,
        ..config.clone()
    };
    let surplus = planned.steps() as f64 / planned.iterations as f64;
    let iterations = (steps / surplus).max(1.0) as usize;
    planned.iterations = iterations.clamp(*ITERATIONS.start(), *ITERATIONS.end());
    planned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        for (text, seconds) in [("30", 30.0), ("30s", 30.0), ("2m", 120.0), ("1.5h", 5400.0)] {
            assert_eq!(
                duration(text),
                Ok(Duration::from_secs_f64(seconds)),
                "{text}"
            );
        }
        for text in [
            "", "s", "0", "-1s", "nan", "inf", "1e30h", "9999h9", "9000h", "3 s", "30ms",
        ] {
            assert!(duration(text).is_err(), "{text}");
        }
    }

    #[test]
    fn plans_take_as_many_steps_as_there_is_time_for() {
        let fast = TrainingConfig::fast();
        for steps in [310.0, 1_450.0, 9_999.0] {
            let planned = planned(&fast, steps);
            assert_eq!(planned.starts, fast.starts);
            assert!((planned.steps() as f64 - steps).abs() < 5.0, "{steps}");
        }
        let short = planned(&fast, 200.0);
        assert_eq!((short.starts, short.iterations), (1, 200));
        assert_eq!(planned(&fast, -5.0).iterations, *ITERATIONS.start());
        assert_eq!(planned(&fast, 1e9).iterations, *ITERATIONS.end());
    }

    #[test]
    fn only_the_size_of_the_preset_is_changed() {
        let fast = TrainingConfig::fast();
        let sizes: Vec<_> = larger(&fast)
            .map(|c| (c.networks.width, c.points))
            .collect();
        assert_eq!(sizes, LARGER);
        assert!(larger(&fast).all(|c| c.steps() == fast.steps() && c.problem().is_none()));
        let points = TrainingConfig {
            points: 999,
            ..fast
        };
        assert_eq!(larger(&points).count(), 0);
        assert_eq!(larger(&TrainingConfig::paper()).count(), 0);
    }
}
