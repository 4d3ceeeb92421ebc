//! The metrics of UVs.

use fam_surface::metrics::Metrics;
use fam_surface::{TriangleMesh, UvMap};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::failure::Failure;

/// The metrics of a mesh's UVs as JSON; `uv_triangles` has the UVs of the corners of every triangle.
#[pyfunction]
pub fn measure(
    py: Python<'_>,
    positions: PyReadonlyArray2<'_, f64>,
    triangles: PyReadonlyArray2<'_, u32>,
    uvs: PyReadonlyArray2<'_, f32>,
    uv_triangles: PyReadonlyArray2<'_, u32>,
) -> PyResult<String> {
    let found = || {
        let mesh = TriangleMesh::new(rows(&positions)?, rows(&triangles)?)?;
        let uvs = UvMap::new(rows(&uvs)?, rows(&uv_triangles)?)?;
        py.detach(|| {
            let metrics = crate::pool::pool()?.install(|| Metrics::measure(&mesh, &uvs))?;
            serde_json::to_string(&metrics).map_err(|error| Failure::Internal(error.to_string()))
        })
    };
    found().map_err(|failure: Failure| failure.exception(py))
}
