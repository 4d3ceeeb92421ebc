//! The programs, and how they are run.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::RgbImage;
use serde::Deserialize;

/// Where the programs are installed, with all that a test needs of them.
pub struct Consumers(PathBuf);

const PYTHON: &str = "venv/bin/python";

impl Consumers {
    pub fn with_validator() -> Option<Self> {
        Self::with(&["node_modules/gltf-validator"])
    }

    pub fn with_mesh_readers() -> Option<Self> {
        Self::with(&[PYTHON])
    }

    pub fn with_browser() -> Option<Self> {
        let packages = ["node_modules/three", "node_modules/playwright-core"];
        Self::with(&[packages[0], packages[1], "/usr/bin/chromium"])
    }

    fn with(needed: &[&str]) -> Option<Self> {
        let folder = std::env::var_os("FAM_CONSUMERS").map_or_else(
            || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/consumers"),
            PathBuf::from,
        );
        let missing = needed.iter().find(|path| !folder.join(path).exists());
        let Some(missing) = missing else {
            return Some(Self(folder));
        };
        assert!(
            std::env::var_os("FAM_REQUIRE_CONSUMERS").is_none(),
            "{missing} is not installed, and FAM_REQUIRE_CONSUMERS is set"
        );
        skipped(&format!(
            "{missing} is not installed; tests/consumers/install does that"
        ));
        None
    }

    /// Runs one of the scripts and returns what it prints.
    fn run(&self, program: impl AsRef<Path>, script: &str, arguments: &[&Path]) -> Vec<u8> {
        let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("consumers");
        let output = Command::new(program.as_ref())
            .arg(scripts.join(script))
            .args(arguments)
            .env("FAM_CONSUMERS", &self.0)
            .output()
            .unwrap_or_else(|error| panic!("{}: {error}", program.as_ref().display()));
        assert!(
            output.status.success(),
            "{script} {arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        output.stdout
    }

    /// What the Khronos validator says about each file.
    pub fn validate(&self, files: &[PathBuf]) -> BTreeMap<PathBuf, Vec<Message>> {
        let files: Vec<_> = files.iter().map(PathBuf::as_path).collect();
        serde_json::from_slice(&self.run("node", "validate.mjs", &files)).unwrap()
    }

    /// Meshes and clouds as `trimesh` or `meshio` sees them.
    pub fn read(&self, tool: &str, files: &[PathBuf]) -> BTreeMap<PathBuf, Seen> {
        let files = files.iter().map(PathBuf::as_path);
        let arguments: Vec<_> = [Path::new(tool)].into_iter().chain(files).collect();
        let seen = self.run(self.0.join(PYTHON), "read_mesh.py", &arguments);
        serde_json::from_slice(&seen).unwrap()
    }

    /// The files as three.js shows them from a direction, on [`BACKGROUND`], under a light that
    /// leaves the colours of textures as they are.
    pub fn pictures(&self, direction: [i32; 3], files: &[&Path]) -> Vec<RgbImage> {
        let folder = tempfile::tempdir().unwrap();
        let pictures: Vec<_> = (0..files.len())
            .map(|at| folder.path().join(format!("{at}.png")))
            .collect();
        let direction = PathBuf::from(direction.map(|c| c.to_string()).join(","));
        let pairs = files.iter().copied().zip(&pictures);
        let arguments: Vec<&Path> = std::iter::once(direction.as_path())
            .chain(pairs.flat_map(|(file, picture)| [file, picture]))
            .collect();
        let log = self.run("node", "screenshot.mjs", &arguments);
        let log: Vec<String> = serde_json::from_slice(&log).unwrap();
        let complaints = |line: &&String| line.starts_with("error") || line.starts_with("warning");
        assert_eq!(log.iter().find(complaints), None);
        let open = |path: &PathBuf| image::open(path).unwrap().to_rgb8();
        pictures.iter().map(open).collect()
    }
}

/// Says, past the capture of the test harness, that a test does not run.
pub fn skipped(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
}

/// What is behind the object in a picture.
pub const BACKGROUND: [u8; 3] = [255, 0, 255];

/// A message of the validator.
#[derive(Debug, Deserialize)]
pub struct Message {
    pub code: String,
    message: String,
    #[serde(default)]
    pointer: String,
    severity: u32,
}

impl Message {
    /// Whether it is more than an information or a hint.
    pub fn is_error_or_warning(&self) -> bool {
        self.severity <= 1
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {}: {}", self.code, self.pointer, self.message)
    }
}

/// Positions with UVs after them if the program sees any.
#[derive(Debug, Deserialize)]
pub struct Seen {
    /// Of the corners of each face.
    pub faces: Vec<Vec<Vec<f64>>>,
    /// Of each point, if there are no faces.
    pub points: Vec<Vec<f64>>,
}
