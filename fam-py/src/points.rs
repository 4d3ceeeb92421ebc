//! Unwrapping a point cloud.

use burn_flex::Flex;
use fam::{Parting, Uvs};
use fam_core::atlas::Atlas;
use numpy::{IntoPyArray, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{cloud, of_rows, rows};
use crate::failure::Failure;
use crate::job::{Job, Output};
use crate::map::Map;
use crate::settings::Settings;
use crate::unwrapped::Told;

/// The job that unwraps a point cloud.
#[pyfunction]
pub fn unwrap_points(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    normals: Option<PyReadonlyArray2<'_, f64>>,
    settings: Settings,
) -> PyResult<Job> {
    let start = || {
        let normals = normals.as_ref().map(rows).transpose()?;
        let surface = cloud(rows(&points)?, normals)?;
        let options = settings.options(Parting::default())?;
        let backend = settings.backend()?;
        Job::start(move |signal| {
            let Told {
                unwrapped,
                report,
                warnings,
            } = Told::of(&surface, &options, backend, signal)?;
            let Uvs::Points(uvs) = unwrapped.uvs else {
                return Err(Failure::Internal("a cloud has UVs of corners".to_owned()));
            };
            Ok(PointOutput {
                uvs,
                seams: unwrapped.seams.points,
                report,
                warnings,
                map: unwrapped.map,
            })
        })
    };
    start().map_err(|failure| failure.exception(py))
}

struct PointOutput {
    uvs: Vec<[f32; 2]>,
    seams: Vec<u32>,
    report: String,
    warnings: Vec<String>,
    map: Option<Atlas<Flex>>,
}

impl Output for PointOutput {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = PyDict::new(py);
        found.set_item("uvs", of_rows(py, self.uvs))?;
        found.set_item("seams", self.seams.into_pyarray(py))?;
        found.set_item("report", self.report)?;
        found.set_item("warnings", self.warnings)?;
        found.set_item("map", self.map.map(Map::from))?;
        Ok(found.into_any())
    }
}
