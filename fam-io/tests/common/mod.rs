//! Files in a folder of their own.

use std::fs;
use std::path::PathBuf;

use fam_io::{Document, read_surface};
use tempfile::TempDir;

/// A folder that is removed at the end of a test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, content).unwrap();
        path
    }

    pub fn read(&self, name: &str, content: impl AsRef<[u8]>) -> Document {
        read_surface(self.file(name, content)).unwrap()
    }
}
