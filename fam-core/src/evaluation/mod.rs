//! How the networks are computed in training: a strategy beside the method.
//!
//! [`Plain`] is Burn's operations one after the other, on any backend. [`Tiled`] takes a whole
//! sub-network as one operation whose values stay in the caches of a CPU, for backends that
//! compute on the host; [`Blocked`] is `Plain` in larger operations, for graphics devices. Tests hold
//! both to `Plain`.

mod blocked;
mod buffers;
mod kernel;
#[cfg(test)]
mod tests;
mod tiled;

use burn::module::{AutodiffModule, Module};
use burn::tensor::{Tensor, backend::Backend};
use burn_autodiff::Autodiff;

use crate::networks::Mlp;

pub use blocked::Blocked;
pub use tiled::Tiled;

/// Evaluates the MLPs of a sub-network, differentiably with respect to their weights and all
/// inputs. The bodies given here are plain Burn operations.
pub trait Evaluation<B: Backend>: Send + Sync {
    /// ξ(x): `[N, in] → [N, out]`.
    fn single(&self, xi: &Mlp<B>, x: Tensor<B, 2>) -> Tensor<B, 2> {
        xi.forward(x)
    }

    /// ξ″([x, ξ′(x)]), and its derivative there applied to each of `tangents`: all
    /// `[N, in] → [N, out]`.
    fn twofold(
        &self,
        xi_1: &Mlp<B>,
        xi_2: &Mlp<B>,
        x: Tensor<B, 2>,
        tangents: Vec<Tensor<B, 2>>,
    ) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let beside = |x, latent| Tensor::cat(vec![x, latent], 1);
        let (latent, slopes_1) = xi_1.forward_with_slopes(x.clone());
        let (y, slopes_2) = xi_2.forward_with_slopes(beside(x, latent));
        let push = |tangent: Tensor<B, 2>| {
            let latent = xi_1.push_tangent(tangent.clone(), &slopes_1);
            xi_2.push_tangent(beside(tangent, latent), &slopes_2)
        };
        (y, tangents.into_iter().map(push).collect())
    }

    /// ξ″([x, ξ′(x)]), `[N, in] → [N, out]`, and the same on an autodiff layer above `B` as a
    /// function of K copies of x, `[K, N, in] → [K, N, out]`.
    ///
    /// Gradients that a backward pass on the layer above gives for the copies are tensors of `B`,
    /// differentiable there with respect to the weights and to what the pass went out from.
    /// Slopes of activations are constants, and the gradients do not depend on x.
    fn twofold_above(
        &self,
        xi_1: &Mlp<B>,
        xi_2: &Mlp<B>,
        x: Tensor<B, 2>,
        copies: Tensor<Autodiff<B>, 3>,
    ) -> (Tensor<B, 2>, Tensor<Autodiff<B>, 3>) {
        let (y, _) = self.twofold(xi_1, xi_2, x, Vec::new());
        // Lifted without gradients on the layer above, which would be computed for nothing.
        let lifted = |xi: &Mlp<B>| Mlp::<Autodiff<B>>::from_inner(xi.clone()).no_grad();
        let [k, n, inputs] = copies.dims();
        let rows = copies.reshape([k * n, inputs]);
        let (rows, _) = Plain.twofold(&lifted(xi_1), &lifted(xi_2), rows, Vec::new());
        let [_, outputs] = rows.dims();
        (y, rows.reshape([k, n, outputs]))
    }
}

/// Burn's operations, one for every product, bias and activation.
#[derive(Debug, Clone, Copy, Default)]
pub struct Plain;

impl<B: Backend> Evaluation<B> for Plain {}
