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
        let corners = |opened: &Opened| -> Vec<u32> {
            opened
                .topology
                .triangles()
                .iter()
                .flatten()
                .copied()
                .collect()
        };
        let mut pairs: Vec<_> = corners(&opened)
            .into_iter()
            .zip(corners(&self.opened))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut sums = vec![[0.0; 3]; opened.topology.vertices()];
        for (new, old) in pairs {
            let (uv, sum) = (self.uv[old as usize], &mut sums[new as usize]);
            *sum = [sum[0] + uv[0], sum[1] + uv[1], sum[2] + 1.0];
        }
        Self {
            cut,
            opened,
            uv: sums.into_iter().map(|[u, v, n]| [u / n, v / n]).collect(),
            energy: self.energy,
            area_distortion: self.area_distortion,
            conformality: self.conformality,
        }
    }
}
