//! The statements of an OBJ file, one at a time: lines, joined where one ends in a backslash.

use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::ops::Range;

use crate::content::Content;
use crate::text::{self, is_blank, lines, push_words};

const MARK: &[u8] = b"\xef\xbb\xbf";
const BUFFER: usize = 1 << 17;

/// Opens a file, or what is in memory.
pub(super) fn open(content: &Content) -> io::Result<Box<dyn BufRead + '_>> {
    Ok(match content {
        Content::File(path) => Box::new(BufReader::with_capacity(BUFFER, File::open(path)?)),
        Content::Bytes(bytes) => Box::new(bytes.as_slice()),
    })
}

/// Tells whether a file is the same as before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fingerprint {
    length: u64,
    hash: u64,
}

/// A statement: its words and its bytes.
pub(super) struct Statement<'a> {
    /// The line it starts on, counting from 1.
    pub line: usize,
    /// The byte order mark, which may be before the first statement; else empty.
    pub mark: &'a [u8],
    /// All of its bytes, line ends included.
    pub bytes: &'a [u8],
    /// Whether the file ends where a backslash announces one more line.
    pub open: bool,
    words: &'a [Range<usize>],
}

impl<'a> Statement<'a> {
    /// The first word; empty on a line without any.
    pub fn keyword(&self) -> &'a [u8] {
        self.words
            .first()
            .map_or(b"", |word| &self.bytes[word.clone()])
    }

    /// Where the words after the first are.
    pub fn arguments(&self) -> &'a [Range<usize>] {
        self.words.get(1..).unwrap_or_default()
    }

    /// The words after the first.
    pub fn words(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let bytes = self.bytes;
        self.arguments().iter().map(|word| &bytes[word.clone()])
    }

    /// What follows the first word, as one name: blanks and `#` may be part of it, but a `#`
    /// between blanks starts a comment.
    pub fn name(&self) -> Vec<u8> {
        let rest = self
            .words
            .first()
            .map_or(b"".as_slice(), |word| &self.bytes[word.end..]);
        let mut name = Vec::with_capacity(rest.len());
        for line in lines(rest) {
            let text = &rest[line.text];
            let joined = line.next < rest.len() && text.ends_with(b"\\");
            name.extend(&text[..text.len() - usize::from(joined)]);
        }
        let is_end = |at: Option<usize>| {
            at.and_then(|at| name.get(at))
                .is_none_or(|&byte| is_blank(byte))
        };
        let comment = (0..name.len())
            .find(|&at| name[at] == b'#' && is_end(at.checked_sub(1)) && is_end(Some(at + 1)));
        name.truncate(comment.unwrap_or(name.len()));
        trim(&name).to_vec()
    }
}

fn trim(bytes: &[u8]) -> &[u8] {
    let is_part = |&byte: &u8| !is_blank(byte);
    let start = bytes.iter().position(is_part).unwrap_or(bytes.len());
    let end = bytes.iter().rposition(is_part).map_or(start, |at| at + 1);
    &bytes[start..end]
}

/// A name as text: in UTF-8 or, if it is not valid, in Latin-1.
pub(super) fn decode(name: &[u8]) -> String {
    std::str::from_utf8(name).map_or_else(
        |_| name.iter().copied().map(char::from).collect(),
        str::to_owned,
    )
}

/// Reads statements, those without words included.
pub(super) struct Statements<R> {
    reader: R,
    line: usize,
    bytes: Vec<u8>,
    words: Vec<Range<usize>>,
    hasher: DefaultHasher,
    length: u64,
}

impl<R: BufRead> Statements<R> {
    pub fn new(reader: R) -> Self {
        Self {
            reader,
            line: 0,
            bytes: Vec::new(),
            words: Vec::new(),
            hasher: DefaultHasher::new(),
            length: 0,
        }
    }

    /// The next statement; nothing at the end of the file.
    pub fn next(&mut self) -> io::Result<Option<Statement<'_>>> {
        self.bytes.clear();
        self.words.clear();
        let line = self.line + 1;
        let mut mark = 0;
        let mut open = false;
        loop {
            let start = self.bytes.len();
            let Some(mut end) = self.read_line()? else {
                open = start > 0;
                break;
            };
            let mut start = start;
            if start == 0 && line == 1 && self.bytes.starts_with(MARK) {
                mark = MARK.len();
                start = mark;
            }
            let text = &self.bytes[start..end];
            let comment = text::comment(text);
            let continues = comment.is_none() && text.ends_with(b"\\");
            end = comment.map_or(end - usize::from(continues), |at| start + at);
            push_words(&self.bytes, start..end, is_blank, &mut self.words);
            if !continues {
                break;
            }
        }
        if self.bytes.is_empty() {
            return Ok(None);
        }
        self.hasher.write(&self.bytes);
        self.length += self.bytes.len() as u64;
        for word in &mut self.words {
            *word = word.start - mark..word.end - mark;
        }
        let (mark, bytes) = self.bytes.split_at(mark);
        Ok(Some(Statement {
            line,
            mark,
            bytes,
            open,
            words: &self.words,
        }))
    }

    /// Of all statements so far.
    pub fn fingerprint(&self) -> Fingerprint {
        Fingerprint {
            length: self.length,
            hash: self.hasher.finish(),
        }
    }

    /// Appends the next line and its end; returns where its text ends.
    fn read_line(&mut self) -> io::Result<Option<usize>> {
        let start = self.bytes.len();
        while self.is_more()? {
            let buffer = self.reader.fill_buf()?;
            let Some(end) = buffer.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
                let length = buffer.len();
                self.bytes.extend_from_slice(buffer);
                self.reader.consume(length);
                continue;
            };
            let carriage = buffer[end] == b'\r';
            self.bytes.extend_from_slice(&buffer[..=end]);
            let text = self.bytes.len() - 1;
            self.reader.consume(end + 1);
            if carriage && self.is_more()? && self.reader.fill_buf()?[0] == b'\n' {
                self.bytes.push(b'\n');
                self.reader.consume(1);
            }
            self.line += 1;
            return Ok(Some(text));
        }
        if self.bytes.len() == start {
            return Ok(None);
        }
        self.line += 1;
        Ok(Some(self.bytes.len()))
    }

    /// Whether there is something to read.
    fn is_more(&mut self) -> io::Result<bool> {
        loop {
            match self.reader.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                buffer => return buffer.map(|bytes| !bytes.is_empty()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line, words and bytes of all statements, read through a buffer of `capacity` bytes.
    fn all(text: &[u8], capacity: usize) -> Vec<(usize, Vec<String>, Vec<u8>)> {
        let mut statements = Statements::new(BufReader::with_capacity(capacity, text));
        let mut all = Vec::new();
        while let Some(s) = statements.next().unwrap() {
            let words = s.words.iter().map(|w| decode(&s.bytes[w.clone()]));
            all.push((s.line, words.collect(), [s.mark, s.bytes].concat()));
        }
        all
    }

    #[test]
    fn backslashes_join_lines_but_not_in_comments() {
        let text = b"\xef\xbb\xbff 1 2\\\r\n 3 \\\n4\nv 1 # C:\\\nv 2\r\r\n#\n\\";
        let expected = [
            (1, "f 1 2 3 4", &text[..18]),
            (4, "v 1", b"v 1 # C:\\\n"),
            (5, "v 2", b"v 2\r"),
            (6, "", b"\r\n"),
            (7, "", b"#\n"),
            (8, "", b"\\"),
        ];
        for capacity in 1..text.len() + 1 {
            let found = all(text, capacity);
            let found: Vec<_> = found
                .iter()
                .map(|(line, words, bytes)| (*line, words.join(" "), bytes.as_slice()))
                .collect();
            assert_eq!(found, expected.map(|(l, w, b)| (l, w.to_owned(), b)));
        }
    }

    #[test]
    fn a_file_may_end_inside_a_statement() {
        let open = |text: &str| {
            let mut statements = Statements::new(text.as_bytes());
            statements.next().unwrap().unwrap().open
        };
        assert!(open("v 1 \\") && open("v 1 \\\n"));
        assert!(!open("v 1 \\\n\n") && !open("v 1") && !open("# \\"));
    }

    #[test]
    fn names_have_blanks_but_no_comments() {
        let name = |text: &str| {
            let mut statements = Statements::new(text.as_bytes());
            decode(&statements.next().unwrap().unwrap().name())
        };
        assert_eq!(name("o  a b#2 #3\t# 4 # 5\r\n"), "a b#2 #3");
        assert_eq!(name("o #ff0000"), "#ff0000");
        assert_eq!(name("o # none"), "");
        assert_eq!(name("o"), "");
        assert_eq!(name("usemtl a \\\r\n b\n"), "a  b");
        assert_eq!(decode(b"gr\xfcn"), "gr\u{fc}n");
        assert_eq!(decode("gr\u{fc}n".as_bytes()), "gr\u{fc}n");
    }

    #[test]
    fn fingerprints_tell_files_apart() {
        let of = |text: &[u8], capacity| {
            let mut statements = Statements::new(BufReader::with_capacity(capacity, text));
            while statements.next().unwrap().is_some() {}
            statements.fingerprint()
        };
        assert_eq!(of(b"v 1\r\nv 2", 1), of(b"v 1\r\nv 2", 99));
        for other in ["v 1\nv 2", "v 1\r\nv 3", "v 2\r\nv 1", "v 1\r\nv 2\n", ""] {
            assert_ne!(of(other.as_bytes(), 99), of(b"v 1\r\nv 2", 99));
        }
    }
}
