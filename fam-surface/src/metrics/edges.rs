use crate::weld::weld;
use crate::{TriangleMesh, UvMap};

/// A mesh edge as one of its triangles sees it.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// The ends of the edge, as welded vertices in ascending order.
    pub(super) edge: [u32; 2],
    /// The bit patterns of the UV coordinates at the two ends.
    pub(super) uvs: [[u32; 2]; 2],
    /// The triangle.
    pub(super) triangle: u32,
    /// Whether the triangle runs from the second end to the first.
    pub(super) reversed: bool,
}

/// The sides of all edges, sorted by edge and then by UV coordinates.
///
/// Vertices at equal positions are one vertex; an edge between two of them has no sides.
pub(super) fn sides(mesh: &TriangleMesh, uv: &UvMap) -> Vec<Side> {
    let welded = weld(mesh.positions());
    let mut sides = Vec::with_capacity(3 * mesh.triangles().len());
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let vertices = triangle.map(|v| welded[v as usize]);
        // Adding 0 turns −0 into 0.
        let uvs = uv.corners(t).map(|q| q.map(|c| (c + 0.0).to_bits()));
        for (start, end) in [(0, 1), (1, 2), (2, 0)] {
            let reversed = vertices[start] > vertices[end];
            let (first, second) = if reversed { (end, start) } else { (start, end) };
            if vertices[first] != vertices[second] {
                sides.push(Side {
                    edge: [vertices[first], vertices[second]],
                    uvs: [uvs[first], uvs[second]],
                    triangle: t as u32,
                    reversed,
                });
            }
        }
    }
    sides.sort_unstable();
    sides
}
