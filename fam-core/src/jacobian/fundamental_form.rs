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

#[cfg(test)]
mod tests {
    use super::*;
    use burn_ndarray::NdArray;

    type Cpu = NdArray<f32>;

    fn form(u: [f32; 3], v: [f32; 3]) -> [f32; 2] {
        let device = Default::default();
        let row = |r: [f32; 3]| Tensor::<Cpu, 2>::from_data([r], &device);
        let form = FirstFundamentalForm::of(Jacobian {
            u: row(u),
            v: row(v),
        });
        form.eigenvalues().map(|t| t.into_scalar())
    }

    #[test]
    fn eigenvalues_are_squared_singular_values() {
        // The unit cylinder (cos u, sin u, v): an isometry.
        let angle = 0.7f32;
        let [larger, smaller] = form([-angle.sin(), angle.cos(), 0.0], [0.0, 0.0, 1.0]);
        assert!((larger - 1.0).abs() < 1e-6 && (smaller - 1.0).abs() < 1e-6);
        // An ellipse of half axes 3 and 2, turned by 30 degrees in the parameter plane.
        let (c, s) = (0.75f32.sqrt(), 0.5);
        let [larger, smaller] = form([3.0 * c, 2.0 * s, 0.0], [-3.0 * s, 2.0 * c, 0.0]);
        assert!((larger - 9.0).abs() < 1e-5 && (smaller - 4.0).abs() < 1e-5);
        // A fold: no area.
        let [larger, smaller] = form([1.0, 1.0, 0.0], [2.0, 2.0, 0.0]);
        assert!((larger - 10.0).abs() < 1e-5 && smaller.abs() < 1e-5);
    }

    #[test]
    fn a_conformal_point_has_a_finite_gradient() {
        type Tracked = burn_autodiff::Autodiff<Cpu>;
        let device = Default::default();
        let _turn = crate::training::turn();
        let u = Tensor::<Tracked, 2>::from_data([[1.0, 0.0, 0.0]], &device).require_grad();
        let v = Tensor::<Tracked, 2>::from_data([[0.0, 1.0, 0.0]], &device);
        let form = FirstFundamentalForm::of(Jacobian { u: u.clone(), v });
        let gradients = form.eigenvalue_gap().sum().backward();
        let gradient = u.grad(&gradients).unwrap().into_data();
        assert_eq!(gradient.to_vec::<f32>().unwrap(), [0.0; 3]);
    }
}
