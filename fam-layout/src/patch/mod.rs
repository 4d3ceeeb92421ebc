//! One component, ready to be cut and flattened.

pub mod topology;

use crate::patch::topology::{Opened, Topology};
use fam_surface::TriangleMesh;
use fam_surface::vector::{cross, length, sub};

/// The area of a surface of unit extent below which it counts as none.
const NEXT_TO_NOTHING: f64 = 1e-12;

/// A component coherently oriented, moved and scaled so that its area is 1.
pub struct Patch {
    /// Its triangles.
    pub topology: Topology,
    /// For every vertex that of the component's mesh.
    pub source: Vec<u32>,
    /// Of every vertex.
    pub positions: Vec<[f64; 3]>,
    /// Of every half-edge.
    pub lengths: Vec<f64>,
    /// Of every half-edge: its length times what a seam costs there, as against elsewhere. Lengths,
    /// unless [`priced`](Self::priced).
    pub prices: Vec<f64>,
    /// Whether seams are to lie where little is seen.
    pub hides_seams: bool,
    /// Of every half-edge: whether it is to be cut only where there is no other way.
    pub forbidden: Vec<bool>,
    /// How much the creases of the surface count where a cut is looked for; usually 1.
    pub crease_weight: f64,
    /// Of every triangle.
    pub areas: Vec<f64>,
    /// How long the mesh's unit of length is here.
    pub scale: f64,
}

impl Patch {
    /// The patch of a component's mesh. Where that has no area to speak of, its longest side
    /// is scaled to 1 instead.
    pub fn of(mesh: &TriangleMesh) -> Self {
        let Opened { topology, source } = Topology::oriented(mesh);
        let (unit, mut scale) = unit_positions(mesh.positions());
        let mut positions: Vec<_> = source.iter().map(|&v| unit[v as usize]).collect();
        let total: f64 = areas(&topology, &positions).iter().sum();
        if total > NEXT_TO_NOTHING {
            let factor = 1.0 / total.sqrt();
            scale *= factor;
            positions = positions.iter().map(|p| p.map(|c| c * factor)).collect();
        }
        Self::over(Opened { topology, source }, positions, scale)
    }

    /// The patch of an oriented surface whose vertices have positions, at the scale that these
    /// have.
    pub fn over(surface: Opened, positions: Vec<[f64; 3]>, scale: f64) -> Self {
        let Opened { topology, source } = surface;
        let at = |v: u32| positions[v as usize];
        let lengths: Vec<f64> = (0..topology.half_edges())
            .map(|h| length(sub(at(topology.target(h)), at(topology.origin(h)))))
            .collect();
        Self {
            areas: areas(&topology, &positions),
            forbidden: vec![false; lengths.len()],
            prices: lengths.clone(),
            hides_seams: false,
            crease_weight: 1.0,
            topology,
            source,
            positions,
            lengths,
            scale,
        }
    }

    /// Some of its triangles by themselves, at the same scale. The sources of the vertices are
    /// vertices of this patch.
    pub fn subset(&self, triangles: &[u32]) -> Self {
        let part = self.topology.part(triangles);
        let at = |&v: &u32| self.positions[v as usize];
        let positions = part.source.iter().map(at).collect();
        let half_edges = triangles.iter().flat_map(|&t| 3 * t..3 * t + 3);
        let forbidden = half_edges.clone().map(|h| self.forbidden[h as usize]);
        let prices = half_edges.map(|h| self.prices[h as usize]);
        Self {
            forbidden: forbidden.collect(),
            prices: prices.collect(),
            hides_seams: self.hides_seams,
            crease_weight: self.crease_weight,
            ..Self::over(part, positions, self.scale)
        }
    }

    /// With the edges forbidden for which `forbidden` holds, by vertices of the mesh.
    pub fn forbidding(mut self, forbidden: impl Fn(u32, u32) -> bool) -> Self {
        let at = |v: u32| self.source[v as usize];
        self.forbidden = (0..self.topology.half_edges())
            .map(|h| forbidden(at(self.topology.origin(h)), at(self.topology.target(h))))
            .collect();
        self
    }

    /// With seams that cost `rate` times as much as they did, by the vertices of the mesh at the ends of
    /// an edge.
    pub fn priced(mut self, rate: impl Fn([u32; 2]) -> f64) -> Self {
        let (topology, source) = (&self.topology, &self.source);
        for (h, price) in (0..).zip(&mut self.prices) {
            let ends = [topology.origin(h), topology.target(h)];
            *price *= rate(ends.map(|v| source[v as usize]));
        }
        self
    }

    /// The most that a seam costs for each unit of length; at least 1.
    pub fn highest_rate(&self) -> f64 {
        let rates = self.prices.iter().zip(&self.lengths);
        rates
            .filter(|(_, length)| **length > 0.0)
            .fold(1.0, |most, (price, length)| f64::max(most, price / length))
    }

    /// Costs of half-edges with those of forbidden ones infinite.
    pub fn without_forbidden(&self, mut cost: Vec<f64>) -> Vec<f64> {
        for (cost, _) in cost.iter_mut().zip(&self.forbidden).filter(|(_, f)| **f) {
            *cost = f64::INFINITY;
        }
        cost
    }
}

/// Positions with the corner of their bounding box at the origin and its longest side 1, and
/// the factor by which they were scaled.
fn unit_positions(positions: &[[f64; 3]]) -> (Vec<[f64; 3]>, f64) {
    let fold = |axis: usize, f: fn(f64, f64) -> f64, start: f64| {
        positions.iter().map(|p| p[axis]).fold(start, f)
    };
    let low = [0, 1, 2].map(|axis| fold(axis, f64::min, f64::INFINITY));
    let high = [0, 1, 2].map(|axis| fold(axis, f64::max, f64::NEG_INFINITY));
    // Halves, so that no difference overflows.
    let side = (0..3)
        .map(|a| 0.5 * high[a] - 0.5 * low[a])
        .fold(0.0, f64::max);
    let side = if side > 0.0 { side } else { 1.0 };
    let place = |p: &[f64; 3]| [0, 1, 2].map(|a| (0.5 * p[a] - 0.5 * low[a]) / side);
    (positions.iter().map(place).collect(), 0.5 / side)
}

fn areas(topology: &Topology, positions: &[[f64; 3]]) -> Vec<f64> {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        0.5 * length(cross(sub(b, a), sub(c, a)))
    };
    topology.triangles().iter().map(area).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn its_area_is_1_whatever_the_unit_and_place() {
        for unit in [1.0, 1e-200, 1e200, 3e307] {
            let torus = shapes::torus(1.0, 0.4, 16, 9);
            let place = |p: &[f64; 3]| [0, 1, 2].map(|k| unit * (p[k] + 2.0));
            let positions = torus.positions().iter().map(place).collect();
            let mesh = TriangleMesh::new(positions, torus.triangles().to_vec()).unwrap();
            let patch = Patch::of(&mesh);
            let total: f64 = patch.areas.iter().sum();
            assert!((total - 1.0).abs() < 1e-9, "{total} at {unit}");
            let area: f64 = torus.triangle_areas().iter().sum();
            let scale = patch.scale * unit * area.sqrt();
            assert!((scale - 1.0).abs() < 1e-9, "{scale} at {unit}");
            for h in 0..patch.topology.half_edges() {
                let [a, b] = [patch.topology.origin(h), patch.topology.target(h)]
                    .map(|v| torus.positions()[patch.source[v as usize] as usize]);
                let expected = length(sub(a, b)) / area.sqrt();
                assert!((patch.lengths[h as usize] / expected - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn prices_are_lengths_times_rates_and_parts_keep_them() {
        let patch = Patch::of(&shapes::rectangle(2.0, 1.0, 4, 2));
        assert_eq!(patch.prices, patch.lengths);
        assert_eq!(patch.highest_rate(), 1.0);
        let rate = |v: u32| f64::from(v % 3) + 0.5;
        let priced = patch.priced(|ends| 0.5 * (rate(ends[0]) + rate(ends[1])));
        assert_eq!(priced.highest_rate(), 2.5);
        for h in 0..priced.topology.half_edges() {
            let ends = [priced.topology.origin(h), priced.topology.target(h)];
            let mean: f64 = ends
                .map(|v| rate(priced.source[v as usize]))
                .iter()
                .sum::<f64>()
                / 2.0;
            assert_eq!(priced.prices[h as usize], priced.lengths[h as usize] * mean);
        }
        let part = priced.subset(&[1, 4]);
        let expected = [3, 4, 5, 12, 13, 14].map(|h: usize| priced.prices[h]);
        assert_eq!(part.prices, expected);
    }

    #[test]
    fn without_area_its_longest_side_is_1() {
        let line = [[0.0, 0.0, 0.0], [4e9, 0.0, 0.0], [1e9, 0.0, 0.0]];
        let mesh = TriangleMesh::new(line.to_vec(), vec![[0, 1, 2]]).unwrap();
        let patch = Patch::of(&mesh);
        assert_eq!(patch.lengths, [1.0, 0.75, 0.25]);
        assert_eq!(patch.scale, 0.25e-9);
        let point = TriangleMesh::new(vec![[7.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
        assert_eq!(Patch::of(&point).lengths, [0.0; 3]);
    }
}
