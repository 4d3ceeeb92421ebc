//! The header: what is in the body, and where the header's own words are.

use std::ops::Range;

use crate::error::ReadFault;
use crate::text::{self, excerpt, is_blank, line_end, lines, syntax, words};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scalar {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Float32,
    Float64,
}

impl Scalar {
    fn of_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::Int8,
            b"uchar" | b"uint8" => Self::UInt8,
            b"short" | b"int16" => Self::Int16,
            b"ushort" | b"uint16" => Self::UInt16,
            b"int" | b"int32" => Self::Int32,
            b"uint" | b"uint32" => Self::UInt32,
            b"float" | b"float32" => Self::Float32,
            b"double" | b"float64" => Self::Float64,
            _ => return None,
        })
    }

    /// The bytes it takes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::Int8 | Self::UInt8 => 1,
            Self::Int16 | Self::UInt16 => 2,
            Self::Int32 | Self::UInt32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }

    pub fn is_float(self) -> bool {
        matches!(self, Self::Float32 | Self::Float64)
    }

    /// How many of the integers from zero on it tells apart.
    pub fn integers(self) -> u64 {
        match self {
            Self::Int8 => 1 << 7,
            Self::UInt8 => 1 << 8,
            Self::Int16 => 1 << 15,
            Self::UInt16 => 1 << 16,
            Self::Int32 => 1 << 31,
            Self::UInt32 => 1 << 32,
            Self::Float32 => 1 << 24,
            Self::Float64 => 1 << 53,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { length: Scalar, item: Scalar },
}

#[derive(Debug, Clone)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
    /// Its line with the line end.
    pub line: Range<usize>,
    /// The word that is the type of the scalar or of the list's items.
    pub type_word: Range<usize>,
}

#[derive(Debug, Clone)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// Its line with the line end, without those of its properties.
    pub line: Range<usize>,
    pub count_word: Range<usize>,
}

impl Element {
    /// The name for an error message.
    pub fn title(&self) -> String {
        excerpt(self.name.as_bytes())
    }

    /// The first property of this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name)
    }

    /// The first properties of these names, if they are scalars and all there.
    pub fn scalars<const N: usize>(&self, names: [&str; N]) -> Option<[(usize, Scalar); N]> {
        let mut columns = [(0, Scalar::Float32); N];
        for (column, name) in columns.iter_mut().zip(names) {
            let at = self.column(name)?;
            let Kind::Scalar(scalar) = self.properties[at].kind else {
                return None;
            };
            *column = (at, scalar);
        }
        Some(columns)
    }

    /// Where the line of one more property belongs.
    pub fn end(&self) -> usize {
        self.properties.last().map_or(self.line.end, |p| p.line.end)
    }
}

#[derive(Debug, Clone)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the body starts.
    pub end: usize,
}

impl Header {
    /// The first element of this name.
    pub fn element(&self, name: &str) -> Option<usize> {
        self.elements.iter().position(|e| e.name == name)
    }

    pub fn parse(bytes: &[u8]) -> Result<Self, ReadFault> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut magic = false;
        for line in lines(bytes) {
            let words = words(bytes, line.text.clone(), is_blank);
            let texts: Vec<&[u8]> = words.iter().map(|word| &bytes[word.clone()]).collect();
            let bad = |what: &str| {
                let text = excerpt(bytes[line.text.clone()].trim_ascii());
                syntax(line.number, format!("`{text}` is not {what}"))
            };
            if !std::mem::replace(&mut magic, true) {
                if texts != [b"ply"] {
                    return Err(bad("the first line of a PLY file"));
                }
                continue;
            }
            let whole = line.text.start..line.next;
            match texts.as_slice() {
                [] | [b"comment" | b"obj_info", ..] => {}
                [b"format", name, _] => {
                    encoding = Some(encoding_of(name).ok_or_else(|| bad("a format of PLY"))?)
                }
                [b"element", name, count] => elements.push(Element {
                    name: String::from_utf8_lossy(name).into_owned(),
                    count: text::parse(count).ok_or_else(|| bad("an element with its number"))?,
                    properties: Vec::new(),
                    line: whole,
                    count_word: words[2].clone(),
                }),
                [b"property", ..] => {
                    let property = property(bytes, &words, whole)
                        .ok_or_else(|| bad("a property of a known type"))?;
                    let element = elements.last_mut();
                    let element = element.ok_or_else(|| bad("possible before an element"))?;
                    element.properties.push(property);
                }
                [b"end_header"] => {
                    // After `\r`, a `\n` may be the first byte of a binary body.
                    let lone = line_end(bytes) == "\r";
                    let end = if lone {
                        line.next.min(line.text.end + 1)
                    } else {
                        line.next
                    };
                    return Ok(Self {
                        encoding: encoding.ok_or_else(|| bad("possible before the format"))?,
                        elements,
                        end,
                    });
                }
                _ => return Err(bad("a line of a PLY header")),
            }
        }
        Err(ReadFault::Malformed(
            "the header ends without end_header".to_owned(),
        ))
    }
}

fn encoding_of(name: &[u8]) -> Option<Encoding> {
    match name {
        b"ascii" => Some(Encoding::Ascii),
        b"binary_little_endian" => Some(Encoding::LittleEndian),
        b"binary_big_endian" => Some(Encoding::BigEndian),
        _ => None,
    }
}

/// A property; its name may have blanks.
fn property(bytes: &[u8], words: &[Range<usize>], line: Range<usize>) -> Option<Property> {
    let scalar = |at: usize| Scalar::of_name(&bytes[words.get(at)?.clone()]);
    let (kind, name) = if &bytes[words.get(1)?.clone()] == b"list" {
        let (length, item) = (scalar(2)?, scalar(3)?);
        if length.is_float() {
            return None;
        }
        (Kind::List { length, item }, 4)
    } else {
        (Kind::Scalar(scalar(1)?), 2)
    };
    let range = words.get(name)?.start..words.last()?.end;
    Some(Property {
        name: String::from_utf8_lossy(&bytes[range]).into_owned(),
        kind,
        line,
        type_word: words[name - 1].clone(),
    })
}
