use burn::module::{AutodiffModule, Module};
use burn::tensor::{Tensor, backend::Backend};
use burn_autodiff::Autodiff;

use super::Jacobian;
use crate::evaluation::Plain;
use crate::networks::WrapNet;

/// Differentiates the network's points with respect to Q by a backward pass on an autodiff
/// layer of its own, whose gradients stay tracked by `B`.
///
/// `backward` consumes its graph, so the three rows of the Jacobian are not taken one after
/// the other: Q is tiled three times and copy k contributes coordinate k to one summed output.
pub(super) fn jacobian<B: Backend>(net: &WrapNet<B>, q: Tensor<B, 2>) -> Jacobian<B> {
    let [n, _] = q.dims();
    // Lifted without gradients on the outer layer, which would be computed for nothing.
    let net = WrapNet::<Autodiff<B>>::from_inner(net.clone()).no_grad();
    let copies = Tensor::cat(vec![q.clone(), q.clone(), q], 0);
    let tiled = Tensor::<Autodiff<B>, 2>::from_inner(copies).require_grad();
    let points = net.forward(tiled.clone(), &Plain).points;
    let coordinate = |k: usize| points.clone().slice([k * n..(k + 1) * n, k..k + 1]).sum();
    let gradients = (coordinate(0) + coordinate(1) + coordinate(2)).backward();
    let rows = tiled
        .grad(&gradients)
        .expect("the points depend on every copy of Q");
    let column = |c: usize| {
        let blocks = (0..3)
            .map(|k| rows.clone().slice([k * n..(k + 1) * n, c..c + 1]))
            .collect();
        Tensor::cat(blocks, 1)
    };
    Jacobian {
        u: column(0),
        v: column(1),
    }
}
