//! The file again, with other UVs.

use std::io::{self, Write};

use fam_surface::UvMap;
use fam_surface::polygons::{Pieces, Split};

use super::header::{Element, Encoding, Kind, Scalar};
use super::source::{CORNER_UVS, Faces, Source, UV_NAMES};
use crate::text::{Edits, line_end};
use crate::uvs::Uvs;

/// A face to be written, or the part of one.
pub(super) struct Face {
    vertices: Vec<u32>,
    /// Of its corners, if that is where they are written.
    uvs: Vec<[f32; 2]>,
}

/// The body of the output: entries as lines or bytes.
struct Rows<'a> {
    out: &'a mut dyn Write,
    encoding: Encoding,
    line_end: &'static str,
    row: Vec<u8>,
}

impl Rows<'_> {
    /// A property as it is in the file.
    fn copy(&mut self, cell: &[u8]) {
        self.separate();
        self.row.extend_from_slice(cell);
    }

    fn integer(&mut self, scalar: Scalar, value: i64) {
        match scalar {
            _ if self.encoding == Encoding::Ascii => self.word(value),
            Scalar::Int8 | Scalar::UInt8 => self.bytes((value as u8).to_le_bytes()),
            Scalar::Int16 | Scalar::UInt16 => self.bytes((value as u16).to_le_bytes()),
            Scalar::Int32 | Scalar::UInt32 => self.bytes((value as u32).to_le_bytes()),
            Scalar::Float32 => self.bytes((value as f32).to_le_bytes()),
            Scalar::Float64 => self.bytes((value as f64).to_le_bytes()),
        }
    }

    fn float(&mut self, scalar: Scalar, value: f32) {
        match scalar {
            _ if self.encoding == Encoding::Ascii => self.word(value),
            Scalar::Float64 => self.bytes(f64::from(value).to_le_bytes()),
            _ => self.bytes(value.to_le_bytes()),
        }
    }

    fn word(&mut self, value: impl ToString) {
        self.separate();
        self.row.extend_from_slice(value.to_string().as_bytes());
    }

    fn separate(&mut self) {
        if self.encoding == Encoding::Ascii && !self.row.is_empty() {
            self.row.push(b' ');
        }
    }

    fn bytes<const N: usize>(&mut self, mut little: [u8; N]) {
        if self.encoding == Encoding::BigEndian {
            little.reverse();
        }
        self.row.extend_from_slice(&little);
    }

    fn end(&mut self) -> io::Result<()> {
        if self.encoding == Encoding::Ascii {
            self.row.extend_from_slice(self.line_end.as_bytes());
        }
        self.out.write_all(&self.row)?;
        self.row.clear();
        Ok(())
    }
}

/// What is not as it is in the file.
pub(super) struct Changes {
    pub vertices: Option<Vertices>,
    /// The pieces of every polygon.
    pub faces: Option<Vec<Vec<Face>>>,
}

/// UVs of the vertices of the file and of those that are added.
pub(super) struct Vertices {
    pub uvs: Vec<[f32; 2]>,
    /// The vertices that the added ones are copies of.
    pub added: Vec<u32>,
}

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        let changes = match uvs {
            Uvs::Mesh(uvs) if self.has_corner_uvs() => self.corner_changes(uvs),
            Uvs::Mesh(uvs) => self.vertex_changes(uvs),
            Uvs::Points(uvs) => Changes {
                vertices: Some(Vertices {
                    uvs: self.kept.uvs_of_all(uvs),
                    added: Vec::new(),
                }),
                faces: None,
            },
        };
        self.header_edits(&changes)
            .apply(&self.bytes[..self.header.end], out)?;
        self.write_body(&changes, out)
    }

    fn has_corner_uvs(&self) -> bool {
        matches!(self.faces, Faces::Polygons { uvs: Some(_), .. })
    }

    fn corner_changes(&self, uvs: &UvMap) -> Changes {
        let mut pieces = Pieces::of(uvs);
        let faces = self.polygons.divided().map(|(polygon, division)| {
            let pieces = pieces.next(division).into_iter();
            let face = |piece: Vec<(usize, u32)>| Face {
                vertices: piece.iter().map(|&(corner, _)| polygon[corner]).collect(),
                uvs: piece
                    .iter()
                    .map(|&(_, uv)| uvs.uvs()[uv as usize])
                    .collect(),
            };
            pieces.map(face).collect()
        });
        Changes {
            vertices: None,
            faces: Some(faces.collect()),
        }
    }

    fn vertex_changes(&self, uvs: &UvMap) -> Changes {
        let vertices = self.entries[self.vertices].starts.len();
        let split = Split::at_seams(vertices, &self.polygons, uvs);
        let face = |vertices| Face {
            vertices,
            uvs: Vec::new(),
        };
        let pieces = |pieces: Vec<Vec<u32>>| pieces.into_iter().map(face).collect();
        Changes {
            vertices: Some(Vertices {
                uvs: split.uvs,
                added: split.added,
            }),
            faces: Some(split.faces.into_iter().map(pieces).collect()),
        }
    }

    pub(super) fn header_edits(&self, changes: &Changes) -> Edits {
        let mut edits = Edits::default();
        let line_end = line_end(&self.bytes);
        if let Some(vertices) = &changes.vertices {
            let element = &self.header.elements[self.vertices];
            let count = element.count + vertices.added.len() as u64;
            edits.replace(element.count_word.clone(), count);
            for column in self.old_vertex_uvs() {
                edits.replace(element.properties[column].line.clone(), "");
            }
            let [s, t] = UV_NAMES[0];
            let lines = format_args!("property float {s}{line_end}property float {t}{line_end}");
            edits.replace(element.end()..element.end(), lines);
        }
        let Some(faces) = &changes.faces else {
            return edits;
        };
        match self.faces {
            Faces::None => {}
            Faces::Polygons {
                element, corners, ..
            } => {
                let small = self.entries[element].starts.len() - faces.len();
                let count = small + faces.iter().map(Vec::len).sum::<usize>();
                let definition = &self.header.elements[element];
                edits.replace(definition.count_word.clone(), count);
                for column in self.old_corner_uvs(element) {
                    edits.replace(definition.properties[column].line.clone(), "");
                }
                let property = &definition.properties[corners];
                if let Kind::List { item, .. } = property.kind
                    && self.index_type(item, changes) != item
                {
                    edits.replace(property.type_word.clone(), "uint");
                }
            }
            Faces::Strips { element } => {
                let empty = |element: &&Element| element.name == "face";
                for face in self.header.elements.iter().filter(empty) {
                    remove_lines(face, &mut edits);
                }
                let strips = &self.header.elements[element];
                remove_lines(strips, &mut edits);
                let lines = format_args!(
                    "element face {}{line_end}property list uchar uint vertex_indices{line_end}",
                    faces.len()
                );
                edits.replace(strips.end()..strips.end(), lines);
            }
        }
        edits
    }

    /// The properties of the vertices that new UVs replace: older UVs, and what else has the
    /// name of new ones.
    fn old_vertex_uvs(&self) -> Vec<usize> {
        let element = &self.header.elements[self.vertices];
        let complete = UV_NAMES
            .into_iter()
            .filter(|&names| element.scalars(names).is_some());
        let names: Vec<&str> = complete.chain([UV_NAMES[0]]).flatten().collect();
        named(element, &names)
    }

    /// The properties of the faces that UVs of the vertices replace.
    fn old_corner_uvs(&self, element: usize) -> Vec<usize> {
        if self.has_corner_uvs() {
            return Vec::new();
        }
        named(&self.header.elements[element], &[CORNER_UVS])
    }

    /// The type of vertex indices, which the number of vertices may outgrow.
    fn index_type(&self, old: Scalar, changes: &Changes) -> Scalar {
        let vertices = changes.vertices.as_ref().map_or(0, |v| v.uvs.len());
        if vertices as u64 > old.integers() {
            Scalar::UInt32
        } else {
            old
        }
    }

    /// The entries of the vertices alone.
    pub(super) fn write_points(&self, points: &Vertices, out: &mut dyn Write) -> io::Result<()> {
        self.write_vertices(points, &mut self.rows(out))
    }

    fn rows<'a>(&self, out: &'a mut dyn Write) -> Rows<'a> {
        Rows {
            out,
            encoding: self.header.encoding,
            line_end: line_end(&self.bytes),
            row: Vec::new(),
        }
    }

    fn write_body(&self, changes: &Changes, out: &mut dyn Write) -> io::Result<()> {
        let mut rows = self.rows(out);
        let mut end = self.header.end;
        for (index, entries) in self.entries.iter().enumerate() {
            end = entries.range.end;
            if let Some(vertices) = &changes.vertices
                && index == self.vertices
            {
                self.write_vertices(vertices, &mut rows)?;
                continue;
            }
            match (&changes.faces, self.faces) {
                (
                    Some(faces),
                    Faces::Polygons {
                        element,
                        corners,
                        uvs,
                    },
                ) if element == index => {
                    let columns = (corners, uvs);
                    self.write_faces(element, columns, faces, changes, &mut rows)?;
                }
                (Some(faces), Faces::Strips { element }) if element == index => {
                    for face in faces.iter().flatten() {
                        write_corners(&mut rows, Scalar::UInt8, Scalar::UInt32, &face.vertices);
                        rows.end()?;
                    }
                }
                _ => rows.out.write_all(&self.bytes[entries.range.clone()])?,
            }
        }
        rows.out.write_all(&self.bytes[end..])
    }

    fn write_vertices(&self, vertices: &Vertices, rows: &mut Rows) -> io::Result<()> {
        let table = self.table(self.vertices);
        let starts = &table.entries.starts;
        let old = self.old_vertex_uvs();
        let added = vertices
            .added
            .iter()
            .map(|&vertex| &starts[vertex as usize]);
        let mut cells = Vec::new();
        for (&start, uv) in starts.iter().chain(added).zip(&vertices.uvs) {
            table.cells(start, &mut cells);
            for (column, cell) in cells.iter().enumerate() {
                if !old.contains(&column) {
                    rows.copy(&self.bytes[cell.clone()]);
                }
            }
            uv.iter().for_each(|&c| rows.float(Scalar::Float32, c));
            rows.end()?;
        }
        Ok(())
    }

    fn write_faces(
        &self,
        element: usize,
        (corners, uvs): (usize, Option<usize>),
        faces: &[Vec<Face>],
        changes: &Changes,
        rows: &mut Rows,
    ) -> io::Result<()> {
        let table = self.table(element);
        let properties = &table.element.properties;
        let old = self.old_corner_uvs(element);
        let mut faces = faces.iter();
        let mut cells = Vec::new();
        for &start in &table.entries.starts {
            table.cells(start, &mut cells);
            let indices = table.numbers(properties[corners].kind, cells[corners].clone());
            let vertices: Vec<u32> = indices.map(|index| index.unwrap_or(0.0) as u32).collect();
            let small;
            let pieces = if vertices.len() < 3 {
                let uvs = Vec::new();
                small = vec![Face { vertices, uvs }];
                &small
            } else if let Some(pieces) = faces.next() {
                pieces
            } else {
                break;
            };
            for piece in pieces {
                for (column, cell) in cells.iter().enumerate() {
                    match properties[column].kind {
                        Kind::List { length, item } if column == corners => {
                            let item = self.index_type(item, changes);
                            write_corners(rows, length, item, &piece.vertices);
                        }
                        Kind::List { length, item }
                            if uvs == Some(column) && !piece.uvs.is_empty() =>
                        {
                            rows.integer(length, 2 * piece.uvs.len() as i64);
                            let parts = piece.uvs.as_flattened();
                            parts.iter().for_each(|&c| rows.float(item, c));
                        }
                        _ if old.contains(&column) => {}
                        _ => rows.copy(&self.bytes[cell.clone()]),
                    }
                }
                rows.end()?;
            }
        }
        Ok(())
    }
}

fn write_corners(rows: &mut Rows, length: Scalar, item: Scalar, vertices: &[u32]) {
    rows.integer(length, vertices.len() as i64);
    vertices.iter().for_each(|&v| rows.integer(item, v.into()));
}

/// The properties of these names.
fn named(element: &Element, names: &[&str]) -> Vec<usize> {
    let all = element.properties.iter().enumerate();
    all.filter(|(_, property)| names.contains(&property.name.as_str()))
        .map(|(column, _)| column)
        .collect()
}

fn remove_lines(element: &Element, edits: &mut Edits) {
    edits.replace(element.line.clone(), "");
    for property in &element.properties {
        edits.replace(property.line.clone(), "");
    }
}
