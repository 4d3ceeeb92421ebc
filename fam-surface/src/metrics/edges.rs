use crate::sides;
use crate::weld::weld;
use crate::{TriangleMesh, UvMap};

/// A mesh edge as one of its triangles sees it, at the bit patterns of the UV coordinates of its
/// two ends.
pub(super) type Side = sides::Side<[[u32; 2]; 2]>;

/// The sides of all edges, sorted by edge and then by UV coordinates.
pub(super) fn sides(mesh: &TriangleMesh, uv: &UvMap) -> Vec<Side> {
    let first = weld(mesh.positions());
    let triangles = mesh.triangles().iter();
    let welded: Vec<[u32; 3]> = triangles.map(|t| t.map(|v| first[v as usize])).collect();
    let uvs = |h: u32, reversed: bool| {
        // Adding 0 turns −0 into 0.
        let corners = uv
            .corners(h as usize / 3)
            .map(|q| q.map(|c| (c + 0.0).to_bits()));
        let [a, b] = [0, 1].map(|end| corners[(h as usize % 3 + end) % 3]);
        Some(if reversed { [b, a] } else { [a, b] })
    };
    sides::sides(mesh.triangles(), &welded, |_| 0, uvs)
}
