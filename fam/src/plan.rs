//! Training that is planned to end on time.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::{self, Start};
use fam_core::training::{Strategies, TrainingConfig};
use fam_surface::Surface;

use crate::error::UnwrapError;
use crate::parting::Parting;

/// Share of the time that is left to finishing, at most.
const FINISHING_SHARE: f64 = 0.3;

/// Time for finishing, in times of the preset's training: on the meshes of docs/finishing.md it takes
/// up to two fifths of that. It stops when the time is up.
const FINISHING_TRAININGS: f64 = 0.45;

/// Share of the time that is left to seams, pictures and files.
const WRITING_SHARE: f64 = 0.05;

/// Steps that are measured.
const PROBE: usize = 10;

/// Steps before those.
const UNMEASURED: usize = 2;

/// Iterations that are always made, and the most, which are the paper's.
const ITERATIONS: std::ops::RangeInclusive<usize> = 50..=10_000;

/// Width, `unwrap_factor` and points of larger trainings than the preset `fast`. Maps get better by
/// them, but more by more steps as long as there are fewer than the most (docs/performance.md).
const LARGER: [(usize, usize, usize); 2] = [(64, 3, 1_000), (128, 1, 2_000)];

/// With fewer iterations than this there is a single start.
const FEW_ITERATIONS: usize = 200;

/// When layouts are no longer refined, so that files are written in time.
pub fn deadline(started: Instant, budget: Duration) -> Instant {
    started + budget.mul_f64(1.0 - WRITING_SHARE)
}

/// What training is planned for.
pub struct Plan<'a> {
    /// What would be trained with any amount of time.
    pub config: &'a TrainingConfig,
    /// What is trained on.
    pub surface: &'a Surface,
    /// Which triangles belong together.
    pub parting: &'a Parting,
    /// Whether the map becomes a layout, which needs time as well.
    pub finished: bool,
    /// For everything together.
    pub budget: Duration,
}

/// Measures some steps and chooses what a time allows: the iterations and, of the preset `fast`, the
/// width and the points. `observe` is asked at every step; after it breaks off, the plan is the
/// configuration as it was.
///
/// # Errors
/// The surface or the configuration cannot be trained on.
pub fn planned<B: AutodiffBackend>(
    plan: &Plan,
    device: &B::Device,
    strategies: &Strategies<B>,
    observe: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<TrainingConfig, UnwrapError> {
    let started = Instant::now();
    let mut pace = |config: &TrainingConfig| plan.pace::<B>(config, device, strategies, observe);
    let Some(own) = pace(plan.config)? else {
        return Ok(plan.config.clone());
    };
    let budget = plan.budget.as_secs_f64();
    let finishing = FINISHING_TRAININGS * (own.of(plan.config) - own.start);
    let reserved = match plan.finished {
        true => finishing.min(FINISHING_SHARE * budget),
        false => 0.0,
    };
    let training = budget * (1.0 - WRITING_SHARE) - reserved;
    let left = || training - started.elapsed().as_secs_f64();
    let (config, pace) = largest(plan.config, own, left, pace)?;
    Ok(within(&config, pace, left()))
}

/// The largest training that the time left allows, by the paces that are measured for larger ones.
/// Networks grow only where smaller ones would be through with the most iterations.
fn largest(
    config: &TrainingConfig,
    pace: Pace,
    left: impl Fn() -> f64,
    mut measure: impl FnMut(&TrainingConfig) -> Result<Option<Pace>, UnwrapError>,
) -> Result<(TrainingConfig, Pace), UnwrapError> {
    let mut largest = (config.clone(), pace);
    for larger in larger(config) {
        let longest = TrainingConfig {
            iterations: *ITERATIONS.end(),
            ..largest.0.clone()
        };
        if largest.1.of(&longest) > left() {
            break;
        }
        match measure(&larger)? {
            Some(pace) if pace.of(&larger) <= left() => largest = (larger, pace),
            _ => break,
        }
    }
    Ok(largest)
}

/// How fast training is, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pace {
    step: f64,
    /// A step that opens the surface.
    opening: f64,
    /// What it takes beside its steps.
    start: f64,
}

impl Pace {
    /// What the whole training takes.
    fn of(&self, config: &TrainingConfig) -> f64 {
        let opening = config.opening_steps();
        let others = config.steps() - opening;
        self.start + self.opening * opening as f64 + self.step * others as f64
    }
}

impl Plan<'_> {
    /// `None` if the observer breaks off: what was measured is worth nothing then.
    fn pace<B: AutodiffBackend>(
        &self,
        config: &TrainingConfig,
        device: &B::Device,
        strategies: &Strategies<B>,
        observe: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Option<Pace>, UnwrapError> {
        // Every step is to be seen.
        let strategies = Strategies {
            read_every: 1,
            ..strategies.clone()
        };
        let mut timed = |iterations: usize, opening: f64| -> Result<Option<Pace>, UnwrapError> {
            let config = TrainingConfig {
                iterations,
                opening,
                starts: 1,
                ..config.clone()
            };
            let division = self.parting.division();
            let before = Instant::now();
            let mut interrupted = false;
            let strategies = strategies.clone();
            // Of every component the first step that counts, the last, and when they ended.
            let mut seen: HashMap<usize, [(usize, Instant); 2]> = HashMap::new();
            let (start, surface) = (Start::Fresh(&config), self.surface);
            atlas::flatten::<B>(start, surface, division, device, strategies, |at| {
                let now = (at.step.iteration, Instant::now());
                if now.0 + 1 >= UNMEASURED {
                    let ends = seen.entry(at.component).or_insert([now; 2]);
                    ends[1] = now;
                }
                let flow = observe();
                interrupted |= flow.is_break();
                flow
            })
            .map_err(UnwrapError::Training)?;
            let taken = before.elapsed().as_secs_f64();
            if interrupted {
                return Ok(None);
            }
            let mean = |[first, last]: &[(usize, Instant); 2]| {
                let steps = (last.0 - first.0).max(1);
                (last.1 - first.1).as_secs_f64() / steps as f64
            };
            let step = seen.values().map(mean).sum::<f64>().max(1e-6);
            Ok(Some(Pace {
                step,
                opening: step,
                start: (taken - step * iterations as f64).max(0.0),
            }))
        };
        // The first steps allocate, and on a graphics adapter compile.
        let mut probe = |opening: f64| -> Result<Option<Pace>, UnwrapError> {
            match timed(UNMEASURED, opening)? {
                Some(_) => timed(UNMEASURED + PROBE, opening),
                None => Ok(None),
            }
        };
        let Some(pace) = probe(0.0)? else {
            return Ok(None);
        };
        if config.opening == 0.0 {
            return Ok(Some(pace));
        }
        // They take at least their share of points.
        let least = pace.step * config.points_at(0, config.points) as f64 / config.points as f64;
        Ok(probe(1.0)?.map(|Pace { opening, .. }| Pace {
            opening: opening.max(least),
            ..pace
        }))
    }
}

/// Larger trainings than the preset `fast`; none if its sizes are not its own.
fn larger(config: &TrainingConfig) -> impl Iterator<Item = TrainingConfig> {
    let fast = TrainingConfig::fast();
    let own = config.networks == fast.networks && config.points == fast.points;
    let sizes = LARGER.into_iter().filter(move |_| own);
    sizes.map(|(width, factor, points)| TrainingConfig {
        points,
        networks: config
            .networks
            .clone()
            .with_width(width)
            .with_unwrap_factor(Some(factor)),
        ..config.clone()
    })
}

/// The configuration that takes about so many seconds.
fn within(config: &TrainingConfig, pace: Pace, seconds: f64) -> TrainingConfig {
    let with = |iterations: usize, starts: usize| TrainingConfig {
        iterations,
        starts,
        ..config.clone()
    };
    let fits = |config: &TrainingConfig| pace.of(config) <= seconds;
    let starts = match fits(&with(FEW_ITERATIONS, config.starts)) {
        true => config.starts,
        false => 1,
    };
    let (mut least, mut most) = (*ITERATIONS.start(), *ITERATIONS.end());
    while least < most {
        let middle = (least + most).div_ceil(2);
        match fits(&with(middle, starts)) {
            true => least = middle,
            false => most = middle - 1,
        }
    }
    with(least, starts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_take_as_much_time_as_there_is() {
        let fast = TrainingConfig::fast();
        let pace = Pace {
            step: 0.01,
            opening: 0.004,
            start: 1.0,
        };
        for seconds in [5.0, 20.0, 100.0] {
            let planned = within(&fast, pace, seconds);
            assert_eq!(planned.starts, fast.starts);
            let taken = pace.of(&planned);
            assert!((seconds - 0.1..=seconds).contains(&taken), "{taken}");
        }
        // Of one start all steps count, and the tenth of them that open are faster.
        let short = within(&fast, pace, 2.0);
        assert_eq!((short.starts, short.iterations), (1, 106));
        assert_eq!(within(&fast, pace, -5.0).iterations, *ITERATIONS.start());
        assert_eq!(within(&fast, pace, 1e9).iterations, *ITERATIONS.end());
    }

    #[test]
    fn networks_grow_where_the_most_iterations_leave_time() {
        let fast = TrainingConfig::fast();
        let most = TrainingConfig {
            iterations: *ITERATIONS.end(),
            ..fast.clone()
        };
        // The time of the most iterations.
        let pace = |seconds: f64| Pace {
            step: seconds / most.steps() as f64,
            opening: seconds / most.steps() as f64,
            start: 0.0,
        };
        let [a, b] = LARGER;
        let chosen = |left: f64, stopped_at: usize| {
            let mut measured = Vec::new();
            let measure = |config: &TrainingConfig| {
                let size = size(config);
                measured.push(size);
                let at = LARGER.iter().position(|larger| *larger == size).unwrap();
                Ok((at != stopped_at).then(|| pace([300.0, 900.0][at])))
            };
            let (config, chosen) = largest(&fast, pace(200.0), || left, measure).unwrap();
            (size(&config), chosen.of(&most).round(), measured)
        };
        assert_eq!(chosen(199.0, 9), (size(&fast), 200.0, vec![]));
        assert_eq!(chosen(201.0, 9), (a, 300.0, vec![a]));
        assert_eq!(chosen(299.0, 9), (a, 300.0, vec![a]));
        assert_eq!(chosen(301.0, 9), (b, 900.0, vec![a, b]));
        assert_eq!(chosen(1e9, 0), (size(&fast), 200.0, vec![a]));
    }

    fn size(config: &TrainingConfig) -> (usize, usize, usize) {
        let networks = &config.networks;
        (
            networks.width,
            networks.unwrap_factor.unwrap(),
            config.points,
        )
    }

    #[test]
    fn only_the_size_of_the_preset_is_changed() {
        let fast = TrainingConfig::fast();
        let sizes: Vec<_> = larger(&fast).map(|c| size(&c)).collect();
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
