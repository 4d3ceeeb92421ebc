use burn::tensor::{Tensor, backend::Backend};

use super::Jacobian;

/// The first fundamental form JᵀJ = [[E, F], [F, G]] of a map, row by row, each `[N, 1]`.
#[derive(Debug, Clone)]
pub struct FirstFundamentalForm<B: Backend> {
    /// E = ⟨∂u, ∂u⟩.
    pub e: Tensor<B, 2>,
    /// F = ⟨∂u, ∂v⟩.
    pub f: Tensor<B, 2>,
    /// G = ⟨∂v, ∂v⟩.
    pub g: Tensor<B, 2>,
}

/// Below this squared gap two eigenvalues count as equal. The square root has no derivative
/// at zero, and equal eigenvalues are what training is after.
const SMALLEST_SQUARED_GAP: f32 = 1e-16;

impl<B: Backend> FirstFundamentalForm<B> {
    /// The form of a Jacobian.
    pub fn of(jacobian: Jacobian<B>) -> Self {
        let Jacobian { u, v } = jacobian;
        Self {
            e: (u.clone() * u.clone()).sum_dim(1),
            f: (u * v.clone()).sum_dim(1),
            g: (v.clone() * v).sum_dim(1),
        }
    }

    /// λ¹ − λ² ≥ 0, the difference of the eigenvalues of JᵀJ: √((E − G)² + 4F²), `[N, 1]`.
    /// Where it is zero the map is conformal, and the gradient there is zero.
    pub fn eigenvalue_gap(&self) -> Tensor<B, 2> {
        let difference = self.e.clone() - self.g.clone();
        let squared = difference.clone() * difference + self.f.clone() * self.f.clone() * 4.0;
        squared.clamp_min(SMALLEST_SQUARED_GAP).sqrt()
    }

    /// The eigenvalues λ¹ ≥ λ² of JᵀJ, each `[N, 1]`: the squared singular values of J.
    pub fn eigenvalues(&self) -> [Tensor<B, 2>; 2] {
        let sum = self.e.clone() + self.g.clone();
        let gap = self.eigenvalue_gap();
        [
            (sum.clone() + gap.clone()) * 0.5,
            (sum - gap).clamp_min(0.0) * 0.5,
        ]
    }
}
