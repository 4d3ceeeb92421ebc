use burn::tensor::{FloatDType, Tensor, TensorData, backend::Backend};

use super::Jacobian;
use crate::networks::{WrapNet, Wrapped};

pub(super) fn wrap<B: Backend>(net: &WrapNet<B>, q: Tensor<B, 2>) -> (Wrapped<B>, Jacobian<B>) {
    let [n, _] = q.dims();
    let device = q.device();
    let dtype: FloatDType = q.dtype().into();
    let (wrapped, slopes) = net.forward_with_slopes(q);
    let push = |unit: [f32; 2]| {
        let tangent = Tensor::<B, 2>::from_data(TensorData::from([unit]), &device).cast(dtype);
        net.push_tangent(tangent.repeat_dim(0, n), &slopes)
    };
    let jacobian = Jacobian {
        u: push([1.0, 0.0]),
        v: push([0.0, 1.0]),
    };
    (wrapped, jacobian)
}
