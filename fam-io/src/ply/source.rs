//! A file in memory: its polygons, its normals and colours, and the UVs of its corners.

use std::io;

use fam_surface::polygons::Polygons;
use fam_surface::{SurfaceError, UvMap};

use super::body::{Entries, Table};
use super::header::{Element, Header, Kind, Scalar};
use crate::color::{COLOR, linear_color, mean};
use crate::error::ReadFault;
use crate::kept::Kept;
use crate::scene::{Mesh, Scene, corner_normals};
use crate::text::vertex;
use crate::uvs::Uvs;

pub(super) const UV_NAMES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
pub(super) const CORNER_UVS: &str = "texcoord";
const RGB: [&str; 3] = ["red", "green", "blue"];

/// A PLY file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(super) bytes: Vec<u8>,
    pub(super) header: Header,
    /// Of every element.
    pub(super) entries: Vec<Entries>,
    pub(super) vertices: usize,
    pub(super) faces: Faces,
    pub(super) polygons: Polygons,
    /// Which entries of the vertices the surface has.
    pub(super) kept: Kept,
}

/// Where the polygons come from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Faces {
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

/// The list of vertices among the properties of a face or strip.
fn corners_column(element: &Element) -> Option<usize> {
    element.properties.iter().position(|property| {
        let name = property.name.to_ascii_lowercase().replace('_', "");
        let is_list = matches!(property.kind, Kind::List { .. });
        is_list && ["vertexindices", "vertexindex"].contains(&name.as_str())
    })
}

impl Source {
    pub(super) fn table(&self, element: usize) -> Table<'_> {
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

    pub(super) fn normals(&self) -> Option<Vec<[f64; 3]>> {
        let vertex = self.table(self.vertices);
        let columns = vertex.element.scalars(["nx", "ny", "nz"])?;
        Some(vertex.columns(columns))
    }

    /// Checks that words are numbers where points are left out.
    pub(super) fn check_left_out(&self, xyz: [(usize, Scalar); 3]) -> Result<(), ReadFault> {
        let vertex = self.table(self.vertices);
        let mut left_out = self.kept.left_out().iter();
        match left_out.find(|&&at| !vertex.has_numbers(at, xyz)) {
            Some(&index) => Err(SurfaceError::NonFinitePosition { index }.into()),
            None => Ok(()),
        }
    }

    pub(super) fn read_faces(&self, vertices: usize) -> Result<(Faces, Polygons), ReadFault> {
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
    pub(super) fn read_corner_uvs(&mut self) -> Option<Uvs> {
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

    /// A scalar of the vertices of the surface by its name, those of colours from 0 to 1;
    /// for [`COLOR`] the mean of red, green and blue. `None` if there is none.
    pub fn vertex_numbers(&self, name: &str) -> Option<Vec<f64>> {
        let vertex = self.table(self.vertices);
        if name == COLOR
            && let Some(colors) = self.rgb()
        {
            return Some(self.kept.only(colors.map(mean).collect()));
        }
        let column = vertex.element.scalars([name])?;
        let unit = match RGB.contains(&name) {
            true => largest(column[0].1),
            false => 1.0,
        };
        let numbers = vertex.columns(column).into_iter();
        Some(
            self.kept
                .only(numbers.map(|[number]| number / unit).collect()),
        )
    }

    /// The names that there are numbers of.
    pub fn number_names(&self) -> Vec<String> {
        let element = self.table(self.vertices).element;
        let scalars = element.properties.iter();
        let scalars = scalars.filter(|property| matches!(property.kind, Kind::Scalar(_)));
        let mut names: Vec<_> = scalars.map(|property| property.name.clone()).collect();
        let has_color = element.scalars(RGB).is_some();
        names.extend(has_color.then(|| COLOR.to_owned()));
        names
    }

    /// Red, green and blue of every entry of the vertices, from 0 to 1.
    fn rgb(&self) -> Option<impl Iterator<Item = [f64; 3]> + use<>> {
        let vertex = self.table(self.vertices);
        let rgb = vertex.element.scalars(RGB)?;
        let units = rgb.map(|(_, scalar)| largest(scalar));
        let unit = move |color: [f64; 3]| std::array::from_fn(|c| color[c] / units[c]);
        Some(vertex.columns(rgb).into_iter().map(unit))
    }

    fn colors(&self) -> Option<Vec<[f32; 4]>> {
        let vertex = self.table(self.vertices);
        let colors = self.rgb()?;
        let alpha = vertex.element.scalars(["alpha"]);
        let part = |(_, scalar), value: f64| value / largest(scalar);
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
