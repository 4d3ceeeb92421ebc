mod above;

use std::sync::Arc;

use burn::tensor::backend::Backend;
use burn::tensor::{DType, Tensor, TensorData, TensorPrimitive};
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::base::Checkpointer;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};

use super::buffers::Buffers;
use super::kernel::{self, Saved, Sizes};
use super::{Evaluation, Plain};
use crate::networks::Mlp;

/// A whole sub-network, tangents and gradients included, as one operation on the host: points go
/// through all layers in tiles that stay in a core's cache, and tiles side by side on the cores.
///
/// For backends whose tensors are in the host's memory; on others it is right but copies to and
/// fro. Numbers other than `f32` are evaluated as by [`Plain`]. Its gradients are not
/// differentiable again but those of [`twofold_above`](Evaluation::twofold_above), which is made
/// for it.
///
/// Memory of one step is used again by the next; clones share it.
///
/// Like Burn's own backends on the CPU it waits for `rayon`'s threads while a step has the
/// [turn](crate::training::turn): trainings side by side are not to run in tasks of `rayon`, which
/// would take up one training while they wait for another.
///
/// # Panics
/// If the numbers of rows and columns do not fit, as Burn's operations do.
#[derive(Debug, Clone, Default)]
pub struct Tiled {
    buffers: Arc<Buffers>,
}

type Rows<B, C> = Tensor<Autodiff<B, C>, 2>;

impl<B: Backend, C: CheckpointStrategy> Evaluation<Autodiff<B, C>> for Tiled {
    fn single(&self, xi: &Mlp<Autodiff<B, C>>, x: Rows<B, C>) -> Rows<B, C> {
        if !is_f32(&[xi], &x) {
            return Plain.single(xi, x);
        }
        self.stacked(&[xi], x, 0).output
    }

    fn twofold(
        &self,
        xi_1: &Mlp<Autodiff<B, C>>,
        xi_2: &Mlp<Autodiff<B, C>>,
        x: Rows<B, C>,
        tangents: Vec<Rows<B, C>>,
    ) -> (Rows<B, C>, Vec<Rows<B, C>>) {
        if !is_f32(&[xi_1, xi_2], &x) {
            return Plain.twofold(xi_1, xi_2, x, tangents);
        }
        self.with_tangents(&[xi_1, xi_2], x, tangents)
    }

    /// The points are evaluated once. What they leave serves the backward passes of both layers,
    /// and that of the layer above is an operation in tiles as well.
    fn twofold_above(
        &self,
        xi_1: &Mlp<Autodiff<B, C>>,
        xi_2: &Mlp<Autodiff<B, C>>,
        x: Rows<B, C>,
        copies: Tensor<Autodiff<Autodiff<B, C>>, 3>,
    ) -> (Rows<B, C>, Tensor<Autodiff<Autodiff<B, C>>, 3>) {
        if !is_f32(&[xi_1, xi_2], &x) {
            return Plain.twofold_above(xi_1, xi_2, x, copies);
        }
        assert_eq!(copies.dims()[1..], x.dims(), "copies have the shape of x");
        let evaluated = self.stacked(&[xi_1, xi_2], x, 0);
        (evaluated.output.clone(), above::above(evaluated, copies))
    }
}

/// The results of an evaluation, and what its gradients need.
struct Evaluated<B: Backend, C: CheckpointStrategy> {
    output: Rows<B, C>,
    /// All of them in one row.
    parameters: Tensor<Autodiff<B, C>, 1>,
    saved: Arc<Saved>,
}

impl Tiled {
    /// Evaluates points, and pushes tangents along.
    fn with_tangents<B: Backend, C: CheckpointStrategy>(
        &self,
        mlps: &[&Mlp<Autodiff<B, C>>],
        x: Rows<B, C>,
        tangents: Vec<Rows<B, C>>,
    ) -> (Rows<B, C>, Vec<Rows<B, C>>) {
        let shape = x.dims();
        assert!(
            tangents.iter().all(|tangent| tangent.dims() == shape),
            "every tangent has the shape of x, {shape:?}"
        );
        if tangents.is_empty() {
            return (self.stacked(mlps, x, 0).output, tangents);
        }
        let [n, _] = shape;
        let count = tangents.len();
        let rows = std::iter::once(x).chain(tangents).collect();
        let output = self.stacked(mlps, Tensor::cat(rows, 0), count).output;
        let block = |k: usize| output.clone().narrow(0, k * n, n);
        (block(0), (1..=count).map(block).collect())
    }

    /// Evaluates stacked rows: those of the points, then those of each tangent.
    fn stacked<B: Backend, C: CheckpointStrategy>(
        &self,
        mlps: &[&Mlp<Autodiff<B, C>>],
        rows: Rows<B, C>,
        tangents: usize,
    ) -> Evaluated<B, C> {
        let [count, columns] = rows.dims();
        let stacks: Vec<Vec<usize>> = mlps.iter().map(|mlp| mlp.channels()).collect();
        let mut expected = 0;
        for stack in &stacks {
            expected += columns;
            assert_eq!(stack[0], expected, "inputs of an MLP");
            expected = stack[stack.len() - 1];
        }
        let sizes = Sizes {
            stacks,
            points: count / (1 + tangents),
            tangents,
        };
        let outputs = sizes.outputs();
        let parameters = mlps.iter().flat_map(|mlp| mlp.parameters()).collect();
        let parameters = Tensor::cat(parameters, 0);
        let weights = parameters.clone().into_primitive().tensor();
        let rows = rows.into_primitive().tensor();
        let device = B::float_device(&rows.primitive);
        let input = host::<B, 2>(rows.primitive);
        let values = host::<B, 1>(weights.primitive);
        let buffers = self.buffers.clone();
        let (output, saved) = kernel::forward(sizes, input, values, buffers);
        let saved = Arc::new(saved);
        let output = from_host::<B, 2>(output, [count, outputs], &device);
        let prepared = TiledStacks
            .prepare::<C>([rows.node, weights.node])
            .compute_bound()
            .stateful();
        let output = match prepared {
            OpsKind::Tracked(prepared) => prepared.finish(saved.clone(), output),
            OpsKind::UnTracked(prepared) => prepared.finish(output),
        };
        Evaluated {
            output: Tensor::from_primitive(TensorPrimitive::Float(output)),
            parameters,
            saved,
        }
    }
}

/// The backward pass: gradients of the stacked rows and of the parameters.
#[derive(Debug)]
struct TiledStacks;

impl<B: Backend> Backward<B, 2> for TiledStacks {
    type State = Arc<Saved>;

    fn backward(
        self,
        ops: Ops<Self::State, 2>,
        gradients: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let saved = ops.state;
        let gradient = gradients.consume::<B>(&ops.node);
        let device = B::float_device(&gradient);
        let [rows, parameters] = ops.parents;
        let inputs = saved.sizes.inputs();
        let found = kernel::backward(&saved, &host::<B, 2>(gradient), rows.is_some());
        if let Some(rows) = rows {
            let shape = [found.input.len() / inputs, inputs];
            let gradient = from_host::<B, 2>(found.input, shape, &device);
            gradients.register::<B>(rows.id, gradient);
        }
        if let Some(parameters) = parameters {
            let shape = [found.parameters.len()];
            let gradient = from_host::<B, 1>(found.parameters, shape, &device);
            gradients.register::<B>(parameters.id, gradient);
        }
    }
}

/// Whether all numbers that take part are of 32 bits.
fn is_f32<B: Backend>(mlps: &[&Mlp<B>], x: &Tensor<B, 2>) -> bool {
    let mut layers = mlps.iter().flat_map(|mlp| &mlp.layers);
    x.dtype() == DType::F32 && layers.all(|layer| layer.weight.dtype() == DType::F32)
}

fn host<B: Backend, const D: usize>(tensor: B::FloatTensorPrimitive) -> Vec<f32> {
    Tensor::<B, D>::from_primitive(TensorPrimitive::Float(tensor))
        .into_data()
        .into_vec()
        .expect("tensors of f32 only come here")
}

fn from_host<B: Backend, const D: usize>(
    values: Vec<f32>,
    shape: [usize; D],
    device: &B::Device,
) -> B::FloatTensorPrimitive {
    Tensor::<B, D>::from_data(TensorData::new(values, shape), device)
        .into_primitive()
        .tensor()
}
