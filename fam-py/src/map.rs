//! Trained maps.

use std::path::PathBuf;

use burn_autodiff::Autodiff;
use burn_flex::Flex;
use fam_core::atlas::Atlas;
use fam_core::training::Strategies;
use fam_io::atomic::write_atomically;
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};
use fam_surface::{Normalization, Surface};
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Faces, PolygonMesh, cloud, of_rows, rows};
use crate::failure::Failure;
use crate::job::{Job, Output};
use crate::pool::pool;
use crate::settings::Settings;

/// A trained map: it gives a UV to any point.
#[pyclass(frozen, module = "flatten_anything._native")]
pub struct Map(Atlas<Flex>);

impl From<Atlas<Flex>> for Map {
    fn from(atlas: Atlas<Flex>) -> Self {
        Self(atlas)
    }
}

impl Output for Map {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(Bound::new(py, *self)?.into_any())
    }
}

/// The job that trains a map of a mesh, or of a cloud if there are no faces.
#[pyfunction]
pub fn train(
    py: Python<'_>,
    positions: PyReadonlyArray2<'_, f64>,
    corners: Option<PyReadonlyArray1<'_, u32>>,
    sizes: Option<PyReadonlyArray1<'_, u32>>,
    normals: Option<PyReadonlyArray2<'_, f64>>,
    settings: Settings,
) -> PyResult<Job> {
    let start = || {
        let positions = rows(&positions)?;
        let surface = match corners {
            Some(corners) => {
                let mesh = PolygonMesh::new(positions, &Faces { corners, sizes })?.mesh;
                Surface::Mesh(mesh)
            }
            None => cloud(positions, normals.as_ref().map(rows).transpose()?)?,
        };
        let config = settings.training()?;
        Job::start(move |signal| {
            let steps = config.steps();
            let trained = fam::train::<Autodiff<Flex>>(
                &config,
                &surface,
                &fam::Parting::default(),
                SeamRule::Spacing,
                &Default::default(),
                Strategies::tiled(),
                |now| signal.observe(&fam::Progress::Training { steps, now }),
            )?;
            Ok(Map(trained.flattened.atlas))
        })
    };
    start().map_err(|failure: Failure| failure.exception(py))
}

/// The map in a file.
#[pyfunction]
pub fn load(py: Python<'_>, path: PathBuf) -> PyResult<Map> {
    let load = || {
        let fail = |reason: String| Failure::File(format!("{}: {reason}", path.display()));
        let bytes = std::fs::read(&path).map_err(|error| fail(error.to_string()))?;
        let atlas = Atlas::from_safetensors(&bytes, &Default::default());
        atlas.map(Map).map_err(|error| fail(error.to_string()))
    };
    py.detach(load).map_err(|failure| failure.exception(py))
}

#[pymethods]
impl Map {
    /// The UVs `[N, 2]` of points `[N, 3]`.
    fn uvs<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let points = finite(py, &points)?;
        let uvs = py.detach(|| Ok(pool()?.install(|| self.0.uvs(&points))));
        let uvs = uvs.map_err(|failure: Failure| failure.exception(py))?;
        Ok(of_rows(py, uvs))
    }

    /// The derivatives `[N, 2, 3]` of the UVs by the coordinates of points `[N, 3]`.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let points = finite(py, &points)?;
        let found = py.detach(|| Ok(pool()?.install(|| self.0.jacobian(&points))));
        let found = found.map_err(|failure: Failure| failure.exception(py))?;
        let shape = (found.len(), 2, 3);
        let numbers = found.into_flattened().into_flattened();
        let array = Array3::from_shape_vec(shape, numbers);
        Ok(array
            .unwrap_or_else(|error| unreachable!("{error}"))
            .into_pyarray(py))
    }

    /// Those of points `[N, 3]` at which the map is torn.
    fn seams<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let points = finite(py, &points)?;
        let find = || {
            let normalization = Normalization::of(&points)?;
            let uvs = pool()?.install(|| self.0.uvs(&points));
            let placed: Vec<_> = points.iter().map(|&p| normalization.apply(p)).collect();
            let threshold = SeamThreshold::of(SeamRule::Spacing, &placed, &uvs);
            Ok(Seams::of_points(&placed, &uvs, threshold).points)
        };
        let found = py.detach(find);
        let found = found.map_err(|failure: Failure| failure.exception(py))?;
        Ok(found.into_pyarray(py))
    }

    /// The content of `model.safetensors`.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| self.0.to_safetensors());
        let bytes = bytes.map_err(|error| Failure::from(error).exception(py))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// The map that [`to_bytes`](Self::to_bytes) wrote.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        let atlas = Atlas::from_safetensors(bytes, &Default::default());
        atlas
            .map(Self)
            .map_err(|error| Failure::from(error).exception(py))
    }

    /// Writes `model.safetensors`, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let save = || {
            let bytes = self.0.to_safetensors()?;
            write_atomically(&path, |out| out.write_all(&bytes))?;
            Ok(())
        };
        py.detach(save)
            .map_err(|failure: Failure| failure.exception(py))
    }
}

/// Points with finite coordinates.
fn finite(py: Python<'_>, points: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    let points = rows::<3, f64>(points).map_err(|failure| failure.exception(py))?;
    match points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        None => Ok(points),
        Some(index) => {
            let problem = format!("point {index} has a coordinate that is not a finite number");
            Err(Failure::Input(problem).exception(py))
        }
    }
}
