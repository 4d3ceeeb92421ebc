//! Which files a command line of files, folders and patterns stands for.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

use fam_io::{Format, ReadFault, format_of};

use crate::failure::Failure;
use crate::output::is_results;

/// The inputs of a run.
#[derive(Debug, PartialEq)]
pub enum Inputs {
    /// The built-in surface.
    Sample,
    /// One file, named as such.
    One(PathBuf),
    /// Any number of files.
    Batch {
        /// Each with the folder for its results, relative to that of all.
        files: Vec<(PathBuf, PathBuf)>,
        /// What could not be looked into, with the reason.
        failed: Vec<(PathBuf, String)>,
    },
}

impl Inputs {
    /// The files that `arguments` stand for. Of a folder these are, at any depth, those of a
    /// known format; results of earlier runs, `out` and hidden entries are left out.
    pub fn collect(arguments: &[PathBuf], out: Option<&Path>) -> Result<Self, Failure> {
        match arguments {
            [] => return Ok(Self::Sample),
            [one] if !one.is_dir() && !is_pattern(one) => return Ok(Self::One(one.clone())),
            _ => {}
        }
        let mut found = Found::default();
        for argument in arguments {
            if is_pattern(argument) {
                match matches(argument) {
                    Ok(paths) => paths
                        .iter()
                        .for_each(|path| found.add(path, Path::new(""), out)),
                    Err(reason) => found.failed.push((argument.clone(), reason)),
                }
            } else {
                found.add(argument, Path::new(""), out);
            }
        }
        if !found.files.is_empty() {
            return Ok(Self::Batch {
                files: with_folders(once(found.files)),
                failed: found.failed,
            });
        }
        Err(match found.failed.first() {
            Some((path, reason)) => Failure::input(format!("{}: {reason}", path.display())),
            None => {
                let names: Vec<_> = arguments.iter().map(|a| a.display().to_string()).collect();
                let names = names.join(", ");
                Failure::input(format!("{names}: no mesh or point cloud there"))
            }
        })
    }
}

impl Inputs {
    /// A single file as one of many: of a pattern that matches one, shards have it or not.
    pub fn many(self) -> Self {
        match self {
            Self::One(path) => Self::Batch {
                files: with_folders(vec![(path, PathBuf::new())]),
                failed: Vec::new(),
            },
            other => other,
        }
    }
}

/// Whether a path that does not exist as such has a wildcard in it.
fn is_pattern(path: &Path) -> bool {
    let text = path.to_string_lossy();
    text.contains(['*', '?', '[']) && !path.exists()
}

fn matches(pattern: &Path) -> Result<Vec<PathBuf>, String> {
    let text = pattern.to_str().ok_or("a pattern must be UTF-8")?;
    let paths = glob::glob(text).map_err(|error| error.msg.to_string())?;
    let paths: Vec<PathBuf> = paths
        .collect::<Result<_, _>>()
        .map_err(|error| error.error().to_string())?;
    if paths.is_empty() {
        return Err("nothing matches".to_string());
    }
    Ok(paths)
}

/// The files found so far, each with its place below the folder that was named.
#[derive(Default)]
struct Found {
    files: BTreeSet<(PathBuf, PathBuf)>,
    failed: Vec<(PathBuf, String)>,
}

impl Found {
    /// Adds a file, or the files of a folder.
    fn add(&mut self, path: &Path, below: &Path, out: Option<&Path>) {
        if !path.is_dir() {
            self.files.insert((path.to_owned(), below.to_owned()));
        } else if let Err(error) = self.add_folder(path, below, out) {
            self.failed.push((path.to_owned(), error.to_string()));
        }
    }

    fn add_folder(&mut self, path: &Path, below: &Path, out: Option<&Path>) -> io::Result<()> {
        // One named `.fam` may be left from a run that was killed.
        if is_results(path) || path.extension() == Some("fam".as_ref()) {
            return Ok(());
        }
        for entry in std::fs::read_dir(path)? {
            let entry = entry?;
            let (inner, name) = (entry.path(), entry.file_name());
            let name = Path::new(&name);
            if name.to_string_lossy().starts_with('.') || is_same(&inner, out) {
                continue;
            }
            // Links to folders are not followed: they may lead back.
            if entry.file_type()?.is_dir() {
                self.add(&inner, &below.join(name), out);
            } else if inner.is_file() && is_surface(&inner) {
                self.files.insert((inner, below.to_owned()));
            }
        }
        Ok(())
    }
}

/// Whether a file is, or claims to be, in a format of meshes or clouds. JSON under any name but
/// that of glTF is taken for something else.
fn is_surface(path: &Path) -> bool {
    match format_of(path) {
        Ok(Format::Gltf) => Format::of_path(path).is_some(),
        Err(ReadFault::UnknownFormat(_)) => false,
        _ => true,
    }
}

fn is_same(path: &Path, other: Option<&Path>) -> bool {
    let other = other.and_then(|other| other.canonicalize().ok());
    other.is_some_and(|other| path.canonicalize().is_ok_and(|path| path == other))
}

/// Each file once, however often and in whatever spelling it is named; one that was found in a folder
/// keeps its place there.
fn once(found: BTreeSet<(PathBuf, PathBuf)>) -> Vec<(PathBuf, PathBuf)> {
    let depth = |below: &Path| below.components().count();
    let mut files: BTreeMap<PathBuf, (PathBuf, PathBuf)> = BTreeMap::new();
    for (path, below) in found {
        match files.entry(location(&path)) {
            Entry::Vacant(place) => {
                place.insert((path, below));
            }
            Entry::Occupied(mut known) if depth(&below) > depth(&known.get().1) => {
                known.insert((path, below));
            }
            Entry::Occupied(_) => {}
        }
    }
    files.into_values().collect()
}

/// The same for all spellings of a path. A file that is a link is not the file that it links to.
fn location(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = absolute
        .parent()
        .and_then(|folder| folder.canonicalize().ok());
    match (folder, absolute.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => absolute,
    }
}

/// The folder of each file: its stem with `.fam`; its whole name with `.fam` where stems meet.
fn with_folders(found: Vec<(PathBuf, PathBuf)>) -> Vec<(PathBuf, PathBuf)> {
    let stem = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let key = |path: &Path, below: &Path| below.join(stem(path).to_lowercase());
    let mut counts: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for (path, below) in &found {
        *counts.entry(key(path, below)).or_default() += 1;
    }
    let mut taken = BTreeSet::new();
    found
        .into_iter()
        .map(|(path, below)| {
            let mut name = if counts[&key(&path, &below)] == 1 {
                stem(&path)
            } else {
                path.file_name()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned()
            };
            // Files of one name from several arguments.
            while !taken.insert(below.join(name.to_lowercase())) {
                name.push('_');
            }
            (path, below.join(format!("{name}.fam")))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folders(files: &[(&str, &str)]) -> Vec<String> {
        let found = files
            .iter()
            .map(|(path, below)| (PathBuf::from(path), PathBuf::from(below)));
        with_folders(found.collect())
            .into_iter()
            .map(|(_, folder)| folder.display().to_string())
            .collect()
    }

    #[test]
    fn a_file_counts_once() {
        let here = std::env::current_dir().unwrap().join("src/x.obj");
        let found = [
            ("./src/x.obj", "src"),
            ("src/x.obj", ""),
            ("src/../y.obj", ""),
            ("y.obj", ""),
            (here.to_str().unwrap(), ""),
        ];
        let found = found.map(|(path, below)| (PathBuf::from(path), PathBuf::from(below)));
        let files = once(found.clone().into());
        assert_eq!(files.len(), 2, "{files:?}");
        assert!(files.contains(&found[0]));
    }

    #[test]
    fn every_file_has_a_folder_of_its_own() {
        assert_eq!(
            folders(&[("a/x.obj", ""), ("a/y.ply", "")]),
            ["x.fam", "y.fam"]
        );
        let same_stem = [
            ("a/cube.OBJ", ""),
            ("a/cube.glb", ""),
            ("a/s/cube.glb", "s"),
        ];
        assert_eq!(
            folders(&same_stem),
            ["cube.OBJ.fam", "cube.glb.fam", "s/cube.fam"]
        );
        let same_name = [("a/x.obj", ""), ("b/X.obj", "")];
        assert_eq!(folders(&same_name), ["x.obj.fam", "X.obj_.fam"]);
    }
}
