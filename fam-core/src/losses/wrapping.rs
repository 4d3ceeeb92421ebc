use burn::tensor::{Int, Tensor, backend::Backend};

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
/// `nearest_p` `[M]` indexes P for each P̂, `nearest_p_hat` `[N]` indexes P̂ for each P.
pub fn chamfer_distance<B: Backend>(
    p_hat: Tensor<B, 2>,
    p: Tensor<B, 2>,
    nearest_p: Tensor<B, 1, Int>,
    nearest_p_hat: Tensor<B, 1, Int>,
) -> ChamferDistance<B> {
    ChamferDistance {
        to_surface: mean_distance(p_hat.clone(), p.clone().select(0, nearest_p)),
        from_surface: mean_distance(p, p_hat.select(0, nearest_p_hat)),
    }
}

fn mean_distance<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 1> {
    let difference = a - b;
    let squared = (difference.clone() * difference).sum_dim(1);
    squared.clamp_min(SMALLEST_SQUARED_DISTANCE).sqrt().mean()
}
