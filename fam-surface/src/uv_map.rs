use std::collections::HashMap;

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

    /// A map from the coordinates of all corners `[3 T, 2]`, triangle by triangle. Equal coordinates
    /// get one index.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    ///
    /// # Panics
    /// If their number is no multiple of 3.
    pub fn of_corners(corners: &[[f32; 2]]) -> Result<Self, SurfaceError> {
        let (triangles, rest) = corners.as_chunks::<3>();
        assert!(rest.is_empty(), "every triangle has three corners");
        let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
        let mut uvs = Vec::new();
        let mut number = |q: [f32; 2]| {
            // Adding zero makes −0 and 0 one.
            let key = q.map(|c| (c + 0.0).to_bits());
            *numbers.entry(key).or_insert_with(|| {
                uvs.push(q);
                uvs.len() as u32 - 1
            })
        };
        let triangles = triangles.iter().map(|t| t.map(&mut number)).collect();
        Self::new(uvs, triangles)
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

    /// The area of the triangle of number `t`, whichever way it runs, in square UV units.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn area(&self, t: usize) -> f64 {
        let [a, b, c] = self.corners(t).map(|q| q.map(f64::from));
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_is_that_of_the_triangle_whichever_way_it_runs() {
        let corners = [[1.0, 1.0], [4.0, 1.0], [2.0, 3.0]];
        let [a, b, c] = corners;
        for corners in [[a, b, c], [b, a, c]] {
            assert_eq!(UvMap::of_corners(&corners).unwrap().area(0), 3.0);
        }
    }

    #[test]
    fn equal_corners_get_one_index() {
        let corners = [
            [0.0, 0.0],
            [1.0, 0.0],
            [0.0, 1.0],
            [-0.0, 0.0],
            [0.0, 1.0],
            [2.0, 2.0],
        ];
        let map = UvMap::of_corners(&corners).unwrap();
        assert_eq!(map.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(map.uvs(), [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0, 2.0]]);
        let broken = UvMap::of_corners(&[[0.0, f32::NAN]; 3]);
        assert_eq!(broken, Err(SurfaceError::NonFiniteUv { index: 0 }));
    }
}
