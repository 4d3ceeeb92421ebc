use burn::module::Module;
use burn::tensor::{Tensor, backend::Backend};

use super::Mlp;
use crate::evaluation::Evaluation;

/// Deform-Net M_d: moves the points of a uniform lattice G in [−1, 1]² to UV coordinates,
/// Q̂ = ξ″([G, ξ′(G)]) + G.
#[derive(Module, Debug)]
pub struct DeformNet<B: Backend> {
    /// ξ′: `[N, 2] → [N, latent]`.
    pub mlp_1: Mlp<B>,
    /// ξ″: `[N, 2 + latent] → [N, 2]`.
    pub mlp_2: Mlp<B>,
}

impl<B: Backend> DeformNet<B> {
    /// G `[N, 2]` → Q̂ `[N, 2]`.
    pub fn forward(&self, g: Tensor<B, 2>, evaluation: &dyn Evaluation<B>) -> Tensor<B, 2> {
        let none = Vec::new();
        let (moved, _) = evaluation.twofold(&self.mlp_1, &self.mlp_2, g.clone(), none);
        moved + g
    }
}
