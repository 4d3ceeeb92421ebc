//! ASCII files.

use super::facets::Facets;
use crate::error::ReadFault;
use crate::text::{coordinate, excerpt, is_blank, lines, syntax, words};

/// Adds the facets of a file.
pub(super) fn read(bytes: &[u8], facets: &mut Facets) -> Result<(), ReadFault> {
    let mut reader = Reader {
        facets,
        in_solid: false,
        facet: None,
        vertex: None,
        last: None,
        after_end: false,
    };
    for line in lines(bytes) {
        for word in words(bytes, line.text, is_blank) {
            let keyword = reader.word(&bytes[word], line.number)?;
            if matches!(keyword, Some(Keyword::Solid | Keyword::EndSolid)) {
                // The rest of the line is a name.
                break;
            }
        }
    }
    reader.finish()
}

/// A statement.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Keyword {
    Solid,
    EndSolid,
    Facet,
    EndFacet,
    /// `outer`, `loop` or `endloop`: a facet has only one loop.
    Loop,
    Vertex,
    /// Some programs add it.
    Color,
}

impl Keyword {
    fn of(word: &[u8]) -> Option<Self> {
        let known: [(&[u8], Self); 9] = [
            (b"vertex", Self::Vertex),
            (b"facet", Self::Facet),
            (b"outer", Self::Loop),
            (b"loop", Self::Loop),
            (b"endloop", Self::Loop),
            (b"endfacet", Self::EndFacet),
            (b"solid", Self::Solid),
            (b"endsolid", Self::EndSolid),
            (b"color", Self::Color),
        ];
        let found = known
            .iter()
            .find(|(name, _)| word.eq_ignore_ascii_case(name));
        found.map(|(_, keyword)| *keyword)
    }

    /// The statement that `end` and this word make.
    fn of_end(word: &[u8]) -> Option<Self> {
        match Self::of(word)? {
            Self::Solid => Some(Self::EndSolid),
            Self::Facet => Some(Self::EndFacet),
            Self::Loop => Some(Self::Loop),
            _ => None,
        }
    }
}

/// A vertex that is being read.
struct Vertex {
    line: usize,
    position: [f64; 3],
    /// How many numbers there were so far.
    count: usize,
}

/// Takes one word after the other.
struct Reader<'a> {
    facets: &'a mut Facets,
    in_solid: bool,
    /// The corners of the facet that is being read.
    facet: Option<Vec<[f64; 3]>>,
    vertex: Option<Vertex>,
    /// The last keyword and its line.
    last: Option<(Keyword, usize)>,
    /// Whether the last word was `end`.
    after_end: bool,
}

impl Reader<'_> {
    /// Takes a word; returns the keyword that it is or completes.
    fn word(&mut self, word: &[u8], line: usize) -> Result<Option<Keyword>, ReadFault> {
        let found = if std::mem::take(&mut self.after_end) {
            Some(Keyword::of_end(word).ok_or_else(|| misplaced(word, line))?)
        } else {
            Keyword::of(word)
        };
        let Some(keyword) = found else {
            self.after_end = word.eq_ignore_ascii_case(b"end");
            if !self.after_end {
                self.argument(word, line)?;
            }
            return Ok(None);
        };
        self.end_vertex()?;
        match (keyword, &mut self.facet) {
            (Keyword::Solid, None) if !self.in_solid => self.in_solid = true,
            (Keyword::EndSolid, None) if self.in_solid => {
                self.in_solid = false;
                self.facets.end_solid();
            }
            (Keyword::Facet, None) if self.in_solid => self.facet = Some(Vec::new()),
            (Keyword::Loop, Some(_)) | (Keyword::Color, _) => {}
            (Keyword::Vertex, Some(_)) => {
                self.vertex = Some(Vertex {
                    line,
                    position: [0.0; 3],
                    count: 0,
                });
            }
            (Keyword::EndFacet, Some(corners)) => {
                let corners = corners.as_slice().try_into().map_err(|_| {
                    let count = corners.len();
                    syntax(line, format!("a facet has 3 vertices, not {count}"))
                })?;
                self.facets.push(corners);
                self.facet = None;
            }
            _ => return Err(misplaced(word, line)),
        }
        self.last = Some((keyword, line));
        Ok(found)
    }

    /// Takes a word that is no keyword: a coordinate, part of a normal or a colour, or one that
    /// the line of a statement has beyond it.
    fn argument(&mut self, word: &[u8], line: usize) -> Result<(), ReadFault> {
        if let Some(vertex) = &mut self.vertex {
            if let Some(place) = vertex.position.get_mut(vertex.count) {
                *place = coordinate(word, line)?;
            }
            vertex.count += 1;
            return Ok(());
        }
        match self.last {
            Some((Keyword::Facet | Keyword::Color, _)) => Ok(()),
            Some((_, last)) if last == line => Ok(()),
            _ => Err(misplaced(word, line)),
        }
    }

    fn end_vertex(&mut self) -> Result<(), ReadFault> {
        let Some(vertex) = self.vertex.take() else {
            return Ok(());
        };
        if vertex.count != 3 {
            let problem = format!("a vertex has 3 coordinates, not {}", vertex.count);
            return Err(syntax(vertex.line, problem));
        }
        if let Some(corners) = &mut self.facet {
            corners.push(vertex.position);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<(), ReadFault> {
        self.end_vertex()?;
        if self.in_solid {
            let problem = "the file ends before the end of a solid";
            return Err(ReadFault::Malformed(problem.to_owned()));
        }
        Ok(())
    }
}

fn misplaced(word: &[u8], line: usize) -> ReadFault {
    let statement = excerpt(word);
    syntax(line, format!("`{statement}` is not expected here"))
}
