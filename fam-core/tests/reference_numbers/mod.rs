//! Against reference numbers: the authors' PyTorch model and losses on a torus, evaluated with
//! the same weights and inputs.

use std::collections::HashMap;

use burn::tensor::{Tensor, TensorData, backend::AutodiffBackend};
use fam_core::evaluation::Evaluation;
use fam_core::jacobian::{FirstFundamentalForm, Jacobian, JacobianMode};
use fam_core::losses::{
    LossWeights, Losses, Objective, Term, bounding_box_normalized, bounding_box_side,
    chamfer_distance, repulsion_threshold,
};
use fam_core::neighbors::{KdTree, NeighborSearch};
use fam_core::networks::FlattenAnything;
use fam_core::training::turn;
use safetensors::SafeTensors;

/// Greatest L2 norm of a tensor's difference from the reference, over the reference's norm.
pub const TOLERANCE: f64 = 1e-4;

pub struct Reference {
    pub bytes: Vec<u8>,
}

impl Reference {
    pub fn small() -> Self {
        Self {
            bytes: include_bytes!("small.safetensors").to_vec(),
        }
    }

    pub fn values(&self, name: &str) -> (Vec<f32>, Vec<usize>) {
        let file = SafeTensors::deserialize(&self.bytes).unwrap();
        let view = file
            .tensor(name)
            .unwrap_or_else(|_| panic!("{name} is in the reference"));
        let (chunks, _) = view.data().as_chunks::<4>();
        let values = chunks.iter().map(|b| f32::from_le_bytes(*b)).collect();
        (values, view.shape().to_vec())
    }

    pub fn tensor<B: AutodiffBackend>(&self, name: &str, device: &B::Device) -> Tensor<B, 2> {
        let (values, shape) = self.values(name);
        Tensor::from_data(TensorData::new(values, [shape[0], shape[1]]), device)
    }

    /// Asserts that `found` is the tensor `name`.
    fn check(&self, name: &str, found: &[f32]) {
        let (expected, _) = self.values(name);
        let error = relative_error(found, &expected);
        assert!(error < TOLERANCE, "{name}: relative error {error:.2e}");
    }
}

pub fn relative_error(found: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    let difference = norm(
        &mut found
            .iter()
            .zip(expected)
            .map(|(a, b)| f64::from(*a) - f64::from(*b)),
    );
    difference / norm(&mut expected.iter().map(|v| f64::from(*v))).max(1e-12)
}

pub fn host<B: AutodiffBackend, const D: usize>(tensor: &Tensor<B, D>) -> Vec<f32> {
    tensor.to_data().convert::<f32>().to_vec().unwrap()
}

fn jacobian_matches<B: AutodiffBackend>(reference: &Reference, jacobian: &Jacobian<B>, map: &str) {
    reference.check(&format!("{map}_u"), &host(&jacobian.u));
    reference.check(&format!("{map}_v"), &host(&jacobian.v));
    let [larger, smaller] = FirstFundamentalForm::of(jacobian.clone()).eigenvalues();
    reference.check(&format!("lambda_{map}1"), &host(&larger));
    reference.check(&format!("lambda_{map}2"), &host(&smaller));
}

/// Every intermediate tensor, loss term and gradient for one objective and Jacobian mode.
pub fn matches<B: AutodiffBackend>(
    reference: &Reference,
    objective: Objective,
    mode: JacobianMode,
    evaluation: &dyn Evaluation<B>,
    device: &B::Device,
) {
    let _turn = turn();
    let model = FlattenAnything::<B>::from_reference(&reference.bytes, device).unwrap();
    let points = reference.tensor::<B>("points", device);
    let normals = reference.tensor::<B>("normals", device);
    let grid = reference.tensor::<B>("grid", device);

    let on_g = (objective == Objective::Paper).then_some(mode);
    let deform = model.deform_branch(grid, on_g, true, evaluation);
    reference.check("q_hat", &host(&deform.q_hat));
    reference.check("p_hat", &host(&deform.p_hat));
    reference.check("p_hat_normals", &host(&deform.p_hat_normals));
    reference.check("p_hat_cut", &host(&deform.p_hat_cut));
    reference.check("q_hat_cycle", &host(&deform.q_hat_cycle));
    if let Some(jacobian) = &deform.jacobian {
        jacobian_matches(reference, jacobian, "g");
    }
    let unwrap = model.unwrap_branch(points.clone(), mode, true, evaluation);
    reference.check("p_cut", &host(&unwrap.p_cut));
    reference.check("q", &host(&unwrap.q));
    reference.check("p_cycle", &host(&unwrap.p_cycle));
    reference.check("p_cycle_normals", &host(&unwrap.p_cycle_normals));
    reference.check("uv_side", &host(&bounding_box_side(unwrap.q.clone())));
    jacobian_matches(reference, &unwrap.jacobian, "f");
    let epsilon = bounding_box_side(unwrap.q.clone()) * (0.2 / (points.dims()[0] as f32).sqrt());
    reference.check("epsilon", &host(&epsilon));
    let normalized = bounding_box_normalized(unwrap.q.clone());
    reference.check("q_normalized", &host(&normalized));
    let threshold = repulsion_threshold(deform.q_hat.dims()[0]);
    reference.check("repulsion_threshold", &[threshold]);
    let nearest_p = KdTree.nearest(points.clone(), deform.p_hat.clone());
    let nearest_p_hat = KdTree.nearest(deform.p_hat.clone(), points.clone());
    let p_hat = deform.p_hat.clone();
    let nearest_p = KdTree.gather(points.clone(), nearest_p);
    let nearest_p_hat = KdTree.gather(p_hat.clone(), nearest_p_hat);
    let chamfer = chamfer_distance(p_hat, points.clone(), nearest_p, nearest_p_hat);
    let average = (chamfer.to_surface + chamfer.from_surface) * 0.5;
    reference.check("loss.wrap_avg", &host(&average));

    let losses = Losses::of(
        objective,
        points,
        Some(normals),
        Some(deform),
        Some(unwrap),
        None,
        &KdTree,
    );
    for (term, value) in &losses.terms {
        let name = match (term, objective) {
            (Term::Wrap, _) => "wrap",
            (Term::Unwrap, Objective::Paper) => "unwrap_mean",
            (Term::Unwrap, Objective::Reference) => "repulsion_q",
            (Term::UnwrapQHat, _) => "repulsion_q_hat",
            (Term::UnwrapQHatCycle, _) => "repulsion_q_hat_cycle",
            (Term::CyclePoints, _) => "cycle_points",
            (Term::CycleUv, _) => "cycle_uv",
            (Term::CycleNormals, _) => "cycle_normals",
            (Term::ConformalityF, _) => "conformal_f",
            (Term::ConformalityG, _) => "conformal_g",
            (Term::Flattening | Term::Added { .. }, _) => panic!("the reference has no such term"),
        };
        reference.check(&format!("loss.{name}"), &host(value));
    }
    let total_name = match objective {
        Objective::Paper => "total_paper",
        Objective::Reference => "total_reference",
    };
    let total = losses.total(&LossWeights::default());
    reference.check(&format!("loss.{total_name}"), &host(&total));

    let gradients = total.backward();
    for (name, gradient) in named_gradients(&model, &gradients) {
        reference.check(&format!("grad.{total_name}.{name}"), &gradient);
    }
}

/// The gradient of every weight `[out, in]` and bias, by the authors' names.
fn named_gradients<B: AutodiffBackend>(
    model: &FlattenAnything<B>,
    gradients: &B::Gradients,
) -> HashMap<String, Vec<f32>> {
    let stacks = [
        ("grid_deforming.mlp_1", &model.deform.mlp_1),
        ("grid_deforming.mlp_2", &model.deform.mlp_2),
        ("wrapping.mlp_1", &model.wrap.mlp_1),
        ("wrapping.mlp_2", &model.wrap.mlp_2),
        ("unwrapping.cut.mlp_1", &model.cut.mlp_1),
        ("unwrapping.cut.mlp_2", &model.cut.mlp_2),
        ("unwrapping.mlp", &model.unwrap.mlp),
    ];
    let mut named = HashMap::new();
    for (stack, mlp) in stacks {
        for (i, layer) in mlp.layers.iter().enumerate() {
            let weight = layer.weight.grad(gradients).expect("every weight is used");
            let weight = weight.transpose().into_data().convert::<f32>();
            named.insert(format!("{stack}.{i}.conv.weight"), weight.to_vec().unwrap());
            let bias = layer.bias.as_ref().unwrap().grad(gradients).unwrap();
            let bias = bias.into_data().convert::<f32>();
            named.insert(format!("{stack}.{i}.conv.bias"), bias.to_vec().unwrap());
        }
    }
    assert_eq!(named.len(), 50);
    named
}

/// Both objectives in both Jacobian modes.
pub fn all_combinations<B: AutodiffBackend>(
    reference: &Reference,
    evaluation: &dyn Evaluation<B>,
    device: &B::Device,
) {
    for objective in [Objective::Paper, Objective::Reference] {
        for mode in [JacobianMode::DoubleBackward, JacobianMode::ForwardTangent] {
            matches::<B>(reference, objective, mode, evaluation, device);
        }
    }
}
