//! What the readers of all formats make of their files.

use fam_surface::polygons::Polygons;
use fam_surface::{PointCloud, Surface, SurfaceError, TriangleMesh};

use crate::labels::Labels;
use crate::uvs::Uvs;
use crate::warning::Warning;

/// What a reader makes of a file: `S` is what its writer needs.
pub(crate) struct Parsed<S> {
    pub surface: Surface,
    pub uvs: Option<Uvs>,
    pub labels: Labels,
    pub diagonals: Vec<[u32; 2]>,
    pub warnings: Vec<Warning>,
    pub source: S,
}

/// The surface of a file: a cloud if no face is left. Normals that are not finite count as
/// unknown.
pub(crate) fn surface(
    positions: Vec<[f64; 3]>,
    polygons: &Polygons,
    normals: Option<Vec<[f64; 3]>>,
) -> Result<Surface, SurfaceError> {
    surface_of_triangles(positions, polygons.triangles(), normals)
}

/// As [`surface`], of faces that are triangles.
pub(crate) fn surface_of_triangles(
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<[f64; 3]>>,
) -> Result<Surface, SurfaceError> {
    let known = |n: [f64; 3]| {
        if n.iter().all(|c| c.is_finite()) {
            n
        } else {
            [0.0; 3]
        }
    };
    let normals = normals.map(|normals| normals.into_iter().map(known).collect::<Vec<_>>());
    if triangles.is_empty() {
        return PointCloud::new(positions, normals).map(Surface::PointCloud);
    }
    let mesh = TriangleMesh::new(positions, triangles)?;
    Ok(Surface::Mesh(match normals {
        Some(normals) => mesh.with_normals(normals)?,
        None => mesh,
    }))
}
