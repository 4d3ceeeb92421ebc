use burn::module::Module;
use burn::tensor::{Tensor, backend::Backend};

use super::{Mlp, Slopes};

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
    pub fn forward(&self, q: Tensor<B, 2>) -> Wrapped<B> {
        let latent = self.mlp_1.forward(q.clone());
        Wrapped::split(self.mlp_2.forward(Tensor::cat(vec![q, latent], 1)))
    }

    /// [`WrapNet::forward`] with the activations' slopes of ξ′ and ξ″.
    pub fn forward_with_slopes(&self, q: Tensor<B, 2>) -> (Wrapped<B>, [Slopes<B>; 2]) {
        let (latent, slopes_1) = self.mlp_1.forward_with_slopes(q.clone());
        let (output, slopes_2) = self
            .mlp_2
            .forward_with_slopes(Tensor::cat(vec![q, latent], 1));
        (Wrapped::split(output), [slopes_1, slopes_2])
    }

    /// The derivative of the points with respect to Q along a tangent: `[N, 2] → [N, 3]`.
    pub fn push_tangent(&self, tangent: Tensor<B, 2>, slopes: &[Slopes<B>; 2]) -> Tensor<B, 2> {
        let latent = self.mlp_1.push_tangent(tangent.clone(), &slopes[0]);
        self.mlp_2
            .push_tangent(Tensor::cat(vec![tangent, latent], 1), &slopes[1])
            .narrow(1, 0, 3)
    }
}
