//! The folder that `unwrap` writes.

use std::path::{Path, PathBuf};

use fam_io::atomic::write_atomically;
use fam_io::picture::{self, Flattened as Drawn, encode_png, preview_picture, uv_picture};
use fam_io::seams::{Threshold, write_seams_json, write_seams_obj};
use fam_io::{Document, Format, Uvs, WriteOptions};
use fam_surface::metrics::Metrics;
use fam_surface::{Surface, SurfaceError, TriangleMesh, UvMap};
use serde::Serialize;

use crate::failure::Failure;
use crate::finish::{Layout, Outcome};
use crate::flatten::Flattened;
use crate::report::{Measured, Report};
use crate::surface::Parting;

/// Side of uv.png in pixels.
const UV_PICTURE_SIDE: u32 = 1024;

/// Name of the report, which is written last: where it is, the folder is complete.
const REPORT: &str = "metrics.json";

/// The other files beside the mesh or cloud.
const SIDE_FILES: [&str; 6] = [
    "config.toml",
    "model.safetensors",
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

/// A flattened surface and how it came about.
pub struct Results<'a> {
    pub document: &'a Document,
    pub parting: &'a Parting,
    pub flattened: &'a Flattened,
    pub layout: &'a Layout,
    pub config_toml: &'a str,
    /// Of a run that came to its end.
    pub fingerprint: Option<&'a str>,
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

    /// Whether the folder holds the complete results of a run with this fingerprint.
    pub fn is_done(&self, fingerprint: &str) -> bool {
        let complete = SIDE_FILES
            .iter()
            .all(|name| self.folder.join(name).exists());
        complete && self.file().exists() && self.report()["fingerprint"] == fingerprint
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
    pub fn write(&self, results: &Results) -> Result<Report, Failure> {
        self.invalidate()?;
        let layout = results.layout;
        let surface = results.document.surface();
        let options = WriteOptions {
            seam_lines: if self.seam_lines {
                layout.seams.edges.clone()
            } else {
                Vec::new()
            },
            ..self.options.clone()
        };
        let drawn_seams = picture::Seams {
            points: &layout.seams.points,
            edges: &layout.seams.edges,
        };
        let (measured, uv_png, preview_png) = match (surface, &layout.uvs) {
            (Surface::Mesh(mesh), Uvs::Mesh(map)) => {
                results
                    .document
                    .write_mesh_uvs(map, self.file(), &options)
                    .map_err(Failure::work)?;
                let row = in_a_row(map, results.parting).map_err(Failure::work)?;
                let drawn = Drawn::Mesh(mesh, &row);
                (
                    Some(measure(mesh, &row, results).map_err(Failure::work)?),
                    uv_picture(drawn, UV_PICTURE_SIDE),
                    preview_picture(drawn, drawn_seams),
                )
            }
            (Surface::PointCloud(cloud), Uvs::Points(uvs)) => {
                results
                    .document
                    .write_point_uvs(uvs, self.file(), &options)
                    .map_err(Failure::work)?;
                let drawn = Drawn::Cloud(cloud, uvs);
                (
                    None,
                    uv_picture(drawn, UV_PICTURE_SIDE),
                    preview_picture(drawn, drawn_seams),
                )
            }
            _ => return Err(Failure::work("the UVs are of another kind of surface")),
        };
        let report = Report::new(results, measured);
        self.write_seams(surface, layout)?;
        self.save("model.safetensors", &results.flattened.model)?;
        self.save("config.toml", results.config_toml.as_bytes())?;
        self.save("uv.png", &encode_png(&uv_png).map_err(Failure::work)?)?;
        self.save(
            "preview.png",
            &encode_png(&preview_png).map_err(Failure::work)?,
        )?;
        self.save_json(REPORT, &report)?;
        Ok(report)
    }

    fn write_seams(&self, surface: &Surface, layout: &Layout) -> Result<(), Failure> {
        let thresholds: Vec<Option<Threshold>> = layout
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
            points: &layout.seams.points,
            edges: &layout.seams.edges,
            thresholds: &thresholds,
        };
        write_seams_json(self.folder.join("seams.json"), &seams).map_err(Failure::work)?;
        write_seams_obj(self.folder.join("seams.obj"), &seams).map_err(Failure::work)
    }

    fn save(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        write_atomically(self.folder.join(name), |out| out.write_all(bytes)).map_err(Failure::work)
    }
}

/// The metrics of a map and, if it was made of another, of that; UV squares side by side.
fn measure(mesh: &TriangleMesh, row: &UvMap, results: &Results) -> Result<Measured, SurfaceError> {
    let raw = results.layout.finished.as_ref().and_then(|finished| {
        let Outcome::Mesh { raw, .. } = &finished.outcome else {
            return None;
        };
        Some(in_a_row(raw, results.parting).and_then(|row| Metrics::measure(mesh, &row)))
    });
    Ok(Measured {
        mesh: Metrics::measure(mesh, row)?,
        raw: raw.transpose()?,
    })
}

/// The map with its UV squares side by side, so that triangles of different squares do not count
/// as overlapping.
fn in_a_row(map: &UvMap, parting: &Parting) -> Result<UvMap, SurfaceError> {
    if parting.uv_squares() == 1 {
        return Ok(map.clone());
    }
    let mut uvs = map.uvs().to_vec();
    let mut moved = vec![false; uvs.len()];
    for (triangle, &label) in map.triangles().iter().zip(&parting.labels) {
        for &corner in triangle {
            let corner = corner as usize;
            if !std::mem::replace(&mut moved[corner], true) {
                uvs[corner][0] += parting.squares[label as usize] as f32;
            }
        }
    }
    UvMap::new(uvs, map.triangles().to_vec())
}
