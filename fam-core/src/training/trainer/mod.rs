mod run;
mod saved;

use std::ops::ControlFlow;
use std::sync::Arc;

use burn::module::AutodiffModule;
use burn::optim::GradientsParams;
use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::{Tensor, TensorData};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::starts::Starts;
use super::state::State;
use super::{Ablation, Strategies, TrainingConfig, turn};
use crate::cycles::lattice;
use crate::losses::{AddedTerm, Evaluated, Flattening, LossTerm, Losses, Objective, Term};
use crate::map::TrainedMap;
use crate::sampling::{PointSource, Sample, TriangleSource};
use fam_surface::{Normalization, Surface, SurfaceError};

pub(crate) use saved::TrainerRecord;

/// What one iteration did.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Zero-based, from its start.
    pub iteration: usize,
    /// Steps before it, from all starts.
    pub before: usize,
    /// The sum of these terms by the configured weights, before the step.
    pub total: f32,
    /// The unweighted terms, before the step; most steps of the opening have no ℓ_flat.
    pub terms: Vec<(Term, f32)>,
}

/// Why training could not start or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrainingError {
    /// The surface cannot be trained on.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The configuration cannot be trained.
    #[error("bad configuration: {0}")]
    Config(&'static str),
    /// Training cannot go on from a checkpoint, for this reason.
    #[error("{0}")]
    Checkpoint(String),
    /// A loss became NaN or infinite. The trainer holds the last good weights.
    #[error("the loss term {} became {value} at iteration {iteration}", term.name())]
    NonFiniteLoss {
        /// The first such term.
        term: Term,
        /// Its value.
        value: f32,
        /// Zero-based iteration.
        iteration: usize,
    },
}

/// Trains the model on a surface, step by step.
///
/// [`Trainer::new`] takes the strategies that any backend can do, [`Trainer::with_strategies`]
/// others.
///
/// Trainers on several threads take [turns](turn), step by step. They are not to be in tasks of
/// `rayon`.
#[derive(Clone)]
pub struct Trainer<B: AutodiffBackend> {
    config: TrainingConfig,
    device: B::Device,
    normalization: Normalization,
    source: PointSource,
    /// Where ℓ_flat is evaluated, if it has a weight.
    flattened: Option<Arc<TriangleSource>>,
    /// Of the opening, and after it.
    stages: [Stage<B>; 2],
    state: State<B>,
    /// To which training goes back if it breaks down.
    safe: State<B>,
    starts: Starts<B>,
    strategies: Strategies<B>,
    /// Terms beside those of the method.
    terms: Vec<AddedTerm<B>>,
    /// Steps so far, from all starts.
    done: usize,
}

/// What does not change from one iteration to the next.
#[derive(Debug, Clone)]
struct Stage<B: AutodiffBackend> {
    /// Points of an iteration.
    count: usize,
    /// They themselves, if they are always the same.
    fixed: Option<Batch<B>>,
    lattice: Tensor<B, 2>,
}

/// The points of an iteration on the device.
#[derive(Debug, Clone)]
struct Batch<B: AutodiffBackend> {
    points: Tensor<B, 2>,
    normals: Option<Tensor<B, 2>>,
}

/// Steps between two states that training can go back to: few beside a training, and many beside what
/// a copy costs.
const SAFE_EVERY: usize = 50;

impl<B: AutodiffBackend> Trainer<B> {
    /// A trainer with fresh weights and [`Strategies::plain`].
    ///
    /// # Errors
    /// A configuration or a surface that cannot be trained on.
    pub fn new(
        config: TrainingConfig,
        surface: &Surface,
        device: &B::Device,
    ) -> Result<Self, TrainingError> {
        Self::with_strategies(config, surface, device, Strategies::plain())
    }

    /// A trainer with fresh weights and strategies of the caller's.
    ///
    /// # Errors
    /// A configuration or a surface that cannot be trained on.
    pub fn with_strategies(
        config: TrainingConfig,
        surface: &Surface,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Result<Self, TrainingError> {
        if let Some(problem) = config.problem() {
            return Err(TrainingError::Config(problem));
        }
        if let Surface::Mesh(mesh) = surface
            && mesh.triangles().len() == 1
        {
            return Err(SurfaceError::TooSmall("it is a single triangle").into());
        }
        let normalization = surface.normalization()?;
        if let Surface::Mesh(mesh) = surface
            && mesh.triangle_areas().iter().all(|&area| area == 0.0)
        {
            return Err(SurfaceError::TooSmall("its triangles have no area").into());
        }
        let mut rng = Pcg64::seed_from_u64(config.seed);
        let source = PointSource::new(
            surface,
            &normalization,
            config.sampling,
            config.points,
            &mut rng,
        )?;
        if source.count() < MIN_POINTS {
            return Err(SurfaceError::TooSmall("it has fewer than 4 points").into());
        }
        let flattened = (config.weights.flattening > 0.0)
            .then(|| TriangleSource::new(surface, &normalization))
            .flatten()
            .map(Arc::new);
        let stages = [0, config.opening_iterations()].map(|iteration| {
            let count = config.points_at(iteration, source.count());
            let rows = lattice(count).into_flattened();
            let shape = [rows.len() / 2, 2];
            Stage {
                count,
                fixed: source
                    .is_fixed(count)
                    .then(|| Batch::new(source.draw(count, &mut rng), config.normals, device)),
                lattice: Tensor::from_data(TensorData::new(rows, shape), device),
            }
        });
        let state = State::new(&config, 0, device)?;
        Ok(Self {
            device: device.clone(),
            normalization,
            source,
            flattened,
            stages,
            safe: state.clone(),
            state,
            starts: Starts::default(),
            strategies,
            terms: config
                .terms
                .iter()
                .map(|term| term.term(surface, &normalization))
                .collect(),
            done: 0,
            config,
        })
    }

    /// This trainer with another term in its objective. A term of weight 0 is only observed. Terms are
    /// added before the first step, and before [`resumed`](Self::resumed).
    pub fn with_term(mut self, weight: f64, term: Arc<dyn LossTerm<B>>) -> Self {
        self.terms.push(AddedTerm { weight, term });
        self
    }

    /// Normalised points as one iteration after the opening sees them. Where they are drawn anew each
    /// time, this draws as well, and training goes on with other points than it would have.
    pub fn sample(&mut self) -> Sample {
        let count = self.source.count();
        self.source.draw(count, &mut self.state.rng)
    }

    /// How input units relate to the networks' unit ball.
    pub fn normalization(&self) -> &Normalization {
        &self.normalization
    }

    /// How many points each iteration trains on after the opening.
    pub fn points(&self) -> usize {
        self.source.count()
    }

    /// The loss terms of the current weights on the points of the next iteration, and on fresh
    /// triangles for ℓ_flat. What this draws at random, training goes on without, but for the
    /// triangles of ℓ_flat in the opening. Beside other trainers, whoever calls this holds the [`turn`]
    /// until they are differentiated or dropped.
    pub fn losses(&mut self) -> Losses<B> {
        self.losses_with(true)
    }

    /// The loss terms, `all` of them or those that the next iteration minimises.
    fn losses_with(&mut self, all: bool) -> Losses<B> {
        let iteration = self.state.iteration;
        let stage = &self.stages[usize::from(iteration >= self.config.opening_iterations())];
        let batch = match &stage.fixed {
            Some(batch) => batch.clone(),
            None => Batch::new(
                self.source.draw(stage.count, &mut self.state.rng),
                self.config.normals,
                &self.device,
            ),
        };
        let minimised = self.config.weights_at(iteration).flattening > 0.0;
        let TrainingConfig {
            jacobian,
            objective,
            without,
            ..
        } = self.config;
        let cut_net = without != Ablation::CutNet;
        let model = &self.state.model;
        let deform = (without != Ablation::DeformBranch).then(|| {
            let on_g = (objective == Objective::Paper).then_some(jacobian);
            model.deform_branch(
                stage.lattice.clone(),
                on_g,
                cut_net,
                &*self.strategies.evaluation,
            )
        });
        let unwrap = (without != Ablation::UnwrapBranch).then(|| {
            model.unwrap_branch(
                batch.points.clone(),
                jacobian,
                cut_net,
                &*self.strategies.evaluation,
            )
        });
        let flattening = self.flattened.clone();
        let flattening = flattening
            .filter(|_| (all || minimised) && without != Ablation::UnwrapBranch)
            .map(|source| {
                // Training goes on alike whether or not a term is looked at that it leaves out.
                let rng = &mut self.state.rng;
                let triangles = match minimised {
                    true => source.draw(stage.count, rng),
                    false => source.draw(stage.count, &mut rng.clone()),
                };
                let jacobian = self.state.model.flattening(
                    triangles.corners.map(|p| rows(p, &self.device)),
                    triangles.gradients.map(|g| rows(g, &self.device)),
                    cut_net,
                    &*self.strategies.evaluation,
                );
                Flattening {
                    jacobian,
                    oriented: source.is_oriented(),
                }
            });
        let added = match self.terms.is_empty() {
            true => Vec::new(),
            false => self.added(&Evaluated {
                iteration,
                points: batch.points.clone(),
                normals: batch.normals.clone(),
                deform: deform.clone(),
                unwrap: unwrap.clone(),
                flattening: flattening.clone(),
                normalization: &self.normalization,
                model: &self.state.model,
                cut_net,
                evaluation: &*self.strategies.evaluation,
            }),
        };
        let mut losses = Losses::of(
            objective,
            batch.points,
            batch.normals,
            deform,
            unwrap,
            flattening,
            &*self.strategies.search,
        );
        losses.terms.extend(added);
        losses
    }

    /// The terms that are not the method's.
    fn added(&self, evaluated: &Evaluated<'_, B>) -> Vec<(Term, Tensor<B, 1>)> {
        let added = self.terms.iter().zip(self.added_terms());
        added
            .filter_map(|(added, term)| Some((term, added.term.loss(evaluated)?)))
            .collect()
    }

    /// The names and weights of the terms that are not the method's.
    fn added_terms(&self) -> Vec<Term> {
        let terms = self.terms.iter().enumerate();
        let term = |(index, added): (usize, &AddedTerm<B>)| Term::Added {
            index,
            name: added.term.name(),
            weight: added.weight,
        };
        terms.map(term).collect()
    }

    /// One optimiser step. The learning rate follows its cosine for the configured number of
    /// iterations; further steps start the cosine again.
    ///
    /// # Errors
    /// [`TrainingError::NonFiniteLoss`], after which the trainer is back at the last weights
    /// whose losses were read and finite, or at fresh ones if there are none.
    pub fn step(&mut self) -> Result<Step, TrainingError> {
        self.read_step(true)
    }

    /// A step with a look at the losses: `all` of them or those that it minimises.
    fn read_step(&mut self, all: bool) -> Result<Step, TrainingError> {
        let _turn = turn();
        let losses = self.losses_with(all);
        let step = self.read(&losses)?;
        self.state.last_good = self.state.model.clone();
        self.state.last = Some(step.clone());
        if self.state.iteration >= self.safe.iteration + SAFE_EVERY {
            self.safe = self.state.clone();
        }
        self.descend(losses);
        Ok(step)
    }

    /// The last step that was read of those that led to the weights that [`finish`](Self::finish) takes.
    pub fn last_step(&self) -> Option<&Step> {
        let best = self.starts.best.first().map(|(_, state)| state);
        best.unwrap_or(&self.state).last.as_ref()
    }

    /// [`step`](Self::step) without a look at the losses, and so without waiting for the device (but
    /// [`Soap`](super::Soap) does).
    pub fn step_unread(&mut self) {
        let _turn = turn();
        let losses = self.losses_with(false);
        self.descend(losses);
    }

    fn descend(&mut self, losses: Losses<B>) {
        let weights = self.config.weights_at(self.state.iteration);
        let gradients = losses.total(&weights).backward();
        let gradients = GradientsParams::from_grads(gradients, &self.state.model);
        self.state.descend(gradients);
        self.done += 1;
    }

    /// The trained map with the UVs of `surface` in the unit square. Where starts are still compared, it
    /// is that of the best one that has ended: the others have not come as far. And whether the last step
    /// went well: if its weights have losses that are not finite, that error comes beside the
    /// map of the last good weights.
    pub fn finish(
        mut self,
        surface: &Surface,
    ) -> (TrainedMap<B::InnerBackend>, Result<(), TrainingError>) {
        if let Some((_, best)) = self.starts.best.first() {
            self.state = best.clone();
        }
        let turn = turn();
        let losses = self.losses();
        let last_step = self.read(&losses).map(|_| ());
        drop(turn);
        let mut map = TrainedMap::new(
            self.state.model.valid(),
            self.config,
            self.source.count(),
            self.normalization,
            &self.device,
        );
        map.fit_unit_square(surface);
        (map, last_step)
    }

    /// Reads all terms from the device at once. If one is not finite, the model goes back to the
    /// last good weights.
    fn read(&mut self, losses: &Losses<B>) -> Result<Step, TrainingError> {
        let total = losses.total(&self.config.weights).inner();
        let scalars = losses
            .terms
            .iter()
            .map(|(_, value)| value.clone().inner())
            .chain([total])
            .collect();
        let values: Vec<f32> = Tensor::cat(scalars, 0).into_data().iter::<f32>().collect();
        let terms: Vec<(Term, f32)> = losses
            .terms
            .iter()
            .map(|(term, _)| *term)
            .zip(values.iter().copied())
            .collect();
        let total = values[terms.len()];
        let counts = |term: &Term| !term.is_only_observed();
        let broken = match terms
            .iter()
            .find(|(t, value)| counts(t) && !value.is_finite())
        {
            // Finite terms whose sum is not: the largest is to blame.
            None if !total.is_finite() => terms.iter().max_by(|a, b| a.1.total_cmp(&b.1)),
            found => found,
        };
        if let Some(&(term, value)) = broken {
            self.state.model = self.state.last_good.clone();
            return Err(TrainingError::NonFiniteLoss {
                term,
                value,
                iteration: self.state.iteration,
            });
        }
        Ok(Step {
            iteration: self.state.iteration,
            before: self.done,
            total,
            terms,
        })
    }
}

/// Fewer points have no three neighbours each.
const MIN_POINTS: usize = 4;

impl<B: AutodiffBackend> Batch<B> {
    fn new(sample: Sample, with_normals: bool, device: &B::Device) -> Self {
        Self {
            points: rows(sample.points, device),
            normals: sample
                .normals
                .filter(|_| with_normals)
                .map(|normals| rows(normals, device)),
        }
    }
}

fn rows<B: Backend, const D: usize>(rows: Vec<[f32; D]>, device: &B::Device) -> Tensor<B, 2> {
    let shape = [rows.len(), D];
    Tensor::from_data(TensorData::new(rows.into_flattened(), shape), device)
}

/// Trains on a surface until the iterations are done or `observe` breaks off; it is called after
/// every step that is read. Returns the map as far as it was trained.
///
/// # Errors
/// See [`TrainingError`]. To get at the last good weights after a loss that was not finite,
/// drive a [`Trainer`] instead.
pub fn train<B: AutodiffBackend>(
    config: TrainingConfig,
    surface: &Surface,
    device: &B::Device,
    strategies: Strategies<B>,
    observe: impl FnMut(&Step) -> ControlFlow<()>,
) -> Result<TrainedMap<B::InnerBackend>, TrainingError> {
    let mut trainer = Trainer::<B>::with_strategies(config, surface, device, strategies)?;
    trainer.run(observe)?;
    let (map, last_step) = trainer.finish(surface);
    last_step.map(|()| map)
}
