//! Which UVs of a document stay.

use fam::Kept;
use fam_io::Document;
use fam_surface::{Surface, TriangleMesh, UvMap};

use crate::args::Unwrap;
use crate::failure::Failure;

/// From this value of its attribute on a vertex is selected.
const SELECTED: f64 = 0.5;

/// The UVs that stay by `--improve`, `--only` and `--selected`, if any of these is given. `bound` is the
/// distortion up to which a chart is fine.
pub fn kept(arguments: &Unwrap, document: &Document, bound: f64) -> Result<Option<Kept>, Failure> {
    let option = match (
        arguments.improve,
        arguments.only.is_empty(),
        &arguments.selected,
    ) {
        (true, ..) => "--improve",
        (_, false, _) => "--only",
        (.., Some(_)) => "--selected",
        _ => return Ok(None),
    };
    let Surface::Mesh(mesh) = document.surface() else {
        let reason = format!("{option} is for meshes, and this is a point cloud");
        return Err(Failure::input(reason));
    };
    let none = || {
        let reason =
            format!("it has no texture coordinates on all of its faces, as {option} needs");
        Failure::input(reason)
    };
    let uvs = document.uv_map().ok_or_else(none)?.clone();
    if arguments.improve {
        return Kept::fine(mesh, uvs, bound)
            .map(Some)
            .map_err(Failure::input);
    }
    let selected = arguments.selected.as_deref();
    all_but(document, mesh, uvs, &arguments.only, selected).map(Some)
}

/// The UVs of all faces of the mesh of a document but those of the materials and objects `only`, and those
/// all of whose vertices have more than 0.5 of the attribute `selected`.
///
/// # Errors
/// There is no material and no object of a name, no such attribute, or no face that is selected.
pub fn all_but(
    document: &Document,
    mesh: &TriangleMesh,
    uvs: UvMap,
    only: &[String],
    selected: Option<&str>,
) -> Result<Kept, Failure> {
    let mut is_kept = vec![true; mesh.triangles().len()];
    for name in only {
        let named = document.labels().named(name, mesh.triangles().len());
        for t in named.map_err(Failure::input)? {
            is_kept[t as usize] = false;
        }
    }
    if let Some(attribute) = selected {
        let values = document
            .vertex_attribute(attribute)
            .map_err(Failure::input)?;
        let is_selected = |v: &u32| values[*v as usize] > SELECTED;
        for (is_kept, triangle) in is_kept.iter_mut().zip(mesh.triangles()) {
            *is_kept &= !triangle.iter().all(is_selected);
        }
    }
    if is_kept.iter().all(|is_kept| *is_kept) {
        return Err(Failure::input("no face is selected"));
    }
    Kept::new(uvs, is_kept).map_err(Failure::input)
}
