use super::{SurfaceError, mesh::check_indices};

/// Texture coordinates of a triangle mesh, with their own triangles: corner `c` of mesh
/// triangle `t` has the coordinate `uvs[triangles[t][c]]`.
///
/// A vertex on a seam has several coordinates, so the two index lists differ there.
/// u grows to the right and v upwards.
#[derive(Debug, Clone, PartialEq)]
pub struct UvMap {
    uvs: Vec<[f32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl UvMap {
    /// A map from coordinates `[U, 2]` and, per mesh triangle, indices into them `[T, 3]`.
    ///
    /// # Errors
    /// A coordinate that is not finite, or an index out of range.
    pub fn new(uvs: Vec<[f32; 2]>, triangles: Vec<[u32; 3]>) -> Result<Self, SurfaceError> {
        if let Some(index) = uvs.iter().position(|q| !q.iter().all(|c| c.is_finite())) {
            return Err(SurfaceError::NonFiniteUv { index });
        }
        check_indices(&triangles, uvs.len())?;
        Ok(Self { uvs, triangles })
    }

    /// The texture coordinates.
    pub fn uvs(&self) -> &[[f32; 2]] {
        &self.uvs
    }

    /// Per mesh triangle, the indices of its corners' texture coordinates.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The three texture coordinates of triangle `t`.
    ///
    /// # Panics
    /// If `t` is not a triangle of this map.
    pub fn corners(&self, t: usize) -> [[f32; 2]; 3] {
        self.triangles[t].map(|i| self.uvs[i as usize])
    }
}
