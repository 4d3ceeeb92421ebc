//! What came of a trial, kept in a file so that a run that ended early goes on.

use std::path::{Path, PathBuf};

use fam_core::training::TrainingConfig;
use fam_io::atomic::write_atomically;
use fam_layout::LayoutConfig;
use fam_surface::metrics::Metrics;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::plan::Trial;
use super::surfaces::Loaded;
use super::unseen::Unseen;
use crate::failure::Failure;

/// Version of the record's form. Records of another one are made anew.
const VERSION: u32 = 2;

/// What came of one trial of one surface.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Record {
    pub surface: String,
    pub trial: String,
    pub seed: Option<u64>,
    pub circumstances: Circumstances,
    /// Changes with the surface and with all that shapes the result.
    pub fingerprint: String,
    pub outcome: Outcome,
}

/// What it was measured on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Circumstances {
    pub machine: String,
    pub version: String,
    /// Of the sources, where the program was told when it was built.
    pub commit: Option<String>,
    /// The preset of the training and what was changed in it. None of a direct layout.
    pub preset: Option<String>,
    pub backend: String,
}

/// What a trial came to.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    Done(Measured),
    Failed(String),
}

/// What was measured.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Measured {
    /// None without training.
    pub training_seconds: Option<f64>,
    pub layouts: Vec<Layout>,
    /// The map at points that training did not see.
    pub unseen: Vec<Unseen>,
}

/// UVs of a surface.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Layout {
    pub kind: LayoutKind,
    /// Seconds of laying out; none of a raw map.
    pub seconds: Option<f64>,
    pub metrics: Metrics,
}

/// How UVs were made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LayoutKind {
    /// The map that training ends with.
    Raw,
    /// The layout that the map leads to.
    Finished,
    /// The layout without networks.
    Direct,
}

impl Record {
    /// What was measured, if anything was.
    pub fn measured(&self) -> Option<&Measured> {
        match &self.outcome {
            Outcome::Done(measured) => Some(measured),
            Outcome::Failed(_) => None,
        }
    }

    /// The metrics of a layout, if there is one.
    pub fn metrics(&self, kind: LayoutKind) -> Option<&Metrics> {
        let layouts = &self.measured()?.layouts;
        let layout = layouts.iter().find(|layout| layout.kind == kind)?;
        Some(&layout.metrics)
    }
}

/// The hash that a record must have to count for this trial.
pub fn fingerprint(
    loaded: &Loaded,
    trial: Trial,
    config: Option<&TrainingConfig>,
    backend: &str,
) -> Result<String, Failure> {
    let mut hasher = Sha256::new();
    let shaping = match config {
        Some(config) => {
            let config = serde_json::to_string(config).map_err(Failure::work)?;
            format!("{VERSION} {} {config} {backend}", trial.name())
        }
        None => format!("{VERSION} {}", trial.name()),
    };
    let layout = serde_json::to_string(&LayoutConfig::default()).map_err(Failure::work)?;
    hasher.update(format!("{shaping} {layout}"));
    for coordinate in loaded.mesh.positions().iter().flatten() {
        hasher.update(coordinate.to_le_bytes());
    }
    for vertex in loaded.mesh.triangles().iter().flatten() {
        hasher.update(vertex.to_le_bytes());
    }
    Ok(format!("{:x}", hasher.finalize()))
}

/// The folder of a suite: records, surfaces, pictures, layouts of peers.
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// The store in a folder, which is made if it is not there.
    pub fn open(folder: PathBuf) -> Result<Self, Failure> {
        let store = Self { folder };
        for name in ["runs", "surfaces", "peers", "pictures"] {
            let folder = store.folder.join(name);
            std::fs::create_dir_all(&folder)
                .map_err(|error| Failure::input(format!("{}: {error}", folder.display())))?;
        }
        Ok(store)
    }

    /// Where the surface goes for peers, with the UVs of its direct layout.
    pub fn surfaces(&self) -> PathBuf {
        self.folder.join("surfaces")
    }

    /// Where peers leave their layouts.
    pub fn peers(&self) -> PathBuf {
        self.folder.join("peers")
    }

    /// Where the picture of a trial is.
    pub fn picture(&self, surface: &str, trial: Trial) -> PathBuf {
        let name = format!("{}.png", key(surface, trial));
        self.folder.join("pictures").join(name)
    }

    /// Where a training that was broken off is saved.
    pub fn checkpoint(&self, surface: &str, trial: Trial) -> PathBuf {
        self.run(surface, trial, "safetensors")
    }

    /// The record of a trial, if there is one that can be read.
    pub fn record(&self, surface: &str, trial: Trial) -> Option<Record> {
        let text = std::fs::read(self.run(surface, trial, "json")).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Keeps the record of a trial.
    pub fn keep(&self, surface: &str, trial: Trial, record: &Record) -> Result<(), Failure> {
        let mut json = serde_json::to_vec_pretty(record).map_err(Failure::work)?;
        json.push(b'\n');
        save(&self.run(surface, trial, "json"), &json)
    }

    fn run(&self, surface: &str, trial: Trial, extension: &str) -> PathBuf {
        let name = format!("{}.{extension}", key(surface, trial));
        self.folder.join("runs").join(name)
    }
}

fn key(surface: &str, trial: Trial) -> String {
    let name = trial.name();
    match trial.seed() {
        Some(seed) => format!("{surface}.{name}.{seed}"),
        None => format!("{surface}.{name}"),
    }
}

/// Writes a file, whole or not at all.
pub fn save(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_atomically(path, |out| out.write_all(bytes)).map_err(Failure::work)
}
