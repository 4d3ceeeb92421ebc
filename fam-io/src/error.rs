use std::io;
use std::path::{Path, PathBuf};

use fam_surface::SurfaceError;

use crate::format::Format;
use crate::text::excerpt;

/// A file that could not be read as a surface; displayed as one line, `file: reason`.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: ReadFault,
}

/// What is wrong with a file that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadFault {
    /// The operating system refused.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The extension is not one of a known format.
    #[error(
        "{0} is not a known format; \
         the known ones are .glb, .gltf, .obj, .off, .ply, .stl and .xyz"
    )]
    UnknownFormat(String),
    /// The content does not follow the rules of its format.
    #[error("line {line}: {problem}")]
    Syntax {
        /// The line, counting from 1.
        line: usize,
        /// What is wrong there.
        problem: String,
    },
    /// A face refers to a vertex that does not exist.
    #[error("face {face} refers to vertex {index}, but there are only {count}{numbering}")]
    VertexOutOfRange {
        /// The face, counting from 1 in the order of the file.
        face: usize,
        /// The vertex as the file writes it.
        index: i64,
        /// How many vertices there are.
        count: usize,
        /// A hint on how the format counts, to end the sentence with.
        numbering: &'static str,
    },
    /// The header announces more than the file holds.
    #[error("it announces {announced} entries of `{element}`, but holds only {found}")]
    Truncated {
        /// What there should be more of.
        element: String,
        /// The announced number.
        announced: u64,
        /// The number there is (or, in a file of fixed sizes, that there can be at most).
        found: u64,
    },
    /// A text in UTF-16, whatever its format.
    #[error("text in UTF-16 is not supported; save it as UTF-8")]
    Utf16,
    /// A part of the format that is not read.
    #[error("{0} not supported")]
    Unsupported(String),
    /// A file that the parser of its format rejects, or that lacks what a surface needs.
    #[error("{0}")]
    Malformed(String),
    /// The parts do not make a surface.
    #[error("{0}")]
    Surface(#[from] SurfaceError),
}

/// A file that could not be written; displayed as one line, `file: reason`.
/// Whatever was at its path before is still there.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// Why it was not written.
    pub fault: WriteFault,
}

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteFault {
    /// The operating system refused.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The format cannot hold UVs.
    #[error("{0} has no place for UVs")]
    NoPlaceForUvs(Format),
    /// The format cannot hold this surface.
    #[error("{format} has no place for {surface}")]
    NoPlaceForSurface {
        /// The format of the output.
        format: Format,
        /// What the surface is.
        surface: &'static str,
    },
    /// The UVs of a mesh for a point cloud, or the other way round.
    #[error("the surface is {surface}, but the UVs are for {uvs}")]
    OtherKind {
        /// What the surface is.
        surface: &'static str,
        /// What the UVs are for.
        uvs: &'static str,
    },
    /// There are too many UVs or too few.
    #[error("{expected} {of} need as many UVs, found {found}")]
    CountMismatch {
        /// What has UVs: triangles or points.
        of: &'static str,
        /// How many of them there are.
        expected: usize,
        /// How many UVs were given.
        found: usize,
    },
    /// A UV is NaN or infinite.
    #[error("the UV of point {0} is not a finite number")]
    NonFiniteUv(usize),
    /// A seam refers to a vertex that does not exist.
    #[error("a seam refers to vertex {index}, but there are only {count}")]
    SeamOutOfRange {
        /// The zero-based vertex.
        index: u32,
        /// How many vertices there are.
        count: usize,
    },
}

/// Why the vertices have no numbers of some name; displayed as one line.
#[derive(Debug, thiserror::Error)]
pub enum AttributeError {
    /// The file could not be read again.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// There are no such numbers.
    #[error("the vertices have no attribute `{}`; they have {}", excerpt(name.as_bytes()), listed(known))]
    Missing {
        /// The name that was asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// A number is NaN or infinite, or a word in its place is no number.
    #[error("the attribute `{}` of vertex {vertex} is not a finite number", excerpt(name.as_bytes()))]
    NonFinite {
        /// The name that was asked for.
        name: String,
        /// The zero-based vertex of the surface.
        vertex: usize,
    },
}

/// No material and no object has some name; displayed as one line.
#[derive(Debug, thiserror::Error)]
#[error("there is no material or object `{}`; there are {}", excerpt(name.as_bytes()), listed(known))]
pub struct NameError {
    /// The name that was asked for.
    pub name: String,
    /// The names there are.
    pub known: Vec<String>,
}

/// The first of some names, for a message.
fn listed(names: &[String]) -> String {
    /// More make no message of one line.
    const MOST: usize = 8;
    if names.is_empty() {
        return "none".to_owned();
    }
    let shown = names.iter().take(MOST);
    let shown: Vec<_> = shown.map(|name| excerpt(name.as_bytes())).collect();
    let more = if names.len() > MOST { ", …" } else { "" };
    format!("{}{more}", shown.join(", "))
}

impl WriteFault {
    pub(crate) fn at(self, path: &Path) -> WriteError {
        WriteError {
            path: path.to_owned(),
            fault: self,
        }
    }
}
