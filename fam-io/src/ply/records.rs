//! A binary cloud, a number of points at a time.

use std::io::{self, Read, Write};

use fam_surface::polygons::Polygons;

use super::body::Entries;
use super::header::{Element, Encoding, Header, Kind, Scalar};
use super::source::{Faces, Source};
use super::write::{Changes, Vertices};
use crate::error::ReadFault;
use crate::kept::Kept;

/// Longest header that is looked for.
const LONGEST_HEADER: u64 = 1 << 20;

/// A binary file that has nothing but points of one size.
#[derive(Debug, Clone)]
pub(crate) struct Records {
    /// The header alone.
    head: Source,
    xyz: [(usize, Scalar); 3],
    /// Bytes of a point.
    size: usize,
    /// Points.
    pub count: u64,
}

/// Points that follow one another.
pub(crate) struct Block(Source);

impl Records {
    /// None if the file is not of that kind.
    ///
    /// # Errors
    /// A header that is not one of PLY, or more points announced than a file of `length` bytes has.
    pub fn open(file: &mut impl Read, length: u64) -> Result<Option<Self>, ReadFault> {
        let mut bytes = Vec::new();
        file.take(LONGEST_HEADER).read_to_end(&mut bytes)?;
        let header = match Header::parse(&bytes) {
            Err(_) if bytes.len() as u64 == LONGEST_HEADER => return Ok(None),
            header => header?,
        };
        if header.end as u64 == LONGEST_HEADER {
            // There may be more of its last line.
            return Ok(None);
        }
        bytes.truncate(header.end);
        let Some(vertices) = header.element("vertex") else {
            return Ok(None);
        };
        let element = &header.elements[vertices];
        let others = header.elements.iter().enumerate();
        let alone = others
            .filter(|(i, _)| *i != vertices)
            .all(|(_, other)| other.count == 0);
        let size = size(element);
        let xyz = element.scalars(["x", "y", "z"]);
        let (Some(size), Some(xyz), true) = (size, xyz, alone) else {
            return Ok(None);
        };
        if header.encoding == Encoding::Ascii || element.count == 0 {
            return Ok(None);
        }
        let found = length.saturating_sub(header.end as u64) / size as u64;
        if found < element.count {
            return Err(ReadFault::Truncated {
                element: element.title(),
                announced: element.count,
                found,
            });
        }
        Ok(Some(Self {
            xyz,
            size,
            count: element.count,
            head: source(header, vertices, bytes),
        }))
    }

    /// Bytes before the first point.
    pub fn start(&self) -> u64 {
        self.head.header.end as u64
    }

    /// Reads the next points.
    pub fn read(&self, count: usize, file: &mut impl Read) -> io::Result<Block> {
        let mut bytes = vec![0; count * self.size];
        file.read_exact(&mut bytes)?;
        let mut header = self.head.header.clone();
        header.end = 0;
        let mut block = source(header, self.head.vertices, bytes);
        block.entries[block.vertices] = Entries {
            starts: (0..count).map(|point| point * self.size).collect(),
            range: 0..block.bytes.len(),
        };
        Ok(Block(block))
    }

    /// Where the points of a block are; some may not be finite.
    pub fn positions(&self, block: &Block) -> Vec<[f64; 3]> {
        block.0.table(block.0.vertices).columns(self.xyz)
    }

    /// The header with the properties of the UVs.
    pub fn write_header(&self, out: &mut dyn Write) -> io::Result<()> {
        let changes = Changes {
            vertices: Some(Vertices {
                uvs: Vec::new(),
                added: Vec::new(),
            }),
            faces: None,
        };
        let edits = self.head.header_edits(&changes);
        edits.apply(&self.head.bytes, out)
    }
}

impl Block {
    /// The points with their UVs.
    pub fn write(&self, uvs: Vec<[f32; 2]>, out: &mut dyn Write) -> io::Result<()> {
        let added = Vec::new();
        self.0.write_points(&Vertices { uvs, added }, out)
    }
}

/// A file of no entries.
fn source(header: Header, vertices: usize, bytes: Vec<u8>) -> Source {
    let none = |_: &Element| Entries {
        starts: Vec::new(),
        range: header.end..header.end,
    };
    Source {
        entries: header.elements.iter().map(none).collect(),
        bytes,
        header,
        vertices,
        faces: Faces::None,
        polygons: Polygons::default(),
        kept: Kept::default(),
    }
}

/// The bytes of an entry, if all have the same.
fn size(element: &Element) -> Option<usize> {
    let sizes = element
        .properties
        .iter()
        .map(|property| match property.kind {
            Kind::Scalar(scalar) => Some(scalar.size()),
            Kind::List { .. } => None,
        });
    sizes.sum()
}
