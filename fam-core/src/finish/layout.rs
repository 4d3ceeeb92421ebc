//! A patch cut open and laid out in the plane.

use super::cut::Cut;
use super::topology::Opened;

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

/// The most area distortion and conformality that a good layout has whose mean energy is
/// [`ORDINARY_EXCESS`] above that of an isometry.
const ORDINARY_AREA: f64 = 1.12;
const ORDINARY_ANGLE: f64 = 0.1;
const ORDINARY_EXCESS: f64 = 0.1;

/// What bounds of areas and angles never go below: rounding.
const ROUNDING: f64 = 1e-3;

impl Layout {
    /// Whether the distortion is within a bound: the energy, and the distortion of areas and
    /// angles that goes with it. For small distortions the energy grows as their squares.
    pub fn is_within(&self, bound: f64) -> bool {
        let factor = ((bound - 4.0) / ORDINARY_EXCESS).max(0.0).sqrt();
        self.energy <= bound
            && self.area_distortion.ln() <= (factor * ORDINARY_AREA.ln()).max(ROUNDING)
            && self.conformality <= (factor * ORDINARY_ANGLE).max(ROUNDING)
    }
}

impl Layout {
    /// The lowest bound that the distortion is within, without what is owed to rounding.
    pub fn least_bound(&self) -> f64 {
        let areas = (self.area_distortion.ln() / ORDINARY_AREA.ln()).powi(2);
        let angles = (self.conformality / ORDINARY_ANGLE).powi(2);
        (4.0 + ORDINARY_EXCESS * areas.max(angles)).max(self.energy)
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
