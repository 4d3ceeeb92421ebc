use burn::tensor::{Tensor, backend::Backend};

/// Distances below this count as zero: the square root has no derivative there.
const SMALLEST_SQUARED_DISTANCE: f32 = 1e-14;

/// The two halves of the Chamfer distance, scalars `[1]` in the units of the points.
#[derive(Debug, Clone)]
pub struct ChamferDistance<B: Backend> {
    /// Mean distance from each P̂ to its nearest P.
    pub to_surface: Tensor<B, 1>,
    /// Mean distance from each P to its nearest P̂.
    pub from_surface: Tensor<B, 1>,
}

impl<B: Backend> ChamferDistance<B> {
    /// ℓ_wrap: the greater of the two.
    pub fn larger(self) -> Tensor<B, 1> {
        self.to_surface.max_pair(self.from_surface)
    }
}

/// The Chamfer distance between P̂ `[M, 3]` and P `[N, 3]`: mean distances, not squared.
///
/// `nearest_p` `[M, 3]` is the nearest P to each P̂, `nearest_p_hat` `[N, 3]` the nearest P̂ to
/// each P, as from [`NeighborSearch::gather`](crate::neighbors::NeighborSearch::gather).
pub fn chamfer_distance<B: Backend>(
    p_hat: Tensor<B, 2>,
    p: Tensor<B, 2>,
    nearest_p: Tensor<B, 2>,
    nearest_p_hat: Tensor<B, 2>,
) -> ChamferDistance<B> {
    ChamferDistance {
        to_surface: mean_distance(p_hat, nearest_p),
        from_surface: mean_distance(p, nearest_p_hat),
    }
}

fn mean_distance<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 1> {
    let difference = a - b;
    let squared = (difference.clone() * difference).sum_dim(1);
    squared.clamp_min(SMALLEST_SQUARED_DISTANCE).sqrt().mean()
}
