use burn::module::Module;
use burn::tensor::{Tensor, backend::Backend};
use burn_autodiff::Autodiff;

use super::Mlp;
use crate::evaluation::Evaluation;

/// Wrap-Net M_w: wraps UV coordinates onto the surface and predicts its normals there,
/// [P̂; P̂ⁿ] = ξ″([Q̂, ξ′(Q̂)]).
#[derive(Module, Debug)]
pub struct WrapNet<B: Backend> {
    /// ξ′: `[N, 2] → [N, latent]`.
    pub mlp_1: Mlp<B>,
    /// ξ″: `[N, 2 + latent] → [N, 6]`, points and normals.
    pub mlp_2: Mlp<B>,
}

/// What Wrap-Net makes of UV coordinates.
#[derive(Debug, Clone)]
pub struct Wrapped<B: Backend> {
    /// Points `[N, 3]`.
    pub points: Tensor<B, 2>,
    /// Normals `[N, 3]`, of any length.
    pub normals: Tensor<B, 2>,
}

impl<B: Backend> Wrapped<B> {
    fn split(output: Tensor<B, 2>) -> Self {
        Self {
            points: output.clone().narrow(1, 0, 3),
            normals: output.narrow(1, 3, 3),
        }
    }
}

impl<B: Backend> WrapNet<B> {
    /// Q `[N, 2]` → points and normals.
    pub fn forward(&self, q: Tensor<B, 2>, evaluation: &dyn Evaluation<B>) -> Wrapped<B> {
        self.forward_with_tangents(q, Vec::new(), evaluation).0
    }

    /// [`WrapNet::forward`], and the derivative of the points with respect to Q along each of
    /// `tangents`: `[N, 2] → [N, 3]`.
    pub fn forward_with_tangents(
        &self,
        q: Tensor<B, 2>,
        tangents: Vec<Tensor<B, 2>>,
        evaluation: &dyn Evaluation<B>,
    ) -> (Wrapped<B>, Vec<Tensor<B, 2>>) {
        let (output, pushed) = evaluation.twofold(&self.mlp_1, &self.mlp_2, q, tangents);
        let points = |tangent: Tensor<B, 2>| tangent.narrow(1, 0, 3);
        let pushed = pushed.into_iter().map(points).collect();
        (Wrapped::split(output), pushed)
    }

    /// [`WrapNet::forward`], and the points `[K, N, 3]` as a function of K copies `[K, N, 2]` of Q
    /// on an autodiff layer above `B`, whose gradients `B` tracks
    /// ([`Evaluation::twofold_above`]).
    pub fn forward_above(
        &self,
        q: Tensor<B, 2>,
        copies: Tensor<Autodiff<B>, 3>,
        evaluation: &dyn Evaluation<B>,
    ) -> (Wrapped<B>, Tensor<Autodiff<B>, 3>) {
        let (output, above) = evaluation.twofold_above(&self.mlp_1, &self.mlp_2, q, copies);
        (Wrapped::split(output), above.narrow(2, 0, 3))
    }
}
