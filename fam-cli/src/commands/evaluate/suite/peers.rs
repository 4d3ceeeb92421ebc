//! Layouts of the suite's surfaces by other tools.

use std::path::Path;
use std::process::Command;

use fam_io::Document;
use fam_surface::Surface;
use fam_surface::metrics::Metrics;
use serde::{Deserialize, Serialize};

use super::record::Store;
use crate::failure::Failure;

/// A layout by another tool, or why there is none.
#[derive(Debug, Clone, Serialize)]
pub struct PeerLayout {
    pub peer: String,
    pub surface: String,
    #[serde(flatten)]
    pub report: PeerReport,
    pub metrics: Option<Metrics>,
}

/// What the program that called the tool reports of a layout.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PeerReport {
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

/// Calls the program that lays out the suite's surfaces by other tools, if there are any. What it prints
/// goes to standard error.
pub fn call(program: &Path, store: &Store) -> Result<(), Failure> {
    let fail = |reason: String| Failure::work(format!("{}: {reason}", program.display()));
    if names(&store.surfaces()).is_empty() {
        return Ok(());
    }
    // A name without a folder would be looked for elsewhere.
    let path = program
        .canonicalize()
        .map_err(|error| fail(error.to_string()))?;
    let status = Command::new(path)
        .arg(store.surfaces())
        .arg(store.peers())
        .stdout(std::io::stderr())
        .status()
        .map_err(|error| fail(error.to_string()))?;
    match status.success() {
        true => Ok(()),
        false => Err(fail(status.to_string())),
    }
}

/// The layouts that peers left, measured; by peer and surface.
pub fn measured(store: &Store) -> Vec<PeerLayout> {
    let surfaces: Vec<String> = names(&store.surfaces())
        .iter()
        .filter_map(|name| Some(name.strip_suffix(".obj")?.to_string()))
        .collect();
    let peers = names(&store.peers());
    let layouts = surfaces.iter().flat_map(|surface| {
        let original = store.surfaces().join(format!("{surface}.obj"));
        let original = fam_io::read_surface(original).ok();
        peers
            .iter()
            .filter_map(move |peer| layout(&store.peers().join(peer), surface, original.as_ref()?))
    });
    layouts.collect()
}

/// The names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
    names.sort();
    names
}

/// The layout of a surface in the folder of a peer; none if it was not tried, or was of another
/// surface.
fn layout(folder: &Path, surface: &str, original: &Document) -> Option<PeerLayout> {
    let text = std::fs::read(folder.join(format!("{surface}.json"))).ok()?;
    let mut report: PeerReport = serde_json::from_slice(&text).ok()?;
    let mut measured = None;
    if report.reason.is_none() {
        match metrics(&folder.join(format!("{surface}.obj")), original) {
            Ok(metrics) => measured = Some(metrics?),
            Err(reason) => report.reason = Some(reason),
        }
    }
    Some(PeerLayout {
        peer: folder.file_name()?.to_string_lossy().into_owned(),
        surface: surface.to_string(),
        report,
        metrics: measured,
    })
}

/// What `fam metrics` says of the file; none if it has another surface than the original.
fn metrics(path: &Path, original: &Document) -> Result<Option<Metrics>, String> {
    let document = fam_io::read_surface(path).map_err(|error| error.to_string())?;
    let (Surface::Mesh(mesh), Some(uvs)) = (document.surface(), document.uv_map()) else {
        return Err("its file has no mesh with UVs".to_string());
    };
    let Surface::Mesh(original) = original.surface() else {
        return Ok(None);
    };
    if (mesh.positions(), mesh.triangles()) != (original.positions(), original.triangles()) {
        return Ok(None);
    }
    let metrics = Metrics::measure(mesh, uvs).map_err(|error| error.to_string())?;
    Ok(Some(metrics))
}
