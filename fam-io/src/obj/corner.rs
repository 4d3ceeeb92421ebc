//! The corners of faces and lines.

use std::io::{self, Write};

use crate::text;

/// A corner as written: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
pub(super) struct Corner<'a> {
    parts: [&'a [u8]; 3],
}

impl<'a> Corner<'a> {
    /// The parts of a word; nothing if there are more than three.
    pub fn split(word: &'a [u8]) -> Option<Self> {
        let mut parts: [&[u8]; 3] = [b"", b"", b""];
        for (at, part) in word.split(|&b| b == b'/').enumerate() {
            *parts.get_mut(at)? = part;
        }
        Some(Self { parts })
    }

    /// The three references; `None` for one that is left out, nothing if one is no number.
    pub fn references(&self) -> Option<[Option<i64>; 3]> {
        let mut references = [None; 3];
        for (reference, part) in references.iter_mut().zip(self.parts) {
            if !part.is_empty() {
                *reference = Some(text::parse(part)?);
            }
        }
        Some(references)
    }

    /// Writes the corner with another `vt`, counting from 0, or without any.
    pub fn write_with_uv(&self, uv: Option<u32>, out: &mut Vec<u8>) -> io::Result<()> {
        let [vertex, _, normal] = self.parts;
        out.extend_from_slice(vertex);
        match uv {
            Some(uv) => write!(out, "/{}", u64::from(uv) + 1)?,
            None if !normal.is_empty() => out.push(b'/'),
            None => {}
        }
        if !normal.is_empty() {
            out.push(b'/');
            out.extend_from_slice(normal);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vt_is_replaced_and_the_rest_stays_as_written() {
        let written = |word: &str, uv| {
            let mut out = Vec::new();
            let corner = Corner::split(word.as_bytes()).unwrap();
            corner.write_with_uv(uv, &mut out).unwrap();
            String::from_utf8(out).unwrap()
        };
        for (word, with, without) in [
            ("1", "1/8", "1"),
            ("1/", "1/8", "1"),
            ("-1//", "-1/8", "-1"),
            ("+1/2", "+1/8", "+1"),
            ("1//-3", "1/8/-3", "1//-3"),
            ("1/2/3", "1/8/3", "1//3"),
        ] {
            assert_eq!(written(word, Some(7)), with);
            assert_eq!(written(word, None), without);
        }
        assert_eq!(written("1", Some(u32::MAX)), "1/4294967296");
        assert!(Corner::split(b"1/2/3/4").is_none());
    }
}
