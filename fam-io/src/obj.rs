//! Wavefront OBJ.
//!
//! Read are `v`, `vt`, `vn` and `f` statements; all others, unknown ones too, are kept.
//! A statement may go over several lines with a backslash at the end of a line, and `#`
//! starts a comment. Faces may come before the vertices they refer to. Corners are `v`,
//! `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back from the last `v`, `vt` or
//! `vn` before the face. Faces of fewer than three corners are no part of the surface.
//!
//! The crate `tobj` reads the numbers of `v`, `vt` and `vn`. It reorders the vertices of
//! every group and forgets where a face was, so the faces are scanned here: their vertices
//! must keep the order of the file, and they are written back in place.
//!
//! - A fourth number of a `v` is a weight that divides the others; more than four numbers
//!   are a colour, which is not looked at.
//! - Normals are those of the corners: if a vertex has several, their mean. In a cloud there
//!   are normals if there is one `vn` for every `v`.
//! - UVs are there if every corner of every face refers to an existing `vt` and all `vt` are
//!   finite. In a cloud there are UVs if there is one `vt` for every `v`. References to `vt`
//!   and `vn` that do not exist are passed over.
//!
//! Writing keeps every byte but those of UVs: `vt` statements go, the new ones come before
//! the first face (in a cloud: at the end), and corners get their new `vt` index while `v`
//! and `vn` stay as written. A polygon with a seam inside becomes triangles. Lines (`l`) and
//! faces of two corners lose their `vt` references.

mod numbers;
mod statements;

use std::io::{self, Write};

use fam_core::surface::{Surface, SurfaceError, UvMap, vector};

use crate::document::{Parsed, surface, vertex_uvs};
use crate::polygons::{Pieces, Polygons, fan};
use crate::scene::Scene;
use crate::text::{self, Edits, excerpt, syntax};
use crate::{Labels, ReadFault, Uvs};
use numbers::Numbers;
use statements::{Statement, statements};

/// An OBJ file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    bytes: Vec<u8>,
}

pub(crate) fn parse(bytes: Vec<u8>) -> Result<Parsed<Source>, ReadFault> {
    let numbers = numbers::read(&bytes)?;
    if numbers.positions.is_empty() {
        return Err(SurfaceError::NoVertices.into());
    }
    let faces = Faces::read(&bytes, &numbers)?;
    let normals = if faces.vertices.iter().next().is_none() {
        let one_each = numbers.normals.len() == numbers.positions.len();
        one_each.then(|| numbers.normals.clone())
    } else {
        faces.vertex_normals(&numbers)
    };
    let vertices = numbers.positions.len();
    let surface = surface(numbers.positions, &faces.vertices, normals)?;
    let uvs = match &surface {
        Surface::Mesh(_) => faces.uv_map(numbers.uvs),
        Surface::PointCloud(_) if numbers.uvs.len() == vertices => {
            vertex_uvs(&surface, numbers.uvs)
        }
        Surface::PointCloud(_) => None,
    };
    Ok(Parsed {
        surface,
        uvs,
        labels: Labels::default(),
        source: Source { bytes },
    })
}

/// The faces of a file, with what each of their corners refers to.
#[derive(Default)]
struct Faces {
    vertices: Polygons,
    uvs: Vec<Option<u32>>,
    normals: Vec<Option<u32>>,
}

impl Faces {
    fn read(bytes: &[u8], numbers: &Numbers) -> Result<Self, ReadFault> {
        let mut faces = Self::default();
        let mut number = 0;
        // How many `v`, `vt` and `vn` there are so far.
        let mut seen = [0; 3];
        for statement in statements(bytes) {
            match statement.keyword(bytes) {
                b"v" => seen[0] += 1,
                b"vt" => seen[1] += 1,
                b"vn" => seen[2] += 1,
                b"f" => {
                    number += 1;
                    if statement.arguments().len() >= 3 {
                        faces.push(bytes, &statement, number, seen, numbers)?;
                    }
                }
                _ => {}
            }
        }
        Ok(faces)
    }

    fn push(
        &mut self,
        bytes: &[u8],
        statement: &Statement,
        number: usize,
        seen: [usize; 3],
        numbers: &Numbers,
    ) -> Result<(), ReadFault> {
        let mut vertices = Vec::with_capacity(statement.arguments().len());
        for word in statement.arguments() {
            let word = &bytes[word.clone()];
            let bad = || {
                let problem = format!("`{}` is not the corner of a face", excerpt(word));
                syntax(statement.line, problem)
            };
            let [vertex, uv, normal] = Corner::split(word)
                .and_then(|corner| corner.references())
                .ok_or_else(bad)?;
            let written = vertex.ok_or_else(bad)?;
            let count = numbers.positions.len();
            let vertex = resolve(written, seen[0], count).ok_or(ReadFault::VertexOutOfRange {
                face: number,
                index: written,
                count,
                numbering: if written == 0 {
                    ", numbered from 1"
                } else {
                    ""
                },
            })?;
            vertices.push(vertex);
            self.uvs
                .push(uv.and_then(|uv| resolve(uv, seen[1], numbers.uvs.len())));
            self.normals
                .push(normal.and_then(|normal| resolve(normal, seen[2], numbers.normals.len())));
        }
        self.vertices.push(vertices);
        Ok(())
    }

    /// The normal of every vertex, zero where no corner gives one; `None` if none does.
    fn vertex_normals(&self, numbers: &Numbers) -> Option<Vec<[f64; 3]>> {
        self.normals.iter().any(Option::is_some).then(|| {
            let mut only: Vec<Option<u32>> = vec![None; numbers.positions.len()];
            let mut sums = vec![[0.0; 3]; numbers.positions.len()];
            let mut differ = vec![false; numbers.positions.len()];
            let corners = self.vertices.iter().flatten().zip(&self.normals);
            for (&vertex, &normal) in corners {
                let Some(normal) = normal else { continue };
                let vertex = vertex as usize;
                let value = numbers.normals[normal as usize];
                let first = *only[vertex].get_or_insert(normal);
                differ[vertex] |= numbers.normals[first as usize] != value;
                sums[vertex] = vector::add(sums[vertex], vector::normalize(value));
            }
            let normals = only.into_iter().zip(sums).zip(differ);
            normals
                .map(|((only, sum), differ)| match only {
                    Some(normal) if !differ => numbers.normals[normal as usize],
                    _ => vector::normalize(sum),
                })
                .collect()
        })
    }

    /// The UVs, if every corner has one.
    fn uv_map(&self, uvs: Vec<[f32; 2]>) -> Option<Uvs> {
        let corners: Vec<u32> = self.uvs.iter().copied().collect::<Option<_>>()?;
        let mut rest = corners.as_slice();
        let mut triangles = Vec::new();
        for polygon in self.vertices.iter() {
            let (corners, others) = rest.split_at(polygon.len());
            triangles.extend(fan(corners));
            rest = others;
        }
        UvMap::new(uvs, triangles).ok().map(Uvs::Mesh)
    }
}

/// A zero-based index: positive ones count from 1, negative ones back from the `seen`-th.
fn resolve(written: i64, seen: usize, count: usize) -> Option<u32> {
    let index = if written > 0 {
        written - 1
    } else if written < 0 {
        i64::try_from(seen).ok()?.checked_add(written)?
    } else {
        return None;
    };
    let exists = usize::try_from(index).is_ok_and(|index| index < count);
    u32::try_from(index).ok().filter(|_| exists)
}

/// A corner of a face as written: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
struct Corner<'a> {
    parts: [&'a [u8]; 3],
}

impl<'a> Corner<'a> {
    fn split(word: &'a [u8]) -> Option<Self> {
        let mut parts: [&[u8]; 3] = [b"", b"", b""];
        for (at, part) in word.split(|&b| b == b'/').enumerate() {
            *parts.get_mut(at)? = part;
        }
        Some(Self { parts })
    }

    /// The three references; `None` for one that is left out, nothing if one is no number.
    fn references(&self) -> Option<[Option<i64>; 3]> {
        let mut references = [None; 3];
        for (reference, part) in references.iter_mut().zip(self.parts) {
            if !part.is_empty() {
                *reference = Some(text::parse(part)?);
            }
        }
        Some(references)
    }

    /// The corner with another `vt`, counting from 0, or without any.
    fn with_uv(&self, uv: Option<u32>) -> String {
        let [vertex, _, normal] = self.parts.map(String::from_utf8_lossy);
        let uv = uv
            .map(|uv| (u64::from(uv) + 1).to_string())
            .unwrap_or_default();
        match (uv.is_empty(), normal.is_empty()) {
            (true, true) => vertex.into_owned(),
            (false, true) => format!("{vertex}/{uv}"),
            (_, false) => format!("{vertex}/{uv}/{normal}"),
        }
    }
}

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        match uvs {
            Uvs::Mesh(uvs) => self.write_mesh(uvs, out),
            Uvs::Points(uvs) => self.write_points(uvs, out),
        }
    }

    pub fn scene(&self) -> io::Result<Scene> {
        Ok(Scene::default())
    }

    fn write_mesh(&self, uvs: &UvMap, out: &mut dyn Write) -> io::Result<()> {
        let mut edits = Edits::default();
        let mut pieces = Pieces::of(uvs);
        let mut first_face = true;
        for statement in statements(&self.bytes) {
            match statement.keyword(&self.bytes) {
                b"vt" => edits.replace(statement.start..statement.next, ""),
                b"f" if statement.arguments().len() >= 3 => {
                    if first_face {
                        self.insert_uvs(statement.start, uvs.uvs(), &mut edits);
                        first_face = false;
                    }
                    self.edit_face(&statement, &mut pieces, &mut edits);
                }
                b"f" | b"l" => self.remove_uvs(&statement, &mut edits),
                _ => {}
            }
        }
        edits.apply(&self.bytes, out)
    }

    fn write_points(&self, uvs: &[[f32; 2]], out: &mut dyn Write) -> io::Result<()> {
        let mut edits = Edits::default();
        for statement in statements(&self.bytes) {
            match statement.keyword(&self.bytes) {
                b"vt" => edits.replace(statement.start..statement.next, ""),
                b"f" | b"l" => self.remove_uvs(&statement, &mut edits),
                _ => {}
            }
        }
        let end = self.bytes.len();
        if text::ends_inside_a_line(&self.bytes) {
            edits.replace(end..end, text::line_end(&self.bytes));
        }
        self.insert_uvs(end, uvs, &mut edits);
        edits.apply(&self.bytes, out)
    }

    fn insert_uvs(&self, at: usize, uvs: &[[f32; 2]], edits: &mut Edits) {
        let line_end = text::line_end(&self.bytes);
        for [u, v] in uvs {
            edits.replace(at..at, format_args!("vt {u} {v}{line_end}"));
        }
    }

    fn edit_face(&self, statement: &Statement, pieces: &mut Pieces, edits: &mut Edits) {
        let words = statement.arguments();
        let corner = |&(corner, uv): &(usize, u32)| {
            let written = Corner::split(&self.bytes[words[corner].clone()]);
            written.map_or_else(String::new, |written| written.with_uv(Some(uv)))
        };
        match pieces.next(words.len()).as_slice() {
            [whole] => {
                for (word, piece) in words.iter().zip(whole) {
                    edits.replace(word.clone(), corner(piece));
                }
            }
            torn => {
                let faces: Vec<String> = torn
                    .iter()
                    .map(|piece| piece.iter().map(corner).collect::<Vec<_>>().join(" "))
                    .collect();
                let between = format!("{}f ", text::line_end(&self.bytes));
                let all = words[0].start..words[words.len() - 1].end;
                edits.replace(all, faces.join(&between));
            }
        }
    }

    fn remove_uvs(&self, statement: &Statement, edits: &mut Edits) {
        for word in statement.arguments() {
            if let Some(corner) = Corner::split(&self.bytes[word.clone()]) {
                edits.replace(word.clone(), corner.with_uv(None));
            }
        }
    }
}
