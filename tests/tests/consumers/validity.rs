//! The Khronos validator has nothing against what is written that it did not have against the
//! input.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use fam_io::{Document, Format, WriteOptions};
use fam_surface::Surface;

use crate::gltf::write_documents;
use crate::installed::{Consumers, Message};
use crate::surfaces::{documents, per_corner, per_vertex, real_models, write};

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

/// Files that are written of a document.
struct Written {
    /// The document itself, if it is glTF.
    input: Option<PathBuf>,
    /// Without seams, so that there are as many vertices as before.
    whole: Vec<PathBuf>,
    torn: Vec<PathBuf>,
}

impl Written {
    fn of(document: &Document, input: Option<PathBuf>, stem: &Path) -> Self {
        let surface = document.surface();
        let files = |layout: &str| -> Vec<_> {
            let named = |(variant, options)| {
                let mut name = stem.as_os_str().to_owned();
                name.push(format!("-{layout}-{variant}"));
                (PathBuf::from(name), options)
            };
            variants(surface).into_iter().map(named).collect()
        };
        let (whole, torn) = (files("whole"), files("torn"));
        for (path, options) in &whole {
            write(document, &per_vertex(surface), path, options);
        }
        for (path, options) in &torn {
            write(document, &per_corner(surface), path, options);
        }
        let paths = |files: Vec<(PathBuf, _)>| files.into_iter().map(|(path, _)| path).collect();
        Self {
            input,
            whole: paths(whole),
            torn: paths(torn),
        }
    }

    fn of_file(input: PathBuf, folder: &Path) -> Option<Self> {
        let document = fam_io::read_surface(&input).ok()?;
        let stem = folder.join(input.file_name()?);
        let is_gltf = matches!(document.format(), Format::Glb | Format::Gltf);
        Some(Self::of(&document, is_gltf.then_some(input), &stem))
    }

    fn had_tangents(&self) -> bool {
        let bytes = self.input.as_ref().map(|input| fs::read(input).unwrap());
        bytes.is_some_and(|bytes| bytes.windows(9).any(|window| window == b"\"TANGENT\""))
    }

    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.whole.iter().chain(&self.torn).chain(&self.input)
    }
}

/// What the validator says where a normal texture is on a primitive without tangents. They are
/// left out when they belonged to UVs that are replaced, and viewers compute them.
const GENERATED_TANGENTS: &str = "MESH_PRIMITIVE_GENERATED_TANGENT_SPACE";

/// Asserts that the files have no errors and warnings but those of the input. Where vertices
/// are copied, an error or warning may be there once for each copy.
#[track_caller]
fn check(consumers: &Consumers, written: &[Written]) {
    let files: Vec<_> = written.iter().flat_map(Written::files).cloned().collect();
    let reports = consumers.validate(&files);
    // The first file with each.
    let mut new = BTreeMap::new();
    for written in written {
        let before = written
            .input
            .as_ref()
            .map(|file| complaints(&reports[file]));
        let before = before.unwrap_or_default();
        for file in written.whole.iter().chain(&written.torn) {
            let is_torn = written.torn.contains(file);
            for (code, count) in complaints(&reports[file]) {
                if code == GENERATED_TANGENTS && written.had_tangents() {
                    continue;
                }
                let known = before.get(code).copied().unwrap_or(0);
                if count > known && !(is_torn && known > 0) {
                    let message = reports[file].iter().find(|m| m.code == code);
                    new.entry(code)
                        .or_insert_with(|| format!("{}: {}", file.display(), message.unwrap()));
                }
            }
        }
    }
    assert!(new.is_empty(), "{new:#?}");
}

#[test]
fn conversions_are_valid() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let written = documents()
        .into_iter()
        .map(|(name, document)| Written::of(&document, None, &folder.path().join(name)));
    check(&consumers, &written.collect::<Vec<_>>());
}

/// Writes valid documents into a folder, and what becomes of them.
fn written_documents(consumers: &Consumers, folder: &Path) -> Vec<Written> {
    let inputs = write_documents(folder);
    for (input, messages) in consumers.validate(&inputs) {
        let wrong = messages.iter().find(|m| m.is_error_or_warning());
        assert!(wrong.is_none(), "{}: {wrong:?}", input.display());
    }
    let written = |input| Written::of_file(input, folder).unwrap();
    inputs.into_iter().map(written).collect()
}

#[test]
fn documents_of_all_kinds_stay_valid() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    check(&consumers, &written_documents(&consumers, folder.path()));
}

#[test]
fn what_was_written_stays_valid_when_it_is_written_again() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let once = written_documents(&consumers, folder.path());
    let last = |mut written: Written| written.torn.pop();
    let again = once.into_iter().filter_map(last);
    let again = again.map(|input| Written::of_file(input, folder.path()).unwrap());
    check(&consumers, &again.collect::<Vec<_>>());
}

#[test]
fn real_documents_get_no_new_faults() {
    let Some(consumers) = Consumers::with_validator() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let inputs = real_models(500_000).into_iter();
    let written: Vec<_> = inputs
        .filter_map(|input| Written::of_file(input, folder.path()))
        .collect();
    check(&consumers, &written);
}
