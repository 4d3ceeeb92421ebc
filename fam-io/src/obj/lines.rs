//! The lines (`l`) of an OBJ file.

use crate::error::ReadFault;
use crate::text::{excerpt, syntax};

use super::corner::Corner;
use super::faces::resolve;
use super::numbers::NumberReader;
use super::statements::{Statement, Statements};

/// The vertices of a file and the pieces of its lines.
#[derive(Debug, PartialEq)]
pub(crate) struct Lines {
    pub positions: Vec<[f64; 3]>,
    /// From one vertex of a line to the next.
    pub segments: Vec<Segment>,
}

/// A piece of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    /// The vertices at its ends.
    pub ends: [u32; 2],
    /// Where it is in the file, counting from 1.
    pub line: usize,
}

impl Lines {
    /// Reads a file; faces and all else in it are passed over.
    ///
    /// # Errors
    /// A vertex is no number, or a line refers to one that does not exist.
    pub fn read(bytes: &[u8]) -> Result<Self, ReadFault> {
        let mut statements = Statements::new(bytes);
        let mut numbers = NumberReader::default();
        let mut segments = Vec::new();
        while let Some(statement) = statements.next()? {
            match statement.keyword() {
                b"v" => numbers.push(&statement)?,
                b"l" => {
                    let vertices = vertices(&statement, numbers.seen()[0])?;
                    segments.extend(vertices.windows(2).map(|ends| Segment {
                        ends: [ends[0], ends[1]],
                        line: statement.line,
                    }));
                }
                _ => {}
            }
        }
        let numbers = numbers.finish()?;
        numbers.check_finite()?;
        let positions = numbers.positions;
        let missing = |v: &u32| *v as usize >= positions.len();
        let fault = segments
            .iter()
            .find_map(|s: &Segment| Some((s.line, *s.ends.iter().find(|v| missing(v))?)));
        match fault {
            Some((line, vertex)) => {
                let index = i64::from(vertex) + 1;
                Err(no_such_vertex(line, index, positions.len()))
            }
            None => Ok(Self {
                positions,
                segments,
            }),
        }
    }
}

/// The vertices of a line after `seen` vertices of the file; some may come only later.
fn vertices(statement: &Statement, seen: usize) -> Result<Vec<u32>, ReadFault> {
    let vertex = |word: &[u8]| {
        let written = Corner::split(word)
            .and_then(|corner| corner.references())
            .and_then(|[vertex, ..]| vertex)
            .ok_or_else(|| {
                let problem = format!("`{}` is not a vertex of a line", excerpt(word));
                syntax(statement.line, problem)
            })?;
        resolve(written, seen).ok_or_else(|| no_such_vertex(statement.line, written, seen))
    };
    statement.words().map(vertex).collect()
}

fn no_such_vertex(line: usize, index: i64, count: usize) -> ReadFault {
    let numbering = if index == 0 { ", numbered from 1" } else { "" };
    let problem =
        format!("the line refers to vertex {index}, but there are only {count}{numbering}");
    syntax(line, problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<([u32; 2], usize)>, String> {
        let lines = Lines::read(text.as_bytes()).map_err(|fault| fault.to_string())?;
        Ok(lines.segments.iter().map(|s| (s.ends, s.line)).collect())
    }

    #[test]
    fn lines_have_several_vertices_counted_from_either_end() {
        let text = "v 0 0 0\nv 1 0 0\nl -2 -1\nvt 0 0\nv 2 0 0\nf 1 2 3\nl 1/1 2/1 \\\n4 -1\nv 3 0 0\nl 2\nl\n";
        let expected = [([0, 1], 3), ([0, 1], 7), ([1, 3], 7), ([3, 2], 7)];
        assert_eq!(read(text).unwrap(), expected);
        assert_eq!(read("v 0 0 0\nf 1 1 1\n").unwrap(), []);
        assert_eq!(read("").unwrap(), []);
    }

    #[test]
    fn what_is_missing_is_named_with_its_line() {
        let vertices = "v 0 0 0\nv 1 0 0\n";
        for (line, reason) in [
            (
                "l 1 3",
                "line 3: the line refers to vertex 3, but there are only 2",
            ),
            (
                "l -3 1",
                "line 3: the line refers to vertex -3, but there are only 2",
            ),
            (
                "l 1 0",
                "line 3: the line refers to vertex 0, but there are only 2, numbered from 1",
            ),
            ("l 1 x", "line 3: `x` is not a vertex of a line"),
            ("l 1 /2", "line 3: `/2` is not a vertex of a line"),
            (
                "l 1 99999999999",
                "line 3: the line refers to vertex 99999999999, but there are only 2",
            ),
        ] {
            assert_eq!(
                read(&format!("{vertices}{line}\n")),
                Err(reason.to_string())
            );
        }
        assert!(read("v 0 0\nl 1 1\n").unwrap_err().starts_with("line 1"));
        assert!(
            read("v 0 0 nan\nl 1 1\n")
                .unwrap_err()
                .starts_with("line 1")
        );
    }
}
