use burn::lr_scheduler::LrScheduler;
use burn::lr_scheduler::cosine::{CosineAnnealingLrScheduler, CosineAnnealingLrSchedulerConfig};
use burn::optim::GradientsParams;
use burn::tensor::backend::AutodiffBackend;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use super::checkpoint::{CheckpointError, ModelReader, ModelWriter, Reader, StepRecord, Writer};
use super::optimizer::Optimizer;
use super::{Step, TrainingConfig, TrainingError};
use crate::losses::Term;
use crate::networks::FlattenAnything;

/// Tells the seeds of the starts from those that users count up.
const SEED_OF_START: u64 = 0x9e37_79b9_7f4a_7c15;

/// How often the learning rate is halved before training gives up: a rate eight times too high is a
/// mistake.
pub(super) const MOST_HALVINGS: u32 = 3;

/// What steps change.
#[derive(Clone)]
pub(super) struct State<B: AutodiffBackend> {
    pub model: FlattenAnything<B>,
    pub last_good: FlattenAnything<B>,
    optimizer: Optimizer<B>,
    schedule: CosineAnnealingLrScheduler,
    /// How often the learning rate was halved, after training broke down.
    pub halvings: u32,
    /// Draws the points of each step.
    pub rng: Pcg64,
    /// Steps from this start.
    pub iteration: usize,
    /// The last of them that was read.
    pub last: Option<Step>,
}

/// What of a [`State`] is no tensor.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct StateRecord {
    pub iteration: usize,
    schedule: usize,
    halvings: u32,
    rng: Pcg64,
    last: Option<StepRecord>,
}

impl StateRecord {
    /// Whether training of so many iterations can have come there; further steps are allowed.
    pub fn is_possible(&self, iterations: usize) -> bool {
        self.halvings <= MOST_HALVINGS && self.iteration <= iterations.saturating_mul(2)
    }
}

impl<B: AutodiffBackend> State<B> {
    /// Fresh weights; the first start has the configured seed.
    pub fn new(
        config: &TrainingConfig,
        start: usize,
        device: &B::Device,
    ) -> Result<Self, TrainingError> {
        let seed = SEED_OF_START.wrapping_mul(start as u64);
        let model = config
            .networks
            .init::<B>(device, config.seed.wrapping_add(seed));
        let schedule = CosineAnnealingLrSchedulerConfig::new(
            config.learning_rate,
            config.iterations.max(2) - 1,
        )
        .with_min_lr(config.final_learning_rate)
        .init()
        .map_err(|_| TrainingError::Config("learning rates must lie in (0, 1]"))?;
        Ok(Self {
            last_good: model.clone(),
            model,
            optimizer: Optimizer::new(config.optimizer, config.weight_decay),
            schedule,
            halvings: 0,
            // Other numbers than those that a fixed sample was drawn by.
            rng: Pcg64::seed_from_u64(!config.seed.wrapping_add(seed)),
            iteration: 0,
            last: None,
        })
    }

    /// A step along gradients.
    pub fn descend(&mut self, gradients: GradientsParams) {
        let rate = self.schedule.step() * 0.5_f64.powi(self.halvings as i32);
        self.model = self.optimizer.step(rate, self.model.clone(), gradients);
        self.iteration += 1;
    }

    /// Writes its tensors under a name. Returns all else.
    pub fn write(&self, name: &str, out: &mut Writer) -> StateRecord {
        ModelWriter::write(format!("{name}.model"), &self.model, out);
        ModelWriter::write(format!("{name}.last-good"), &self.last_good, out);
        let optimizer = format!("{name}.optimizer");
        self.optimizer.write(&self.model, &optimizer, out);
        StateRecord {
            iteration: self.iteration,
            schedule: self.schedule.to_record::<B>(),
            halvings: self.halvings,
            rng: self.rng.clone(),
            last: self.last.as_ref().map(StepRecord::of),
        }
    }

    /// The state that [`write`](Self::write) wrote; `added` are terms beside those of the method.
    pub fn read(
        config: &TrainingConfig,
        record: StateRecord,
        name: &str,
        added: &[Term],
        file: &Reader,
        device: &B::Device,
    ) -> Result<Self, CheckpointError> {
        let fresh = Self::new(config, 0, device).map_err(|_| CheckpointError::Config)?;
        let model = |what: &str| {
            let name = format!("{name}.{what}");
            ModelReader::read::<B>(&name, &config.networks, file, device)
        };
        let (model, last_good) = (model("model")?, model("last-good")?);
        let optimizer = format!("{name}.optimizer");
        Ok(Self {
            optimizer: fresh.optimizer.with_states(&model, &optimizer, file)?,
            model,
            last_good,
            schedule: fresh.schedule.load_record::<B>(record.schedule),
            halvings: record.halvings,
            rng: record.rng,
            iteration: record.iteration,
            last: record.last.map(|step| step.step(added)),
        })
    }
}
