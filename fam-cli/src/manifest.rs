//! The manifest of a batch: what came of every file, one JSON object per line.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::failure::Failure;

/// The manifest of a run that has no shard.
pub const NAME: &str = "manifest.jsonl";

/// The manifests in a folder of results.
pub fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    // A path without a folder is in the current one.
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let fail = |error| Failure::input(format!("{}: {error}", folder.display()));
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("manifest") && name.ends_with(".jsonl") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// What came of a file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    Done,
    Failed,
    TimedOut,
    Interrupted,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::TimedOut => "timed out",
            Self::Interrupted => "interrupted",
        })
    }
}

/// A line of the manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The absolute path of the file.
    pub input: String,
    /// The folder of its results.
    pub folder: String,
    /// SHA-256 of the file, followed by those that it refers to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<String>,
    pub state: State,
    /// From the start to the end; none of what was done before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// The result in a line, or the reason why there is none.
    pub message: String,
    /// Of metrics.json, without what is said of every component.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metrics: Option<Value>,
    /// Seconds since 1970. The latest entry of a file is the one that counts.
    pub finished: f64,
}

/// Now, as entries have it.
pub fn now() -> f64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.unwrap_or_default().as_secs_f64()
}

/// A report without its list of components, and without what entries have by themselves.
pub fn metrics(mut report: Value) -> Value {
    if let Some(fields) = report.as_object_mut() {
        for name in [
            "state",
            "input",
            "folder",
            "interrupted",
            "components",
            "fingerprint",
        ] {
            fields.shift_remove(name);
        }
    }
    report
}

/// A manifest that lines are added to.
pub struct Manifest {
    file: File,
}

impl Manifest {
    /// Opens a manifest, or begins one. A line that an earlier run left unfinished is closed.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let fail = |error| Failure::input(format!("{}: {error}", path.display()));
        let mut options = OpenOptions::new();
        let opened = options.create(true).append(true).read(true).open(path);
        let mut file = opened.map_err(fail)?;
        let length = file.metadata().map_err(fail)?.len();
        if length > 0 {
            let mut last = [0];
            file.seek(SeekFrom::Start(length - 1)).map_err(fail)?;
            file.read_exact(&mut last).map_err(fail)?;
            if last != *b"\n" {
                file.write_all(b"\n").map_err(fail)?;
            }
        }
        Ok(Self { file })
    }

    /// Adds a line, in one piece.
    pub fn add(&mut self, entry: &Entry) -> Result<(), Failure> {
        let mut line = serde_json::to_vec(entry).map_err(Failure::work)?;
        line.push(b'\n');
        let written = self.file.write_all(&line);
        written.map_err(|error| Failure::work(format!("manifest: {error}")))
    }
}

/// The entries of a manifest, and a sentence about lines that are none. A file that has only such
/// lines is no manifest, unless there is a single one that was not finished.
pub fn read(path: &Path) -> Result<(Vec<Entry>, Option<String>), Failure> {
    let name = path.display();
    let bytes = std::fs::read(path).map_err(|error| Failure::input(format!("{name}: {error}")))?;
    let mut entries = Vec::new();
    let mut fault = None;
    let mut faults = 0;
    let is_unfinished = !bytes.contains(&b'\n');
    for (number, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        if line.trim_ascii().is_empty() {
            continue;
        }
        match serde_json::from_slice(line) {
            Ok(entry) => entries.push(entry),
            Err(error) => {
                fault.get_or_insert_with(|| format!("line {}: {error}", number + 1));
                faults += 1;
            }
        }
    }
    match fault {
        Some(fault) if entries.is_empty() && !is_unfinished => Err(Failure::input(format!(
            "{name}: it is no manifest: {fault}"
        ))),
        fault => {
            let sentence = |fault| format!("{name}: {faults} unreadable lines, the first: {fault}");
            Ok((entries, fault.map(sentence)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(input: &str) -> Entry {
        Entry {
            input: input.to_owned(),
            folder: String::from("x.fam"),
            hash: None,
            state: State::TimedOut,
            seconds: Some(1.5),
            message: String::from("not done within 1s"),
            metrics: None,
            finished: 1e9,
        }
    }

    #[test]
    fn a_line_left_unfinished_spoils_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("manifest.jsonl");
        Manifest::open(&path).unwrap().add(&entry("a")).unwrap();
        std::fs::write(
            &path,
            [std::fs::read(&path).unwrap(), b"{\"input\": \"b".to_vec()].concat(),
        )
        .unwrap();
        let mut manifest = Manifest::open(&path).unwrap();
        manifest.add(&entry("c")).unwrap();
        let (entries, fault) = read(&path).unwrap();
        assert_eq!(entries, [entry("a"), entry("c")]);
        let fault = fault.unwrap();
        assert!(
            fault.contains("1 unreadable lines, the first: line 2"),
            "{fault}"
        );
        std::fs::write(&path, "{\"input\": \"b").unwrap();
        assert!(read(&path).unwrap().0.is_empty());
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\n").unwrap();
        assert!(
            read(&path)
                .unwrap_err()
                .to_string()
                .contains("it is no manifest: line 1")
        );
    }
}
