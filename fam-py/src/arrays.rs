//! Arrays from Python, and back.

use fam_surface::polygons::Polygons;
use fam_surface::{PointCloud, Surface, TriangleMesh, UvMap};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::failure::Failure;

/// Rows of `N` numbers from a contiguous array `[M, N]`.
pub fn rows<const N: usize, T: numpy::Element + Copy>(
    array: &PyReadonlyArray2<'_, T>,
) -> Result<Vec<[T; N]>, Failure> {
    let bad = || Failure::Input(format!("an array of {N} columns was expected"));
    if array.as_array().ncols() != N {
        return Err(bad());
    }
    let numbers = array.as_slice().map_err(|_| bad())?;
    Ok(numbers.as_chunks().0.to_vec())
}

/// An array `[M, N]` of rows.
pub fn of_rows<'py, const N: usize, T: numpy::Element + Copy>(
    py: Python<'py>,
    rows: Vec<[T; N]>,
) -> Bound<'py, PyArray2<T>> {
    let shape = (rows.len(), N);
    let array = Array2::from_shape_vec(shape, rows.into_flattened());
    array
        .unwrap_or_else(|error| unreachable!("{error}"))
        .into_pyarray(py)
}

/// Faces from Python: the vertices of all corners, face by face, and how many corners each has.
pub struct Faces {
    corners: Vec<u32>,
    /// None if all are triangles.
    sizes: Option<Vec<u32>>,
}

impl Faces {
    /// Copies of contiguous arrays.
    pub fn new(
        corners: &PyReadonlyArray1<'_, u32>,
        sizes: Option<&PyReadonlyArray1<'_, u32>>,
    ) -> Result<Self, Failure> {
        let flat = |array: &PyReadonlyArray1<'_, u32>| {
            let slice = array.as_slice();
            let bad = |_| Failure::Input("faces are not contiguous".to_owned());
            slice.map(<[u32]>::to_vec).map_err(bad)
        };
        Ok(Self {
            corners: flat(corners)?,
            sizes: sizes.map(flat).transpose()?,
        })
    }
}

/// A mesh with the polygons that its triangles are parts of.
pub struct PolygonMesh {
    pub mesh: TriangleMesh,
    pub polygons: Polygons,
    /// Edges of triangles inside of what is one polygon.
    pub diagonals: Vec<[u32; 2]>,
}

impl PolygonMesh {
    /// A mesh of faces with `positions`. To divide a polygon of many corners may take seconds.
    pub fn new(positions: Vec<[f64; 3]>, faces: &Faces) -> Result<Self, Failure> {
        let count = positions.len();
        let mut polygons = Polygons::default();
        let mut push =
            |face: usize, corners: &[u32]| match corners.iter().find(|&&v| v as usize >= count) {
                Some(vertex) => Err(Failure::Input(format!(
                    "face {face} refers to vertex {vertex}, but there are only {count}"
                ))),
                None => {
                    polygons.push(corners.iter().copied());
                    Ok(())
                }
            };
        match &faces.sizes {
            None => {
                let (triangles, _) = faces.corners.as_chunks::<3>();
                for (face, triangle) in triangles.iter().enumerate() {
                    push(face, triangle)?;
                }
            }
            Some(sizes) => {
                let mut rest = faces.corners.as_slice();
                for (face, &size) in sizes.iter().enumerate() {
                    let short = || Failure::Input(format!("face {face} has too few corners"));
                    let (own, others) = rest.split_at_checked(size as usize).ok_or_else(short)?;
                    if own.len() < 3 {
                        return Err(short());
                    }
                    push(face, own)?;
                    rest = others;
                }
            }
        }
        if faces.sizes.is_some() && positions.iter().flatten().all(|c| c.is_finite()) {
            polygons.divide(&positions);
        }
        let mesh = TriangleMesh::new(positions, polygons.triangles())?;
        Ok(Self {
            mesh,
            diagonals: polygons.diagonals(),
            polygons,
        })
    }

    /// What every triangle has, of what every face has.
    pub fn of_triangles<T: Copy>(&self, of_faces: &[T]) -> Vec<T> {
        let counts = self
            .polygons
            .divided()
            .map(|(_, division)| division.count());
        of_faces
            .iter()
            .zip(counts)
            .flat_map(|(&value, count)| std::iter::repeat_n(value, count))
            .collect()
    }

    /// The UVs of the triangles, of those of the corners of all faces.
    pub fn uv_map(&self, of_corners: &[[f32; 2]]) -> Result<UvMap, Failure> {
        if of_corners.len() != self.polygons.corners().len() {
            let reason = "there is not a UV for every corner of the faces";
            return Err(Failure::Input(reason.to_owned()));
        }
        let mut rest = of_corners;
        let mut of_triangles = Vec::with_capacity(3 * self.mesh.triangles().len());
        for (face, division) in self.polygons.divided() {
            let (own, others) = rest.split_at(face.len());
            of_triangles.extend(division.of(own).flatten());
            rest = others;
        }
        Ok(UvMap::of_corners(&of_triangles)?)
    }
}

/// A cloud of points, with normals if they are known.
pub fn cloud(points: Vec<[f64; 3]>, normals: Option<Vec<[f64; 3]>>) -> Result<Surface, Failure> {
    Ok(Surface::PointCloud(PointCloud::new(points, normals)?))
}
