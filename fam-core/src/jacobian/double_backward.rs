use burn::tensor::{Tensor, backend::Backend};
use burn_autodiff::Autodiff;

use super::Jacobian;
use crate::evaluation::Evaluation;
use crate::networks::{WrapNet, Wrapped};

/// Coordinates of a point, and rows of a Jacobian.
const ROWS: usize = 3;

/// Differentiates the network's points with respect to Q by a backward pass on an autodiff
/// layer of its own, whose gradients stay tracked by `B`.
///
/// `backward` consumes its graph, so the three rows of the Jacobian are not taken one after
/// the other: there are three copies of Q, and copy k contributes coordinate k to one summed
/// output.
pub(super) fn wrap<B: Backend>(
    net: &WrapNet<B>,
    q: Tensor<B, 2>,
    evaluation: &dyn Evaluation<B>,
) -> (Wrapped<B>, Jacobian<B>) {
    let [n, _] = q.dims();
    let copies = Tensor::stack::<3>(vec![q.clone(); ROWS], 0);
    let copies = Tensor::<Autodiff<B>, 3>::from_inner(copies).require_grad();
    let (wrapped, points) = net.forward_above(q, copies.clone(), evaluation);
    let coordinate = |k: usize| points.clone().slice([k..k + 1, 0..n, k..k + 1]).sum();
    let gradients = (coordinate(0) + coordinate(1) + coordinate(2)).backward();
    let rows = copies
        .grad(&gradients)
        .expect("the points depend on every copy of Q");
    let column = |c: usize| {
        let blocks = (0..ROWS)
            .map(|k| {
                rows.clone()
                    .slice([k..k + 1, 0..n, c..c + 1])
                    .reshape([n, 1])
            })
            .collect();
        Tensor::cat(blocks, 1)
    };
    let jacobian = Jacobian {
        u: column(0),
        v: column(1),
    };
    (wrapped, jacobian)
}
