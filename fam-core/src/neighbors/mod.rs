//! Nearest neighbours, for the Chamfer distance, the unwrapping loss and seams.
//!
//! Training asks for them through the trait [`NeighborSearch`] in tensors, so that a search on
//! the device can take the place of the k-d tree on the host. Which they are is a constant for
//! the gradient; where they are is not.

#[cfg(feature = "cube")]
mod brute_force;
mod kd_tree;

use burn::tensor::{Int, Tensor, backend::Backend};

#[cfg(feature = "cube")]
pub use brute_force::{BruteForce, BruteForceBackend};
pub use kd_tree::KdTree;
pub(crate) use kd_tree::rows;

/// Finds nearest neighbours in Euclidean distance.
pub trait NeighborSearch<B: Backend>: Send + Sync {
    /// For each of `queries` `[M, D]` the indices of its nearest row of `points` `[N, D]`: `[M]`.
    /// D is 2 or 3.
    fn nearest(&self, points: Tensor<B, 2>, queries: Tensor<B, 2>) -> Tensor<B, 1, Int>;

    /// For each row of `points` `[N, D]` the indices of its `k` nearest other rows, nearest
    /// first, row by row: `[N · k]`. D is 2 or 3 and `k` < N.
    fn nearest_others(&self, points: Tensor<B, 2>, k: usize) -> Tensor<B, 1, Int>;

    /// The rows of `points` `[N, D]` that were found: `[M, D]`, differentiable with respect to
    /// `points`.
    fn gather(&self, points: Tensor<B, 2>, indices: Tensor<B, 1, Int>) -> Tensor<B, 2> {
        points.select(0, indices)
    }
}
