//! The metrics of UVs, whatever squares they are in.

use fam_surface::metrics::Metrics;
use fam_surface::{SurfaceError, TriangleMesh, UvMap};

use crate::parting::Parting;

/// The map with its UV squares side by side, so that triangles of different squares do not count
/// as overlapping. With several `tiles`, every square is one, and they lie side by side already.
pub fn in_a_row(map: &UvMap, parting: &Parting, tiles: u32) -> Result<UvMap, SurfaceError> {
    if parting.uv_squares() == 1 || tiles > 1 {
        return Ok(map.clone());
    }
    let mut uvs = map.uvs().to_vec();
    let mut moved = vec![false; uvs.len()];
    for (triangle, &label) in map.triangles().iter().zip(&parting.labels) {
        for &corner in triangle {
            let corner = corner as usize;
            if !std::mem::replace(&mut moved[corner], true) {
                uvs[corner][0] += parting.squares[label as usize] as f32;
            }
        }
    }
    UvMap::new(uvs, map.triangles().to_vec())
}

/// The metrics of a map, its UV squares side by side.
pub fn measured(
    mesh: &TriangleMesh,
    map: &UvMap,
    parting: &Parting,
    tiles: u32,
) -> Result<Metrics, SurfaceError> {
    Metrics::measure(mesh, &in_a_row(map, parting, tiles)?)
}
