//! What of a document belongs together.

use fam::Parting;
use fam_io::{Document, Labels};
use fam_surface::Surface;

use crate::failure::Failure;
use crate::weights::Weight;

/// Which triangles share a UV square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Squares {
    /// All of them.
    One,
    /// Those of a material.
    PerMaterial,
    /// Those of an object.
    PerObject,
}

impl Squares {
    /// Those that two flags ask for, of which one may be set.
    pub fn of(per_material: bool, per_object: bool) -> Self {
        match (per_material, per_object) {
            (true, _) => Self::PerMaterial,
            (_, true) => Self::PerObject,
            _ => Self::One,
        }
    }
}

/// Objects are apart; materials too if each has a square of its own.
pub fn parting(labels: &Labels, squares: Squares) -> Parting {
    let by_object = || Parting::by_object(&labels.objects);
    match squares {
        Squares::PerMaterial if !labels.materials.is_empty() => {
            Parting::by_material(&labels.objects, &labels.materials)
        }
        Squares::One | Squares::PerMaterial => by_object(),
        Squares::PerObject => by_object().with_square_per_label(),
    }
}

/// A parting of a document with charts of some materials or objects larger than others, which are apart
/// from them. A triangle that several `weights` are for has the last.
///
/// # Errors
/// There is no material and no object of a name.
pub fn weighted(
    document: &Document,
    parting: Parting,
    weights: &[Weight],
) -> Result<Parting, Failure> {
    if weights.is_empty() {
        return Ok(parting);
    }
    let triangles = match document.surface() {
        Surface::Mesh(mesh) => mesh.triangles().len(),
        Surface::PointCloud(_) => 0,
    };
    let mut factors = vec![1.0; triangles];
    for weight in weights {
        weight.give(document.labels(), &mut factors)?;
    }
    Ok(parting.with_weights(&factors))
}
