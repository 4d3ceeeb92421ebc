use crate::vector::{length, sub};

use super::edges::Side;
use super::layout::Layout;

/// The edges whose triangles, two or more, do not all have the same UV coordinates there, by
/// welded vertices, ascending.
pub(super) fn seam_edges(sides: &[Side]) -> impl Iterator<Item = [u32; 2]> + '_ {
    sides
        .chunk_by(|a, b| a.edge == b.edge)
        .filter(|sides| {
            let differs =
                |key: fn(&Side, &Side) -> bool| sides.windows(2).any(|s| key(&s[0], &s[1]));
            differs(|a, b| a.triangle != b.triangle) && differs(|a, b| a.uvs != b.uvs)
        })
        .map(|sides| sides[0].edge)
}

/// The total 3D length of the seam edges over the square root of the surface area.
pub(super) fn seam_length(layout: &Layout, sides: &[Side]) -> f64 {
    let seams = seam_edges(sides).fold(0.0, |sum, edge| {
        let [a, b] = edge.map(|v| layout.position(v));
        sum + length(sub(b, a))
    });
    let area: f64 = layout.measured().map(|t| 0.5 * layout.double_area(t)).sum();
    seams / area.sqrt()
}
