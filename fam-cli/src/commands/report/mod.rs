mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::args;
use crate::failure::{Failure, SUCCESS};
use crate::manifest::{self, Entry};

/// Merges manifests and shows what came of all files.
pub fn report(arguments: &args::Report) -> Result<u8, Failure> {
    let mut paths = Vec::new();
    for path in &arguments.manifests {
        match path.is_dir() {
            true => paths.extend(manifests_in(path)?),
            false => paths.push(path.clone()),
        }
    }
    let mut latest: BTreeMap<String, Entry> = BTreeMap::new();
    for path in paths {
        let (entries, faults) = manifest::read(&path)?;
        for fault in faults {
            eprintln!("warning: {fault}");
        }
        for entry in entries {
            let before = latest.get(&entry.input);
            if before.is_none_or(|before| before.finished <= entry.finished) {
                latest.insert(entry.input.clone(), entry);
            }
        }
    }
    let entries: Vec<Entry> = latest.into_values().collect();
    if arguments.json {
        for entry in &entries {
            println!("{}", serde_json::to_string(entry).map_err(Failure::work)?);
        }
    } else {
        print!("{}", text::Text(&entries));
    }
    Ok(SUCCESS)
}

/// The manifests in a folder of results.
fn manifests_in(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let fail =
        |reason: &dyn std::fmt::Display| Failure::input(format!("{}: {reason}", folder.display()));
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|error| fail(&error))? {
        let path = entry.map_err(|error| fail(&error))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("manifest") && name.ends_with(".jsonl") {
            paths.push(path);
        }
    }
    match paths.is_empty() {
        true => Err(fail(&"there is no manifest.jsonl")),
        false => {
            paths.sort();
            Ok(paths)
        }
    }
}
