//! Layouts of the suite's surfaces by other tools.

use std::path::Path;
use std::process::Command;

use fam_surface::Surface;
use fam_surface::metrics::Metrics;
use serde::{Deserialize, Serialize};

use super::record::{Record, Store};
use crate::failure::Failure;

/// A layout by another tool, or why there is none.
#[derive(Debug, Clone, Serialize)]
pub struct PeerLayout {
    pub peer: String,
    pub surface: String,
    #[serde(flatten)]
    pub told: Told,
    pub metrics: Option<Metrics>,
}

/// What the program that called the tool tells of a layout.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Seconds of laying out.
    #[serde(default)]
    pub seconds: Option<f64>,
    /// Whether the tool was given the seams of our direct layout, since it finds none itself.
    #[serde(default)]
    pub cut: bool,
    #[serde(default)]
    pub version: Option<String>,
    /// Why there is no layout.
    #[serde(default)]
    pub reason: Option<String>,
}

/// Calls the program that lays out the suite's surfaces by other tools.
pub fn call(program: &Path, store: &Store) -> Result<(), Failure> {
    let fail = |reason: String| Failure::work(format!("{}: {reason}", program.display()));
    let status = Command::new(program)
        .arg(store.surfaces())
        .arg(store.peers())
        .status()
        .map_err(|error| fail(error.to_string()))?;
    match status.success() {
        true => Ok(()),
        false => Err(fail(status.to_string())),
    }
}

/// The layouts that peers left, of the surfaces of these records, measured; by peer and in the order
/// of the records.
pub fn measured(store: &Store, records: &[Record]) -> Vec<PeerLayout> {
    let mut surfaces: Vec<&str> = Vec::new();
    for record in records {
        if !surfaces.contains(&record.surface.as_str()) {
            surfaces.push(&record.surface);
        }
    }
    let folders = std::fs::read_dir(store.peers())
        .into_iter()
        .flatten()
        .flatten();
    let mut folders: Vec<_> = folders.map(|entry| entry.path()).collect();
    folders.sort();
    let layouts = folders.iter().flat_map(|folder| {
        surfaces
            .iter()
            .filter_map(|surface| layout(folder, surface))
    });
    layouts.collect()
}

/// The layout of a surface in the folder of a peer; none if it was not tried.
fn layout(folder: &Path, surface: &str) -> Option<PeerLayout> {
    let text = std::fs::read(folder.join(format!("{surface}.json"))).ok()?;
    let mut told: Told = serde_json::from_slice(&text).ok()?;
    let metrics = match told.reason {
        Some(_) => None,
        None => match metrics(&folder.join(format!("{surface}.obj"))) {
            Ok(metrics) => Some(metrics),
            Err(reason) => {
                told.reason = Some(reason);
                None
            }
        },
    };
    Some(PeerLayout {
        peer: folder.file_name()?.to_string_lossy().into_owned(),
        surface: surface.to_string(),
        told,
        metrics,
    })
}

/// What `fam metrics` says of the file.
fn metrics(path: &Path) -> Result<Metrics, String> {
    let document = fam_io::read_surface(path).map_err(|error| error.to_string())?;
    match (document.surface(), document.uv_map()) {
        (Surface::Mesh(mesh), Some(uvs)) => {
            Metrics::measure(mesh, uvs).map_err(|error| error.to_string())
        }
        _ => Err("its file has no mesh with UVs".to_string()),
    }
}
