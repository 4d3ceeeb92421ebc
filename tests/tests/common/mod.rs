//! Runs the `fam` binary as a user would.

#![allow(dead_code)] // Not every test file uses all of it.

use std::path::Path;
use std::process::{Command, Output};

use fam_io::{Document, WriteOptions};
use fam_surface::{Surface, TriangleMesh, UvMap};

/// The binary.
pub const FAM: &str = env!("CARGO_BIN_EXE_fam-under-test");

/// What a run printed, and its exit code.
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("standard output is UTF-8"),
            stderr: String::from_utf8(output.stderr).expect("standard error is UTF-8"),
        }
    }
}

/// Runs `fam` in `folder`.
pub fn fam(folder: &Path, arguments: &[&str]) -> Run {
    let output = Command::new(FAM)
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("fam starts");
    output.into()
}

/// Runs `fam` and asserts that it succeeds.
pub fn succeeds(folder: &Path, arguments: &[&str]) -> Run {
    let run = fam(folder, arguments);
    assert_eq!(run.code, Some(0), "{arguments:?}: {}", run.stderr);
    run
}

/// Asserts that `fam` refuses with exit code 2 and one line that contains all of `words`.
pub fn refuses(folder: &Path, arguments: &[&str], words: &[&str]) {
    let run = fam(folder, arguments);
    assert_eq!(run.code, Some(2), "{arguments:?}: {}", run.stderr);
    let lines: Vec<&str> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("fam: "))
        .collect();
    assert_eq!(lines.len(), 1, "{arguments:?}: {}", run.stderr);
    assert_eq!(run.stderr.lines().last(), Some(lines[0]));
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    for word in words {
        assert!(lines[0].contains(word), "{word} is not in: {}", lines[0]);
    }
}

/// Options of a training that takes a moment, on the CPU.
pub const BRIEF: [&str; 6] = ["--backend", "flex", "--iterations", "3", "--points", "150"];

/// `fam unwrap` with [`BRIEF`] and more.
pub fn brief<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    ["unwrap"]
        .iter()
        .chain(arguments)
        .chain(&BRIEF)
        .copied()
        .collect()
}

/// Writes a mesh with made-up UVs in the format of the extension.
pub fn write_mesh(path: &Path, mesh: &TriangleMesh) {
    let flat = mesh.positions().iter().map(|p| [p[0] as f32, p[1] as f32]);
    let uvs = UvMap::new(flat.collect(), mesh.triangles().to_vec()).unwrap();
    let document = Document::of_surface(Surface::Mesh(mesh.clone()));
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    document
        .write_mesh_uvs(&uvs, path, &WriteOptions::default())
        .unwrap();
}
