//! Terms beside those of the method: a trait, and three of them.

mod config;
mod isometry;
mod landmarks;
mod mips;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use burn::tensor::{Tensor, backend::Backend};

use super::Flattening;
use crate::cycles::{DeformBranch, UnwrapBranch};
use crate::evaluation::Evaluation;
use crate::networks::FlattenAnything;
use fam_surface::Normalization;

pub use config::{TermConfig, TermKind};
pub use isometry::Isometry;
pub use landmarks::Landmarks;
pub use mips::Mips;

/// A term of the objective that training minimises beside its own.
///
/// ```
/// use burn::tensor::{Tensor, backend::Backend};
/// use fam_core::losses::{Evaluated, LossTerm};
///
/// /// Keeps the UVs near the origin.
/// struct Small;
///
/// impl<B: Backend> LossTerm<B> for Small {
///     fn name(&self) -> &'static str {
///         "small"
///     }
///
///     fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>> {
///         let q = evaluated.unwrap.as_ref()?.q.clone();
///         Some((q.clone() * q).mean())
///     }
/// }
/// ```
pub trait LossTerm<B: Backend>: Send + Sync {
    /// A short name, as in progress lines and errors.
    fn name(&self) -> &'static str;

    /// The unweighted term `[1]`, a mean over points; none if it does not apply to this surface or to
    /// the branches that there are.
    fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>>;
}

/// A term and its weight.
#[derive(Clone)]
pub struct AddedTerm<B: Backend> {
    /// What it is multiplied by in the sum that is minimised.
    pub weight: f64,
    /// The term.
    pub term: Arc<dyn LossTerm<B>>,
}

/// What an iteration has evaluated, all of it differentiable by the weights of the networks.
///
/// Points are normalised: the surface lies in the unit ball.
pub struct Evaluated<'a, B: Backend> {
    /// Zero-based, from its start.
    pub iteration: usize,
    /// P `[N, 3]`.
    pub points: Tensor<B, 2>,
    /// Pⁿ `[N, 3]`, where the surface has normals.
    pub normals: Option<Tensor<B, 2>>,
    /// The 2D→3D→2D branch, unless it is left out.
    pub deform: Option<DeformBranch<B>>,
    /// The 3D→2D→3D branch, unless it is left out.
    pub unwrap: Option<UnwrapBranch<B>>,
    /// The derivatives of Q on triangles of the surface, where this iteration minimises ℓ_flat.
    pub flattening: Option<Flattening<B>>,
    /// How input units relate to the unit ball.
    pub normalization: &'a Normalization,
    /// The networks.
    pub model: &'a FlattenAnything<B>,
    /// Whether Cut-Net takes part.
    pub cut_net: bool,
    /// How the networks are computed.
    pub evaluation: &'a dyn Evaluation<B>,
}

impl<B: Backend> Evaluated<'_, B> {
    /// The Q `[K, 2]` of other normalised points `[K, 3]`.
    pub fn q(&self, points: Tensor<B, 2>) -> Tensor<B, 2> {
        self.model.unwrap(points, self.cut_net, self.evaluation)
    }
}
