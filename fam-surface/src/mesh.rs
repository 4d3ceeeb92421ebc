use super::vector::{add, cross, length, normalize, sub};
use super::{SurfaceError, point_cloud::check_positions};

/// A triangle mesh: vertices, and triangles that index them.
///
/// Counter-clockwise winding seen from outside. Topology is free: open, closed,
/// several components, non-manifold edges and zero-area triangles are allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangleMesh {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<[f64; 3]>>,
}

impl TriangleMesh {
    /// A mesh from vertex positions `[V, 3]` and triangles `[T, 3]`.
    ///
    /// # Errors
    /// No vertices, no triangles, a coordinate that is not finite, or an index out of range.
    pub fn new(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, SurfaceError> {
        check_positions(&positions)?;
        if triangles.is_empty() {
            return Err(SurfaceError::NoFaces);
        }
        check_indices(&triangles, positions.len())?;
        Ok(Self {
            positions,
            triangles,
            normals: None,
        })
    }

    /// The mesh with one normal per vertex, of any length; zero means unknown.
    ///
    /// # Errors
    /// The number of normals is not the number of vertices.
    pub fn with_normals(mut self, normals: Vec<[f64; 3]>) -> Result<Self, SurfaceError> {
        if normals.len() != self.positions.len() {
            return Err(SurfaceError::LengthMismatch {
                attribute: "normals",
                expected: self.positions.len(),
                found: normals.len(),
            });
        }
        self.normals = Some(normals);
        Ok(self)
    }

    /// Vertex positions, in input units.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Triangles as vertex indices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The normals the input came with, one per vertex.
    pub fn normals(&self) -> Option<&[[f64; 3]]> {
        self.normals.as_deref()
    }

    /// The three corners of triangle `t`.
    ///
    /// # Panics
    /// If `t` is not a triangle of this mesh.
    pub fn corners(&self, t: usize) -> [[f64; 3]; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }

    /// Twice the area of triangle `t` times its unit normal (the cross product of its edges).
    pub fn area_vector(&self, t: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(t);
        cross(sub(b, a), sub(c, a))
    }

    /// The area of every triangle, in squared input units.
    pub fn triangle_areas(&self) -> Vec<f64> {
        (0..self.triangles.len())
            .map(|t| 0.5 * length(self.area_vector(t)))
            .collect()
    }

    /// Unit normals per vertex: those of the input, else the area-weighted mean of the
    /// incident triangles. Zero where neither defines a direction.
    pub fn vertex_normals(&self) -> Vec<[f64; 3]> {
        if let Some(normals) = &self.normals {
            return normals.iter().copied().map(normalize).collect();
        }
        let mut sums = vec![[0.0; 3]; self.positions.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let weighted = self.area_vector(t);
            for &v in triangle {
                sums[v as usize] = add(sums[v as usize], weighted);
            }
        }
        sums.into_iter().map(normalize).collect()
    }

    /// The vertices that belong to a triangle, ascending.
    pub fn used_vertices(&self) -> Vec<u32> {
        let mut used = vec![false; self.positions.len()];
        for &v in self.triangles.iter().flatten() {
            used[v as usize] = true;
        }
        (0..self.positions.len() as u32)
            .filter(|&v| used[v as usize])
            .collect()
    }
}

pub(super) fn check_indices(triangles: &[[u32; 3]], count: usize) -> Result<(), SurfaceError> {
    for (face, triangle) in triangles.iter().enumerate() {
        if let Some(&index) = triangle.iter().find(|&&v| v as usize >= count) {
            return Err(SurfaceError::IndexOutOfRange { face, index, count });
        }
    }
    Ok(())
}
