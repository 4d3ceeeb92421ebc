//! XYZ: a first line that names the columns, and then one line for each point.
//!
//! The columns are the coordinates, the normal of unit length if there are normals, the colour
//! (red, green and blue from 0 to 255) if there are colours, and the UV. Unknown normals are
//! 0 0 0; in a file with colours, what has none is white.

use std::io::{self, Write};

use fam_surface::vector::normalize;

use crate::color::srgb_bytes;

use super::baked::Baked;

pub(super) fn write(baked: &Baked, out: &mut dyn Write) -> io::Result<()> {
    let names = |wanted: bool, names: &'static str| if wanted { names } else { "" };
    let normals = names(baked.has_normals(), " nx ny nz");
    let colors = names(baked.has_colors(), " r g b");
    writeln!(out, "# x y z{normals}{colors} u v")?;
    for point in baked.vertices() {
        let [x, y, z] = point.position;
        write!(out, "{x} {y} {z}")?;
        if baked.has_normals() {
            let [x, y, z] = normalize(point.normal.map(f64::from)).map(|c| c as f32);
            write!(out, " {x} {y} {z}")?;
        }
        if baked.has_colors() {
            let [r, g, b, _] = srgb_bytes(point.color);
            write!(out, " {r} {g} {b}")?;
        }
        let [u, v] = point.uv;
        writeln!(out, " {u} {v}")?;
    }
    Ok(())
}
