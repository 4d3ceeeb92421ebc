use std::ops::ControlFlow;
use std::sync::Arc;

use burn::lr_scheduler::LrScheduler;
use burn::lr_scheduler::cosine::{CosineAnnealingLrScheduler, CosineAnnealingLrSchedulerConfig};
use burn::module::AutodiffModule;
use burn::optim::adaptor::OptimizerAdaptor;
use burn::optim::{AdamW, AdamWConfig, GradientsParams, Optimizer};
use burn::tensor::backend::AutodiffBackend;
use burn::tensor::{Tensor, TensorData};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::{Ablation, TrainingConfig, turn};
use crate::cycles::lattice;
use crate::evaluation::{Evaluation, Plain};
use crate::losses::{LossTerm, Losses, Objective};
use crate::map::TrainedMap;
use crate::neighbors::{KdTree, NeighborSearch};
use crate::networks::FlattenAnything;
use crate::sampling::{PointSource, Sample, TangentsFrom};
use crate::surface::{Normalization, Surface, SurfaceError};

/// What one iteration did.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Zero-based iteration.
    pub iteration: usize,
    /// The weighted sum of the terms, before the step.
    pub total: f32,
    /// The unweighted terms, before the step.
    pub terms: Vec<(LossTerm, f32)>,
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
    /// A loss became NaN or infinite. The trainer holds the last good weights.
    #[error("the loss term {} became {value} at iteration {iteration}", term.name())]
    NonFiniteLoss {
        /// The first such term.
        term: LossTerm,
        /// Its value.
        value: f32,
        /// Zero-based iteration.
        iteration: usize,
    },
}

/// Trains the model on a surface, step by step.
///
/// [`Trainer::new`] takes the k-d tree on the host for nearest neighbours and plain operations
/// for the networks, [`Trainer::with_strategies`] others.
///
/// Trainers on several threads take [turns](turn), step by step. These are to be threads of their
/// own, not `rayon`'s.
#[derive(Clone)]
pub struct Trainer<B: AutodiffBackend> {
    config: TrainingConfig,
    device: B::Device,
    normalization: Normalization,
    source: PointSource,
    rng: Pcg64,
    fixed: Option<Batch<B>>,
    lattice: Tensor<B, 2>,
    model: FlattenAnything<B>,
    last_good: FlattenAnything<B>,
    optimizer: OptimizerAdaptor<AdamW, FlattenAnything<B>, B>,
    schedule: CosineAnnealingLrScheduler,
    search: Arc<dyn NeighborSearch<B>>,
    evaluation: Arc<dyn Evaluation<B>>,
    iteration: usize,
}

/// The points of an iteration on the device.
#[derive(Debug, Clone)]
struct Batch<B: AutodiffBackend> {
    points: Tensor<B, 2>,
    normals: Option<Tensor<B, 2>>,
    tangents: Option<[Tensor<B, 2>; 2]>,
}

impl<B: AutodiffBackend> Trainer<B> {
    /// A trainer with fresh weights, neighbours from a k-d tree on the host and plain operations.
    ///
    /// # Errors
    /// A configuration or a surface that cannot be trained on.
    pub fn new(
        config: TrainingConfig,
        surface: &Surface,
        device: &B::Device,
    ) -> Result<Self, TrainingError> {
        Self::with_strategies(config, surface, device, Arc::new(KdTree), Arc::new(Plain))
    }

    /// A trainer with fresh weights, a neighbour search and an evaluation of the caller's.
    ///
    /// # Errors
    /// A configuration or a surface that cannot be trained on.
    pub fn with_strategies(
        config: TrainingConfig,
        surface: &Surface,
        device: &B::Device,
        search: Arc<dyn NeighborSearch<B>>,
        evaluation: Arc<dyn Evaluation<B>>,
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
        let tangents_from = match surface {
            Surface::PointCloud(_) if !config.normals => TangentsFrom::Points,
            _ => TangentsFrom::Normals,
        };
        let source = PointSource::new(
            surface,
            &normalization,
            config.sampling,
            config.points,
            (config.weights.flattening > 0.0).then_some(tangents_from),
            &mut rng,
        )?;
        if source.count() < MIN_POINTS {
            return Err(SurfaceError::TooSmall("it has fewer than 4 points").into());
        }
        let fixed = source
            .is_fixed()
            .then(|| Batch::new(source.draw(&mut rng), config.normals, device));
        let rows = lattice(source.count()).into_flattened();
        let shape = [rows.len() / 2, 2];
        let model = config.networks.init::<B>(device, config.seed);
        let optimizer = AdamWConfig::new()
            .with_weight_decay(config.weight_decay)
            .with_epsilon(1e-8)
            .init();
        let schedule = CosineAnnealingLrSchedulerConfig::new(
            config.learning_rate,
            config.iterations.max(2) - 1,
        )
        .with_min_lr(config.final_learning_rate)
        .init()
        .map_err(|_| TrainingError::Config("learning rates must lie in (0, 1]"))?;
        Ok(Self {
            device: device.clone(),
            normalization,
            source,
            rng,
            fixed,
            lattice: Tensor::from_data(TensorData::new(rows, shape), device),
            last_good: model.clone(),
            model,
            optimizer,
            schedule,
            search,
            evaluation,
            iteration: 0,
            config,
        })
    }

    /// Normalised points as one iteration sees them. Where they are drawn anew each time, this
    /// draws as well, and training goes on with other points than it would have.
    pub fn sample(&mut self) -> Sample {
        self.source.draw(&mut self.rng)
    }

    /// How many points each iteration trains on.
    pub fn points(&self) -> usize {
        self.source.count()
    }

    /// The loss terms of the current weights on the points of one iteration, drawn as
    /// [`sample`](Self::sample) says. Beside other trainers, whoever calls this holds the [`turn`]
    /// until they are differentiated or dropped.
    pub fn losses(&mut self) -> Losses<B> {
        let batch = match &self.fixed {
            Some(batch) => batch.clone(),
            None => Batch::new(
                self.source.draw(&mut self.rng),
                self.config.normals,
                &self.device,
            ),
        };
        let TrainingConfig {
            jacobian,
            objective,
            without,
            ..
        } = self.config;
        let cut_net = without != Ablation::CutNet;
        let deform = (without != Ablation::DeformBranch).then(|| {
            let on_g = (objective == Objective::Paper).then_some(jacobian);
            self.model
                .deform_branch(self.lattice.clone(), on_g, cut_net, &*self.evaluation)
        });
        let unwrap = (without != Ablation::UnwrapBranch).then(|| {
            self.model.unwrap_branch(
                batch.points.clone(),
                batch.tangents.clone(),
                jacobian,
                cut_net,
                &*self.evaluation,
            )
        });
        Losses::of(
            objective,
            batch.points,
            batch.normals,
            deform,
            unwrap,
            &*self.search,
        )
    }

    /// One optimiser step. The learning rate follows its cosine for the configured number of
    /// iterations; further steps start the cosine again.
    ///
    /// # Errors
    /// [`TrainingError::NonFiniteLoss`], after which the trainer is back at the last weights
    /// whose losses were finite.
    pub fn step(&mut self) -> Result<Step, TrainingError> {
        let _turn = turn();
        let losses = self.losses();
        let step = self.read(&losses)?;
        self.last_good = self.model.clone();
        let gradients = losses.total(&self.config.weights).backward();
        let gradients = GradientsParams::from_grads(gradients, &self.model);
        let rate = self.schedule.step();
        self.model = self.optimizer.step(rate, self.model.clone(), gradients);
        self.iteration += 1;
        Ok(step)
    }

    /// The trained map with the UVs of `surface` in the unit square, and whether the last step
    /// went well: if its weights have losses that are not finite, that error comes beside the
    /// map of the last good weights.
    pub fn finish(
        mut self,
        surface: &Surface,
    ) -> (TrainedMap<B::InnerBackend>, Result<(), TrainingError>) {
        let turn = turn();
        let losses = self.losses();
        let last_step = self.read(&losses).map(|_| ());
        drop(turn);
        let mut map = TrainedMap::new(
            self.model.valid(),
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
        let terms: Vec<(LossTerm, f32)> = losses
            .terms
            .iter()
            .map(|(term, _)| *term)
            .zip(values.iter().copied())
            .collect();
        let total = values[terms.len()];
        let broken = match terms.iter().find(|(_, value)| !value.is_finite()) {
            // Finite terms whose sum is not: the largest is to blame.
            None if !total.is_finite() => terms.iter().max_by(|a, b| a.1.total_cmp(&b.1)),
            found => found,
        };
        if let Some(&(term, value)) = broken {
            self.model = self.last_good.clone();
            return Err(TrainingError::NonFiniteLoss {
                term,
                value,
                iteration: self.iteration,
            });
        }
        Ok(Step {
            iteration: self.iteration,
            total,
            terms,
        })
    }
}

/// Fewer points have no three neighbours each.
const MIN_POINTS: usize = 4;

impl<B: AutodiffBackend> Batch<B> {
    fn new(sample: Sample, with_normals: bool, device: &B::Device) -> Self {
        let tensor = |rows: Vec<[f32; 3]>| {
            let shape = [rows.len(), 3];
            Tensor::from_data(TensorData::new(rows.into_flattened(), shape), device)
        };
        let tangents = sample
            .tangents
            .map(|tangents| [0, 1].map(|k| tensor(tangents.iter().map(|pair| pair[k]).collect())));
        Self {
            points: tensor(sample.points),
            tangents,
            normals: sample.normals.filter(|_| with_normals).map(tensor),
        }
    }
}

/// Trains on a surface until the iterations are done or `observe` breaks off; it is called after
/// every step. `evaluation` computes the networks. Returns the map as far as it was trained.
///
/// # Errors
/// See [`TrainingError`]. To get at the last good weights after a loss that was not finite,
/// drive a [`Trainer`] instead.
pub fn train<B: AutodiffBackend>(
    config: TrainingConfig,
    surface: &Surface,
    device: &B::Device,
    evaluation: impl Evaluation<B> + 'static,
    mut observe: impl FnMut(&Step) -> ControlFlow<()>,
) -> Result<TrainedMap<B::InnerBackend>, TrainingError> {
    let iterations = config.iterations;
    let mut trainer = Trainer::<B>::with_strategies(
        config,
        surface,
        device,
        Arc::new(KdTree),
        Arc::new(evaluation),
    )?;
    for _ in 0..iterations {
        let step = trainer.step()?;
        if observe(&step).is_break() {
            break;
        }
    }
    let (map, last_step) = trainer.finish(surface);
    last_step.map(|()| map)
}
