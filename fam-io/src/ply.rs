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
mod write;

use std::io;

use fam_surface::{SurfaceError, UvMap};

use self::body::{Entries, Table};
pub(crate) use self::records::{Block, Records};

use self::header::{Element, Header, Kind, Scalar};
use crate::color::linear_color;
use crate::document::{Parsed, surface, vertex_uvs};
use crate::kept::Kept;
use crate::polygons::{Polygons, vertex};
use crate::scene::{Mesh, Scene, corner_normals};
use crate::{Labels, ReadFault, Uvs};

const UV_NAMES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
const CORNER_UVS: &str = "texcoord";

/// A PLY file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    bytes: Vec<u8>,
    header: Header,
    /// Of every element.
    entries: Vec<Entries>,
    vertices: usize,
    faces: Faces,
    polygons: Polygons,
    /// Which entries of the vertices the surface has.
    kept: Kept,
}

/// Where the polygons come from.
#[derive(Debug, Clone, Copy)]
enum Faces {
    None,
    /// Polygons of an element, in this property.
    Polygons {
        element: usize,
        corners: usize,
        /// The property with the UVs of the corners.
        uvs: Option<usize>,
    },
    /// Triangle strips of an element.
    Strips {
        element: usize,
    },
}

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
    source.polygons.divide(&positions);
    if source.polygons.len() == 0 {
        source.kept = Kept::of(&positions);
        source.check_left_out(xyz)?;
    }
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

/// The list of vertices among the properties of a face or strip.
fn corners_column(element: &Element) -> Option<usize> {
    element.properties.iter().position(|property| {
        let name = property.name.to_ascii_lowercase().replace('_', "");
        let is_list = matches!(property.kind, Kind::List { .. });
        is_list && ["vertexindices", "vertexindex"].contains(&name.as_str())
    })
}

impl Source {
    fn table(&self, element: usize) -> Table<'_> {
        Table {
            bytes: &self.bytes,
            encoding: self.header.encoding,
            element: &self.header.elements[element],
            entries: &self.entries[element],
        }
    }

    /// The elements of this name that have entries.
    fn filled(&self, name: &str) -> Vec<usize> {
        let filled = |&element: &usize| {
            let entries = &self.entries[element];
            self.header.elements[element].name == name && !entries.starts.is_empty()
        };
        (0..self.entries.len()).filter(filled).collect()
    }

    fn normals(&self) -> Option<Vec<[f64; 3]>> {
        let vertex = self.table(self.vertices);
        let columns = vertex.element.scalars(["nx", "ny", "nz"])?;
        Some(vertex.columns(columns))
    }

    /// Checks that words are numbers where points are left out.
    fn check_left_out(&self, xyz: [(usize, Scalar); 3]) -> Result<(), ReadFault> {
        let vertex = self.table(self.vertices);
        let mut left_out = self.kept.left_out().iter();
        match left_out.find(|&&at| !vertex.has_numbers(at, xyz)) {
            Some(&index) => Err(SurfaceError::NonFinitePosition { index }.into()),
            None => Ok(()),
        }
    }

    fn read_faces(&self, vertices: usize) -> Result<(Faces, Polygons), ReadFault> {
        let mut polygons = Polygons::default();
        let (faces, strips) = (self.filled("face"), self.filled("tristrips"));
        let faces = match (faces.as_slice(), strips.as_slice()) {
            ([], []) => Faces::None,
            (&[element, ..], []) => {
                let corners = self.read_lists(element, |number, list| {
                    if list.len() >= 3 {
                        let corner = |&index: &i64| vertex(index, number, vertices);
                        let corners: Vec<u32> =
                            list.iter().map(corner).collect::<Result<_, _>>()?;
                        polygons.push(corners);
                    }
                    Ok(())
                })?;
                Faces::Polygons {
                    element,
                    corners,
                    uvs: None,
                }
            }
            ([], &[element]) => {
                self.read_lists(element, |number, list| {
                    list.split(|&index| index == -1)
                        .try_for_each(|strip| triangles(strip, number, vertices, &mut polygons))
                })?;
                Faces::Strips { element }
            }
            _ => {
                let what = "triangle strips beside other faces are";
                return Err(ReadFault::Unsupported(what.to_owned()));
            }
        };
        Ok((faces, polygons))
    }

    /// Calls `each` with the number and the vertices of every face or strip; returns the
    /// property with the vertices.
    fn read_lists(
        &self,
        element: usize,
        mut each: impl FnMut(usize, &[i64]) -> Result<(), ReadFault>,
    ) -> Result<usize, ReadFault> {
        let table = self.table(element);
        let name = table.element.title();
        let column = corners_column(table.element)
            .ok_or_else(|| ReadFault::Malformed(format!("`{name}` has no list vertex_indices")))?;
        let kind = table.element.properties[column].kind;
        let (mut cells, mut list) = (Vec::new(), Vec::new());
        for (number, &start) in (1..).zip(&table.entries.starts) {
            table.cells(start, &mut cells);
            list.clear();
            for index in table.numbers(kind, cells[column].clone()) {
                let index = index.filter(|index| index.fract() == 0.0).ok_or_else(|| {
                    ReadFault::Malformed(format!(
                        "entry {number} of `{name}` has a vertex index that is no integer"
                    ))
                })?;
                list.push(index as i64);
            }
            each(number, &list)?;
        }
        Ok(column)
    }

    /// The UVs of the corners of the polygons, if they have all of them.
    fn read_corner_uvs(&mut self) -> Option<Uvs> {
        let Faces::Polygons {
            element, corners, ..
        } = self.faces
        else {
            return None;
        };
        let table = self.table(element);
        let column = table.element.column(CORNER_UVS)?;
        let kind = table.element.properties[column].kind;
        if !matches!(kind, Kind::List { item, .. } if item.is_float()) {
            return None;
        }
        let corners_kind = table.element.properties[corners].kind;
        let mut polygons = self.polygons.divided();
        let (mut uvs, mut triangles) = (Vec::new(), Vec::new());
        let (mut cells, mut values) = (Vec::new(), Vec::new());
        for &start in &table.entries.starts {
            table.cells(start, &mut cells);
            if table.numbers(corners_kind, cells[corners].clone()).count() < 3 {
                continue;
            }
            values.clear();
            let numbers = table.numbers(kind, cells[column].clone());
            values.extend(numbers.map(|number| number.map_or(f32::NAN, |number| number as f32)));
            let (pairs, rest) = values.as_chunks::<2>();
            let (polygon, division) = polygons.next()?;
            if pairs.len() != polygon.len() || !rest.is_empty() {
                return None;
            }
            let first = uvs.len() as u32;
            let indices: Vec<u32> = (first..).take(pairs.len()).collect();
            triangles.extend(division.of(&indices));
            uvs.extend_from_slice(pairs);
        }
        let map = UvMap::new(uvs, triangles).ok()?;
        self.faces = Faces::Polygons {
            element,
            corners,
            uvs: Some(column),
        };
        Some(Uvs::Mesh(map))
    }

    pub fn scene(&self) -> io::Result<Scene> {
        let vertex = self.table(self.vertices);
        let Some(xyz) = vertex.element.scalars(["x", "y", "z"]) else {
            return Ok(Scene::default());
        };
        let normals = self.normals();
        Ok(Scene::of_mesh(Mesh {
            positions: self.kept.only(vertex.columns(xyz)),
            colors: self.colors().map(|colors| self.kept.only(colors)),
            normals: normals
                .map(|normals| corner_normals(&self.polygons, &self.kept.only(normals))),
            polygons: self.polygons.clone(),
            ..Mesh::default()
        }))
    }

    fn colors(&self) -> Option<Vec<[f32; 4]>> {
        let vertex = self.table(self.vertices);
        let rgb = vertex.element.scalars(["red", "green", "blue"])?;
        let alpha = vertex.element.scalars(["alpha"]);
        let part = |(_, scalar), value: f64| value / largest(scalar);
        let colors = vertex
            .columns(rgb)
            .into_iter()
            .map(|[r, g, b]| [part(rgb[0], r), part(rgb[1], g), part(rgb[2], b)]);
        let opacity = alpha.map(|alpha| {
            let column = vertex.columns(alpha).into_iter();
            column.map(|[a]| part(alpha[0], a)).collect::<Vec<f64>>()
        });
        Some(match opacity {
            Some(opacity) => colors
                .zip(opacity)
                .map(|(c, a)| linear_color(c, a))
                .collect(),
            None => colors.map(|c| linear_color(c, 1.0)).collect(),
        })
    }
}

/// The value of a full colour.
fn largest(scalar: Scalar) -> f64 {
    if scalar.is_float() {
        1.0
    } else {
        (scalar.integers() - 1) as f64
    }
}

/// Adds the triangles of a strip.
fn triangles(
    strip: &[i64],
    number: usize,
    vertices: usize,
    polygons: &mut Polygons,
) -> Result<(), ReadFault> {
    let corner = |&index: &i64| vertex(index, number, vertices);
    let strip: Vec<u32> = strip.iter().map(corner).collect::<Result<_, _>>()?;
    for (at, triple) in strip.windows(3).enumerate() {
        let [a, b, c] = [triple[0], triple[1], triple[2]];
        if a != b && b != c && c != a {
            polygons.push(if at % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }
    Ok(())
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
