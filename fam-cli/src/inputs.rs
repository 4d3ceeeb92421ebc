//! Which files a command line of files, folders and patterns stands for.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use fam_io::{ReadFault, format_of};

use crate::failure::Failure;

/// The inputs of a run.
#[derive(Debug, PartialEq)]
pub enum Inputs {
    /// The built-in surface.
    Sample,
    /// One file, named as such.
    One(PathBuf),
    /// Any number of files, each with the folder for its results, relative to that of all.
    Batch(Vec<(PathBuf, PathBuf)>),
}

impl Inputs {
    /// The files that `arguments` stand for. Of a folder these are, at any depth, those of a
    /// known format; results of earlier runs (`*.fam`), `out` and hidden entries are left out.
    pub fn collect(arguments: &[PathBuf], out: Option<&Path>) -> Result<Self, Failure> {
        match arguments {
            [] => return Ok(Self::Sample),
            [one] if !one.is_dir() && !is_pattern(one) => return Ok(Self::One(one.clone())),
            _ => {}
        }
        let mut found = BTreeSet::new();
        for argument in arguments {
            if is_pattern(argument) {
                for path in matches(argument)? {
                    add(&path, Path::new(""), out, &mut found)?;
                }
            } else {
                add(argument, Path::new(""), out, &mut found)?;
            }
        }
        if found.is_empty() {
            let names: Vec<_> = arguments.iter().map(|a| a.display().to_string()).collect();
            return Err(Failure::input(format!(
                "{}: no mesh or point cloud there",
                names.join(", ")
            )));
        }
        Ok(Self::Batch(with_folders(found)))
    }
}

/// Whether a path that does not exist as such has a wildcard in it.
fn is_pattern(path: &Path) -> bool {
    let text = path.to_string_lossy();
    text.contains(['*', '?', '[']) && !path.exists()
}

fn matches(pattern: &Path) -> Result<Vec<PathBuf>, Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", pattern.display()));
    let text = pattern
        .to_str()
        .ok_or_else(|| fail("a pattern must be UTF-8".to_string()))?;
    let paths = glob::glob(text).map_err(|error| fail(error.msg.to_string()))?;
    let paths: Vec<PathBuf> = paths
        .collect::<Result<_, _>>()
        .map_err(|error| fail(error.error().to_string()))?;
    if paths.is_empty() {
        return Err(fail("nothing matches".to_string()));
    }
    Ok(paths)
}

/// Adds a file, or the files of a folder, each with its place below the folder.
fn add(
    path: &Path,
    below: &Path,
    out: Option<&Path>,
    found: &mut BTreeSet<(PathBuf, PathBuf)>,
) -> Result<(), Failure> {
    if !path.is_dir() {
        found.insert((path.to_owned(), below.to_owned()));
        return Ok(());
    }
    let fail = |error: std::io::Error| Failure::input(format!("{}: {error}", path.display()));
    for entry in std::fs::read_dir(path).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        let (inner, name) = (entry.path(), entry.file_name());
        let name = Path::new(&name);
        let is_results = name.extension().is_some_and(|extension| extension == "fam");
        if is_results || name.to_string_lossy().starts_with('.') || is_same(&inner, out) {
            continue;
        }
        // Links to folders are not followed: they may lead back.
        if entry.file_type().map_err(fail)?.is_dir() {
            add(&inner, &below.join(name), out, found)?;
        } else if inner.is_file() && !matches!(format_of(&inner), Err(ReadFault::UnknownFormat(_)))
        {
            found.insert((inner, below.to_owned()));
        }
    }
    Ok(())
}

fn is_same(path: &Path, other: Option<&Path>) -> bool {
    let other = other.and_then(|other| other.canonicalize().ok());
    other.is_some_and(|other| path.canonicalize().is_ok_and(|path| path == other))
}

/// The folder of each file: its stem with `.fam`; its whole name with `.fam` where stems meet.
fn with_folders(found: BTreeSet<(PathBuf, PathBuf)>) -> Vec<(PathBuf, PathBuf)> {
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
