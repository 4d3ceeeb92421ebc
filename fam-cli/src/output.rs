//! The folder that `unwrap` writes.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use fam::{Parting, Report, Unwrapped, Uvs, in_a_row};
use fam_io::atomic::{remove_leftovers, write_atomically};
use fam_io::picture::{self, Flattened as Drawn, encode_png, preview_picture, uv_picture};
use fam_io::seams::{Threshold, write_seams_json, write_seams_obj};
use fam_io::{Document, Format, WriteOptions};
use fam_surface::Surface;
use serde::Serialize;

use crate::failure::Failure;

/// Side of uv.png in pixels.
const UV_PICTURE_SIDE: u32 = 1024;

/// Side of a panel of preview.png in pixels.
const PREVIEW_SIDE: u32 = 512;

/// Name of the report, which is written last: where it is, the folder is complete.
const REPORT: &str = "metrics.json";

/// The trained networks, where any were trained.
const MODEL: &str = "model.safetensors";

/// The other files beside the mesh or cloud.
const SIDE_FILES: [&str; 5] = [
    "config.toml",
    "preview.png",
    "seams.json",
    "seams.obj",
    "uv.png",
];

/// Whether a folder holds results of `unwrap`.
pub fn is_results(folder: &Path) -> bool {
    let mut names = SIDE_FILES.iter().chain([&REPORT]);
    names.all(|name| folder.join(name).is_file())
}

/// Removes what a process left in a folder that was killed while it wrote there.
pub fn sweep(folder: &Path) {
    // Leftovers do no harm.
    let _ = remove_leftovers(folder);
    // Only goes if it is empty.
    let _ = std::fs::remove_dir(folder);
}

/// Where results go, and in which form.
pub struct Output {
    pub folder: PathBuf,
    /// Of the name of the mesh or cloud.
    pub stem: String,
    pub format: Format,
    pub options: WriteOptions,
    /// Whether the seams go into the mesh's file too.
    pub seam_lines: bool,
}

/// An unwrapped surface and how it came about.
pub struct Results<'a> {
    pub document: &'a Document,
    pub parting: &'a Parting,
    /// With the bytes of the trained model.
    pub unwrapped: &'a Unwrapped<Vec<u8>>,
    /// What the report says of it.
    pub report: &'a Report,
    pub config_toml: &'a str,
    /// Of a run that came to its end.
    pub fingerprint: Option<&'a str>,
}

/// metrics.json.
#[derive(Serialize)]
struct Metrics<'a> {
    #[serde(flatten)]
    report: &'a Report,
    #[serde(skip_serializing_if = "Option::is_none")]
    fingerprint: Option<&'a str>,
}

impl Output {
    /// The format to write: that of the input unless another one is asked for.
    pub fn format(document: &Document, asked: Option<Format>) -> Format {
        asked.unwrap_or(match document.format() {
            Format::Stl => Format::Obj,
            own => own,
        })
    }

    /// Makes the folder, so that a bad one is noticed before training. A folder in which the
    /// result would take the place of the input is refused, and so is a format without UVs.
    pub fn prepare(&self, document: &Document, input: Option<&Path>) -> Result<(), Failure> {
        if self.format == Format::Xyz && matches!(document.surface(), Surface::Mesh(_)) {
            let reason = "XYZ has no place for a mesh; choose another --format";
            return Err(Failure::input(reason));
        }
        std::fs::create_dir_all(&self.folder)
            .map_err(|error| Failure::input(format!("{}: {error}", self.folder.display())))?;
        let is_output = |input: &Path| {
            let written = self.file().canonicalize();
            matches!((written, input.canonicalize()), (Ok(a), Ok(b)) if a == b)
        };
        if input.is_some_and(is_output) {
            let reason = "it would be overwritten; choose another folder with -o";
            return Err(Failure::input(reason));
        }
        Ok(())
    }

    /// Where the input with UVs goes: its own name, unless that is the name of the seams' file.
    pub fn file(&self) -> PathBuf {
        let suffix = if self.stem.eq_ignore_ascii_case("seams") {
            "-uv"
        } else {
            ""
        };
        let extension = self.format.extension();
        self.folder
            .join(format!("{}{suffix}.{extension}", self.stem))
    }

    /// The report of a complete run with this fingerprint, if the folder holds its results.
    pub fn done(&self, fingerprint: &str) -> Option<serde_json::Value> {
        let exists = |name: &str| self.folder.join(name).exists();
        let report = self.report();
        let has_model = exists(MODEL) || report["method"] == "direct";
        let complete = has_model && SIDE_FILES.iter().all(|name| exists(name));
        let is_done = complete && self.file().exists() && report["fingerprint"] == fingerprint;
        is_done.then_some(report)
    }

    /// The report that is there.
    fn report(&self) -> serde_json::Value {
        let report = std::fs::read(self.folder.join(REPORT)).unwrap_or_default();
        serde_json::from_slice(&report).unwrap_or_default()
    }

    /// Takes the fingerprint out of a report that is there: the folder is about to change.
    fn invalidate(&self) -> Result<(), Failure> {
        let mut report = self.report();
        let fields = report.as_object_mut();
        if fields.is_some_and(|fields| fields.shift_remove("fingerprint").is_some()) {
            self.save_json(REPORT, &report)?;
        }
        Ok(())
    }

    fn save_json(&self, name: &str, value: &impl Serialize) -> Result<(), Failure> {
        let mut json = serde_json::to_vec_pretty(value).map_err(Failure::work)?;
        json.push(b'\n');
        self.save(name, &json)
    }

    /// Writes every file of the folder, each whole or not at all, and the report last.
    pub fn write(&self, results: &Results) -> Result<(), Failure> {
        self.invalidate()?;
        let unwrapped = results.unwrapped;
        let surface = results.document.surface();
        let options = WriteOptions {
            seam_lines: if self.seam_lines {
                unwrapped.seams.edges.clone()
            } else {
                Vec::new()
            },
            ..self.options.clone()
        };
        let drawn_seams = picture::Seams {
            points: &unwrapped.seams.points,
            edges: &unwrapped.seams.edges,
        };
        let (uv_png, preview_png) = match (surface, &unwrapped.uvs) {
            (Surface::Mesh(mesh), Uvs::Mesh(map)) => {
                results
                    .document
                    .write_mesh_uvs(map, self.file(), &options)
                    .map_err(Failure::work)?;
                let tiles = unwrapped.layout.as_ref().map_or(1, |one| one.config.tiles);
                let row = in_a_row(map, results.parting, tiles).map_err(Failure::work)?;
                let drawn = Drawn::Mesh(mesh, &row);
                (
                    uv_picture(drawn, UV_PICTURE_SIDE),
                    preview_picture(drawn, drawn_seams, PREVIEW_SIDE),
                )
            }
            (Surface::PointCloud(cloud), Uvs::Points(uvs)) => {
                results
                    .document
                    .write_point_uvs(uvs, self.file(), &options)
                    .map_err(Failure::work)?;
                let drawn = Drawn::Cloud(cloud, uvs);
                (
                    uv_picture(drawn, UV_PICTURE_SIDE),
                    preview_picture(drawn, drawn_seams, PREVIEW_SIDE),
                )
            }
            _ => return Err(Failure::work("the UVs are of another kind of surface")),
        };
        self.write_seams(surface, unwrapped)?;
        self.save_model(unwrapped)?;
        self.save("config.toml", results.config_toml.as_bytes())?;
        self.save("uv.png", &encode_png(&uv_png).map_err(Failure::work)?)?;
        self.save(
            "preview.png",
            &encode_png(&preview_png).map_err(Failure::work)?,
        )?;
        self.save_json(
            REPORT,
            &Metrics {
                report: results.report,
                fingerprint: results.fingerprint,
            },
        )
    }

    /// Writes the trained networks. Without any, those of an earlier run go: they would not belong
    /// to the UVs beside them.
    fn save_model(&self, unwrapped: &Unwrapped<Vec<u8>>) -> Result<(), Failure> {
        match &unwrapped.map {
            Some(model) => self.save(MODEL, model),
            None => match std::fs::remove_file(self.folder.join(MODEL)) {
                Err(error) if error.kind() != ErrorKind::NotFound => Err(Failure::work(error)),
                _ => Ok(()),
            },
        }
    }

    fn write_seams(
        &self,
        surface: &Surface,
        unwrapped: &Unwrapped<Vec<u8>>,
    ) -> Result<(), Failure> {
        let thresholds: Vec<Option<Threshold>> = unwrapped
            .thresholds
            .iter()
            .map(|threshold| {
                threshold.map(|threshold| Threshold {
                    distance: threshold.distance,
                    spacing: threshold.spacing,
                })
            })
            .collect();
        let seams = fam_io::seams::Seams {
            positions: surface.positions(),
            points: &unwrapped.seams.points,
            edges: &unwrapped.seams.edges,
            thresholds: &thresholds,
        };
        write_seams_json(self.folder.join("seams.json"), &seams).map_err(Failure::work)?;
        write_seams_obj(self.folder.join("seams.obj"), &seams).map_err(Failure::work)
    }

    fn save(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        write_atomically(self.folder.join(name), |out| out.write_all(bytes)).map_err(Failure::work)
    }
}
