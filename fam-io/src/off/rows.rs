//! The lines of a file, and the keyword on the first.

use std::ops::Range;

use crate::error::ReadFault;
use crate::text::{self, excerpt, is_blank, lines, syntax, words};

/// Which columns the vertices have beside their coordinates.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Letters {
    pub uvs: bool,
    pub colors: bool,
    pub normals: bool,
}

/// A line with content.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub line: usize,
    pub text: Range<usize>,
    pub next: usize,
}

impl Row {
    pub fn words(&self, bytes: &[u8]) -> Vec<Range<usize>> {
        words(bytes, self.text.clone(), is_blank)
    }
}

/// The lines that are not empty, without their comments.
pub(super) fn rows(bytes: &[u8]) -> impl Iterator<Item = Row> + '_ {
    lines(bytes).filter_map(|line| {
        let mut text = line.text.clone();
        if let Some(comment) = text::comment(&bytes[line.text.clone()]) {
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

/// The letters and the length of the keyword that a file starts with.
pub(super) fn keyword(word: &[u8], line: usize) -> Result<(Letters, usize), ReadFault> {
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
