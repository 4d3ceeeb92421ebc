use burn::tensor::ops::IntTensor;
use burn::tensor::{DType, Int, IntDType, Tensor, TensorPrimitive};
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::base::Checkpointer;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};

use super::BruteForceBackend;

/// The rows of `points` `[N, D]` at `indices` `[M]`: `[M, D]`. Their gradients add up by
/// [`BruteForceBackend::sum_by_index`], which is not differentiable again.
pub(super) fn rows<B: BruteForceBackend, C: CheckpointStrategy>(
    points: Tensor<Autodiff<B, C>, 2>,
    indices: Tensor<Autodiff<B, C>, 1, Int>,
) -> Tensor<Autodiff<B, C>, 2> {
    if points.dtype() != DType::F32 {
        return points.select(0, indices);
    }
    let rows = points.dims()[0];
    let indices = indices.cast(IntDType::I32).into_primitive();
    let points = points.into_primitive().tensor();
    let found = B::float_select(points.primitive, 0, indices.clone());
    let prepared = Gather
        .prepare::<C>([points.node])
        .compute_bound()
        .stateful();
    let found = match prepared {
        OpsKind::Tracked(prepared) => prepared.finish((indices, rows), found),
        OpsKind::UnTracked(prepared) => prepared.finish(found),
    };
    Tensor::from_primitive(TensorPrimitive::Float(found))
}

#[derive(Debug)]
struct Gather;

impl<B: BruteForceBackend> Backward<B, 1> for Gather {
    type State = (IntTensor<B>, usize);

    fn backward(
        self,
        ops: Ops<Self::State, 1>,
        gradients: &mut Gradients,
        _checkpointer: &mut Checkpointer,
    ) {
        let (indices, rows) = ops.state;
        let gradient = gradients.consume::<B>(&ops.node);
        if let [Some(points)] = ops.parents {
            let sums = B::sum_by_index(gradient, indices, rows);
            gradients.register::<B>(points.id, sums);
        }
    }
}
