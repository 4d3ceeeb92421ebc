use std::path::{Path, PathBuf};

use fam::Report;
use serde::Serialize;

/// What `unwrap --json` prints.
#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    pub state: &'a str,
    pub input: &'a str,
    pub folder: &'a Path,
    pub file: PathBuf,
    /// Where networks were trained, if any were.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backend: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub training_seconds: Option<f64>,
    pub finishing_seconds: f64,
    pub interrupted: bool,
    #[serde(flatten)]
    pub report: &'a Report,
}
