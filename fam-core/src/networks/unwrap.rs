use burn::module::Module;
use burn::tensor::{Tensor, backend::Backend};

use super::Mlp;
use crate::evaluation::Evaluation;

/// Unwrap-Net M_u: flattens the opened surface onto the plane, Q = ξ(P_cut).
#[derive(Module, Debug)]
pub struct UnwrapNet<B: Backend> {
    /// ξ: `[N, 3] → [N, 2]`.
    pub mlp: Mlp<B>,
}

impl<B: Backend> UnwrapNet<B> {
    /// P_cut `[N, 3]` → Q `[N, 2]`.
    pub fn forward(&self, p_cut: Tensor<B, 2>, evaluation: &dyn Evaluation<B>) -> Tensor<B, 2> {
        evaluation.single(&self.mlp, p_cut)
    }
}
