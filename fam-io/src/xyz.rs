//! XYZ: a point cloud as lines of columns.
//!
//! Columns are separated by blanks, commas or semicolons; the first three are the
//! coordinates. `#` and `//` start comments. Before the points there may be a line with their
//! number, which is not looked at, and one with the names of the columns.
//!
//! - Columns 4 to 6 are normals if every point has them and each is of unit length to within
//!   0.01; otherwise they are taken for something else and only kept.
//! - The next three columns are colours if all are whole numbers from 0 to 255 and one is above
//!   1; this matters only for writing another format and as an attribute.
//! - The last two columns are UVs if a line before the first point, comment or not, names the
//!   columns and ends in `u v`.
//!
//! Points with a coordinate that is NaN or infinite, in any spelling, are left out of the
//! surface, with a warning.
//!
//! Writing keeps every line and adds the UV as two columns, or replaces the one that is
//! there. A point that was left out gets NaN as its UV, or keeps what it has. A first line `# … u v` that names the columns is added if there is none.

use std::io::{self, Write};
use std::ops::Range;

use fam_surface::polygons::Polygons;
use fam_surface::{Surface, SurfaceError, vector};

use crate::color::{linear_color, mean};
use crate::error::ReadFault;
use crate::kept::{self, NO_UV};
use crate::labels::Labels;
use crate::parsed::{Parsed, surface};
use crate::scene::Scene;
use crate::text::{self, Edits, Line, lines, words};
use crate::uvs::{Uvs, vertex_uvs};
use crate::warning::Warning;

const UNIT_TOLERANCE: f64 = 1e-2;

/// An XYZ file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    bytes: Vec<u8>,
    /// The columns of every point of the surface.
    points: Vec<Range<usize>>,
    /// The columns of the points that are left out.
    left_out: Vec<Range<usize>>,
    columns: Columns,
}

/// What the columns of a file are.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    /// How many the first point has.
    width: usize,
    /// The names of the columns before the UV, if a line gives them.
    names: Option<Vec<String>>,
    has_uvs: bool,
    has_normals: bool,
}

/// A point of a file.
pub(crate) struct Point {
    /// From the first of its columns to the last.
    pub columns: Range<usize>,
    /// None for a point that is left out.
    pub position: Option<[f64; 3]>,
}

/// Reads the lines of a file one after the other, and finds out what its columns are.
#[derive(Debug, Default)]
pub(crate) struct Reader {
    /// Whether the line of the number of points is over.
    counted: bool,
    /// Whether the line of the names is over.
    titled: bool,
    headers: Vec<Vec<String>>,
    /// Of the first point.
    width: Option<usize>,
    /// Whether a line before the first point names UVs.
    named: bool,
    /// Whether a point has no UV in its last two columns.
    without_uv: bool,
    /// Whether a point has no normal, if its last two columns are a UV and if they are not.
    without_normal: [bool; 2],
    /// Points with finite coordinates.
    kept: usize,
    /// Points with others.
    left_out: usize,
}

impl Reader {
    /// The point on a line; none if there is no point.
    pub fn line(&mut self, bytes: &[u8], line: &Line) -> Result<Option<Point>, ReadFault> {
        let (data, comment) = split_comment(bytes, line.text.clone());
        let data = columns(bytes, data);
        let texts = |words: &[Range<usize>]| {
            let text = |word: &Range<usize>| String::from_utf8_lossy(&bytes[word.clone()]);
            words.iter().map(|word| text(word).into_owned()).collect()
        };
        if data.is_empty() {
            if self.width.is_none() {
                self.headers.push(texts(&comment));
            }
            return Ok(None);
        }
        let number = |word: &Range<usize>| text::number::<f64>(&bytes[word.clone()]);
        let is_number = |word: &Range<usize>| number(word).is_some();
        let is_count = data.len() == 1 && is_number(&data[0]);
        if is_count && !std::mem::replace(&mut self.counted, true) {
            return Ok(None);
        }
        let is_title = !data.iter().any(is_number);
        if is_title && !std::mem::replace(&mut self.titled, true) {
            self.headers.push(texts(&data));
            return Ok(None);
        }
        (self.counted, self.titled) = (true, true);
        if data.len() < 3 {
            let problem = format!("a point has three columns or more, not {}", data.len());
            return Err(text::syntax(line.number, problem));
        }
        let point = |position| Point {
            columns: data[0].start..data[data.len() - 1].end,
            position,
        };
        let mut position = [0.0; 3];
        for (place, word) in position.iter_mut().zip(&data) {
            *place = number(word).ok_or_else(|| {
                let found = text::excerpt(&bytes[word.clone()]);
                text::syntax(line.number, format!("`{found}` is not a number"))
            })?;
        }
        if !position.iter().all(|c| c.is_finite()) {
            self.left_out += 1;
            return Ok(Some(point(None)));
        }
        self.kept += 1;
        if self.width.is_none() {
            self.width = Some(data.len());
            self.named = self.headers.iter().any(|names| ends_in_uv(names));
        }
        self.without_uv |= self.named && uv(bytes, &data).is_none();
        let lengths = [data.len() - 2, data.len()];
        for (without, length) in self.without_normal.iter_mut().zip(lengths) {
            *without |= unit_normal(bytes, &data[..length]).is_none();
        }
        Ok(Some(point(Some(position))))
    }

    /// After the last line: what the columns are, and what was left out.
    ///
    /// # Errors
    /// There was no point with finite coordinates.
    pub fn finish(self) -> Result<(Columns, Vec<Warning>), ReadFault> {
        let warnings = kept::warnings(self.left_out, self.left_out + self.kept)?;
        let width = self.width.ok_or(SurfaceError::NoVertices)?;
        let has_uvs = self.named && !self.without_uv;
        let mut headers = self.headers.into_iter();
        let columns = Columns {
            width,
            names: headers.rfind(|names| names.len() == width),
            has_uvs,
            has_normals: !self.without_normal[if has_uvs { 0 } else { 1 }],
        };
        Ok((columns, warnings))
    }
}

impl Columns {
    /// Adds the UV of a point, or puts it in the place of the one that is there.
    pub fn edit(&self, bytes: &[u8], point: Range<usize>, [u, v]: [f32; 2], edits: &mut Edits) {
        let columns = columns(bytes, point.clone());
        let separator = String::from_utf8_lossy(&bytes[columns[0].end..columns[1].start]);
        if self.has_uvs {
            let start = columns[columns.len() - 2].start;
            edits.replace(start..point.end, format_args!("{u}{separator}{v}"));
        } else {
            let added = format_args!("{separator}{u}{separator}{v}");
            edits.replace(point.end..point.end, added);
        }
    }

    /// Adds a UV that is none to a point that is left out.
    pub fn edit_left_out(&self, bytes: &[u8], point: Range<usize>, edits: &mut Edits) {
        // Where there are UVs, it may have some of its own, or too few columns.
        if !self.has_uvs {
            self.edit(bytes, point, NO_UV, edits);
        }
    }

    /// Adds the line that names the columns to the start of a file that needs one.
    pub fn edit_header(&self, bytes: &[u8], edits: &mut Edits) {
        if !self.has_uvs
            && let Some(first) = lines(bytes).next()
        {
            let start = first.text.start;
            let names = self.all_names().join(" ");
            let line_end = text::line_end(bytes);
            edits.replace(start..start, format_args!("# {names} u v{line_end}"));
        }
    }

    /// The names of the columns before the UV: those of the file, if it has them.
    fn all_names(&self) -> Vec<String> {
        if let Some(names) = &self.names {
            return names.clone();
        }
        let mut names = vec!["x", "y", "z"];
        if self.has_normals {
            names.extend(["nx", "ny", "nz"]);
        }
        let known = names.len();
        let numbered = (known..self.width).map(|column| format!("column{}", column + 1));
        names
            .into_iter()
            .map(str::to_owned)
            .chain(numbered)
            .collect()
    }
}

fn columns(bytes: &[u8], range: Range<usize>) -> Vec<Range<usize>> {
    words(bytes, range, |b| {
        text::is_blank(b) || matches!(b, b',' | b';')
    })
}

/// Splits a line into its columns and the words of its comment.
fn split_comment(bytes: &[u8], line: Range<usize>) -> (Range<usize>, Vec<Range<usize>>) {
    let text = &bytes[line.clone()];
    let hash = text::comment(text);
    let slashes = text.windows(2).position(|two| two == b"//");
    match hash.into_iter().chain(slashes).min() {
        Some(length) => {
            let data = line.start..line.start + length;
            let marker = |b: &u8| matches!(b, b'#' | b'/');
            let markers = text[length..].iter().take_while(|b| marker(b)).count();
            (data.clone(), columns(bytes, data.end + markers..line.end))
        }
        None => (line.clone(), Vec::new()),
    }
}

pub(crate) fn parse(bytes: Vec<u8>) -> Result<Parsed<Source>, ReadFault> {
    let mut reader = Reader::default();
    let (mut points, mut left_out) = (Vec::new(), Vec::new());
    let mut positions = Vec::new();
    for line in lines(&bytes) {
        if let Some(point) = reader.line(&bytes, &line)? {
            match point.position {
                Some(position) => {
                    points.push(point.columns);
                    positions.push(position);
                }
                None => left_out.push(point.columns),
            }
        }
    }
    let (found, warnings) = reader.finish()?;
    let each = || points.iter().map(|point| columns(&bytes, point.clone()));
    let uvs = |c: Vec<Range<usize>>| uv(&bytes, &c);
    let uvs = found.has_uvs.then(|| each().filter_map(uvs).collect());
    let normals = |c: Vec<Range<usize>>| unit_normal(&bytes, &c);
    let normals = found
        .has_normals
        .then(|| each().filter_map(normals).collect());
    let surface = surface(positions, &Polygons::default(), normals)?;
    let uvs = uvs.and_then(|uvs| vertex_uvs(&surface, uvs));
    Ok(Parsed {
        surface,
        uvs,
        labels: Labels::default(),
        diagonals: Vec::new(),
        warnings,
        source: Source {
            bytes,
            points,
            left_out,
            columns: found,
        },
    })
}

/// The last two columns of a point, if they are numbers.
fn uv(bytes: &[u8], columns: &[Range<usize>]) -> Option<[f32; 2]> {
    let number = |word: &Range<usize>| text::number::<f32>(&bytes[word.clone()]);
    match columns {
        [_, _, _, .., u, v] => Some([number(u)?, number(v)?]),
        _ => None,
    }
}

fn ends_in_uv(names: &[String]) -> bool {
    match names {
        [_, _, _, .., u, v] => u.eq_ignore_ascii_case("u") && v.eq_ignore_ascii_case("v"),
        _ => false,
    }
}

/// Columns 4 to 6, if they are a normal.
fn unit_normal(bytes: &[u8], columns: &[Range<usize>]) -> Option<[f64; 3]> {
    let number = |at: usize| text::number::<f64>(&bytes[columns.get(at)?.clone()]);
    let normal = [number(3)?, number(4)?, number(5)?];
    ((vector::length(normal) - 1.0).abs() <= UNIT_TOLERANCE).then_some(normal)
}

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        match uvs {
            // Never a mesh.
            Uvs::Mesh(_) => Ok(()),
            Uvs::Points(uvs) => self.write_points(uvs, out),
        }
    }

    pub fn scene(&self, surface: &Surface) -> Scene {
        let mut scene = Scene::of_surface(surface);
        scene.meshes[0].colors = self.colors();
        scene
    }

    /// The mean of red, green and blue of every point, from 0 to 1; `None` without colours.
    pub fn vertex_colors(&self) -> Option<Vec<f64>> {
        let colors = self.bytes_of_colors()?.into_iter();
        Some(colors.map(|color| mean(color) / 255.0).collect())
    }

    fn colors(&self) -> Option<Vec<[f32; 4]>> {
        let linear = |color: [f64; 3]| linear_color(color.map(|c| c / 255.0), 1.0);
        let colors = self.bytes_of_colors()?.into_iter();
        Some(colors.map(linear).collect())
    }

    /// Red, green and blue of every point, from 0 to 255.
    fn bytes_of_colors(&self) -> Option<Vec<[f64; 3]>> {
        let before = if self.columns.has_normals { 6 } else { 3 };
        let after = if self.columns.has_uvs { 2 } else { 0 };
        let color = |point: &Range<usize>| {
            let columns = columns(&self.bytes, point.clone());
            let color = columns.get(before..columns.len() - after)?.get(..3)?;
            let is_byte = |c: &f64| c.fract() == 0.0 && (0.0..=255.0).contains(c);
            let number =
                |word: &Range<usize>| text::parse(&self.bytes[word.clone()]).filter(is_byte);
            Some([number(&color[0])?, number(&color[1])?, number(&color[2])?])
        };
        let colors: Option<Vec<[f64; 3]>> = self.points.iter().map(color).collect();
        let colors = colors?;
        let bytes = colors.as_flattened().iter().any(|&c| c > 1.0);
        bytes.then_some(colors)
    }

    fn write_points(&self, uvs: &[[f32; 2]], out: &mut dyn Write) -> io::Result<()> {
        let mut edits = Edits::default();
        self.columns.edit_header(&self.bytes, &mut edits);
        for (point, uv) in self.points.iter().zip(uvs) {
            self.columns
                .edit(&self.bytes, point.clone(), *uv, &mut edits);
        }
        for point in &self.left_out {
            self.columns
                .edit_left_out(&self.bytes, point.clone(), &mut edits);
        }
        edits.apply(&self.bytes, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_after_the_coordinates_are_colours_of_the_scene() {
        let colors = |text: &str| {
            let parsed = parse(text.as_bytes().to_vec()).unwrap();
            parsed.source.scene(&parsed.surface).meshes[0]
                .colors
                .clone()
        };
        let red_and_black = Some(vec![[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]);
        for text in [
            "1 2 3 255 0 0\n4 5 6 0 0 0\n",
            "1 2 3 255.0 0.0 0.0 9\n4 5 6 0 0 0 9\n",
            "1 2 3 0 0 1 255 0 0\n4 5 6 0 1 0 0 0 0\n",
            "# x y z r g b u v\n1 2 3 255 0 0 .5 .5\n4 5 6 0 0 0 .5 .5\n",
        ] {
            assert_eq!(colors(text), red_and_black, "{text}");
        }
        for text in [
            "1 2 3 1 0 0\n4 5 6 0 0 1\n",
            "1 2 3 256 0 0\n4 5 6 0 0 0\n",
            "1 2 3 2.5 0 0\n4 5 6 0 0 0\n",
            "1 2 3 9 9\n4 5 6 0 0 0\n",
        ] {
            assert_eq!(colors(text), None, "{text}");
        }
    }
}
