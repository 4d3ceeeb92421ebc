use std::path::PathBuf;
use std::{fs, io};

/// Where a file's content is.
#[derive(Debug, Clone)]
pub(crate) enum Content {
    /// In a file that can be read again when it is written; not a pipe.
    File(PathBuf),
    /// In memory.
    Bytes(Vec<u8>),
}

impl Content {
    /// All of it in memory.
    pub fn bytes(self) -> io::Result<Vec<u8>> {
        match self {
            Self::File(path) => fs::read(path),
            Self::Bytes(bytes) => Ok(bytes),
        }
    }
}
