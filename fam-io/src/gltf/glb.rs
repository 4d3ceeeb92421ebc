//! The container of binary glTF: a header, a chunk of JSON, and a chunk of bytes.

use std::io::{self, Write};

use crate::error::ReadFault;

pub(super) const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BIN: &[u8; 4] = b"BIN\0";
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// The JSON and, if there is one, the binary chunk; chunks of other types are skipped, and so
/// is what follows the announced length.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ReadFault> {
    let version = number(bytes, 4).ok_or_else(|| malformed("the GLB header is cut off"))?;
    if version != 2 {
        return Err(ReadFault::Unsupported(format!("glTF {version} is")));
    }
    let length = number(bytes, 8).ok_or_else(|| malformed("the GLB header is cut off"))?;
    let file = bytes.get(..length as usize).ok_or_else(|| {
        malformed(format!(
            "the GLB header announces {length} bytes, but there are only {}",
            bytes.len()
        ))
    })?;
    let mut rest = file.get(HEADER..).unwrap_or_default();
    let (mut json, mut bin) = (None, None);
    while !rest.is_empty() {
        let Chunk {
            kind,
            content,
            next,
        } = chunk(rest)?;
        match kind {
            JSON if json.is_none() => json = Some(content),
            BIN if json.is_some() && bin.is_none() => bin = Some(content),
            _ if json.is_none() => break,
            _ => {}
        }
        rest = next;
    }
    let json = json.ok_or_else(|| malformed("the first chunk of the GLB is not JSON"))?;
    Ok((json, bin))
}

struct Chunk<'a> {
    kind: &'a [u8; 4],
    content: &'a [u8],
    /// What follows it.
    next: &'a [u8],
}

fn chunk(bytes: &[u8]) -> Result<Chunk<'_>, ReadFault> {
    let header = number(bytes, 0).zip(bytes.get(4..).and_then(|kind| kind.first_chunk()));
    let (length, kind) = header.ok_or_else(|| malformed("a chunk of the GLB is cut off"))?;
    let (content, next) = bytes[CHUNK_HEADER..]
        .split_at_checked(length as usize)
        .ok_or_else(|| {
            malformed(format!(
                "a chunk of the GLB announces {length} bytes, but there are only {}",
                bytes.len() - CHUNK_HEADER
            ))
        })?;
    Ok(Chunk {
        kind,
        content,
        next,
    })
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    bytes
        .get(at..)?
        .first_chunk()
        .copied()
        .map(u32::from_le_bytes)
}

fn malformed(problem: impl Into<String>) -> ReadFault {
    ReadFault::Malformed(problem.into())
}

/// Writes the container; without bytes there is no binary chunk.
pub(super) fn write(json: &[u8], bin: &[u8], out: &mut dyn Write) -> io::Result<()> {
    let chunks = [(JSON, json, b' '), (BIN, bin, 0)];
    let chunks = &chunks[..if bin.is_empty() { 1 } else { 2 }];
    let padded = |content: &[u8]| content.len().next_multiple_of(4);
    let length = |content: &[u8]| CHUNK_HEADER + padded(content);
    let total = HEADER
        + chunks
            .iter()
            .map(|(_, content, _)| length(content))
            .sum::<usize>();
    let total = u32::try_from(total)
        .map_err(|_| io::Error::other("the document does not fit into the 4 GiB of a GLB"))?;
    out.write_all(MAGIC)?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&total.to_le_bytes())?;
    for &(kind, content, padding) in chunks {
        // The chunk is shorter than the whole, whose length fits.
        out.write_all(&(padded(content) as u32).to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(content)?;
        out.write_all(&[padding; 3][..padded(content) - content.len()])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(json: &[u8], bin: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(json, bin, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn chunks_are_padded() {
        let bytes = written(b"{ }  ", &[1, 2, 3, 4, 5, 6]);
        let expected = b"glTF\x02\0\0\0\x2c\0\0\0\x08\0\0\0JSON{ }     \x08\0\0\0BIN\0\x01\x02\x03\x04\x05\x06\0\0";
        assert_eq!(bytes, expected);
        let (json, bin) = split(&bytes).unwrap();
        assert_eq!(json, b"{ }     ");
        assert_eq!(bin, Some(&[1, 2, 3, 4, 5, 6, 0, 0][..]));
        assert_eq!(written(b"{}  ", b"").len(), 24);
        assert_eq!(split(&written(b"{}  ", b"")).unwrap(), (&b"{}  "[..], None));
    }

    #[test]
    fn further_chunks_and_what_follows_are_skipped() {
        let mut bytes = written(b"{}  ", &[7; 4]);
        bytes.extend(b"\x04\0\0\0DATA....");
        bytes[8] += 12;
        bytes.extend(b"rest");
        assert_eq!(split(&bytes).unwrap(), (&b"{}  "[..], Some(&[7; 4][..])));
    }

    #[test]
    fn wrong_lengths_are_faults() {
        let whole = written(b"{}  ", &[7; 4]);
        let damaged = |at: usize, byte: u8| {
            let mut bytes = whole.clone();
            bytes[at] = byte;
            split(&bytes).unwrap_err().to_string()
        };
        let cases = [
            (damaged(4, 1), "glTF 1 is not supported"),
            (
                damaged(8, 99),
                "the GLB header announces 99 bytes, but there are only 36",
            ),
            (damaged(8, 3), "the first chunk of the GLB is not JSON"),
            (damaged(8, 30), "a chunk of the GLB is cut off"),
            (
                damaged(12, 17),
                "a chunk of the GLB announces 17 bytes, but there are only 16",
            ),
            (damaged(16, b'X'), "the first chunk of the GLB is not JSON"),
        ];
        for (message, expected) in cases {
            assert_eq!(message, expected);
        }
        for length in 4..12 {
            let fault = split(&whole[..length]).unwrap_err();
            assert_eq!(fault.to_string(), "the GLB header is cut off");
        }
    }
}
