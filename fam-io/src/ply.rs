//! PLY, the polygon file format: ASCII and binary of either byte order.
//!
//! - The header has types in both spellings (`float`, `float32`), any line ends, and comments
//!   and names in any encoding. Of several elements or properties of one name the first counts;
//!   the others are only kept. The entries it announces must be there.
//! - In an ASCII file every entry is on a line of its own; empty lines, and what a line has
//!   beyond its properties, are not looked at.
//! - The element `vertex` has the scalars `x`, `y`, `z`, possibly `nx`, `ny`, `nz`, the colour
//!   `red`, `green`, `blue` (possibly with `alpha`; integers up to the largest of their type,
//!   or 0 to 1), and UVs as `s`, `t`, as `u`, `v` or as `texture_u`, `texture_v`.
//! - Points of a cloud with a coordinate that is NaN or infinite are left out of the surface,
//!   with a warning.
//! - The element `face` has a list of zero-based vertices, `vertex_indices` or `vertex_index`
//!   (upper case and missing underscores are the same). Faces of fewer than three corners are
//!   no part of the surface. Without faces it is a point cloud.
//! - A list `texcoord` of the faces has the UVs of their corners. They count if the vertices
//!   have none and if there is one for each corner of the surface.
//! - The element `tristrips`, in the place of faces, has lists of vertices as well: every
//!   three vertices in a row are a triangle, of alternating orientation; −1 starts a new
//!   strip. Triangles that have a vertex twice only continue a strip and are left out.
//!
//! Infinite or NaN UVs, and words that are no numbers, count as no UVs.
//!
//! Writing keeps the encoding, the header's lines, all elements and all properties as they
//! are. UVs of the corners are replaced in place. Otherwise UVs become the last two properties
//! of a vertex, `float s` and `float t`, and the only ones: older ones go, and so does a list
//! `texcoord` of the faces. A vertex with several UVs is split, its copies come after the last
//! vertex. A vertex in no face has the UV 0 0. A polygon with a seam inside becomes triangles;
//! triangle strips become faces. A point that was left out stays, with NaN as its UV.

mod body;
mod header;
mod records;
mod source;
mod write;

use fam_surface::SurfaceError;
use fam_surface::polygons::Polygons;

use crate::error::ReadFault;
use crate::kept::Kept;
use crate::labels::Labels;
use crate::parsed::{Parsed, surface};
use crate::uvs::vertex_uvs;
use header::Header;
pub(crate) use records::{Block, Records};
pub(crate) use source::Source;
use source::{Faces, UV_NAMES};

pub(crate) fn parse(bytes: Vec<u8>) -> Result<Parsed<Source>, ReadFault> {
    let header = Header::parse(&bytes)?;
    let entries = body::locate(&bytes, &header)?;
    let vertices = header.element("vertex").ok_or(SurfaceError::NoVertices)?;
    let mut source = Source {
        bytes,
        header,
        entries,
        vertices,
        faces: Faces::None,
        polygons: Polygons::default(),
        kept: Kept::default(),
    };
    let vertex = source.table(vertices);
    let scalars = |names| vertex.element.scalars(names);
    let xyz = scalars(["x", "y", "z"])
        .ok_or_else(|| ReadFault::Malformed("the vertices have no x, y and z".to_owned()))?;
    let positions = vertex.columns(xyz);
    let normals = source.normals();
    let uvs = UV_NAMES
        .into_iter()
        .find_map(|names| vertex.element.scalars(names))
        .map(|uv| vertex.columns(uv))
        .map(|uvs| uvs.into_iter().map(|uv| uv.map(|c| c as f32)).collect());

    (source.faces, source.polygons) = source.read_faces(positions.len())?;
    if source.polygons.is_empty() {
        source.kept = Kept::of(&positions);
        source.check_left_out(xyz)?;
    }
    source.polygons.divide(&positions);
    let warnings = source.kept.warnings()?;
    let normals = normals.map(|normals| source.kept.only(normals));
    let surface = surface(source.kept.only(positions), &source.polygons, normals)?;
    let uvs = match uvs {
        Some(uvs) => vertex_uvs(&surface, source.kept.only(uvs)),
        None => source.read_corner_uvs(),
    };
    Ok(Parsed {
        surface,
        uvs,
        labels: Labels::default(),
        diagonals: source.polygons.diagonals(),
        warnings,
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_has_polygons_colours_and_normals() {
        let scene = |properties: &str, rows: [&str; 3]| {
            let rows = rows.join("\n");
            let text = format!(
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                 property float z\n{properties}element face 2\n\
                 property list uchar int vertex_indices\nend_header\n{rows}\n2 0 1\n4 2 1 0 1\n"
            );
            let source = parse(text.into_bytes()).unwrap().source;
            source.scene().unwrap().meshes.remove(0)
        };
        let list = |kind: &str, names: &[&str]| -> String {
            let line = |name| format!("property {kind} {name}\n");
            names.iter().map(line).collect()
        };
        let rgb = ["red", "green", "blue"];
        let properties = list("uchar", &rgb) + &list("float", &["nx", "ny", "nz", "alpha"]);
        let mesh = scene(
            &properties,
            [
                "0 0 0 255 0 0 0 0 1 .5",
                "1 0 0 0 0 0 nan 0 0 1",
                "0 1 0 0 255 0 0 3 0 9",
            ],
        );
        assert_eq!(mesh.positions[1], [1.0, 0.0, 0.0]);
        assert_eq!(mesh.polygons.iter().collect::<Vec<_>>(), [[2, 1, 0, 1]]);
        let normals = [[0., 3., 0.], [0.; 3], [0., 0., 1.], [0.; 3]];
        assert_eq!(mesh.normals.unwrap(), normals);
        let colors = [[1., 0., 0., 0.5], [0., 0., 0., 1.], [0., 1., 0., 1.]];
        assert_eq!(mesh.colors.unwrap(), colors);

        let shorts = scene(
            &list("ushort", &rgb),
            ["0 0 0 65535 0 0", "1 0 0 0 0 0", "0 1 0 0 0 0"],
        );
        assert_eq!(shorts.colors.unwrap()[0], [1.0, 0.0, 0.0, 1.0]);
        let floats = scene(
            &list("float", &rgb),
            ["0 0 0 1 0 0", "1 0 0 0 0 0", "0 1 0 0 0 0"],
        );
        assert_eq!(floats.colors.unwrap()[0], [1.0, 0.0, 0.0, 1.0]);
        let lists = scene(
            "property list uchar uchar red\n",
            ["0 0 0 0", "1 0 0 0", "0 1 0 0"],
        );
        assert!(lists.colors.is_none() && lists.normals.is_none());
    }
}
