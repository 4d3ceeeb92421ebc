//! Derivatives of Wrap-Net: the Jacobians J_f at Q and J_g at Q̂, and their singular structure.
//!
//! Two ways give the same numbers (and the same gradients of the loss):
//! - [`JacobianMode::DoubleBackward`] differentiates the network by automatic
//!   differentiation and the loss through that again, as the paper describes;
//! - [`JacobianMode::ForwardTangent`] pushes the two unit tangents through the network
//!   beside the points, so that training differentiates once.

mod double_backward;
mod forward_tangent;
mod fundamental_form;

use burn::tensor::{Tensor, backend::Backend};

use serde::{Deserialize, Serialize};

use crate::evaluation::Evaluation;
use crate::networks::{WrapNet, Wrapped};

pub use fundamental_form::FirstFundamentalForm;

/// Derivatives of a map from one surface to another along two directions, row by row: those of
/// Wrap-Net along the axes of the plane, `[N, 3]`, or of the UVs along two tangents, `[N, 2]`.
#[derive(Debug, Clone)]
pub struct Jacobian<B: Backend> {
    /// ∂/∂u.
    pub u: Tensor<B, 2>,
    /// ∂/∂v.
    pub v: Tensor<B, 2>,
}

/// How Jacobians are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JacobianMode {
    /// Gradients of gradients through burn-autodiff. The inner pass is one that wants the
    /// [turn](crate::training::turn) beside trainers on other threads.
    #[default]
    DoubleBackward,
    /// Two tangents in forward mode.
    ForwardTangent,
}

impl JacobianMode {
    /// Wrap-Net at Q `[N, 2]` and the Jacobian of its points there. Both are differentiable
    /// with respect to the weights and to Q wherever `B` tracks them.
    pub fn wrap<B: Backend>(
        self,
        net: &WrapNet<B>,
        q: Tensor<B, 2>,
        evaluation: &dyn Evaluation<B>,
    ) -> (Wrapped<B>, Jacobian<B>) {
        match self {
            JacobianMode::DoubleBackward => double_backward::wrap(net, q, evaluation),
            JacobianMode::ForwardTangent => forward_tangent::wrap(net, q, evaluation),
        }
    }
}
