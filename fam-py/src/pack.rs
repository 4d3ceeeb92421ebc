//! Packing charts that are there.

use fam_layout::repacked;
use fam_surface::UvMap;
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{of_rows, rows};
use crate::failure::Failure;
use crate::pool::pool;

/// The UVs `[N, 2]` again with their charts side by side in the unit square; `triangles` has the
/// UVs of every triangle. Also what share of the square they cover, and the margin kept in texels.
#[pyfunction]
pub fn pack<'py>(
    py: Python<'py>,
    uvs: PyReadonlyArray2<'_, f32>,
    triangles: PyReadonlyArray2<'_, u32>,
    margin: f64,
    resolution: u32,
) -> PyResult<(Bound<'py, PyArray2<f32>>, f64, f64)> {
    let found = || {
        let map = UvMap::new(rows(&uvs)?, rows(&triangles)?)?;
        py.detach(|| Ok(pool()?.install(|| repacked(&map, margin, resolution))?))
    };
    let packed = found().map_err(|failure: Failure| failure.exception(py))?;
    let uvs = packed.uvs.uvs().to_vec();
    Ok((of_rows(py, uvs), packed.coverage, packed.margin))
}
