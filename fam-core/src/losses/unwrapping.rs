use burn::tensor::{Tensor, backend::Backend};

/// ℓ_unwrap: mean over all points and their K nearest others of max(0, ε − ‖q_i − q_i^(k)‖),
/// a scalar `[1]`. It keeps UV coordinates from lying on each other.
///
/// `q` `[N, 2]`, `near` `[N · K, 2]` the K nearest others of each as from
/// [`NeighborSearch::gather`](crate::neighbors::NeighborSearch::gather), `epsilon` `[1]`, a
/// constant for the gradient. The distance is √(‖·‖² + 1e-8).
pub fn unwrapping_loss<B: Backend>(
    q: Tensor<B, 2>,
    near: Tensor<B, 2>,
    epsilon: Tensor<B, 1>,
) -> Tensor<B, 1> {
    let [n, _] = q.dims();
    let k = near.dims()[0] / n;
    // Broadcast, not `repeat_dim`: Burn 0.21 sums the gradient of that in the wrong order.
    let difference = near.reshape([n, k, 2]) - q.reshape([n, 1, 2]);
    let squared = (difference.clone() * difference)
        .sum_dim(2)
        .reshape([n * k, 1]);
    let distance = (squared + 1e-8).sqrt();
    (epsilon.detach().unsqueeze::<2>() - distance)
        .clamp_min(0.0)
        .mean()
}

/// L(Q): the longer side of the bounding box of `q` `[N, 2]`, as a constant scalar `[1]`.
pub fn bounding_box_side<B: Backend>(q: Tensor<B, 2>) -> Tensor<B, 1> {
    let [greatest, least] = bounds(q.detach());
    (greatest - least).max()
}

/// The greatest and the least coordinates of `q` `[N, 2]`, each `[1, 2]`.
///
/// In two stages where N has a divisor near its root: graphics devices go through a dimension one
/// after the other.
fn bounds<B: Backend>(q: Tensor<B, 2>) -> [Tensor<B, 2>; 2] {
    let n = q.dims()[0];
    let blocks = (1..=n.isqrt())
        .rev()
        .find(|blocks| n.is_multiple_of(*blocks));
    let blocks = blocks.unwrap_or(1);
    let q = q.reshape([blocks, n / blocks, 2]);
    let greatest = q.clone().max_dim(1).squeeze_dim::<2>(1).max_dim(0);
    let least = q.min_dim(1).squeeze_dim::<2>(1).min_dim(0);
    [greatest, least]
}

/// `q` `[N, 2]` minus the centre of its bounding box, divided by the largest distance
/// from it: the UV sets that the reference objective spreads out.
pub fn bounding_box_normalized<B: Backend>(q: Tensor<B, 2>) -> Tensor<B, 2> {
    let [greatest, least] = bounds(q.clone());
    let center = (greatest + least) * 0.5;
    let centered = q - center;
    let squared = (centered.clone() * centered.clone()).sum_dim(1);
    let radius = squared.max_dim(0).sqrt() + 1e-8;
    // The power -1 is a reciprocal of 14 bits on burn-ndarray, as in a division.
    let inverse_root = radius.powf_scalar(-0.5);
    centered * inverse_root.clone() * inverse_root
}

/// The threshold of the reference objective on a normalised UV set of `count` lattice points:
/// a quarter of the lattice spacing, 0.25 · 2 / (⌈√count⌉ − 1).
pub fn repulsion_threshold(count: usize) -> f32 {
    0.25 * 2.0 / ((count as f32).sqrt().ceil() - 1.0)
}
