//! What a call says of seams, and of UVs that are there.

use fam::Kept;
use fam_surface::metrics::present_seams;
use fam_surface::{TriangleMesh, UvMap};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::failure::Failure;

/// What meshes of arrays and of files have in common, as the Python modules name it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked<'py> {
    seams: PyReadonlyArray2<'py, u32>,
    no_seams: PyReadonlyArray2<'py, u32>,
    keep_seams: bool,
    improve: bool,
}

/// Edges by their vertices, and which of the UVs that are there stay.
pub struct Wishes {
    /// The edges to cut along.
    pub wanted: Vec<[u32; 2]>,
    /// The edges not to cut along.
    pub forbidden: Vec<[u32; 2]>,
    /// Whether the seams that are there stay.
    keeps_seams: bool,
    /// Whether the charts that are fine stay as well.
    improves: bool,
}

impl Wishes {
    /// Copies of what is asked for.
    pub fn of(asked: &Asked<'_>) -> Result<Self, Failure> {
        Ok(Self {
            wanted: rows(&asked.seams)?,
            forbidden: rows(&asked.no_seams)?,
            keeps_seams: asked.keep_seams || asked.improve,
            improves: asked.improve,
        })
    }

    /// Marks the seams of the UVs that are there, and all other edges, if they are to stay. Returns
    /// the charts that stay; a chart is fine up to the distortion `bound`.
    pub fn keep(
        &mut self,
        mesh: &TriangleMesh,
        uvs: Option<&UvMap>,
        bound: f64,
    ) -> Result<Option<Kept>, Failure> {
        if !self.keeps_seams {
            return Ok(None);
        }
        let uvs = on_all_faces(uvs)?;
        let [seams, others] = present_seams(mesh, uvs)?;
        self.wanted.extend(seams);
        self.forbidden.extend(others);
        match self.improves {
            true => Ok(Some(Kept::fine(mesh, uvs.clone(), bound)?)),
            false => Ok(None),
        }
    }
}

/// UVs that have to be there.
pub fn on_all_faces(uvs: Option<&UvMap>) -> Result<&UvMap, Failure> {
    let reason = "there are no texture coordinates on all of the faces";
    uvs.ok_or_else(|| Failure::Input(reason.to_owned()))
}
