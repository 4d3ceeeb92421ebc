//! Binary files as text.

use std::fmt::Write;

use fam_surface::SurfaceError;

use super::rows::{keyword, rows};
use crate::error::ReadFault;

/// A file as it is, or as text if it is binary.
pub(super) fn as_text(bytes: Vec<u8>) -> Result<Vec<u8>, ReadFault> {
    let Some(first) = rows(&bytes).next() else {
        return Ok(bytes);
    };
    let words = first.words(&bytes);
    match words.as_slice() {
        [word, format] if bytes[format.clone()] == *b"BINARY" => {
            let word = &bytes[word.clone()];
            let (letters, _) = keyword(word, first.line)?;
            let normal = if letters.normals { 3 } else { 0 };
            let color = if letters.colors { 4 } else { 0 };
            let uv = if letters.uvs { 2 } else { 0 };
            let columns = [3 + normal, color + uv];
            let keyword = String::from_utf8_lossy(word);
            let (body, _) = bytes[first.next..].as_chunks();
            text(&keyword, columns, Numbers(body)).map(String::into_bytes)
        }
        _ => Ok(bytes),
    }
}

/// The text of a file with so many columns of coordinates and of other numbers per vertex.
fn text(
    keyword: &str,
    [coordinates, others]: [usize; 2],
    mut numbers: Numbers,
) -> Result<String, ReadFault> {
    let mut count = |of| {
        let count = numbers.count();
        count.ok_or_else(|| ReadFault::Malformed(format!("the number of {of} is missing")))
    };
    let vertices = count("vertices")?;
    let faces = count("faces")?;
    let edges = count("edges")?;
    let mut text = format!("{keyword}\n{vertices} {faces} {edges}\n");
    let mut non_finite = None;
    for index in 0..vertices {
        let missing = || truncated("vertices", vertices, index);
        let row = numbers.take(coordinates).ok_or_else(missing)?;
        let coordinates = row.iter().map(|&number| f32::from_be_bytes(number));
        if !coordinates.clone().take(3).all(f32::is_finite) {
            non_finite.get_or_insert(index as usize);
        }
        for number in coordinates {
            // The digits of the exact value.
            push(&mut text, f64::from(number));
        }
        let others = numbers.take(others).ok_or_else(missing)?;
        end_row(&mut text, others);
    }
    for index in 0..faces {
        let missing = || truncated("faces", faces, index);
        let corners = numbers.count().ok_or_else(missing)?;
        if let Some(index) = non_finite.filter(|_| corners >= 3) {
            return Err(SurfaceError::NonFinitePosition { index }.into());
        }
        push(&mut text, corners);
        for &corner in numbers.take(corners as usize).ok_or_else(missing)? {
            push(&mut text, i32::from_be_bytes(corner));
        }
        let components = numbers.count().ok_or_else(missing)?;
        let color = numbers.take(components as usize).ok_or_else(missing)?;
        end_row(&mut text, color);
    }
    Ok(text)
}

/// Adds a number to a row.
fn push(text: &mut String, number: impl std::fmt::Display) {
    let separator = if text.ends_with('\n') { "" } else { " " };
    // Writing to a string cannot fail.
    let _ = write!(text, "{separator}{number}");
}

/// Ends a row with numbers that keep their point: colours with one go to 1, not to 255.
fn end_row(text: &mut String, numbers: &[[u8; 4]]) {
    for &number in numbers {
        push(text, format_args!("{:?}", f32::from_be_bytes(number)));
    }
    text.push('\n');
}

fn truncated(element: &str, announced: u32, found: u32) -> ReadFault {
    ReadFault::Truncated {
        element: element.to_owned(),
        announced: announced.into(),
        found: found.into(),
    }
}

/// The numbers that are still to be read.
struct Numbers<'a>(&'a [[u8; 4]]);

impl<'a> Numbers<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [[u8; 4]]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn count(&mut self) -> Option<u32> {
        self.take(1).map(|word| u32::from_be_bytes(word[0]))
    }
}
