use std::collections::HashMap;

use crate::{TriangleMesh, UvMap};

/// For every triangle the first that is the same: its corners have the same positions, and at
/// each of them the same UV, in any order. It is the same piece of surface drawn twice, as the
/// two sides of a sheet are, and takes the same piece of texture on purpose.
pub(super) fn first_alike(mesh: &TriangleMesh, uv: &UvMap) -> Vec<u32> {
    let mut first: HashMap<[[u64; 5]; 3], u32> = HashMap::new();
    (0..mesh.triangles().len())
        .map(|t| {
            let (corners, uvs) = (mesh.corners(t), uv.corners(t));
            let mut key = [0, 1, 2].map(|c| {
                // Without the sign of zero.
                let [x, y, z] = corners[c].map(|x| (x + 0.0).to_bits());
                let [u, v] = uvs[c].map(|x| f64::from(x + 0.0).to_bits());
                [x, y, z, u, v]
            });
            key.sort_unstable();
            *first.entry(key).or_insert(t as u32)
        })
        .collect()
}
