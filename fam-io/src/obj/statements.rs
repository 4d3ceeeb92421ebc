//! The statements of an OBJ file: lines, joined where one ends in a backslash.

use std::ops::Range;

use crate::text::{is_blank, lines, words};

/// A statement: its words and where it is in the file.
pub(super) struct Statement {
    /// The line it starts on, counting from 1.
    pub line: usize,
    /// Where its first line starts.
    pub start: usize,
    /// Where the line after it starts.
    pub next: usize,
    words: Vec<Range<usize>>,
}

impl Statement {
    /// The first word; empty on a line without any.
    pub fn keyword<'a>(&self, bytes: &'a [u8]) -> &'a [u8] {
        self.words.first().map_or(b"", |word| &bytes[word.clone()])
    }

    /// All words but the first.
    pub fn arguments(&self) -> &[Range<usize>] {
        self.words.get(1..).unwrap_or_default()
    }
}

/// The statements of a file, in order, those without words included.
pub(super) fn statements(bytes: &[u8]) -> impl Iterator<Item = Statement> + '_ {
    let mut lines = lines(bytes);
    std::iter::from_fn(move || {
        let mut line = lines.next()?;
        let mut statement = Statement {
            line: line.number,
            start: line.text.start,
            next: line.next,
            words: Vec::new(),
        };
        loop {
            let mut text = line.text;
            let comment = bytes[text.clone()].iter().position(|&b| b == b'#');
            let continues = comment.is_none() && bytes[text.clone()].ends_with(b"\\");
            if let Some(comment) = comment {
                text.end = text.start + comment;
            } else if continues {
                text.end -= 1;
            }
            statement.words.extend(words(bytes, text, is_blank));
            statement.next = line.next;
            match continues.then(|| lines.next()).flatten() {
                Some(following) => line = following,
                None => return Some(statement),
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(usize, Vec<&str>)> {
        statements(text.as_bytes())
            .map(|s| (s.line, s.words.iter().map(|w| &text[w.clone()]).collect()))
            .collect()
    }

    #[test]
    fn backslashes_join_lines_but_not_in_comments() {
        let text = "f 1 2\\\r\n 3 \\\n4\nv 1 # C:\\\nv 2\n\\";
        let expected = [
            (1, vec!["f", "1", "2", "3", "4"]),
            (4, vec!["v", "1"]),
            (5, vec!["v", "2"]),
            (6, vec![]),
        ];
        assert_eq!(all(text), expected);
        let first = statements(text.as_bytes()).next().unwrap();
        assert_eq!(&text[first.start..first.next], "f 1 2\\\r\n 3 \\\n4\n");
    }
}
