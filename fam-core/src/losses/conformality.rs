use burn::tensor::{Tensor, backend::Backend};

use crate::jacobian::{FirstFundamentalForm, Jacobian};

/// ℓ_conf of one map: mean |λ¹ − λ²| of the eigenvalues of JᵀJ, `[1]`.
/// Zero where the map keeps angles.
pub fn conformality_loss<B: Backend>(jacobian: Jacobian<B>) -> Tensor<B, 1> {
    FirstFundamentalForm::of(jacobian).eigenvalue_gap().mean()
}
