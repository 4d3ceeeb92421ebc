//! PLY, binary of little byte order.
//!
//! A vertex has `x`, `y`, `z` (`float` if that holds all coordinates exactly, else `double`),
//! `nx`, `ny`, `nz` if there are normals, `s`, `t`, and `red`, `green`, `blue`, `alpha` from 0 to
//! 255 if there are colours. Unknown normals are 0 0 0; in a file with colours, what has none is
//! white. A point cloud has no element `face`.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::color::srgb_bytes;
use crate::error::WriteFault;
use crate::format::Format;
use crate::uvs::Uvs;

use super::baked::{Baked, BakedVertex};

pub(super) fn write(baked: &Baked, uvs: &Uvs, out: &mut dyn Write) -> Result<(), WriteFault> {
    if baked.vertex_count() as u64 > 1 << 32 {
        return Err(WriteFault::NoPlaceForSurface {
            format: Format::Ply,
            surface: "more than 4294967296 vertices",
        });
    }
    let layout = Layout::of(baked);
    out.write_all(layout.header(baked, uvs).as_bytes())?;
    for vertex in baked.vertices() {
        layout.write_vertex(&vertex, out)?;
    }
    for face in baked.faces() {
        layout.write_face(&face, out)?;
    }
    Ok(())
}

/// What depends on the content.
struct Layout {
    doubles: bool,
    normals: bool,
    colors: bool,
    /// A face has more corners than a byte can count.
    long_lists: bool,
}

impl Layout {
    fn of(baked: &Baked) -> Self {
        let exact = |c: &f64| f64::from(*c as f32) == *c;
        Self {
            doubles: !baked
                .vertices()
                .all(|vertex| vertex.position.iter().all(exact)),
            normals: baked.has_normals(),
            colors: baked.has_colors(),
            long_lists: baked.most_corners() > u8::MAX.into(),
        }
    }

    fn header(&self, baked: &Baked, uvs: &Uvs) -> String {
        let mut header = "ply\nformat binary_little_endian 1.0\n".to_owned();
        let mut element = |name: &str, count: usize, properties: &[(&str, &[&str])]| {
            // Writing to a string cannot fail.
            let _ = writeln!(header, "element {name} {count}");
            for (data_type, names) in properties {
                for name in *names {
                    let _ = writeln!(header, "property {data_type} {name}");
                }
            }
        };
        let number = if self.doubles { "double" } else { "float" };
        let mut properties: Vec<(&str, &[&str])> = vec![(number, &["x", "y", "z"])];
        if self.normals {
            properties.push(("float", &["nx", "ny", "nz"]));
        }
        properties.push(("float", &["s", "t"]));
        if self.colors {
            properties.push(("uchar", &["red", "green", "blue", "alpha"]));
        }
        element("vertex", baked.vertex_count(), &properties);
        if matches!(uvs, Uvs::Mesh(_)) {
            let list = if self.long_lists {
                "list uint uint"
            } else {
                "list uchar uint"
            };
            element("face", baked.face_count(), &[(list, &["vertex_indices"])]);
        }
        header + "end_header\n"
    }

    fn write_vertex(&self, vertex: &BakedVertex, out: &mut dyn Write) -> io::Result<()> {
        let floats = |out: &mut dyn Write, numbers: &[f32]| {
            numbers
                .iter()
                .try_for_each(|number| out.write_all(&number.to_le_bytes()))
        };
        if self.doubles {
            for c in vertex.position {
                out.write_all(&c.to_le_bytes())?;
            }
        } else {
            floats(out, &vertex.position.map(|c| c as f32))?;
        }
        if self.normals {
            floats(out, &vertex.normal)?;
        }
        floats(out, &vertex.uv)?;
        if self.colors {
            out.write_all(&srgb_bytes(vertex.color))?;
        }
        Ok(())
    }

    fn write_face(&self, face: &[usize], out: &mut dyn Write) -> io::Result<()> {
        if self.long_lists {
            out.write_all(&(face.len() as u32).to_le_bytes())?;
        } else {
            out.write_all(&[face.len() as u8])?;
        }
        face.iter()
            .try_for_each(|&vertex| out.write_all(&(vertex as u32).to_le_bytes()))
    }
}
