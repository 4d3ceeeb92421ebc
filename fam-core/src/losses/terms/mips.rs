use burn::tensor::{Tensor, backend::Backend};

use super::{Evaluated, LossTerm};
use crate::jacobian::{FirstFundamentalForm, Jacobian};

/// Times the squared trace of JᵀJ, added to its determinant. Where the map collapses, the term ends at a
/// thousand instead of at infinity, and still has a gradient.
const SMALLEST_DETERMINANT: f32 = 1e-3;

/// Mean λ¹/λ² + λ²/λ¹ of the eigenvalues of JᵀJ, of f and of g where it has a Jacobian: the energy MIPS
/// (Hormann and Greiner, 2000) with eigenvalues in place of singular values. 2 where the map keeps
/// angles, whatever its scale.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mips;

impl Mips {
    pub(super) const NAME: &str = "mips";
}

impl<B: Backend> LossTerm<B> for Mips {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>> {
        mean_over_maps(evaluated, of_jacobian)
    }
}

/// The gradient of its power −1/2 is a number in 32 bits.
const SMALLEST: f32 = 1e-12;

/// The mean of a term of f and of g, where both have a Jacobian.
pub(super) fn mean_over_maps<B: Backend>(
    evaluated: &Evaluated<'_, B>,
    term: impl Fn(Jacobian<B>) -> Tensor<B, 1>,
) -> Option<Tensor<B, 1>> {
    let f = evaluated.unwrap.as_ref().map(|branch| &branch.jacobian);
    let g = evaluated.deform.as_ref();
    let g = g.and_then(|branch| branch.jacobian.as_ref());
    let terms = [f, g].into_iter().flatten().map(|j| term(j.clone()));
    let terms: Vec<Tensor<B, 1>> = terms.collect();
    (!terms.is_empty()).then(|| Tensor::cat(terms, 0).mean())
}

fn of_jacobian<B: Backend>(jacobian: Jacobian<B>) -> Tensor<B, 1> {
    let FirstFundamentalForm { e, f, g } = FirstFundamentalForm::of(jacobian);
    let trace = e.clone() + g.clone();
    let squared = trace.clone() * trace;
    let determinant = e * g - f.clone() * f;
    // λ¹/λ² + λ²/λ¹ = (λ¹ + λ²)² / (λ¹ λ²) − 2.
    let inverse_root = (determinant + squared.clone() * SMALLEST_DETERMINANT)
        .clamp_min(SMALLEST)
        .powf_scalar(-0.5);
    (squared * inverse_root.clone() * inverse_root - 2.0).mean()
}
