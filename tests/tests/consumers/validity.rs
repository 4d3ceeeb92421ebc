//! The Khronos validator has nothing against what is written that it did not have against the
//! input.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use fam_core::surface::Surface;
use fam_io::{Format, Uvs, WriteOptions};

use crate::gltf::write_documents;
use crate::installed::{Consumers, Message};
use crate::surfaces::{documents, per_corner, per_vertex, write};

/// Files that are written of a document: names to tell them apart, and how they are written.
fn variants(surface: &Surface) -> Vec<(&'static str, WriteOptions)> {
    let seam_lines = match surface {
        Surface::Mesh(mesh) => mesh.triangles().iter().map(|t| [t[0], t[1]]).collect(),
        Surface::PointCloud(_) => Vec::new(),
    };
    let options = |uv_set, checker, seam_lines: &[_]| WriteOptions {
        uv_set,
        checker,
        seam_lines: seam_lines.to_vec(),
    };
    vec![
        ("plain.glb", options(0, false, &[])),
        ("plain.gltf", options(0, false, &[])),
        ("set-1.glb", options(1, false, &[])),
        ("set-3.glb", options(3, false, &[])),
        ("checker.glb", options(0, true, &[])),
        ("seams.glb", options(0, false, &seam_lines)),
        ("all.gltf", options(1, true, &seam_lines)),
    ]
}

/// How often each error and warning is there.
fn complaints(messages: &[Message]) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for message in messages.iter().filter(|m| m.is_error_or_warning()) {
        *counts.entry(message.code.as_str()).or_default() += 1;
    }
    counts
}

#[test]
fn conversions_are_valid() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<PathBuf> = Vec::new();
    for (name, document) in documents() {
        for (layout, uvs) in [
            ("whole", per_vertex(document.surface())),
            ("torn", per_corner(document.surface())),
        ] {
            for (variant, options) in variants(document.surface()) {
                let file = folder.path().join(format!("{name}-{layout}-{variant}"));
                write(&document, &uvs, &file, &options);
                files.push(file);
            }
        }
    }
    let reports = consumers.validate(&files);
    assert_eq!(reports.len(), files.len());
    for (file, messages) in reports {
        let wrong: Vec<_> = messages
            .iter()
            .filter(|m| m.is_error_or_warning())
            .collect();
        assert!(wrong.is_empty(), "{}: {wrong:?}", file.display());
    }
}

/// A document with the files that are written of it.
struct Written {
    input: PathBuf,
    whole: Vec<PathBuf>,
    torn: Vec<PathBuf>,
}

impl Written {
    fn of(input: PathBuf, folder: &Path) -> Self {
        let document = fam_io::read_surface(&input).unwrap();
        let name = input.file_name().unwrap().to_string_lossy().into_owned();
        let surface = document.surface();
        let write_all = |layout: &str, uvs: Uvs| -> Vec<PathBuf> {
            let files = variants(surface).into_iter().map(|(variant, options)| {
                let file = folder.join(format!("{name}-{layout}-{variant}"));
                write(&document, &uvs, &file, &options);
                file
            });
            files.collect()
        };
        Self {
            whole: write_all("whole", per_vertex(surface)),
            torn: write_all("torn", per_corner(surface)),
            input,
        }
    }

    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.whole.iter().chain(&self.torn).chain([&self.input])
    }

    /// A fault of a vertex may be there as often as the vertex is.
    fn check(&self, reports: &BTreeMap<PathBuf, Vec<Message>>) {
        let before = complaints(&reports[&self.input]);
        for file in self.whole.iter().chain(&self.torn) {
            let is_torn = self.torn.contains(file);
            for (code, count) in complaints(&reports[file]) {
                let known = before
                    .get(code)
                    .is_some_and(|&known| is_torn || count <= known);
                let first = reports[file].iter().find(|message| message.code == code);
                assert!(known, "{}: {count} {code}: {first:?}", file.display());
            }
        }
    }
}

#[test]
fn documents_of_all_kinds_stay_valid() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let inputs = write_documents(folder.path()).into_iter();
    let written: Vec<_> = inputs
        .map(|input| Written::of(input, folder.path()))
        .collect();
    let files: Vec<_> = written.iter().flat_map(Written::files).cloned().collect();
    let reports = consumers.validate(&files);
    for document in &written {
        let wrong = reports[&document.input]
            .iter()
            .find(|m| m.is_error_or_warning());
        assert!(wrong.is_none(), "{}: {wrong:?}", document.input.display());
        document.check(&reports);
    }
}

#[test]
fn real_documents_get_no_new_faults() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/models/formats");
    if !models.is_dir() {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: the real models are not present"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let entries = fs::read_dir(models)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let is_gltf = |path: &PathBuf| {
        matches!(Format::of_path(path), Some(Format::Glb | Format::Gltf))
            && fam_io::read_surface(path).is_ok()
    };
    let inputs: Vec<_> = entries.filter(is_gltf).collect();
    assert!(inputs.len() >= 6, "{inputs:?}");
    let written: Vec<_> = inputs
        .into_iter()
        .map(|input| Written::of(input, folder.path()))
        .collect();
    let files: Vec<_> = written.iter().flat_map(Written::files).cloned().collect();
    let reports = consumers.validate(&files);
    written.iter().for_each(|document| document.check(&reports));
}
