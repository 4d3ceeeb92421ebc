use std::sync::Arc;

use burn::module::Module;
use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::{Distribution, Tensor, TensorData};
use fam_core::cycles::lattice;
use fam_core::evaluation::Evaluation;
use fam_core::jacobian::JacobianMode;
use fam_core::losses::Objective;
use fam_core::networks::{FlattenAnything, Mlp, WrapNet};
use fam_core::training::{Strategies, Trainer, TrainingConfig};
use fam_surface::{Surface, shapes};
use serde::{Deserialize, Serialize};

use super::timed::{Clock, Clocks, TimedEvaluation, TimedSearch, seconds};
use crate::backend::Job;

/// Side of the square matrices that a backend's products are measured on.
const PRODUCT: usize = 1024;

/// How often; the best counts.
const PRODUCTS: usize = 8;

/// How one backend trained.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// What computed.
    pub backend: String,
    #[serde(flatten)]
    pub seconds: Seconds,
    /// Points (and as many lattice points) a second.
    pub points_per_second: f64,
    /// The products of a step with forward tangents, per second.
    pub gflops: f64,
    /// Of a product of large matrices by the same backend.
    pub product_gflops: f64,
    /// The most memory that the process had, where the system tells.
    pub peak_memory_mib: Option<f64>,
    /// The total loss after the steps.
    pub loss: f32,
}

/// The seconds of a step and of its parts.
#[derive(Debug, Serialize, Deserialize)]
pub struct Seconds {
    pub step: f64,
    pub forward: f64,
    pub jacobian: f64,
    pub neighbors: f64,
    pub losses: f64,
    pub backward: f64,
    pub optimizer: f64,
}

/// Takes some steps and measures them.
pub struct Measure<'a> {
    pub backend: String,
    pub config: &'a TrainingConfig,
    pub steps: usize,
}

impl Job for Measure<'_> {
    type Output = Result<Measurement, String>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let clocks = Arc::new(Clocks::default());
        let search = Arc::new(TimedSearch {
            inner: strategies.search,
            clocks: clocks.clone(),
        });
        let timed = Arc::new(TimedEvaluation {
            inner: strategies.evaluation.clone(),
            clocks: clocks.clone(),
        });
        let torus = Surface::Mesh(shapes::torus(1.0, 0.4, 96, 48));
        let config = self.config.clone();
        let timed = Strategies {
            evaluation: timed,
            search,
            ..strategies
        };
        let mut trainer = Trainer::<B>::with_strategies(config, &torus, device, timed)
            .map_err(|error| error.to_string())?;
        let points = trainer.points();
        // The first step allocates, and on a graphics adapter compiles.
        trainer.step().map_err(|error| error.to_string())?;
        let model = self.config.networks.init::<B>(device, self.config.seed);
        let backward_jacobians = BackwardJacobians::<B>::new(self.config, &model, points, device);
        let mut steps = Vec::with_capacity(self.steps);
        for _ in 0..self.steps {
            let hooks = [&clocks.forward, &clocks.tangents, &clocks.neighbors];
            let (step, whole) = seconds::<B, _>(device, || trainer.step());
            step.map_err(|error| error.to_string())?;
            // What that step left on them.
            let _ = hooks.map(Clock::read);
            let (losses, before_backward) = seconds::<B, _>(device, || trainer.losses());
            let [forward, tangents, neighbors] = hooks.map(Clock::read);
            let total = losses.total(&self.config.weights);
            let (_, backward) = seconds::<B, _>(device, || total.backward());
            let jacobian = tangents + backward_jacobians.seconds(&*strategies.evaluation);
            // Differences of times of different runs, which may be below zero.
            let losses = before_backward - forward - jacobian - neighbors;
            let optimizer = whole - before_backward - backward;
            steps.push(Seconds {
                step: whole,
                forward,
                jacobian,
                neighbors,
                losses: losses.max(0.0),
                backward,
                optimizer: optimizer.max(0.0),
            });
        }
        let losses = trainer.losses().total(&self.config.weights);
        let loss = losses.into_data().iter::<f32>().next().unwrap_or(f32::NAN);
        let typical = |part: fn(&Seconds) -> f64| median(steps.iter().map(part).collect());
        let seconds = Seconds {
            step: typical(|s| s.step),
            forward: typical(|s| s.forward),
            jacobian: typical(|s| s.jacobian),
            neighbors: typical(|s| s.neighbors),
            losses: typical(|s| s.losses),
            backward: typical(|s| s.backward),
            optimizer: typical(|s| s.optimizer),
        };
        // Before the product of large matrices.
        let peak_memory_mib = peak_memory();
        let work = multiplications(&model, self.config) * points as f64;
        Ok(Measurement {
            backend: self.backend,
            points_per_second: points as f64 / seconds.step,
            // A multiplication and an addition; twice as many again in the backward pass.
            gflops: 3.0 * 2.0 * work / seconds.step / 1e9,
            product_gflops: product::<B::InnerBackend>(device),
            peak_memory_mib,
            loss,
            seconds,
        })
    }
}

/// Measures Wrap-Net and its Jacobians on their own where they are differentiated backward, which
/// [`TimedEvaluation`] does not see.
struct BackwardJacobians<B: AutodiffBackend> {
    mode: JacobianMode,
    /// How many there are.
    jacobians: f64,
    /// Without gradients: a graph that nothing differentiates would be kept beside that of the next
    /// step.
    net: WrapNet<B>,
    q: Tensor<B, 2>,
}

impl<B: AutodiffBackend> BackwardJacobians<B> {
    fn new(
        config: &TrainingConfig,
        model: &FlattenAnything<B>,
        points: usize,
        device: &B::Device,
    ) -> Self {
        let q = lattice(points);
        let shape = [q.len(), 2];
        Self {
            mode: config.jacobian,
            jacobians: jacobians(config.objective),
            net: model.wrap.clone().no_grad(),
            q: Tensor::from_data(TensorData::new(q.into_flattened(), shape), device),
        }
    }

    /// What they take; nothing with forward tangents.
    fn seconds(&self, evaluation: &dyn Evaluation<B>) -> f64 {
        if self.mode == JacobianMode::ForwardTangent {
            return 0.0;
        }
        let q = self.q.clone();
        let wrap = || self.mode.wrap(&self.net, q, evaluation);
        self.jacobians * seconds::<B, _>(&self.q.device(), wrap).1
    }
}

/// How many Jacobians a step has, at all points each.
fn jacobians(objective: Objective) -> f64 {
    match objective {
        Objective::Paper => 2.0,
        Objective::Reference => 1.0,
    }
}

/// Multiplications in the products of one forward pass with forward tangents, for each point.
fn multiplications<B: Backend>(model: &FlattenAnything<B>, config: &TrainingConfig) -> f64 {
    let of = |mlps: &[&Mlp<B>]| -> f64 {
        let layers = mlps.iter().flat_map(|mlp| &mlp.layers);
        layers
            .map(|layer| layer.weight.shape().num_elements() as f64)
            .sum()
    };
    let deform = of(&[&model.deform.mlp_1, &model.deform.mlp_2]);
    let wrap = of(&[&model.wrap.mlp_1, &model.wrap.mlp_2]);
    let cut = of(&[&model.cut.mlp_1, &model.cut.mlp_2]);
    let unwrap = of(&[&model.unwrap.mlp]);
    let flattenings = f64::from(config.weights.flattening > 0.0);
    // Two tangents for each Jacobian; ℓ_flat has a triangle for each point.
    deform
        + 2.0 * (wrap + cut + unwrap)
        + 2.0 * jacobians(config.objective) * wrap
        + 3.0 * flattenings * (cut + unwrap)
}

/// The rate of the best of some matrix products, in GFLOP/s.
fn product<B: Backend>(device: &B::Device) -> f64 {
    let matrix = || {
        let uniform = Distribution::Uniform(-1.0, 1.0);
        Tensor::<B, 2>::random([PRODUCT, PRODUCT], uniform, device)
    };
    let (a, b) = (matrix(), matrix());
    let best = (0..PRODUCTS)
        .map(|_| seconds::<B, _>(device, || a.clone().matmul(b.clone())).1)
        .fold(f64::INFINITY, f64::min);
    2.0 * (PRODUCT as f64).powi(3) / best / 1e9
}

/// The most memory that this process had so far, as Linux tells it.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
