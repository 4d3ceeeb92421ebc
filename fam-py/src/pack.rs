//! Packing charts that are there.

use fam_layout::{LayoutConfig, PackOptions, Repacked, Turns, repacked};
use fam_surface::UvMap;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::arrays::{of_rows, rows};
use crate::failure::Failure;
use crate::job::{Job, Output};
use crate::settings::in_python;

/// The job that lays the charts of the UVs of corners `[3 M, 2]` side by side in the unit square, turned
/// as `turns` says.
#[pyfunction]
pub fn pack(
    py: Python<'_>,
    uvs: PyReadonlyArray2<'_, f32>,
    margin: f64,
    resolution: u32,
    turns: &str,
) -> PyResult<Job> {
    let config = LayoutConfig {
        margin,
        resolution,
        ..LayoutConfig::default()
    };
    let start = || {
        if let Some(problem) = config.problem() {
            return Err(Failure::Input(in_python(problem)));
        }
        let turns = match turns {
            "free" => Turns::Free,
            "quarters" => Turns::Quarters,
            "none" => Turns::None,
            other => return Err(Failure::Input(format!("there are no turns {other:?}"))),
        };
        let uvs = rows(&uvs)?;
        Job::start(move |_| {
            let options = PackOptions::new(margin, resolution);
            Ok(repacked(
                &UvMap::of_corners(&uvs)?,
                &[],
                None,
                turns,
                &options,
            )?)
        })
    };
    start().map_err(|failure| failure.exception(py))
}

impl Output for Repacked {
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let corners = self.uvs.triangles().iter().flatten();
        let uvs = corners.map(|&v| self.uvs.uvs()[v as usize]).collect();
        let all = (of_rows::<2, f32>(py, uvs), self.coverage, self.margin);
        Ok(all.into_pyobject(py)?.into_any())
    }
}
