//! OFF with UVs: `STOFF`, with `N` if there are normals and with `C` if there are colours.
//!
//! The columns of a vertex are its coordinates, its normal, its colour (red, green, blue and
//! opacity from 0 to 255) and its UV. Unknown normals are 0 0 0; in a file with colours, what
//! has none is white.

use std::io::{self, Write};

use crate::color::srgb_bytes;

use super::baked::Baked;

pub(super) fn write(baked: &Baked, out: &mut dyn Write) -> io::Result<()> {
    let letter = |wanted: bool, letter: &'static str| if wanted { letter } else { "" };
    let colors = letter(baked.has_colors(), "C");
    let normals = letter(baked.has_normals(), "N");
    let (vertices, faces) = (baked.vertex_count(), baked.face_count());
    writeln!(out, "ST{colors}{normals}OFF\n{vertices} {faces} 0")?;
    for vertex in baked.vertices() {
        let [x, y, z] = vertex.position;
        write!(out, "{x} {y} {z}")?;
        if baked.has_normals() {
            let [x, y, z] = vertex.normal;
            write!(out, " {x} {y} {z}")?;
        }
        if baked.has_colors() {
            let [r, g, b, opacity] = srgb_bytes(vertex.color);
            write!(out, " {r} {g} {b} {opacity}")?;
        }
        let [u, v] = vertex.uv;
        writeln!(out, " {u} {v}")?;
    }
    for face in baked.faces() {
        write!(out, "{}", face.len())?;
        for vertex in face {
            write!(out, " {vertex}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
