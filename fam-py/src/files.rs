//! Files, read and written back with other UVs.

use std::path::PathBuf;
use std::sync::Arc;

use fam_io::{Document, WriteOptions, read_surface};
use fam_surface::{Surface, UvMap};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{of_rows, rows};
use crate::failure::Failure;

/// UVs of a mesh as they are written, with the indices of its corners.
#[pyclass(frozen, module = "flatten_anything._native")]
pub struct IndexedUvs(UvMap);

impl From<UvMap> for IndexedUvs {
    fn from(uvs: UvMap) -> Self {
        Self(uvs)
    }
}

/// A file that was read.
#[pyclass(frozen, module = "flatten_anything._native")]
pub struct File(Arc<Document>);

impl File {
    /// What is in it.
    pub fn document(&self) -> &Arc<Document> {
        &self.0
    }
}

/// Reads a mesh or a point cloud.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<File> {
    let document = py.detach(|| read_surface(&path));
    let document = document.map_err(|error| Failure::from(error).exception(py))?;
    Ok(File(Arc::new(document)))
}

#[pymethods]
impl File {
    /// The positions `[N, 3]`.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        of_rows(py, self.0.surface().positions().to_vec())
    }

    /// The triangles `[M, 3]`; none of a cloud.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<u32>>> {
        match self.0.surface() {
            Surface::Mesh(mesh) => Some(of_rows(py, mesh.triangles().to_vec())),
            Surface::PointCloud(_) => None,
        }
    }

    /// The normals `[N, 3]`, if it has any.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let normals = match self.0.surface() {
            Surface::Mesh(mesh) => mesh.normals(),
            Surface::PointCloud(cloud) => cloud.normals(),
        };
        Some(of_rows(py, normals?.to_vec()))
    }

    /// The UVs of the corners `[3 M, 2]`, or of the points `[N, 2]`, if it has any.
    #[getter]
    fn uvs<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f32>>> {
        let uvs = match (self.0.uv_map(), self.0.point_uvs()) {
            (Some(map), _) => {
                let corners = map.triangles().iter().flatten();
                corners.map(|&v| map.uvs()[v as usize]).collect()
            }
            (None, Some(uvs)) => uvs.to_vec(),
            (None, None) => return None,
        };
        Some(of_rows(py, uvs))
    }

    /// The object of every triangle; none if there is one object.
    #[getter]
    fn objects<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<u32>>> {
        let objects = &self.0.labels().objects;
        (!objects.is_empty()).then(|| objects.clone().into_pyarray(py))
    }

    /// The material of every triangle, −1 for none; none if there are no materials.
    #[getter]
    fn materials<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<i64>>> {
        let materials = &self.0.labels().materials;
        let numbers = materials
            .iter()
            .map(|material| material.map_or(-1, i64::from));
        (!materials.is_empty()).then(|| numbers.collect::<Vec<_>>().into_pyarray(py))
    }

    /// The names of the materials.
    #[getter]
    fn material_names(&self) -> Vec<String> {
        self.0.labels().material_names.clone()
    }

    /// The files beside it that it refers to.
    #[getter]
    fn companions(&self) -> Vec<PathBuf> {
        self.0.companions()
    }

    /// What the user should know about the file.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings().iter().map(ToString::to_string).collect()
    }

    /// Writes the file with the UVs of a layout.
    fn write_layout(
        &self,
        py: Python<'_>,
        path: PathBuf,
        uvs: &IndexedUvs,
        uv_set: u32,
    ) -> PyResult<()> {
        self.write_map(py, &path, &uvs.0, uv_set)
    }

    /// Writes the file with UVs of its corners `[3 M, 2]`, or of its points `[N, 2]`.
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        uvs: PyReadonlyArray2<'_, f32>,
        uv_set: u32,
    ) -> PyResult<()> {
        let fail = |failure: Failure| failure.exception(py);
        let uvs = rows::<2, f32>(&uvs).map_err(fail)?;
        match self.0.surface() {
            Surface::Mesh(_) => {
                let map = UvMap::of_corners(&uvs).map_err(|error| fail(error.into()))?;
                self.write_map(py, &path, &map, uv_set)
            }
            Surface::PointCloud(_) => {
                let options = options(uv_set);
                let write = || self.0.write_point_uvs(&uvs, &path, &options);
                py.detach(write).map_err(|error| fail(error.into()))
            }
        }
    }
}

impl File {
    fn write_map(&self, py: Python<'_>, path: &PathBuf, uvs: &UvMap, set: u32) -> PyResult<()> {
        let options = options(set);
        let write = || self.0.write_mesh_uvs(uvs, path, &options);
        py.detach(write)
            .map_err(|error| Failure::from(error).exception(py))
    }
}

fn options(uv_set: u32) -> WriteOptions {
    WriteOptions {
        uv_set,
        ..WriteOptions::default()
    }
}
