//! Trained maps.

use std::path::PathBuf;
use std::sync::Arc;

use burn::tensor::backend::AutodiffBackend;
use burn_flex::Flex;
use fam_core::atlas::{Atlas, Start};
use fam_core::training::{Strategies, TrainingConfig};
use fam_io::atomic::write_atomically;
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};
use fam_surface::{Normalization, Surface};
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Faces, PolygonMesh, cloud, of_rows, rows};
use crate::backend::{backend, on_cpu};
use crate::failure::Failure;
use crate::job::{Job, Output, Signal};
use crate::settings::Settings;

/// A trained map: it gives a UV to any point.
#[pyclass(frozen, module = "flatten_anything._native")]
pub struct Map(Arc<Atlas<Flex>>);

impl From<Atlas<Flex>> for Map {
    fn from(atlas: Atlas<Flex>) -> Self {
        Self(Arc::new(atlas))
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
        let faces = corners.map(|corners| Faces::new(&corners, sizes.as_ref()));
        let faces = faces.transpose()?;
        let normals = normals.as_ref().map(rows).transpose()?;
        let config = settings.training()?;
        let name = settings.backend()?;
        Job::start(move |signal| {
            let surface = match faces {
                Some(faces) => Surface::Mesh(PolygonMesh::new(positions, &faces)?.mesh),
                None => cloud(positions, normals)?,
            };
            backend(name)?.run(Training {
                config: &config,
                surface: &surface,
                signal,
            })
        })
    };
    start().map_err(|failure: Failure| failure.exception(py))
}

/// Training, on any backend.
struct Training<'a> {
    config: &'a TrainingConfig,
    surface: &'a Surface,
    signal: &'a Signal,
}

impl fam_cli::Job for Training<'_> {
    type Output = Result<Map, Failure>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let steps = self.config.steps();
        let trained = fam::train::<B>(
            Start::Fresh(self.config),
            self.surface,
            &fam::Parting::default(),
            SeamRule::Spacing,
            device,
            strategies,
            |now| self.signal.observe(&fam::Progress::Training { steps, now }),
        )?;
        Ok(Map::from(on_cpu(&trained.flattened.atlas)?))
    }
}

/// The map in a file.
#[pyfunction]
pub fn load(py: Python<'_>, path: PathBuf) -> PyResult<Map> {
    let load = || {
        let fail = |reason: String| Failure::File(format!("{}: {reason}", path.display()));
        let bytes = std::fs::read(&path).map_err(|error| fail(error.to_string()))?;
        let atlas = Atlas::from_safetensors(&bytes, &Default::default());
        atlas
            .map(Map::from)
            .map_err(|error| fail(error.to_string()))
    };
    py.detach(load).map_err(|failure| failure.exception(py))
}

#[pymethods]
impl Map {
    /// The job that computes the UVs `[N, 2]` of points `[N, 3]`.
    fn uvs(&self, py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<Job> {
        self.job(py, &points, |atlas, points| Ok(Uvs(atlas.uvs(&points))))
    }

    /// The job that computes the derivatives `[N, 2, 3]` of the UVs by the coordinates of points
    /// `[N, 3]`.
    fn jacobian(&self, py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<Job> {
        self.job(py, &points, |atlas, points| {
            Ok(Derivatives(atlas.jacobian(&points)))
        })
    }

    /// The job that finds those of points `[N, 3]` at which the map is torn.
    fn seams(&self, py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<Job> {
        self.job(py, &points, |atlas, points| {
            let normalization = Normalization::of(&points)?;
            let uvs = atlas.uvs(&points);
            let placed: Vec<_> = points.iter().map(|&p| normalization.apply(p)).collect();
            let threshold = SeamThreshold::of(SeamRule::Spacing, &placed, &uvs);
            Ok(Torn(Seams::of_points(&placed, &uvs, threshold).points))
        })
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
            .map(Self::from)
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

impl Map {
    /// A job on the map and points.
    fn job<O: Output + 'static>(
        &self,
        py: Python<'_>,
        points: &PyReadonlyArray2<'_, f64>,
        work: impl FnOnce(&Atlas<Flex>, Vec<[f64; 3]>) -> Result<O, Failure> + Send + 'static,
    ) -> PyResult<Job> {
        let atlas = Arc::clone(&self.0);
        rows(points)
            .and_then(|points| Job::start(move |_| work(&atlas, points)))
            .map_err(|failure| failure.exception(py))
    }
}

struct Uvs(Vec<[f32; 2]>);

impl Output for Uvs {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(of_rows(py, self.0).into_any())
    }
}

/// Of every point the rows of u and of v.
struct Derivatives(Vec<[[f32; 3]; 2]>);

impl Output for Derivatives {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = (self.0.len(), 2, 3);
        let numbers = self.0.into_flattened().into_flattened();
        let array = Array3::from_shape_vec(shape, numbers);
        let array = array.unwrap_or_else(|error| unreachable!("{error}"));
        Ok(array.into_pyarray(py).into_any())
    }
}

/// Indices of points.
struct Torn(Vec<u32>);

impl Output for Torn {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.0.into_pyarray(py).into_any())
    }
}
