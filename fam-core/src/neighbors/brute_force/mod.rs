//! Nearest neighbours on the device, for backends that compile kernels by CubeCL.

#[cfg(feature = "fusion")]
mod fusion;
mod gather;
mod kernel;

use burn::tensor::backend::Backend;
use burn::tensor::ops::{FloatTensor, IntTensor};
use burn::tensor::{FloatDType, Int, Tensor};
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::strategy::CheckpointStrategy;
use burn_cubecl::{BoolElement, CubeBackend, CubeRuntime, FloatElement, IntElement};

use super::NeighborSearch;

/// Compares every query with every point on the device, so that no iteration waits for the host.
///
/// Of points at the same distance the first is taken. Coordinates that are not finite are
/// nobody's neighbours; a query that has none gets the index 0.
#[derive(Debug, Clone, Copy, Default)]
pub struct BruteForce;

/// Backends that have the kernels.
pub trait BruteForceBackend: Backend {
    /// For each of `queries` `[M, D]` the indices of its `k` nearest `points` `[N, D]`, nearest
    /// first: 32-bit integers `[M · k]`. Both are 32-bit floats, and D is at most 3. With
    /// `others`, the queries are the points themselves, and none is its own neighbour.
    fn brute_force(
        points: FloatTensor<Self>,
        queries: FloatTensor<Self>,
        k: usize,
        others: bool,
    ) -> IntTensor<Self>;

    /// The sums `[rows, D]` of those of `values` `[M, D]` that have the same of `indices` `[M]`;
    /// floats and integers of 32 bits, and D is at most 3.
    fn sum_by_index(
        values: FloatTensor<Self>,
        indices: IntTensor<Self>,
        rows: usize,
    ) -> FloatTensor<Self>;
}

impl<R, F, I, BT> BruteForceBackend for CubeBackend<R, F, I, BT>
where
    R: CubeRuntime,
    F: FloatElement,
    I: IntElement,
    BT: BoolElement,
{
    fn brute_force(
        points: FloatTensor<Self>,
        queries: FloatTensor<Self>,
        k: usize,
        others: bool,
    ) -> IntTensor<Self> {
        kernel::nearest(points, queries, k, others)
    }

    fn sum_by_index(
        values: FloatTensor<Self>,
        indices: IntTensor<Self>,
        rows: usize,
    ) -> FloatTensor<Self> {
        kernel::sum_by_index(values, indices, rows)
    }
}

impl<B: BruteForceBackend, C: CheckpointStrategy> NeighborSearch<Autodiff<B, C>> for BruteForce {
    fn nearest(
        &self,
        points: Tensor<Autodiff<B, C>, 2>,
        queries: Tensor<Autodiff<B, C>, 2>,
    ) -> Tensor<Autodiff<B, C>, 1, Int> {
        search(points, queries, 1, false)
    }

    fn nearest_others(
        &self,
        points: Tensor<Autodiff<B, C>, 2>,
        k: usize,
    ) -> Tensor<Autodiff<B, C>, 1, Int> {
        search(points.clone(), points, k, true)
    }

    /// As by default, but for the gradient: Burn adds up the rows of one index after the other.
    fn gather(
        &self,
        points: Tensor<Autodiff<B, C>, 2>,
        indices: Tensor<Autodiff<B, C>, 1, Int>,
    ) -> Tensor<Autodiff<B, C>, 2> {
        gather::rows(points, indices)
    }
}

fn search<B: BruteForceBackend, C: CheckpointStrategy>(
    points: Tensor<Autodiff<B, C>, 2>,
    queries: Tensor<Autodiff<B, C>, 2>,
    k: usize,
    others: bool,
) -> Tensor<Autodiff<B, C>, 1, Int> {
    let single = |tensor: Tensor<Autodiff<B, C>, 2>| {
        let tensor = tensor.inner().cast(FloatDType::F32);
        tensor.into_primitive().tensor()
    };
    let found = B::brute_force(single(points), single(queries), k, others);
    Tensor::from_inner(Tensor::from_primitive(found))
}
