use burn::tensor::{Tensor, backend::Backend};

use super::mips::mean_over_maps;
use super::{Evaluated, LossTerm};
use crate::jacobian::FirstFundamentalForm;

/// Mean |λ¹ − 1| + |λ² − 1| of the eigenvalues of JᵀJ, of f and of g where it has a Jacobian. Zero where
/// the map keeps lengths, with the surface in the unit ball.
#[derive(Debug, Clone, Copy, Default)]
pub struct Isometry;

impl Isometry {
    pub(super) const NAME: &str = "isometry";
}

impl<B: Backend> LossTerm<B> for Isometry {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>> {
        mean_over_maps(evaluated, |jacobian| {
            let [larger, smaller] = FirstFundamentalForm::of(jacobian).eigenvalues();
            ((larger - 1.0).abs() + (smaller - 1.0).abs()).mean()
        })
    }
}
