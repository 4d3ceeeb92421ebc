//! A patch cut open and laid out in the plane.

use crate::cut::Cut;
use crate::distortion::Distortion;
use crate::patch::topology::{Opened, Topology};

/// Where a patch is cut, and a coordinate for every vertex that this gives.
#[derive(Clone)]
pub struct Layout {
    /// Where it is cut.
    pub cut: Cut,
    /// The patch, cut.
    pub opened: Opened,
    /// Of every vertex of the cut patch.
    pub uv: Vec<[f64; 2]>,
    /// Mean symmetric Dirichlet energy at the best scale.
    pub energy: f64,
    /// Area distortion: `exp` of the mean absolute logarithm of the areas' ratio.
    pub area_distortion: f64,
    /// Mean absolute difference between angles on the surface and in the plane.
    pub conformality: f64,
}

impl Layout {
    /// Of a distortion that is not known yet.
    pub fn new(cut: Cut, opened: Opened, uv: Vec<[f64; 2]>) -> Self {
        Self {
            cut,
            opened,
            uv,
            energy: f64::INFINITY,
            area_distortion: f64::INFINITY,
            conformality: f64::INFINITY,
        }
    }

    /// Of a coordinate for every half-edge: for the corner of the triangle in which it starts; the
    /// same for all corners at a vertex that the cut leaves whole.
    pub fn of(topology: &Topology, cut: Cut, corners: &[[f64; 2]]) -> Self {
        let opened = cut.open(topology);
        let mut uv = vec![[0.0; 2]; opened.topology.vertices()];
        for (h, &corner) in (0..).zip(corners) {
            uv[opened.topology.origin(h) as usize] = corner;
        }
        Self::new(cut, opened, uv)
    }

    /// How far it is from an isometry.
    pub fn distortion(&self) -> Distortion {
        Distortion {
            energy: self.energy,
            area: self.area_distortion,
            conformality: self.conformality,
        }
    }

    /// Whether the distortion is good enough to a bound, see [`Distortion::least_bound`].
    pub fn suits(&self, bound: f64) -> bool {
        self.distortion().suits(bound)
    }

    /// The lowest bound to which it is.
    pub fn least_bound(&self) -> f64 {
        self.distortion().least_bound()
    }

    /// The same coordinates over another cut of the same patch: vertices that are split have
    /// theirs twice, those that become one have the mean of theirs.
    pub fn recut(&self, cut: Cut, opened: Opened) -> Self {
        let before = |h: u32| self.opened.topology.origin(h);
        // Most vertices come from one; those that come from several are few.
        let mut first: Vec<Option<u32>> = vec![None; opened.topology.vertices()];
        let mut others: Vec<(u32, u32)> = Vec::new();
        for h in 0..opened.topology.half_edges() {
            let (new, old) = (opened.topology.origin(h), before(h));
            let known = *first[new as usize].get_or_insert(old);
            if known != old {
                others.extend([(new, known), (new, old)]);
            }
        }
        let place = |old: Option<u32>| old.map_or([0.0; 2], |old| self.uv[old as usize]);
        let mut uv: Vec<[f64; 2]> = first.into_iter().map(place).collect();
        others.sort_unstable();
        others.dedup();
        for same in others.chunk_by(|a, b| a.0 == b.0) {
            let places = same.iter().map(|pair| self.uv[pair.1 as usize]);
            let sum = places.fold([0.0; 2], |sum, q| [sum[0] + q[0], sum[1] + q[1]]);
            uv[same[0].0 as usize] = sum.map(|c| c / same.len() as f64);
        }
        Self {
            cut,
            opened,
            uv,
            energy: self.energy,
            area_distortion: self.area_distortion,
            conformality: self.conformality,
        }
    }
}
