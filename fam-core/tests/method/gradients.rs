//! Gradients against finite differences, in 64-bit floats: the Jacobian of Wrap-Net, and the
//! derivative of the whole objective with respect to the weights.

use crate::reference_numbers::{Reference, host, relative_error};
use burn::module::{AutodiffModule, Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::{ElementConversion, FloatDType, Tensor, TensorData};
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use fam_core::evaluation::{Evaluation, Plain, Tiled};
use fam_core::jacobian::JacobianMode;
use fam_core::losses::{Flattening, LossWeights, Losses, Objective, conformality_loss};
use fam_core::neighbors::KdTree;
use fam_core::networks::{FlattenAnything, FlattenAnythingConfig};
use fam_core::training::turn;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

type Cpu = Autodiff<NdArray>;

/// Small enough to cross no kink: the activations make Jacobians jump there.
const STEP: f64 = 1e-8;
const TOLERANCE: f64 = 1e-4;

/// Moves every parameter to 64-bit floats.
struct ToDouble;

impl<B: Backend> ModuleMapper<B> for ToDouble {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
        param.map(|tensor| tensor.cast(FloatDType::F64).detach().require_grad())
    }
}

/// Moves every parameter along a random direction of unit entries.
struct Move {
    rng: Pcg64,
    distance: f64,
}

impl<B: Backend> ModuleMapper<B> for Move {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
        param.map(|tensor| {
            let signs = signs(&mut self.rng, &tensor);
            tensor + signs * self.distance
        })
    }
}

/// Sums gradient · direction over the same random direction.
struct Slope<'a, B: AutodiffBackend> {
    rng: Pcg64,
    gradients: &'a B::Gradients,
    total: f64,
}

impl<B: AutodiffBackend> ModuleVisitor<B> for Slope<'_, B> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        let value = param.val();
        let signs = signs(&mut self.rng, &value).inner();
        if let Some(gradient) = value.grad(self.gradients) {
            self.total += (gradient * signs).sum().into_scalar().elem::<f64>();
        }
    }
}

fn signs<B: Backend, const D: usize>(rng: &mut Pcg64, like: &Tensor<B, D>) -> Tensor<B, D> {
    let count = like.shape().num_elements();
    let values: Vec<f64> = (0..count)
        .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
        .collect();
    let data = TensorData::new(values, like.shape());
    Tensor::<B, D>::from_data(data, &like.device()).cast(FloatDType::F64)
}

struct Problem {
    reference: Reference,
    objective: Objective,
    mode: JacobianMode,
}

impl Problem {
    fn model(&self) -> FlattenAnything<Cpu> {
        FlattenAnything::<Cpu>::from_reference(&self.reference.bytes, &Default::default())
            .unwrap()
            .map(&mut ToDouble)
    }

    fn input(&self, name: &str) -> Tensor<Cpu, 2> {
        self.reference
            .tensor::<Cpu>(name, &Default::default())
            .cast(FloatDType::F64)
    }

    /// The corners of a right-angled triangle at every point of the torus, and the gradients that
    /// belong to it.
    fn triangles(&self) -> ([Tensor<Cpu, 2>; 3], [Tensor<Cpu, 2>; 2]) {
        let normals = self.input("normals");
        let up = Tensor::<Cpu, 2>::from_data([[0.0, 0.0, 1.0]], &Default::default());
        let up = up.cast(FloatDType::F64).expand(normals.dims());
        let along = Tensor::cross(up, normals.clone(), 1);
        let length = (along.clone() * along.clone()).sum_dim(1).sqrt();
        let along = along / length;
        let points = self.input("points");
        let corners = [along.clone(), Tensor::cross(normals, along, 1)];
        let [b, c] = corners.map(|tangent| points.clone() + tangent * 0.1);
        let gradients = [[10.0, 0.0], [0.0, 10.0]].map(|gradient| {
            let row = Tensor::<Cpu, 2>::from_data([gradient], &Default::default());
            row.cast(FloatDType::F64).expand([points.dims()[0], 2])
        });
        ([points, b, c], gradients)
    }

    /// The weights that finite differences can follow: in the paper's objective ε moves with
    /// L(Q) but is a constant for the gradient. The reference objective holds ε still, and
    /// with it tests the same loss.
    fn weights(&self) -> LossWeights {
        let weights = LossWeights {
            flattening: 0.1,
            ..LossWeights::default()
        };
        match self.objective {
            Objective::Paper => LossWeights {
                unwrap: 0.0,
                ..weights
            },
            Objective::Reference => weights,
        }
    }

    fn total(&self, model: &FlattenAnything<Cpu>, weights: &LossWeights) -> Tensor<Cpu, 1> {
        let on_g = (self.objective == Objective::Paper).then_some(self.mode);
        let deform = model.deform_branch(self.input("grid"), on_g, true, &Plain);
        let unwrap = model.unwrap_branch(self.input("points"), self.mode, true, &Plain);
        let (corners, gradients) = self.triangles();
        let flattening = Flattening {
            jacobian: model.flattening(corners, gradients, true, &Plain),
            // Either kind.
            oriented: self.objective == Objective::Paper,
        };
        Losses::of(
            self.objective,
            self.input("points"),
            Some(self.input("normals")),
            Some(deform),
            Some(unwrap),
            Some(flattening),
            &KdTree,
        )
        .total(weights)
    }

    /// The slope of the objective along a random direction: by finite differences, and by the
    /// gradient of the objective with `differentiated` weights.
    fn slopes(&self, seed: u64, differentiated: &LossWeights) -> (f64, f64) {
        let _turn = turn();
        let rng = Pcg64::seed_from_u64(seed);
        let at = |distance: f64| {
            let mut step = Move {
                rng: rng.clone(),
                distance,
            };
            let moved = self.model().map(&mut step);
            host_f64(&self.total(&moved, &self.weights()))
        };
        let finite = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        let model = self.model();
        let gradients = self.total(&model, differentiated).backward();
        let mut slope = Slope::<Cpu> {
            rng,
            gradients: &gradients,
            total: 0.0,
        };
        model.visit(&mut slope);
        (finite, slope.total)
    }
}

fn host_f64(tensor: &Tensor<Cpu, 1>) -> f64 {
    tensor.to_data().convert::<f64>().to_vec::<f64>().unwrap()[0]
}

fn relative(a: f64, b: f64) -> f64 {
    (a - b).abs() / a.abs().max(b.abs()).max(1e-12)
}

#[test]
fn objective_gradients_are_those_of_finite_differences() {
    for objective in [Objective::Paper, Objective::Reference] {
        for mode in [JacobianMode::DoubleBackward, JacobianMode::ForwardTangent] {
            let problem = Problem {
                reference: Reference::small(),
                objective,
                mode,
            };
            for seed in 0..3 {
                let (finite, gradient) = problem.slopes(seed, &problem.weights());
                let error = relative(finite, gradient);
                assert!(
                    error < TOLERANCE,
                    "{objective:?} {mode:?}: {finite} against {gradient}"
                );
            }
        }
    }
}

/// The check above must notice that a term of the gradient is missing.
#[test]
fn a_gradient_without_a_term_is_noticed() {
    let problem = Problem {
        reference: Reference::small(),
        objective: Objective::Paper,
        mode: JacobianMode::DoubleBackward,
    };
    let without_conformality = LossWeights {
        conformality: 0.0,
        ..problem.weights()
    };
    let without_flattening = LossWeights {
        flattening: 0.0,
        ..problem.weights()
    };
    // Directions along which the terms have a slope.
    for (seed, without) in [(0, without_conformality), (2, without_flattening)] {
        let (finite, gradient) = problem.slopes(seed, &without);
        assert!(relative(finite, gradient) > 100.0 * TOLERANCE);
    }
}

#[test]
fn jacobians_are_those_of_finite_differences() {
    let problem = Problem {
        reference: Reference::small(),
        objective: Objective::Paper,
        mode: JacobianMode::DoubleBackward,
    };
    let net = problem.model().valid().wrap;
    let q = problem.input("q").inner();
    let device = Default::default();
    let shifted = |du: f64, dv: f64| {
        let offset = Tensor::<NdArray, 2>::from_data([[du, dv]], &device);
        net.forward(q.clone() + offset.cast(FloatDType::F64), &Plain)
            .points
    };
    let finite_u = (shifted(STEP, 0.0) - shifted(-STEP, 0.0)) / (2.0 * STEP);
    let finite_v = (shifted(0.0, STEP) - shifted(0.0, -STEP)) / (2.0 * STEP);
    for mode in [JacobianMode::DoubleBackward, JacobianMode::ForwardTangent] {
        let _turn = turn();
        let (_, jacobian) = mode.wrap(&net, q.clone(), &Plain);
        for (found, expected) in [(jacobian.u, &finite_u), (jacobian.v, &finite_v)] {
            let largest = (found - expected.clone()).abs().max().into_scalar();
            assert!(f64::from(largest) < 1e-5, "{mode:?}: off by {largest}");
        }
    }
}

/// On other weights and points than those of the reference numbers, by plain operations and in
/// tiles: values of the Jacobian and parameter gradients of a loss made of it.
#[test]
fn both_jacobian_modes_agree() {
    let device = Default::default();
    let mut rng = Pcg64::seed_from_u64(4);
    let values: Vec<f32> = (0..600).map(|_| rng.random_range(-1.5..1.5)).collect();
    let config = FlattenAnythingConfig::new().with_width(48).with_latent(12);
    let evaluate = |mode: JacobianMode, evaluation: &dyn Evaluation<Cpu>| {
        let _turn = turn();
        let net = config.init::<Cpu>(&device, 11).wrap;
        let q = Tensor::<Cpu, 2>::from_data(TensorData::new(values.clone(), [300, 2]), &device);
        let (_, jacobian) = mode.wrap(&net, q, evaluation);
        let columns = Tensor::cat(vec![jacobian.u.clone(), jacobian.v.clone()], 1);
        let loss = conformality_loss(jacobian).sum();
        let gradients = loss.backward();
        let mut all = vec![host(&columns)];
        for layer in net.mlp_1.layers.iter().chain(&net.mlp_2.layers) {
            let gradient = layer.weight.grad(&gradients).unwrap();
            all.push(gradient.into_data().to_vec::<f32>().unwrap());
        }
        all
    };
    let forward = evaluate(JacobianMode::ForwardTangent, &Plain);
    for evaluation in [&Plain as &dyn Evaluation<Cpu>, &Tiled::default()] {
        let double = evaluate(JacobianMode::DoubleBackward, evaluation);
        for (a, b) in double.iter().zip(&forward) {
            assert!(relative_error(a, b) < TOLERANCE);
        }
        assert_eq!(double.len(), 9);
    }
}
