use robust::{Coord, orient2d};

use crate::degenerate::{double_area, rescaled};
use crate::{SurfaceError, TriangleMesh, UvMap};

/// A mesh and its UV map with the areas of all triangles.
///
/// Positions are divided by a power of two near the largest coordinate, so that no
/// product of theirs overflows. All metrics are invariant under scaling.
pub(super) struct Layout<'a> {
    mesh: &'a TriangleMesh,
    uv: &'a UvMap,
    positions: Vec<[f64; 3]>,
    /// Twice the 3D areas; 0 for degenerate triangles.
    double_areas: Vec<f64>,
    /// Twice the UV areas, positive where counter-clockwise; the signs are exact.
    uv_double_areas: Vec<f64>,
}

impl<'a> Layout<'a> {
    pub(super) fn new(mesh: &'a TriangleMesh, uv: &'a UvMap) -> Result<Self, SurfaceError> {
        check_lengths(mesh, uv)?;
        let positions = rescaled(mesh.positions());
        let double_areas: Vec<f64> = mesh
            .triangles()
            .iter()
            .map(|t| double_area(t.map(|v| positions[v as usize])))
            .collect();
        if double_areas.iter().all(|&area| area == 0.0) {
            return Err(SurfaceError::TooSmall("all triangles have zero area"));
        }
        let uv_double_areas = (0..uv.triangles().len())
            .map(|t| signed_double_area(uv.corners(t)))
            .collect();
        Ok(Self {
            mesh,
            uv,
            positions,
            double_areas,
            uv_double_areas,
        })
    }

    /// How many triangles there are, degenerate ones included.
    pub(super) fn len(&self) -> usize {
        self.double_areas.len()
    }

    /// The triangles that are not degenerate.
    pub(super) fn measured(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.len()).filter(|&t| self.double_areas[t] > 0.0)
    }

    /// How many triangles have area in 3D but none in UV space.
    pub(super) fn collapsed_triangles(&self) -> usize {
        self.measured()
            .filter(|&t| self.uv_double_areas[t] == 0.0)
            .count()
    }

    /// The rescaled position of a vertex.
    pub(super) fn position(&self, vertex: u32) -> [f64; 3] {
        self.positions[vertex as usize]
    }

    /// The rescaled corners of triangle `t`.
    pub(super) fn corners(&self, t: usize) -> [[f64; 3]; 3] {
        self.mesh.triangles()[t].map(|v| self.position(v))
    }

    /// The UV coordinates of the corners of triangle `t`.
    pub(super) fn uv_corners(&self, t: usize) -> [[f64; 2]; 3] {
        self.uv.corners(t).map(|q| q.map(f64::from))
    }

    /// Twice the rescaled 3D area of triangle `t`; 0 if it is degenerate.
    pub(super) fn double_area(&self, t: usize) -> f64 {
        self.double_areas[t]
    }

    /// Twice the UV area of triangle `t`, positive where counter-clockwise.
    pub(super) fn uv_double_area(&self, t: usize) -> f64 {
        self.uv_double_areas[t]
    }
}

/// A map must have as many triangles as its mesh.
pub(super) fn check_lengths(mesh: &TriangleMesh, uv: &UvMap) -> Result<(), SurfaceError> {
    let (expected, found) = (mesh.triangles().len(), uv.triangles().len());
    if expected != found {
        return Err(SurfaceError::LengthMismatch {
            attribute: "texture coordinate triangles",
            expected,
            found,
        });
    }
    Ok(())
}

/// Twice the signed area of a UV triangle, positive where counter-clockwise; the sign is exact.
pub(super) fn signed_double_area(corners: [[f32; 2]; 3]) -> f64 {
    let [a, b, c] = corners.map(|[x, y]| Coord { x, y });
    orient2d(a, b, c)
}
