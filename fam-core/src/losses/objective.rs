use burn::tensor::{FloatDType, Tensor, backend::Backend};

use serde::{Deserialize, Serialize};

use super::{
    Flattening, bounding_box_normalized, bounding_box_side, chamfer_distance, conformality_loss,
    flattening_loss, normal_loss, point_cycle_loss, repulsion_threshold, unwrapping_loss,
    uv_cycle_loss,
};
use crate::cycles::{DeformBranch, UnwrapBranch};
use crate::neighbors::NeighborSearch;

/// K_u: neighbours that the unwrapping loss keeps apart (the paper's appendix).
const NEIGHBORS: usize = 8;

/// ε / (L(Q) / √N) in the unwrapping loss (the paper's appendix).
const EPSILON_FACTOR: f32 = 0.2;

/// Which formulation of the unwrapping and the conformality term is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// As in the paper: Q itself is spread out by ε = 0.2·L(Q)/√N, and conformality is asked
    /// of f and g.
    Paper,
    /// As in the authors' program: three normalised UV sets are spread out by a quarter of the
    /// lattice spacing, and conformality is asked of f alone.
    Reference,
}

/// Weights of the loss terms; the defaults, which also stand for what a file leaves out, are the
/// paper's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LossWeights {
    /// Of ℓ_wrap: 1.
    pub wrap: f64,
    /// Of ℓ_unwrap: 0.01.
    pub unwrap: f64,
    /// Of each term of ℓ_cycle: 0.01.
    pub cycle: f64,
    /// Of ℓ_conf of each map: 0.01.
    pub conformality: f64,
    /// Of ℓ_flat, which the paper does not have: 0.
    pub flattening: f64,
}

impl Default for LossWeights {
    fn default() -> Self {
        Self {
            wrap: 1.0,
            unwrap: 0.01,
            cycle: 0.01,
            conformality: 0.01,
            flattening: 0.0,
        }
    }
}

impl LossWeights {
    /// The weighted sum of terms.
    pub fn sum(&self, terms: &[(Term, f32)]) -> f32 {
        let weighted = |(term, value): &(Term, f32)| f64::from(*value) * term.weight(self);
        let minimised = terms.iter().filter(|(term, _)| !term.is_only_observed());
        minimised.map(weighted).sum::<f64>() as f32
    }
}

/// One term of the objective.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// ℓ_wrap: Chamfer distance of P̂ and P.
    Wrap,
    /// ℓ_unwrap, of Q or (reference objective) of its normalised copy.
    Unwrap,
    /// ℓ_unwrap of the normalised Q̂ (reference objective).
    UnwrapQHat,
    /// ℓ_unwrap of the normalised Q̂_cycle (reference objective).
    UnwrapQHatCycle,
    /// Mean |P − P_cycle|.
    CyclePoints,
    /// Mean |Q̂ − Q̂_cycle|.
    CycleUv,
    /// Mean of 1 − cos between Pⁿ and P_cycleⁿ.
    CycleNormals,
    /// Mean |λ¹ − λ²| of f.
    ConformalityF,
    /// Mean |λ¹ − λ²| of g.
    ConformalityG,
    /// ℓ_flat: the anticonformal part of the derivative of Q along the surface.
    Flattening,
    /// A [`LossTerm`](super::LossTerm) that was added.
    Added {
        /// Its place among those that were added.
        index: usize,
        /// Its name.
        name: &'static str,
        /// Its weight.
        weight: f64,
    },
}

impl Term {
    /// Those of the method.
    pub(crate) const OF_METHOD: [Self; 10] = [
        Self::Wrap,
        Self::Unwrap,
        Self::UnwrapQHat,
        Self::UnwrapQHatCycle,
        Self::CyclePoints,
        Self::CycleUv,
        Self::CycleNormals,
        Self::ConformalityF,
        Self::ConformalityG,
        Self::Flattening,
    ];

    /// A short name, as in progress lines and errors.
    pub fn name(self) -> &'static str {
        match self {
            Term::Wrap => "wrap",
            Term::Unwrap => "unwrap",
            Term::UnwrapQHat => "unwrap-q-hat",
            Term::UnwrapQHatCycle => "unwrap-q-hat-cycle",
            Term::CyclePoints => "cycle-points",
            Term::CycleUv => "cycle-uv",
            Term::CycleNormals => "cycle-normals",
            Term::ConformalityF => "conformality-f",
            Term::ConformalityG => "conformality-g",
            Term::Flattening => "flattening",
            Term::Added { name, .. } => name,
        }
    }

    /// Whether it was added with the weight 0.
    pub(crate) fn is_only_observed(self) -> bool {
        matches!(self, Term::Added { weight: 0.0, .. })
    }

    fn weight(self, weights: &LossWeights) -> f64 {
        match self {
            Term::Wrap => weights.wrap,
            Term::Unwrap | Term::UnwrapQHat | Term::UnwrapQHatCycle => weights.unwrap,
            Term::CyclePoints | Term::CycleUv | Term::CycleNormals => weights.cycle,
            Term::ConformalityF | Term::ConformalityG => weights.conformality,
            Term::Flattening => weights.flattening,
            Term::Added { weight, .. } => weight,
        }
    }
}

/// The unweighted terms of one evaluation, each a scalar `[1]`.
#[derive(Debug, Clone)]
pub struct Losses<B: Backend> {
    /// The terms that apply: a branch that is left out has none.
    pub terms: Vec<(Term, Tensor<B, 1>)>,
}

impl<B: Backend> Losses<B> {
    /// The terms of the branches and of the `flattening` that are given.
    ///
    /// `p` `[N, 3]` are the surface points, `normals` `[N, 3]` theirs; without them the normals'
    /// term is dropped.
    pub fn of(
        objective: Objective,
        p: Tensor<B, 2>,
        normals: Option<Tensor<B, 2>>,
        deform: Option<DeformBranch<B>>,
        unwrap: Option<UnwrapBranch<B>>,
        flattening: Option<Flattening<B>>,
        search: &dyn NeighborSearch<B>,
    ) -> Self {
        let lattice_size = match &deform {
            Some(deform) => deform.q_hat.dims()[0],
            None => p.dims()[0],
        };
        let spread = |q: Tensor<B, 2>| match objective {
            Objective::Paper => {
                let points = q.dims()[0] as f32;
                let epsilon = bounding_box_side(q.clone()) * (EPSILON_FACTOR / points.sqrt());
                spread_loss(search, q, epsilon)
            }
            Objective::Reference => {
                let threshold = repulsion_threshold(lattice_size);
                let dtype: FloatDType = q.dtype().into();
                let epsilon = Tensor::<B, 1>::full([1], threshold, &q.device()).cast(dtype);
                spread_loss(search, bounding_box_normalized(q), epsilon)
            }
        };
        let mut terms = Vec::new();
        if let Some(deform) = deform {
            let nearest_p = search.nearest(p.clone().detach(), deform.p_hat.clone().detach());
            let nearest_p_hat = search.nearest(deform.p_hat.clone().detach(), p.clone().detach());
            let nearest_p = search.gather(p.clone(), nearest_p);
            let nearest_p_hat = search.gather(deform.p_hat.clone(), nearest_p_hat);
            let chamfer = chamfer_distance(deform.p_hat, p.clone(), nearest_p, nearest_p_hat);
            terms.push((Term::Wrap, chamfer.larger()));
            if objective == Objective::Reference {
                terms.push((Term::UnwrapQHat, spread(deform.q_hat.clone())));
                terms.push((Term::UnwrapQHatCycle, spread(deform.q_hat_cycle.clone())));
            }
            terms.push((
                Term::CycleUv,
                uv_cycle_loss(deform.q_hat, deform.q_hat_cycle),
            ));
            if let Some(jacobian) = deform.jacobian {
                terms.push((Term::ConformalityG, conformality_loss(jacobian)));
            }
        }
        if let Some(unwrap) = unwrap {
            terms.push((Term::Unwrap, spread(unwrap.q)));
            terms.push((Term::CyclePoints, point_cycle_loss(p, unwrap.p_cycle)));
            if let Some(normals) = normals {
                terms.push((
                    Term::CycleNormals,
                    normal_loss(normals, unwrap.p_cycle_normals),
                ));
            }
            terms.push((Term::ConformalityF, conformality_loss(unwrap.jacobian)));
        }
        if let Some(flattening) = flattening {
            terms.push((Term::Flattening, flattening_loss(flattening)));
        }
        Self { terms }
    }

    /// The weighted sum that is minimised, `[1]`; terms that are only observed take no part.
    ///
    /// # Panics
    /// If there is no term.
    pub fn total(&self, weights: &LossWeights) -> Tensor<B, 1> {
        self.terms
            .iter()
            .filter(|(term, _)| !term.is_only_observed())
            .map(|(term, value)| value.clone() * term.weight(weights))
            .reduce(|a, b| a + b)
            .expect("at least one branch is evaluated")
    }
}

fn spread_loss<B: Backend>(
    search: &dyn NeighborSearch<B>,
    q: Tensor<B, 2>,
    epsilon: Tensor<B, 1>,
) -> Tensor<B, 1> {
    let k = NEIGHBORS.min(q.dims()[0] - 1);
    let neighbors = search.nearest_others(q.clone().detach(), k);
    let near = search.gather(q.clone(), neighbors);
    unwrapping_loss(q, near, epsilon)
}
