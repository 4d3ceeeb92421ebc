//! Lines, words and edits of text files, all as byte ranges, so that a file can be written
//! back with single words replaced. Line ends are `\n`, `\r\n` and `\r`.

use std::fmt;
use std::io::{self, Write};
use std::ops::Range;
use std::str::FromStr;

use crate::error::ReadFault;

/// A line: its number (counting from 1), the range of its text without the line end, and
/// where the next line starts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    pub number: usize,
    pub text: Range<usize>,
    pub next: usize,
}

/// The lines of a file; a byte order mark is not part of the first.
pub(crate) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line> + '_ {
    let mut start = if bytes.starts_with(b"\xef\xbb\xbf") {
        3
    } else {
        0
    };
    let mut number = 0;
    std::iter::from_fn(move || {
        if start >= bytes.len() {
            return None;
        }
        number += 1;
        let rest = &bytes[start..];
        let length = rest
            .iter()
            .position(|b| matches!(b, b'\n' | b'\r'))
            .unwrap_or(rest.len());
        let ending = match &rest[length..] {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        let line = Line {
            number,
            text: start..start + length,
            next: start + length + ending,
        };
        start = line.next;
        Some(line)
    })
}

/// The line end that the file uses: that of its first line.
pub(crate) fn line_end(bytes: &[u8]) -> &'static str {
    let first = lines(bytes)
        .next()
        .map(|line| &bytes[line.text.end..line.next]);
    match first {
        Some(b"\r\n") => "\r\n",
        Some(b"\r") => "\r",
        _ => "\n",
    }
}

/// Whether the last line of the file lacks its line end.
pub(crate) fn ends_inside_a_line(bytes: &[u8]) -> bool {
    !matches!(bytes.last(), None | Some(b'\n' | b'\r'))
}

/// The words of a range: what is between separators.
pub(crate) fn words(
    bytes: &[u8],
    range: Range<usize>,
    is_separator: impl Fn(u8) -> bool,
) -> Vec<Range<usize>> {
    let mut words = Vec::new();
    push_words(bytes, range, is_separator, &mut words);
    words
}

/// Appends the words of a range.
pub(crate) fn push_words(
    bytes: &[u8],
    range: Range<usize>,
    is_separator: impl Fn(u8) -> bool,
    words: &mut Vec<Range<usize>>,
) {
    let mut start = None;
    for at in range.clone() {
        match (is_separator(bytes[at]), start) {
            (false, None) => start = Some(at),
            (true, Some(begin)) => {
                words.push(begin..at);
                start = None;
            }
            _ => {}
        }
    }
    words.extend(start.map(|begin| begin..range.end));
}

/// Separates words in OBJ and OFF.
pub(crate) fn is_blank(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == 0x0b
}

/// A word as a number; `None` if it is none.
pub(crate) fn parse<T: FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word as a number; also NaN or infinite, in any spelling that programs write.
pub(crate) fn number<T: FromStr + From<f32>>(word: &[u8]) -> Option<T> {
    parse(word).or_else(|| is_nan_of_c(word).then(|| f32::NAN.into()))
}

/// Whether a word is a NaN or an infinity that C libraries write and Rust does not read:
/// `-nan(ind)`, `1.#QNAN`, `-1.#IND00` or `1.#INF`.
pub(crate) fn is_nan_of_c(word: &[u8]) -> bool {
    let unsigned = match word {
        [b'+' | b'-', unsigned @ ..] => unsigned,
        _ => word,
    };
    match unsigned {
        [b'1', b'.', rest @ ..] => starts_nan_of_c(rest),
        [name @ .., b')'] => name
            .get(..4)
            .is_some_and(|start| start.eq_ignore_ascii_case(b"nan(")),
        _ => false,
    }
}

/// Whether this is what follows the `1.` in such a word.
fn starts_nan_of_c(text: &[u8]) -> bool {
    [&b"#IND"[..], b"#INF", b"#QNAN", b"#SNAN"]
        .iter()
        .any(|name| {
            text.get(..name.len())
                .is_some_and(|start| start.eq_ignore_ascii_case(name))
        })
}

/// Where the comment of a line starts: at a `#`, unless that is part of a number as `1.#IND`.
pub(crate) fn comment(line: &[u8]) -> Option<usize> {
    line.iter().enumerate().position(|(at, &byte)| {
        byte == b'#' && !(line[..at].ends_with(b"1.") && starts_nan_of_c(&line[at..]))
    })
}

/// The text that a file starts with, if it is in UTF-16: it has a byte order mark, or every other
/// byte is zero and the ones between them are no control characters.
pub(crate) fn utf16(start: &[u8]) -> Option<String> {
    /// Bytes that tell, without a mark: more than the header of a binary STL file, which may
    /// have any content.
    const LOOKED_AT: usize = 256;
    /// Characters that it takes, without a mark.
    const FEWEST: usize = 4;
    let (units, _) = start.as_chunks();
    let decode = |number: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = units.iter().map(|unit| number(*unit)).collect();
        Some(String::from_utf16_lossy(&units))
    };
    match units {
        [[0xff, 0xfe], ..] => return decode(u16::from_le_bytes),
        [[0xfe, 0xff], ..] => return decode(u16::from_be_bytes),
        _ => {}
    }
    let first = &units[..units.len().min(LOOKED_AT / 2)];
    let is_character = |byte: u8| byte >= b' ' || byte.is_ascii_whitespace();
    let little = |&[low, high]: &[u8; 2]| high == 0 && is_character(low);
    let big = |&[high, low]: &[u8; 2]| high == 0 && is_character(low);
    match first {
        _ if first.len() < FEWEST => None,
        _ if first.iter().all(little) => decode(u16::from_le_bytes),
        _ if first.iter().all(big) => decode(u16::from_be_bytes),
        _ => None,
    }
}

/// A word as a finite coordinate.
pub(crate) fn coordinate(word: &[u8], line: usize) -> Result<f64, ReadFault> {
    match number::<f64>(word) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(syntax(
            line,
            format!("`{}` is not a finite number", excerpt(word)),
        )),
        None => Err(syntax(line, format!("`{}` is not a number", excerpt(word)))),
    }
}

/// A vertex of a face by its index in a file that counts from 0.
pub(crate) fn vertex(index: i64, face: usize, count: usize) -> Result<u32, ReadFault> {
    let exists = usize::try_from(index).is_ok_and(|index| index < count);
    let vertex = u32::try_from(index).ok().filter(|_| exists);
    vertex.ok_or(ReadFault::VertexOutOfRange {
        face,
        index,
        count,
        numbering: ", numbered from 0",
    })
}

/// A fault at a line.
pub(crate) fn syntax(line: usize, problem: impl Into<String>) -> ReadFault {
    let problem = problem.into();
    ReadFault::Syntax { line, problem }
}

/// A few characters of a word for an error message, without control characters.
pub(crate) fn excerpt(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&word[..word.len().min(4 * LONGEST)]);
    let mut characters = text.chars();
    let mut excerpt: String = characters
        .by_ref()
        .take(LONGEST)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    if characters.next().is_some() {
        excerpt.push('…');
    }
    excerpt
}

/// Replacements in a file; their ranges do not overlap.
#[derive(Debug, Default)]
pub(crate) struct Edits {
    replaced: Vec<(Range<usize>, Range<usize>)>,
    text: String,
}

impl Edits {
    /// Puts `new` in the place of a range of the file; an empty range inserts.
    pub fn replace(&mut self, range: Range<usize>, new: impl fmt::Display) {
        let start = self.text.len();
        self.text.push_str(&new.to_string());
        self.replaced.push((range, start..self.text.len()));
    }

    /// Writes the file with the replacements; insertions at one place keep their order.
    pub fn apply(mut self, bytes: &[u8], out: &mut dyn Write) -> io::Result<()> {
        self.replaced.sort_by_key(|(range, _)| range.start);
        let mut at = 0;
        for (range, new) in self.replaced {
            out.write_all(&bytes[at..range.start])?;
            out.write_all(&self.text.as_bytes()[new])?;
            at = range.end;
        }
        out.write_all(&bytes[at..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_three_ways() {
        let bytes = b"\xef\xbb\xbfa\nb\r\n\rc";
        let texts: Vec<_> = lines(bytes)
            .map(|line| (line.number, &bytes[line.text], line.next))
            .collect();
        let expected: [(usize, &[u8], usize); 4] =
            [(1, b"a", 5), (2, b"b", 8), (3, b"", 9), (4, b"c", 10)];
        assert_eq!(texts, expected);
        assert_eq!(line_end(b"a\r\nb\n"), "\r\n");
        assert_eq!(line_end(b"\rb\n"), "\r");
        assert_eq!(line_end(b"a"), "\n");
        assert!(ends_inside_a_line(b"a") && !ends_inside_a_line(b"a\r"));
    }

    #[test]
    fn words_are_what_separators_leave() {
        assert_eq!(words(b" ab  c\t", 0..7, is_blank), [1..3, 5..6]);
        assert_eq!(words(b"ab", 0..2, is_blank), vec![0..2]);
        assert_eq!(words(b"ab", 1..1, is_blank), Vec::<Range<usize>>::new());
    }

    #[test]
    fn numbers_that_are_not_finite_have_many_spellings() {
        for word in [
            "nan",
            "-NaN",
            "inf",
            "-Infinity",
            "nan(ind)",
            "-nan(ind)",
            "NAN(0x7fc00000)",
            "1.#QNAN",
            "-1.#IND00",
            "1.#INF",
            "-1.#inf00",
            "+1.#SNAN",
        ] {
            let found = number::<f64>(word.as_bytes());
            assert!(found.is_some_and(|n| !n.is_finite()), "{word}");
            assert_eq!(comment(word.as_bytes()), None, "{word}");
        }
        for word in ["", "1.#", "1.#2", "2.#IND", "nan)", "nan(", "x", "1.#QNA"] {
            assert_eq!(number::<f64>(word.as_bytes()), None, "{word}");
        }
        assert_eq!(number::<f32>(b"0.1"), Some(0.1));
        assert_eq!(comment(b"1.#IND 1.# a # b"), Some(9));
        assert_eq!(comment(b"#1.#IND"), Some(0));
    }

    #[test]
    fn utf_16_shows_by_its_mark_or_its_zeros() {
        let encode = |text: &str, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
            text.encode_utf16().flat_map(bytes).collect()
        };
        for bytes in [u16::to_le_bytes, u16::to_be_bytes] {
            for text in ["\u{feff}", "\u{feff}# \u{4e16}", "v 1\r\n\t\u{e4}"] {
                assert_eq!(utf16(&encode(text, bytes)).as_deref(), Some(text));
            }
            assert_eq!(utf16(&encode("v 1", bytes)), None, "too short to tell");
            assert_eq!(utf16(&encode("\u{1}\u{2}\u{3}\u{4}", bytes)), None);
        }
        for bytes in [&b"v 1 2 3\n"[..], b"", b"\xff", &[0; 64]] {
            assert_eq!(utf16(bytes), None);
        }
        // A header of wide characters before binary content.
        let mut binary = encode(&"solid".repeat(8), u16::to_le_bytes);
        binary.extend([1, 2, 3, 4]);
        assert_eq!(utf16(&binary), None);
    }

    #[test]
    fn edits_apply_in_the_order_of_the_file() {
        let mut edits = Edits::default();
        edits.replace(4..5, "E");
        edits.replace(0..0, "<");
        edits.replace(0..0, '>');
        edits.replace(1..3, "");
        let mut out = Vec::new();
        edits.apply(b"abcdef", &mut out).unwrap();
        assert_eq!(out, b"<>adEf");
    }

    #[test]
    fn excerpts_stay_on_one_line() {
        assert_eq!(excerpt(b"a\x1b[1m\xff"), "a\u{fffd}[1m\u{fffd}");
        assert_eq!(excerpt(&[b'x'; 1000]).chars().count(), 41);
    }
}
