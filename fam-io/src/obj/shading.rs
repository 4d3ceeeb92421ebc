//! What an OBJ file says of the shading of its triangles: normals and smoothing groups.

use fam_surface::TriangleMesh;

use crate::shading::{Shade, hard_edges};
use crate::text;

use super::model::Model;
use super::statements::Statement;

/// Of a corner: it has no normal.
const NONE: u32 = u32::MAX;

/// The group that an `s` statement names; none if it is `off` or 0.
pub(super) fn group(statement: &Statement) -> Option<Vec<u8>> {
    let word = statement.words().next()?;
    match text::parse::<u64>(word) {
        Some(0) => None,
        Some(number) => Some(number.to_string().into_bytes()),
        None if word.eq_ignore_ascii_case(b"off") => None,
        None => Some(word.to_vec()),
    }
}

/// The hard edges of the mesh of a file. A triangle with a normal at a corner is shaded by its
/// normals. The groups count between triangles without any, in a file that has groups.
pub(super) fn edges(model: &Model, mesh: &TriangleMesh, diagonals: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let normals = &model.numbers.normals;
    let of_corners = normals_of_triangles(model);
    if of_corners.is_empty() && !model.has_groups {
        return Vec::new();
    }
    // Empty if no face is in one.
    let groups = model.groups.of_triangles(&model.faces.vertices);
    hard_edges(mesh, diagonals, |corner| {
        let triangle = corner / 3;
        let own = of_corners.get(3 * triangle..3 * triangle + 3);
        match own {
            Some(own) if own != [NONE; 3] => match own[corner % 3] {
                NONE => Shade::Unknown,
                normal => Shade::Normal(normals[normal as usize]),
            },
            _ if model.has_groups => Shade::Group(groups.get(triangle).copied().flatten()),
            _ => Shade::Unknown,
        }
    })
}

/// The `vn` of every corner of the triangles, or [`NONE`]; empty if no corner has any.
fn normals_of_triangles(model: &Model) -> Vec<u32> {
    let (faces, count) = (&model.faces, model.numbers.normals.len());
    let corners = faces.vertices.corners().len();
    let normal = |corner: usize| faces.normals.get(corner, count);
    if !(0..corners).any(|corner| normal(corner).is_some()) {
        return Vec::new();
    }
    let mut of_corners = Vec::with_capacity(3 * (corners - 2 * faces.vertices.len()));
    let mut first = 0;
    for (polygon, division) in faces.vertices.divided() {
        let of_triangles = division.corners().flatten();
        of_corners.extend(of_triangles.map(|place| normal(first + place).unwrap_or(NONE)));
        first += polygon.len();
    }
    of_corners
}
