use std::sync::OnceLock;

use burn::tensor::{Tensor, TensorData, backend::Backend};
use serde::{Deserialize, Serialize};

use super::{Evaluated, LossTerm};
use crate::neighbors::rows;
use fam_surface::Normalization;
use fam_surface::neighbors::nearest;

/// Largest distance of a landmark from the nearest point of the surface, with the surface in the unit
/// ball. Farther ones are those of another component.
const REACH: f32 = 0.1;

/// Given points to given UVs: mean distance of their UVs from those that they are to have, in the frame
/// in which the UVs of the surface fill the unit square.
///
/// The frame changes with the UVs, and no gradient goes through it. A map that is mirrored as a whole
/// afterwards mirrors its landmarks, too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landmarks {
    points: Vec<[f64; 3]>,
    uvs: Vec<[f64; 2]>,
    /// Those that lie on the surface, once the first of its points are there.
    #[serde(skip)]
    on_surface: OnceLock<Vec<usize>>,
}

impl Landmarks {
    pub(super) const NAME: &str = "landmarks";

    /// Points in the units of the surface, and as many UVs in 0 … 1: of the raw map, before charts are
    /// packed.
    pub fn new(points: Vec<[f64; 3]>, uvs: Vec<[f64; 2]>) -> Self {
        Self {
            points,
            uvs,
            on_surface: OnceLock::new(),
        }
    }

    /// What keeps them from being used, if anything.
    pub fn problem(&self) -> Option<&'static str> {
        let Self { points, uvs, .. } = self;
        let finite = points.iter().flatten().all(|c| c.is_finite());
        if points.is_empty() || points.len() != uvs.len() {
            Some("landmarks need as many uvs as points, and at least one")
        } else if !finite || !uvs.iter().flatten().all(|c| (0.0..=1.0).contains(c)) {
            Some("points of landmarks must be finite, and their uvs lie in 0..=1")
        } else {
            None
        }
    }

    /// Which of them lie on the surface that has these normalised points `[N, 3]`.
    fn among<B: Backend>(
        &self,
        surface: Tensor<B, 2>,
        normalization: &Normalization,
    ) -> Vec<usize> {
        let surface = rows::<B, 3>(surface);
        let points = self.points.iter().map(|&p| normalization.apply(p));
        let points: Vec<[f32; 3]> = points.collect();
        let nearest = nearest(&surface, &points);
        let distance = |i: usize| {
            let at = surface[nearest[i] as usize];
            let squared = (0..3).map(|axis| (at[axis] - points[i][axis]).powi(2));
            squared.sum::<f32>().sqrt()
        };
        (0..points.len())
            .filter(|&i| distance(i) <= REACH)
            .collect()
    }
}

impl<B: Backend> LossTerm<B> for Landmarks {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>> {
        let q = evaluated.unwrap.as_ref()?.q.clone().detach();
        let device = q.device();
        let near = self.on_surface.get_or_init(|| {
            let surface = evaluated.points.clone().detach();
            self.among(surface, evaluated.normalization)
        });
        if near.is_empty() {
            return None;
        }
        let point = |&i: &usize| evaluated.normalization.apply(self.points[i]);
        let tensor = |values: Vec<f32>, width: usize| {
            let data = TensorData::new(values, [near.len(), width]);
            Tensor::<B, 2>::from_data(data, &device)
        };
        let points = tensor(near.iter().flat_map(point).collect(), 3);
        let wanted = near.iter().flat_map(|&i| self.uvs[i].map(|c| c as f32));
        let wanted = tensor(wanted.collect(), 2);
        let (low, high) = (q.clone().min_dim(0), q.max_dim(0));
        let side = (high - low.clone()).max_dim(1).clamp_min(f32::MIN_POSITIVE);
        // uv = (q − low) / side; compared in units of q, so that nothing is divided by but a constant.
        let difference = evaluated.q(points) - (wanted * side.clone() + low);
        let squared = (difference.clone() * difference).sum_dim(1);
        let distance = squared.clamp_min(f32::MIN_POSITIVE).sqrt();
        Some(distance.mean() * side.reshape([1]).powf_scalar(-1.0))
    }
}
