//! The body: where its entries and their values are.

use std::ops::Range;

use super::header::{Element, Encoding, Header, Kind, Scalar};
use crate::error::ReadFault;
use crate::text::{self, excerpt, is_blank, lines, syntax};

/// The entries of an element.
#[derive(Debug, Clone)]
pub(super) struct Entries {
    pub starts: Vec<usize>,
    /// From the first entry to where the next element starts.
    pub range: Range<usize>,
}

/// What is wrong with an entry.
enum Bad {
    /// It ends after so many of its properties.
    Short(usize),
    /// This is no length of a list.
    Length(Range<usize>),
}

/// Finds the entries of all elements; those of an element without properties take no place.
pub(super) fn locate(bytes: &[u8], header: &Header) -> Result<Vec<Entries>, ReadFault> {
    match header.encoding {
        Encoding::Ascii => locate_lines(bytes, header),
        _ => locate_binary(bytes, header),
    }
}

fn locate_lines(bytes: &[u8], header: &Header) -> Result<Vec<Entries>, ReadFault> {
    let mut lines = lines(bytes)
        .skip_while(|line| line.text.start < header.end)
        .filter(|line| !bytes[line.text.clone()].iter().all(|&b| is_blank(b)));
    let mut end = header.end;
    let mut cells = Vec::new();
    let mut all = Vec::new();
    for element in &header.elements {
        let mut starts = Vec::new();
        let mut range = end..end;
        while entries_left(element, &starts) {
            let Some(line) = lines.next() else {
                return Err(truncated(element, starts.len()));
            };
            let start = line.text.start;
            cut(bytes, header.encoding, element, start, &mut cells).map_err(|bad| {
                let problem = match bad {
                    Bad::Short(found) => {
                        let (name, wanted) = (element.title(), element.properties.len());
                        format!("an entry of `{name}` has only {found} of its {wanted} properties")
                    }
                    Bad::Length(word) => {
                        format!("`{}` is not the length of a list", excerpt(&bytes[word]))
                    }
                };
                syntax(line.number, problem)
            })?;
            if starts.is_empty() {
                range.start = start;
            }
            starts.push(start);
            range.end = line.next;
        }
        end = range.end;
        all.push(Entries { starts, range });
    }
    Ok(all)
}

fn locate_binary(bytes: &[u8], header: &Header) -> Result<Vec<Entries>, ReadFault> {
    let mut at = header.end;
    let mut cells = Vec::new();
    let mut all = Vec::new();
    for element in &header.elements {
        let mut starts = Vec::new();
        let first = at;
        while entries_left(element, &starts) {
            let end = cut(bytes, header.encoding, element, at, &mut cells);
            let end = end.map_err(|bad| match bad {
                Bad::Short(_) => truncated(element, starts.len()),
                Bad::Length(_) => {
                    let (number, name) = (starts.len() + 1, element.title());
                    let problem =
                        format!("entry {number} of `{name}` has a list of negative length");
                    ReadFault::Malformed(problem)
                }
            })?;
            starts.push(at);
            at = end;
        }
        let range = first..at;
        all.push(Entries { starts, range });
    }
    Ok(all)
}

fn entries_left(element: &Element, found: &[usize]) -> bool {
    !element.properties.is_empty() && (found.len() as u64) < element.count
}

fn truncated(element: &Element, found: usize) -> ReadFault {
    ReadFault::Truncated {
        element: element.title(),
        announced: element.count,
        found: found as u64,
    }
}

/// Cuts the entry at `start` into its properties and returns where it ends.
fn cut(
    bytes: &[u8],
    encoding: Encoding,
    element: &Element,
    start: usize,
    cells: &mut Vec<Range<usize>>,
) -> Result<usize, Bad> {
    cells.clear();
    let mut at = start;
    for property in &element.properties {
        let short = Bad::Short(cells.len());
        let cell = match encoding {
            Encoding::Ascii => cut_words(bytes, property.kind, at, short)?,
            _ => cut_bytes(bytes, encoding, property.kind, at, short)?,
        };
        at = cell.end;
        cells.push(cell);
    }
    Ok(at)
}

fn cut_words(bytes: &[u8], kind: Kind, at: usize, short: Bad) -> Result<Range<usize>, Bad> {
    let Some(first) = next_word(bytes, at) else {
        return Err(short);
    };
    let mut cell = first.clone();
    if let Kind::List { .. } = kind {
        let length: Option<u64> = text::parse(&bytes[first.clone()]);
        for _ in 0..length.ok_or(Bad::Length(first))? {
            match next_word(bytes, cell.end) {
                Some(word) => cell.end = word.end,
                None => return Err(short),
            }
        }
    }
    Ok(cell)
}

fn cut_bytes(
    bytes: &[u8],
    encoding: Encoding,
    kind: Kind,
    at: usize,
    short: Bad,
) -> Result<Range<usize>, Bad> {
    let size = match kind {
        Kind::Scalar(scalar) => scalar.size(),
        Kind::List { length, item } => {
            let Some(bytes) = bytes.get(at..at + length.size()) else {
                return Err(short);
            };
            let announced = binary(bytes, length, encoding);
            if announced < 0.0 {
                return Err(Bad::Length(at..at + length.size()));
            }
            length.size() + announced as usize * item.size()
        }
    };
    if size > bytes.len() - at {
        return Err(short);
    }
    Ok(at..at + size)
}

/// The next word on the line.
fn next_word(bytes: &[u8], at: usize) -> Option<Range<usize>> {
    let is_end = |b: &u8| matches!(b, b'\n' | b'\r');
    let start = at
        + bytes[at..]
            .iter()
            .position(|b| !is_blank(*b) || is_end(b))?;
    if is_end(&bytes[start]) {
        return None;
    }
    let length = bytes[start..].iter().position(|b| is_blank(*b));
    Some(start..length.map_or(bytes.len(), |length| start + length))
}

/// A binary number; the bytes are as many as it has.
fn binary(bytes: &[u8], scalar: Scalar, encoding: Encoding) -> f64 {
    let mut eight = [0; 8];
    for (place, byte) in eight.iter_mut().zip(bytes) {
        *place = *byte;
    }
    if encoding == Encoding::BigEndian {
        eight[..bytes.len()].reverse();
    }
    let [a, b, c, d, ..] = eight;
    match scalar {
        Scalar::Int8 => i8::from_le_bytes([a]).into(),
        Scalar::UInt8 => a.into(),
        Scalar::Int16 => i16::from_le_bytes([a, b]).into(),
        Scalar::UInt16 => u16::from_le_bytes([a, b]).into(),
        Scalar::Int32 => i32::from_le_bytes([a, b, c, d]).into(),
        Scalar::UInt32 => u32::from_le_bytes([a, b, c, d]).into(),
        Scalar::Float32 => f32::from_le_bytes([a, b, c, d]).into(),
        Scalar::Float64 => f64::from_le_bytes(eight),
    }
}

/// An element with its entries, for reading them.
#[derive(Clone, Copy)]
pub(super) struct Table<'a> {
    pub bytes: &'a [u8],
    pub encoding: Encoding,
    pub element: &'a Element,
    pub entries: &'a Entries,
}

impl<'a> Table<'a> {
    /// Cuts the entry at `start` into its properties.
    pub fn cells(&self, start: usize, cells: &mut Vec<Range<usize>>) {
        let whole = cut(self.bytes, self.encoding, self.element, start, cells);
        debug_assert!(whole.is_ok(), "entries are cut where they were found");
    }

    /// The numbers of a scalar or of the items of a list; `None` for a word that is none.
    pub fn numbers(
        &self,
        kind: Kind,
        cell: Range<usize>,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        let Self {
            bytes, encoding, ..
        } = *self;
        let (mut at, scalar) = match (kind, encoding) {
            (Kind::Scalar(scalar), _) => (cell.start, scalar),
            (Kind::List { item, .. }, Encoding::Ascii) => {
                let length = next_word(bytes, cell.start);
                (length.map_or(cell.end, |length| length.end), item)
            }
            (Kind::List { length, item }, _) => (cell.start + length.size(), item),
        };
        std::iter::from_fn(move || {
            if at >= cell.end {
                return None;
            }
            if encoding == Encoding::Ascii {
                let word = next_word(bytes, at)?;
                at = word.end;
                return Some(text::number(&bytes[word]));
            }
            let number = &bytes[at..at + scalar.size()];
            at += scalar.size();
            Some(Some(binary(number, scalar, encoding)))
        })
    }

    /// Whether the words of all of these scalars of an entry are numbers.
    pub fn has_numbers<const N: usize>(&self, entry: usize, columns: [(usize, Scalar); N]) -> bool {
        let mut cells = Vec::new();
        self.cells(self.entries.starts[entry], &mut cells);
        columns.iter().all(|&(column, scalar)| {
            let number = self.numbers(Kind::Scalar(scalar), cells[column].clone());
            number.flatten().next().is_some()
        })
    }

    /// The scalars of every entry; NaN for a word that is no number.
    pub fn columns<const N: usize>(&self, columns: [(usize, Scalar); N]) -> Vec<[f64; N]> {
        let mut cells = Vec::new();
        let row = |&start: &usize| {
            self.cells(start, &mut cells);
            columns.map(|(column, scalar)| {
                let cell = cells[column].clone();
                let number = self.numbers(Kind::Scalar(scalar), cell).next();
                number.flatten().unwrap_or(f64::NAN)
            })
        };
        self.entries.starts.iter().map(row).collect()
    }
}
