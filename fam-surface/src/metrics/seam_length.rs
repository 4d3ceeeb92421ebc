use crate::sides::{edges, is_torn};
use crate::vector::{length, sub};

use super::edges::Side;
use super::layout::Layout;

/// The edges of two or more triangles, one of which has the UV coordinates of no other there, by
/// welded vertices, ascending.
pub(super) fn seam_edges(sides: &[Side]) -> impl Iterator<Item = [u32; 2]> + '_ {
    edges(sides)
        .filter(|edge| is_torn(edge))
        .map(|edge| edge[0].ends)
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
