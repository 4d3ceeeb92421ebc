//! Tiles on an autodiff layer above the one that trains: the backward pass of the layer above is
//! one operation of the layer below, which differentiates it again.

use std::sync::Arc;

use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorPrimitive};
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::base::Checkpointer;
use burn_autodiff::checkpoint::strategy::{CheckpointStrategy, NoCheckpointing};
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};

use super::{Evaluated, from_host, host};
use crate::evaluation::kernel::Saved;
use crate::evaluation::kernel::pullback::{self, Pulled};

/// The results of an evaluation without tangents as a function of copies `[K, N, in]` of its
/// inputs: `[K, N, out]`, on the layer above.
pub(super) fn above<B: Backend, C: CheckpointStrategy>(
    evaluated: Evaluated<B, C>,
    copies: Tensor<Autodiff<Autodiff<B, C>>, 3>,
) -> Tensor<Autodiff<Autodiff<B, C>>, 3> {
    let [k, n, _] = copies.dims();
    let [_, outputs] = evaluated.output.dims();
    let output = evaluated.output.unsqueeze::<3>().expand([k, n, outputs]);
    let output = output.into_primitive().tensor();
    let state = Weighted {
        parameters: evaluated.parameters,
        saved: evaluated.saved,
    };
    let copies = copies.into_primitive().tensor();
    let prepared = Above
        .prepare::<NoCheckpointing>([copies.node])
        .compute_bound()
        .stateful();
    let output = match prepared {
        OpsKind::Tracked(prepared) => prepared.finish(state, output),
        OpsKind::UnTracked(prepared) => prepared.finish(output),
    };
    Tensor::from_primitive(TensorPrimitive::Float(output))
}

/// An evaluation, and its parameters as the layer below tracks them.
#[derive(Debug, Clone)]
struct Weighted<B: Backend, C: CheckpointStrategy> {
    parameters: Tensor<Autodiff<B, C>, 1>,
    saved: Arc<Saved>,
}

/// The backward pass of the layer above, in an operation of the layer below.
#[derive(Debug)]
struct Above;

impl<B: Backend, C: CheckpointStrategy> Backward<Autodiff<B, C>, 1> for Above {
    type State = Weighted<B, C>;

    fn backward(
        self,
        ops: Ops<Self::State, 1>,
        gradients: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let upstream = gradients.consume::<Autodiff<B, C>>(&ops.node);
        let upstream = Tensor::from_primitive(TensorPrimitive::Float(upstream));
        let [copies] = ops.parents;
        if let Some(copies) = copies {
            let pulled = pull_back(ops.state, upstream).into_primitive().tensor();
            gradients.register::<Autodiff<B, C>>(copies.id, pulled);
        }
    }
}

/// Gradients `[K, N, in]` of the inputs for gradients `[K, N, out]` of the results; in the layer
/// below a function of these and of the parameters.
fn pull_back<B: Backend, C: CheckpointStrategy>(
    evaluated: Weighted<B, C>,
    upstream: Tensor<Autodiff<B, C>, 3>,
) -> Tensor<Autodiff<B, C>, 3> {
    let [k, n, _] = upstream.dims();
    let Weighted { parameters, saved } = evaluated;
    let inputs = saved.sizes.inputs();
    let parameters = parameters.into_primitive().tensor();
    let upstream = upstream.into_primitive().tensor();
    let device = B::float_device(&upstream.primitive);
    let (rows, pulled) = pullback::pull_back(saved, k, host::<B, 3>(upstream.primitive));
    let rows = from_host::<B, 3>(rows, [k, n, inputs], &device);
    let prepared = PulledBack
        .prepare::<C>([upstream.node, parameters.node])
        .compute_bound()
        .stateful();
    let rows = match prepared {
        OpsKind::Tracked(prepared) => prepared.finish(Arc::new(pulled), rows),
        OpsKind::UnTracked(prepared) => prepared.finish(rows),
    };
    Tensor::from_primitive(TensorPrimitive::Float(rows))
}

/// The gradient of [`pull_back`] in the layer below.
#[derive(Debug)]
struct PulledBack;

impl<B: Backend> Backward<B, 2> for PulledBack {
    type State = Arc<Pulled>;

    fn backward(
        self,
        ops: Ops<Self::State, 2>,
        gradients: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let gradient = gradients.consume::<B>(&ops.node);
        let device = B::float_device(&gradient);
        let [upstream, parameters] = ops.parents;
        let gradient = host::<B, 3>(gradient);
        let found = pullback::backward(&ops.state, &gradient, upstream.is_some());
        if let Some(upstream) = upstream {
            let gradient = from_host::<B, 3>(found.upstream, ops.state.shape(), &device);
            gradients.register::<B>(upstream.id, gradient);
        }
        if let Some(parameters) = parameters {
            let shape = [found.parameters.len()];
            let gradient = from_host::<B, 1>(found.parameters, shape, &device);
            gradients.register::<B>(parameters.id, gradient);
        }
    }
}
