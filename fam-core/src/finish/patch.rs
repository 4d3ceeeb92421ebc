//! One component, ready to be cut and flattened.

use super::topology::{Opened, Topology};
use crate::surface::TriangleMesh;
use crate::surface::vector::{cross, length, sub};

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
        let at = |v: u32| positions[v as usize];
        let lengths = (0..topology.half_edges())
            .map(|h| length(sub(at(topology.target(h)), at(topology.origin(h)))))
            .collect();
        Self {
            areas: areas(&topology, &positions),
            topology,
            source,
            positions,
            lengths,
            scale,
        }
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
    let side = (0..3).map(|a| 0.5 * high[a] - 0.5 * low[a]).fold(0.0, f64::max);
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
