//! Writing an OBJ file again, statement by statement, with new UVs.

use std::io::{self, BufRead, Write};

use fam_surface::UvMap;
use fam_surface::polygons::{Divisions, Piece, Pieces};

use crate::text;

use super::corner::Corner;
use super::statements::{Fingerprint, Statement, Statements};

/// The file is not the one that was read.
pub(super) fn changed() -> io::Error {
    io::Error::other("the file changed since it was read")
}

/// Writes a mesh; returns what the file was like.
pub(super) fn mesh(
    input: impl BufRead,
    uvs: &UvMap,
    divisions: &Divisions,
    out: &mut dyn Write,
) -> io::Result<Fingerprint> {
    let mut statements = Statements::new(input);
    let mut line_end = None;
    let mut pieces = Pieces::of(uvs);
    let mut face = 0;
    let mut buffer = Vec::new();
    while let Some(statement) = statements.next()? {
        let line_end = *line_end.get_or_insert_with(|| text::line_end(statement.bytes));
        out.write_all(statement.mark)?;
        match statement.keyword() {
            b"vt" => {}
            b"f" | b"fo" if statement.arguments().len() >= 3 => {
                if face == 0 {
                    write_uvs(uvs.uvs(), line_end, out)?;
                }
                let division = divisions.of(face, statement.arguments().len());
                face += 1;
                if division.count() > pieces.remaining() {
                    return Err(changed());
                }
                buffer.clear();
                push_face(&statement, &pieces.next(division), line_end, &mut buffer)?;
                out.write_all(&buffer)?;
            }
            _ => write_other(&statement, &mut buffer, out)?,
        }
    }
    Ok(statements.fingerprint())
}

/// Writes a cloud; returns what the file was like.
pub(super) fn points(
    input: impl BufRead,
    uvs: &[[f32; 2]],
    out: &mut dyn Write,
) -> io::Result<Fingerprint> {
    let mut statements = Statements::new(input);
    let mut line_end = None;
    // What it takes to start a statement.
    let mut missing_ends = 0;
    let mut buffer = Vec::new();
    while let Some(statement) = statements.next()? {
        line_end.get_or_insert_with(|| text::line_end(statement.bytes));
        out.write_all(statement.mark)?;
        if statement.keyword() != b"vt" {
            missing_ends = usize::from(text::ends_inside_a_line(statement.bytes))
                + usize::from(statement.open);
            write_other(&statement, &mut buffer, out)?;
        }
    }
    let line_end = line_end.unwrap_or("\n");
    out.write_all(line_end.repeat(missing_ends).as_bytes())?;
    write_uvs(uvs, line_end, out)?;
    Ok(statements.fingerprint())
}

fn write_uvs(uvs: &[[f32; 2]], line_end: &str, out: &mut dyn Write) -> io::Result<()> {
    uvs.iter()
        .try_for_each(|[u, v]| write!(out, "vt {u} {v}{line_end}"))
}

/// Writes a statement that gets no UVs.
fn write_other(statement: &Statement, buffer: &mut Vec<u8>, out: &mut dyn Write) -> io::Result<()> {
    if !matches!(statement.keyword(), b"f" | b"fo" | b"l" | b"surf") {
        return out.write_all(statement.bytes);
    }
    buffer.clear();
    let mut at = 0;
    for word in statement.arguments() {
        if let Some(corner) = Corner::split(&statement.bytes[word.clone()]) {
            buffer.extend_from_slice(&statement.bytes[at..word.start]);
            corner.write_with_uv(None, buffer)?;
            at = word.end;
        }
    }
    buffer.extend_from_slice(&statement.bytes[at..]);
    out.write_all(buffer)
}

/// Appends a face: its corners where they were, or one face for each of several pieces.
fn push_face(
    statement: &Statement,
    pieces: &[Piece],
    line_end: &str,
    buffer: &mut Vec<u8>,
) -> io::Result<()> {
    let (bytes, words) = (statement.bytes, statement.arguments());
    let push = |buffer: &mut Vec<u8>, corner: usize, uv| {
        let corner = Corner::split(&bytes[words[corner].clone()]).ok_or_else(changed)?;
        corner.write_with_uv(Some(uv), buffer)
    };
    let mut at = 0;
    if let [whole] = pieces {
        for &(corner, uv) in whole {
            buffer.extend_from_slice(&bytes[at..words[corner].start]);
            push(buffer, corner, uv)?;
            at = words[corner].end;
        }
    } else {
        buffer.extend_from_slice(&bytes[..words[0].start]);
        for (number, piece) in pieces.iter().enumerate() {
            if number > 0 {
                write!(buffer, "{line_end}f")?;
            }
            for (place, &(corner, uv)) in piece.iter().enumerate() {
                if number + place > 0 {
                    buffer.push(b' ');
                }
                push(buffer, corner, uv)?;
            }
        }
        at = words[words.len() - 1].end;
    }
    buffer.extend_from_slice(&bytes[at..]);
    Ok(())
}
