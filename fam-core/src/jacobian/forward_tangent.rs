use burn::tensor::{FloatDType, Tensor, TensorData, backend::Backend};

use super::Jacobian;
use crate::evaluation::Evaluation;
use crate::networks::{WrapNet, Wrapped};

pub(super) fn wrap<B: Backend>(
    net: &WrapNet<B>,
    q: Tensor<B, 2>,
    evaluation: &dyn Evaluation<B>,
) -> (Wrapped<B>, Jacobian<B>) {
    let [n, _] = q.dims();
    let device = q.device();
    let dtype: FloatDType = q.dtype().into();
    let unit = |unit: [f32; 2]| {
        let tangent = Tensor::<B, 2>::from_data(TensorData::from([unit]), &device).cast(dtype);
        tangent.repeat_dim(0, n)
    };
    let units = vec![unit([1.0, 0.0]), unit([0.0, 1.0])];
    let (wrapped, pushed) = net.forward_with_tangents(q, units, evaluation);
    let [u, v] = <[_; 2]>::try_from(pushed).expect("two tangents went in");
    (wrapped, Jacobian { u, v })
}
