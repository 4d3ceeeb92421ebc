//! OFF, the object file format of Geomview.
//!
//! A keyword of optional letters and `OFF`, the numbers of vertices, faces and (not looked
//! at, may be missing) edges, one line per vertex, one line per face. `#` starts a comment;
//! empty lines are skipped. The counts may follow the keyword on its line, even without a
//! space; a file without a keyword is a plain OFF.
//!
//! - A vertex has three coordinates and then, by the letters of the keyword, a normal (`N`),
//!   a colour (`C`, any number of columns) and a UV (`ST`, the last two columns). More columns
//!   than announced are taken for a colour. Four-dimensional (`4OFF`), n-dimensional (`nOFF`)
//!   and binary files are not read.
//! - A face has its number of corners, the zero-based vertices and possibly a colour. Faces of
//!   fewer than three corners are no part of the surface. Without faces it is a point cloud.
//!
//! Writing makes the keyword one with `ST` and puts a UV at the end of each vertex, replacing
//! an old one; everything else stays as it is in the file. A vertex with several UVs is split,
//! its copies come after the last vertex. A vertex in no face has the UV 0 0. A polygon with a
//! seam inside becomes triangles of the same colour.

use std::io::{self, Write};
use std::ops::Range;

use fam_core::surface::UvMap;

use crate::document::{Parsed, surface, vertex_uvs};
use crate::polygons::{Polygons, Split};
use crate::scene::Scene;
use crate::text::{self, Edits, coordinate, excerpt, is_blank, lines, syntax, words};
use crate::{Labels, ReadFault, Uvs};

/// An OFF file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    bytes: Vec<u8>,
    letters: Letters,
    /// Where the keyword is; empty where it is missing.
    keyword: Range<usize>,
    vertex_count: Range<usize>,
    face_count: Range<usize>,
    vertices: Vec<Row>,
    faces: Vec<Row>,
    polygons: Polygons,
}

/// Which columns the vertices have beside their coordinates.
#[derive(Debug, Clone, Copy, Default)]
struct Letters {
    uvs: bool,
    colors: bool,
    normals: bool,
}

/// A line with content.
#[derive(Debug, Clone)]
struct Row {
    line: usize,
    text: Range<usize>,
    next: usize,
}

impl Row {
    fn words(&self, bytes: &[u8]) -> Vec<Range<usize>> {
        words(bytes, self.text.clone(), is_blank)
    }
}

/// The lines that are not empty, without their comments.
fn rows(bytes: &[u8]) -> impl Iterator<Item = Row> + '_ {
    lines(bytes).filter_map(|line| {
        let mut text = line.text;
        if let Some(comment) = bytes[text.clone()].iter().position(|&b| b == b'#') {
            text.end = text.start + comment;
        }
        let blank = bytes[text.clone()].iter().all(|&b| is_blank(b));
        (!blank).then_some(Row {
            line: line.number,
            text,
            next: line.next,
        })
    })
}

pub(crate) fn parse(bytes: Vec<u8>) -> Result<Parsed<Source>, ReadFault> {
    let mut rows = rows(&bytes);
    let first = rows.next().ok_or_else(|| syntax(1, "the file is empty"))?;
    let mut header = first.words(&bytes);
    let (mut letters, length) = keyword(&bytes[header[0].clone()], first.line)?;
    let start = header[0].start;
    let keyword = start..start + length;
    header[0].start = keyword.end;
    if header[0].is_empty() {
        header.remove(0);
    }
    let mut line = first.line;
    if header.is_empty() {
        let row = rows
            .next()
            .ok_or_else(|| syntax(line, "the counts are missing"))?;
        line = row.line;
        header = row.words(&bytes);
    }
    let count = |at: usize, of: &str| -> Result<(Range<usize>, u64), ReadFault> {
        let missing = || syntax(line, format!("the number of {of} is missing"));
        let word = header.get(at).cloned().ok_or_else(missing)?;
        let number = text::parse(&bytes[word.clone()]);
        let bad = || {
            let found = excerpt(&bytes[word.clone()]);
            syntax(line, format!("`{found}` is not a number of {of}"))
        };
        Ok((word.clone(), number.ok_or_else(bad)?))
    };
    let (vertex_count, announced_vertices) = count(0, "vertices")?;
    let (face_count, announced_faces) = count(1, "faces")?;

    let vertices = take(&mut rows, announced_vertices, "vertices")?;
    let faces = take(&mut rows, announced_faces, "faces")?;
    drop(rows);

    let Vertices {
        positions,
        normals,
        uvs,
        colors,
    } = Vertices::parse(&bytes, &vertices, letters)?;
    letters.colors |= colors;
    let mut polygons = Polygons::default();
    for (number, row) in faces.iter().enumerate() {
        let corners = corners(&bytes, row, number + 1, positions.len())?;
        if corners.len() >= 3 {
            polygons.push(corners);
        }
    }

    let surface = surface(positions, &polygons, letters.normals.then_some(normals))?;
    let uvs = letters.uvs.then(|| vertex_uvs(&surface, uvs)).flatten();
    Ok(Parsed {
        surface,
        uvs,
        labels: Labels::default(),
        source: Source {
            letters,
            keyword,
            vertex_count,
            face_count,
            vertices,
            faces,
            polygons,
            bytes,
        },
    })
}

/// The letters and the length of the keyword that a file starts with.
fn keyword(word: &[u8], line: usize) -> Result<(Letters, usize), ReadFault> {
    let Some(at) = word.windows(3).position(|three| three == b"OFF") else {
        if text::parse::<u64>(word).is_some() {
            return Ok((Letters::default(), 0));
        }
        let found = excerpt(word);
        return Err(syntax(
            line,
            format!("an OFF file starts with OFF, not `{found}`"),
        ));
    };
    let mut letters = Letters::default();
    let mut rest = &word[..at];
    while let Some(&letter) = rest.first() {
        let length = match letter {
            b'S' if rest.starts_with(b"ST") => {
                letters.uvs = true;
                2
            }
            b'C' => {
                letters.colors = true;
                1
            }
            b'N' => {
                letters.normals = true;
                1
            }
            b'4' => return Err(ReadFault::Unsupported("four-dimensional OFF is".to_owned())),
            b'n' => return Err(ReadFault::Unsupported("n-dimensional OFF is".to_owned())),
            _ => {
                let found = excerpt(word);
                return Err(syntax(line, format!("`{found}` is not a keyword of OFF")));
            }
        };
        rest = &rest[length..];
    }
    Ok((letters, at + 3))
}

fn take(
    rows: &mut impl Iterator<Item = Row>,
    announced: u64,
    element: &str,
) -> Result<Vec<Row>, ReadFault> {
    let limit = usize::try_from(announced).unwrap_or(usize::MAX);
    let taken: Vec<Row> = rows.take(limit).collect();
    if taken.len() as u64 == announced {
        Ok(taken)
    } else {
        Err(ReadFault::Truncated {
            element: element.to_owned(),
            announced,
            found: taken.len() as u64,
        })
    }
}

#[derive(Default)]
struct Vertices {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    uvs: Vec<[f32; 2]>,
    /// Whether some have more columns than announced.
    colors: bool,
}

impl Vertices {
    fn parse(bytes: &[u8], rows: &[Row], letters: Letters) -> Result<Self, ReadFault> {
        let mut vertices = Self::default();
        for row in rows {
            let words = row.words(bytes);
            let word = |at: usize| &bytes[words[at].clone()];
            let normal = if letters.normals { 3 } else { 0 };
            let uv = if letters.uvs { 2 } else { 0 };
            let expected = 3 + normal + uv;
            if words.len() < expected {
                let found = words.len();
                let problem = format!("a vertex of {expected} columns or more has only {found}");
                return Err(syntax(row.line, problem));
            }
            vertices.colors |= words.len() > expected;
            let triple = |at: usize| -> Result<[f64; 3], ReadFault> {
                Ok([
                    coordinate(word(at), row.line)?,
                    coordinate(word(at + 1), row.line)?,
                    coordinate(word(at + 2), row.line)?,
                ])
            };
            vertices.positions.push(triple(0)?);
            if letters.normals {
                vertices.normals.push(triple(3)?);
            }
            if letters.uvs {
                let last = [words.len() - 2, words.len() - 1];
                // What is no number makes the UVs unusable, not the surface.
                let uv = last.map(|at| text::parse(word(at)).unwrap_or(f32::NAN));
                vertices.uvs.push(uv);
            }
        }
        Ok(vertices)
    }
}

fn corners(bytes: &[u8], row: &Row, face: usize, count: usize) -> Result<Vec<u32>, ReadFault> {
    let words = row.words(bytes);
    let number = |word: &Range<usize>| -> Result<i64, ReadFault> {
        let word = &bytes[word.clone()];
        let bad = || syntax(row.line, format!("`{}` is not an index", excerpt(word)));
        text::parse(word).ok_or_else(bad)
    };
    let announced = number(&words[0])?;
    let indices = usize::try_from(announced)
        .ok()
        .and_then(|announced| words[1..].get(..announced))
        .ok_or_else(|| {
            let found = words.len() - 1;
            let problem = format!("a face of {announced} corners has {found} columns for them");
            syntax(row.line, problem)
        })?;
    let corner = |word| {
        let index = number(word)?;
        let exists = usize::try_from(index).is_ok_and(|index| index < count);
        let vertex = u32::try_from(index).ok().filter(|_| exists);
        vertex.ok_or(ReadFault::VertexOutOfRange {
            face,
            index,
            count,
            numbering: ", numbered from 0",
        })
    };
    indices.iter().map(corner).collect()
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
        let split = Split::at_seams(self.vertices.len(), &self.polygons, uvs);
        let mut edits = self.with_vertex_uvs(&split.uvs[..self.vertices.len()]);
        let line_end = text::line_end(&self.bytes);
        if let Some(last) = self.vertices.last() {
            let added = split.added.iter().zip(&split.uvs[self.vertices.len()..]);
            for (&vertex, [u, v]) in added {
                let row = &self.vertices[vertex as usize];
                let copied = self.text(row.text.start..self.uv_place(row).start);
                let line = format_args!("{} {u} {v}{line_end}", copied.trim());
                edits.replace(last.next..last.next, line);
            }
        }
        if !split.added.is_empty() {
            edits.replace(self.vertex_count.clone(), split.uvs.len());
        }
        let mut face_count = self.faces.len();
        let mut polygons = self.polygons.iter().zip(&split.faces);
        for row in &self.faces {
            let words = row.words(&self.bytes);
            let corners: usize = text::parse(&self.bytes[words[0].clone()]).unwrap_or(0);
            if corners < 3 {
                continue;
            }
            let Some((polygon, pieces)) = polygons.next() else {
                break;
            };
            if let [whole] = pieces.as_slice() {
                for ((word, old), new) in words[1..].iter().zip(polygon).zip(whole) {
                    if old != new {
                        edits.replace(word.clone(), new);
                    }
                }
                continue;
            }
            face_count += pieces.len() - 1;
            let color = self.text(words[corners].end..row.text.end);
            let faces: Vec<String> = pieces
                .iter()
                .map(|piece| format!("3 {} {} {}", piece[0], piece[1], piece[2]))
                .collect();
            let between = format!("{}{line_end}", color.trim_end());
            edits.replace(words[0].start..words[corners].end, faces.join(&between));
        }
        if face_count != self.faces.len() {
            edits.replace(self.face_count.clone(), face_count);
        }
        edits.apply(&self.bytes, out)
    }

    fn write_points(&self, uvs: &[[f32; 2]], out: &mut dyn Write) -> io::Result<()> {
        self.with_vertex_uvs(uvs).apply(&self.bytes, out)
    }

    /// The new keyword, and the UVs of the vertices that are there.
    fn with_vertex_uvs(&self, uvs: &[[f32; 2]]) -> Edits {
        let mut edits = Edits::default();
        let line_end = text::line_end(&self.bytes);
        let after = if self.keyword.is_empty() {
            line_end
        } else {
            ""
        };
        let letter = |wanted: bool, letter: &'static str| if wanted { letter } else { "" };
        let colors = letter(self.letters.colors, "C");
        let normals = letter(self.letters.normals, "N");
        let keyword = format_args!("ST{colors}{normals}OFF{after}");
        edits.replace(self.keyword.clone(), keyword);
        for (row, [u, v]) in self.vertices.iter().zip(uvs) {
            let place = self.uv_place(row);
            let before = if place.is_empty() { " " } else { "" };
            edits.replace(place, format_args!("{before}{u} {v}"));
        }
        edits
    }

    /// Where the UV of a vertex is, or an empty range where to insert it.
    fn uv_place(&self, row: &Row) -> Range<usize> {
        let words = row.words(&self.bytes);
        let end = words[words.len() - 1].end;
        if self.letters.uvs {
            words[words.len() - 2].start..end
        } else {
            end..end
        }
    }

    fn text(&self, range: Range<usize>) -> std::borrow::Cow<'_, str> {
        String::from_utf8_lossy(&self.bytes[range])
    }
}
