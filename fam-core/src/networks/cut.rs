use burn::module::Module;
use burn::tensor::{Tensor, backend::Backend};

use super::Mlp;
use crate::evaluation::{Evaluation, Plain};

/// Cut-Net M_c: moves surface points by learned offsets so that the surface opens along
/// seams, P_cut = ξ″([P, ξ′(P)]) + P.
#[derive(Module, Debug)]
pub struct CutNet<B: Backend> {
    /// ξ′: `[N, 3] → [N, latent]`.
    pub mlp_1: Mlp<B>,
    /// ξ″: `[N, 3 + latent] → [N, 3]`.
    pub mlp_2: Mlp<B>,
}

impl<B: Backend> CutNet<B> {
    /// P `[N, 3]` → P_cut `[N, 3]`.
    pub fn forward(&self, p: Tensor<B, 2>, evaluation: &dyn Evaluation<B>) -> Tensor<B, 2> {
        let (moved, _) = evaluation.twofold(&self.mlp_1, &self.mlp_2, p.clone(), Vec::new());
        moved + p
    }

    /// [`forward`](Self::forward), and its derivative applied to tangents, all `[N, 3]`.
    pub fn forward_with_tangents<const K: usize>(
        &self,
        p: Tensor<B, 2>,
        tangents: [Tensor<B, 2>; K],
    ) -> (Tensor<B, 2>, [Tensor<B, 2>; K]) {
        let (mlp_1, mlp_2) = (&self.mlp_1, &self.mlp_2);
        let (moved, pushed) = Plain.twofold(mlp_1, mlp_2, p.clone(), tangents.to_vec());
        let mut pushed = pushed.into_iter();
        let added = tangents.map(|tangent| match pushed.next() {
            Some(pushed) => tangent + pushed,
            None => tangent,
        });
        (moved + p, added)
    }
}
