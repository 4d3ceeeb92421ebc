//! The metrics of UVs.

use fam_surface::metrics::Metrics;
use fam_surface::{TriangleMesh, UvMap};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::arrays::rows;
use crate::failure::Failure;
use crate::job::{Job, Output};

/// The job that measures the UVs of a mesh's corners `[3 M, 2]`.
#[pyfunction]
pub fn measure(
    py: Python<'_>,
    positions: PyReadonlyArray2<'_, f64>,
    triangles: PyReadonlyArray2<'_, u32>,
    uvs: PyReadonlyArray2<'_, f32>,
) -> PyResult<Job> {
    let start = || {
        let (positions, triangles, uvs) = (rows(&positions)?, rows(&triangles)?, rows(&uvs)?);
        Job::start(move |_| {
            let mesh = TriangleMesh::new(positions, triangles)?;
            let metrics = Metrics::measure(&mesh, &UvMap::of_corners(&uvs)?)?;
            let text = serde_json::to_string(&metrics);
            text.map(Text)
                .map_err(|error| Failure::Internal(error.to_string()))
        })
    };
    start().map_err(|failure| failure.exception(py))
}

/// JSON.
struct Text(String);

impl Output for Text {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyString::new(py, &self.0).into_any())
    }
}
