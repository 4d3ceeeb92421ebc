use burn::tensor::{Tensor, backend::Backend};

use crate::jacobian::{FirstFundamentalForm, Jacobian};

/// ℓ_conf of one map: mean |λ¹ − λ²| of the eigenvalues of JᵀJ, `[1]`.
/// Zero where the map keeps angles.
pub fn conformality_loss<B: Backend>(jacobian: Jacobian<B>) -> Tensor<B, 1> {
    FirstFundamentalForm::of(jacobian).eigenvalue_gap().mean()
}

/// ℓ_flat: mean (λ¹ − λ²) / (λ¹ + λ²) of the eigenvalues of JᵀJ, `[1]`, for the derivative of Q
/// along the surface. In 0 … 1, zero where the flattening keeps angles.
///
/// The paper has no such term: it asks conformality of the way back to the surface, whose loss a
/// larger Q lowers as well.
pub fn flattening_loss<B: Backend>(jacobian: Jacobian<B>) -> Tensor<B, 1> {
    FirstFundamentalForm::of(jacobian)
        .relative_eigenvalue_gap()
        .mean()
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn_ndarray::NdArray;

    #[test]
    fn flattening_is_judged_by_its_angles_alone() {
        let device = Default::default();
        let loss = |u: [f32; 2], v: [f32; 2]| -> f32 {
            let row = |r: [f32; 2]| Tensor::<NdArray, 2>::from_data([r], &device);
            let jacobian = Jacobian {
                u: row(u),
                v: row(v),
            };
            flattening_loss(jacobian).into_scalar()
        };
        // A turn, a mirror image, and a tiny one of it.
        for scale in [1.0, 1e-2] {
            assert!(loss([0.6 * scale, 0.8 * scale], [-0.8 * scale, 0.6 * scale]) < 1e-3);
            assert!(loss([0.6 * scale, 0.8 * scale], [0.8 * scale, -0.6 * scale]) < 1e-3);
            // Twice as long in one direction: (4 - 1) / (4 + 1).
            assert!((loss([2.0 * scale, 0.0], [0.0, scale]) - 0.6).abs() < 1e-4);
        }
        // Onto a line, and onto a point.
        assert!((loss([1.0, 1.0], [2.0, 2.0]) - 1.0).abs() < 1e-5);
        assert!((loss([0.0; 2], [0.0; 2]) - 1.0).abs() < 1e-5);
    }
}
