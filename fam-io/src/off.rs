//! OFF, the object file format of Geomview.
//!
//! A keyword of optional letters and `OFF`, the numbers of vertices, faces and (not looked
//! at, may be missing) edges, one line per vertex, one line per face. `#` starts a comment;
//! empty lines are skipped. The counts may follow the keyword on its line, even without a
//! space; a file without a keyword is a plain OFF.
//!
//! - A vertex has three coordinates and then, by the letters of the keyword, a normal (`N`),
//!   a colour (`C`, any number of columns) and a UV (`ST`, the last two columns). More columns
//!   than announced are taken for a colour. Four-dimensional (`4OFF`) and n-dimensional
//!   (`nOFF`) files are not read.
//! - A face has its number of corners, the zero-based vertices and possibly a colour. Faces of
//!   fewer than three corners are no part of the surface. Without faces it is a point cloud.
//! - Points of a cloud with a coordinate that is NaN or infinite are left out of the surface,
//!   with a warning. In a mesh they are an error.
//! - Colours of vertices are three or four columns, from 0 to 255 if a vertex has one above 1,
//!   else from 0 to 1.
//! - A file that has `BINARY` after its keyword goes on with big-endian 32-bit numbers: the
//!   three counts, the vertices (colours have four components), and the faces, each with its
//!   number of corners, its vertices, its number of colour components and those.
//!
//! Writing makes the keyword one with `ST` and puts a UV at the end of each vertex, replacing
//! an old one; everything else stays as it is in the file. A vertex with several UVs is split,
//! its copies come after the last vertex. A vertex in no face has the UV 0 0. A polygon with a
//! seam inside becomes triangles of the same colour. A binary file is written as text. A point
//! that was left out stays, with NaN as its UV.

mod binary;
mod rows;
mod write;

use std::io;
use std::ops::Range;

use fam_surface::polygons::Polygons;

use crate::color::linear_color;
use crate::error::ReadFault;
use crate::kept::Kept;
use crate::labels::Labels;
use crate::parsed::{Parsed, surface};
use crate::scene::{Mesh, Scene, corner_normals};
use crate::text::{self, coordinate, excerpt, syntax, vertex};
use crate::uvs::vertex_uvs;
use rows::{Letters, Row, keyword, rows};

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
    /// Which vertices the surface has.
    kept: Kept,
}

pub(crate) fn parse(bytes: Vec<u8>) -> Result<Parsed<Source>, ReadFault> {
    let bytes = binary::as_text(bytes)?;
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

    let columns = Vertices::parse(&bytes, &vertices, letters)?;
    letters.colors |= columns.colors;
    let mut polygons = Polygons::default();
    for (number, row) in faces.iter().enumerate() {
        let corners = corners(&bytes, row, number + 1, vertices.len())?;
        if corners.len() >= 3 {
            polygons.push(corners);
        }
    }
    let kept = match polygons.len() {
        0 => Kept::of(&columns.positions),
        _ => {
            check_finite(&bytes, &vertices, &columns.positions)?;
            Kept::default()
        }
    };
    let warnings = kept.warnings()?;
    polygons.divide(&columns.positions);

    let positions = kept.only(columns.positions);
    let normals = letters.normals.then(|| kept.only(columns.normals));
    let surface = surface(positions, &polygons, normals)?;
    let uvs = letters
        .uvs
        .then(|| vertex_uvs(&surface, kept.only(columns.uvs)))
        .flatten();
    Ok(Parsed {
        surface,
        uvs,
        labels: Labels::default(),
        diagonals: polygons.diagonals(),
        warnings,
        source: Source {
            letters,
            keyword,
            vertex_count,
            face_count,
            vertices,
            faces,
            polygons,
            kept,
            bytes,
        },
    })
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
                let mut triple = [0.0; 3];
                for (place, at) in triple.iter_mut().zip(at..) {
                    *place = number(word(at), row.line)?;
                }
                Ok(triple)
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

/// A word as a number, which may be NaN or infinite.
fn number(word: &[u8], line: usize) -> Result<f64, ReadFault> {
    let bad = || syntax(line, format!("`{}` is not a number", excerpt(word)));
    text::number(word).ok_or_else(bad)
}

/// Checks that the positions, one of each row, are finite.
fn check_finite(bytes: &[u8], rows: &[Row], positions: &[[f64; 3]]) -> Result<(), ReadFault> {
    let is_bad = |p: &[f64; 3]| !p.iter().all(|c| c.is_finite());
    let Some(bad) = positions.iter().position(is_bad) else {
        return Ok(());
    };
    let row = &rows[bad];
    for word in row.words(bytes).into_iter().take(3) {
        coordinate(&bytes[word], row.line)?;
    }
    Ok(())
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
    let corner = |word| vertex(number(word)?, face, count);
    indices.iter().map(corner).collect()
}

impl Source {
    pub fn scene(&self) -> io::Result<Scene> {
        let vertices = Vertices::parse(&self.bytes, &self.vertices, self.letters);
        let vertices = vertices.map_err(io::Error::other)?;
        let normals = self.letters.normals.then_some(vertices.normals);
        Ok(Scene::of_mesh(Mesh {
            positions: self.kept.only(vertices.positions),
            colors: self.colors().map(|colors| self.kept.only(colors)),
            normals: normals
                .map(|normals| corner_normals(&self.polygons, &self.kept.only(normals))),
            polygons: self.polygons.clone(),
            ..Mesh::default()
        }))
    }

    /// The colours of the vertices, if all have one.
    fn colors(&self) -> Option<Vec<[f32; 4]>> {
        let before = if self.letters.normals { 6 } else { 3 };
        let after = if self.letters.uvs { 2 } else { 0 };
        let color = |row: &Row| -> Option<[f64; 4]> {
            let words = row.words(&self.bytes);
            let words = words.get(before..words.len() - after)?;
            let number = |word: &Range<usize>| text::parse::<f64>(&self.bytes[word.clone()]);
            match words {
                [r, g, b] => Some([number(r)?, number(g)?, number(b)?, f64::NAN]),
                [r, g, b, a] => Some([number(r)?, number(g)?, number(b)?, number(a)?]),
                _ => None,
            }
        };
        let colors: Option<Vec<[f64; 4]>> = self.vertices.iter().map(color).collect();
        let colors = colors?;
        let bytes = colors.as_flattened().iter().any(|&c| c > 1.0);
        let largest = if bytes { 255.0 } else { 1.0 };
        let linear = |&[r, g, b, a]: &[f64; 4]| {
            let opacity = if a.is_nan() { 1.0 } else { a / largest };
            linear_color([r, g, b].map(|c| c / largest), opacity)
        };
        Some(colors.iter().map(linear).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_has_polygons_colours_and_normals() {
        let scene = |text: &str| {
            let source = parse(text.as_bytes().to_vec()).unwrap().source;
            source.scene().unwrap().meshes.remove(0)
        };
        let mesh = scene(
            "STCNOFF 4 3 0\n0 0 0 0 0 2 255 0 0 .5 .5\n1 0 0 0 3 0 0 255 0 51 .5 .5\n\
             1 1 0 0 0 1 1 0 0 1 1\n0 1 0 1 0 0 0 0 0 255 1 1\n4 0 1 2 3 7\n2 0 1\n3 3 0 1\n",
        );
        assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0]);
        let polygons: Vec<&[u32]> = mesh.polygons.iter().collect();
        assert_eq!(polygons, [&[0, 1, 2, 3][..], &[3, 0, 1]]);
        let normals = mesh.normals.unwrap();
        assert_eq!(normals.len(), 7);
        assert_eq!(normals[4..], [[1., 0., 0.], [0., 0., 2.], [0., 3., 0.]]);
        let colors = mesh.colors.unwrap();
        assert_eq!(colors[0], [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(colors[1], [0.0, 1.0, 0.0, 0.2]);

        // A cloud has its normals per point; colours without a value above 1 go up to 1.
        let mesh = scene("CNOFF 2 0 0\n0 0 0 0 0 1 1 0 0\n1 0 0 0 1 0 0 0 1 0\n");
        assert_eq!(mesh.normals.unwrap(), [[0., 0., 1.], [0., 1., 0.]]);
        let colors = [[1., 0., 0., 1.], [0., 0., 1., 0.]];
        assert_eq!(mesh.colors.unwrap(), colors);
        // An index of a colour map, or not the same for all.
        assert_eq!(scene("COFF 1 0 0\n0 0 0 3\n").colors, None);
        assert_eq!(scene("COFF 2 0 0\n0 0 0 1 1 1\n0 1 0\n").colors, None);
        assert_eq!(scene("OFF 1 0 0\n0 0 0\n").colors, None);
    }
}
