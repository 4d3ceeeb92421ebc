//! A triangle mesh through the points of a cloud, so that it can be flattened as a mesh is.
//!
//! Every point has a star: its triangles in a Delaunay triangulation of its neighbours on the
//! tangent plane. Triangles that the stars of their corners agree on are stitched together
//! first, then those that fit in beside them, and small holes are closed. The map says which
//! neighbours lie on the same sheet where sheets come close to each other.

mod holes;
mod neighborhood;
mod patchwork;
pub mod places;
mod star;
#[cfg(test)]
mod tests;

use fam_surface::degenerate::rescaled;
use fam_surface::weld::weld;
use fam_surface::{SurfaceError, TriangleMesh, UvMap};

use neighborhood::Neighborhood;
use patchwork::Patchwork;

/// A mesh through the points of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// Vertex `i` is point `i`; those that were not reached are in no triangle.
    pub mesh: TriangleMesh,
    /// The vertex that stands for every point: itself, or the first at the same position;
    /// none for a point that was not reached.
    pub vertices: Vec<Option<u32>>,
}

impl Reconstruction {
    /// Joins points `[N, 3]` to a surface, with the help of a map that gives each a UV `[N, 2]`
    /// and may be torn, folded and overlapping. An edge is in one triangle or two, and around
    /// a vertex no triangles overlap; orientation is left to the caller.
    ///
    /// Time grows as `N log N`. `goes_on` is asked between the steps; none if it says no.
    ///
    /// # Errors
    /// A coordinate that is not finite, another number of UVs than points, or not a single
    /// triangle: fewer than three points, all on a line, or too far apart from each other.
    pub fn of(
        points: &[[f64; 3]],
        uvs: &[[f32; 2]],
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, SurfaceError> {
        if points.len() != uvs.len() {
            return Err(SurfaceError::LengthMismatch {
                attribute: "UVs",
                expected: points.len(),
                found: uvs.len(),
            });
        }
        let map = UvMap::new(uvs.to_vec(), Vec::new())?;
        if let Some(index) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(SurfaceError::NonFinitePosition { index });
        }
        let first = weld(points);
        let distinct: Vec<u32> = (0..points.len() as u32)
            .filter(|&i| first[i as usize] == i)
            .collect();
        let Some(triangles) = triangles(&rescaled(points), map.uvs(), &distinct, goes_on) else {
            return Ok(None);
        };
        if triangles.is_empty() {
            return Err(SurfaceError::TooSmall("its points span no surface"));
        }
        let mesh = TriangleMesh::new(points.to_vec(), triangles)?;
        let mut reached = vec![false; points.len()];
        for v in mesh.used_vertices() {
            reached[v as usize] = true;
        }
        let vertices = first
            .into_iter()
            .map(|v| reached[v as usize].then_some(v))
            .collect();
        Ok(Some(Self { mesh, vertices }))
    }

    /// How many points are in no triangle.
    #[cfg(test)]
    pub fn unreached(&self) -> usize {
        self.vertices.iter().filter(|v| v.is_none()).count()
    }
}

/// Triangles over the points that `distinct` names, no two of which coincide; none if the work is
/// broken off.
fn triangles(
    points: &[[f64; 3]],
    uvs: &[[f32; 2]],
    distinct: &[u32],
    goes_on: &dyn Fn() -> bool,
) -> Option<Vec<[u32; 3]>> {
    if distinct.len() < 3 {
        return Some(Vec::new());
    }
    let places: Vec<[f64; 3]> = distinct.iter().map(|&i| points[i as usize]).collect();
    let uvs: Vec<[f32; 2]> = distinct.iter().map(|&i| uvs[i as usize]).collect();
    let neighborhood = Neighborhood::of(&places, &uvs, goes_on)?;
    let candidates = star::candidates(&neighborhood);
    if !goes_on() {
        return None;
    }
    let mut patchwork = Patchwork::stitched(&neighborhood, &candidates);
    if !goes_on() {
        return None;
    }
    holes::close(&mut patchwork);
    let found = patchwork.triangles().iter();
    Some(found.map(|t| t.map(|v| distinct[v as usize])).collect())
}
