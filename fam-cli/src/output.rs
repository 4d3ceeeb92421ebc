//! The folder that `unwrap` writes.

use std::path::{Path, PathBuf};

use fam_core::atlas::Part;
use fam_core::metrics::Metrics;
use fam_core::surface::{Component, Conditioning, Surface, UvMap};
use fam_io::atomic::write_atomically;
use fam_io::picture::{self, Flattened as Drawn, encode_png, preview_picture, uv_picture};
use fam_io::seams::{Threshold, write_seams_json, write_seams_obj};
use fam_io::{Document, Format, Uvs, WriteOptions};
use serde::Serialize;

use crate::failure::Failure;
use crate::flatten::Flattened;
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
pub struct Layout<'a> {
    pub document: &'a Document,
    pub parting: &'a Parting,
    pub flattened: &'a Flattened,
    pub config_toml: &'a str,
    /// Of a run that came to its end.
    pub fingerprint: Option<&'a str>,
}

/// metrics.json. It holds no times, so that the same run writes the same bytes.
#[derive(Debug, Serialize)]
pub struct Report {
    version: u32,
    points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<Metrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    conditioning: Option<Conditioning>,
    uv_squares: usize,
    seam_points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    torn_edges: Option<usize>,
    pub components: Vec<PartReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fingerprint: Option<String>,
}

/// How one component was flattened.
#[derive(Debug, Serialize)]
pub struct PartReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<usize>,
    points: usize,
    pub iterations: usize,
    loss: serde_json::Map<String, serde_json::Value>,
}

/// What `unwrap --json` prints.
#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    pub state: &'a str,
    pub input: &'a str,
    pub folder: &'a Path,
    pub file: PathBuf,
    pub backend: &'a str,
    pub training_seconds: f64,
    pub interrupted: bool,
    #[serde(flatten)]
    pub report: &'a Report,
}

impl PartReport {
    fn new(part: &Part, component: Option<&Component>) -> Self {
        let mut loss = serde_json::Map::new();
        if let Some(last) = &part.last {
            loss.insert("total".to_string(), last.total.into());
            for (term, value) in &last.terms {
                loss.insert(term.name().to_string(), (*value).into());
            }
        }
        Self {
            triangles: component.map(|component| component.mesh.triangles().len()),
            points: part.points,
            iterations: part.last.as_ref().map_or(0, |last| last.iteration + 1),
            loss,
        }
    }
}

impl Report {
    fn new(layout: &Layout, mesh: Option<Metrics>) -> Self {
        let Flattened {
            components,
            parts,
            seams,
            ..
        } = layout.flattened;
        let component = |i: usize| components.as_ref().map(|components| &components.list[i]);
        Self {
            version: 2,
            points: layout.document.surface().positions().len(),
            torn_edges: mesh.is_some().then_some(seams.edges.len()),
            mesh,
            conditioning: components
                .as_ref()
                .map(|components| components.conditioning),
            uv_squares: squares(layout.parting),
            seam_points: seams.points.len(),
            components: parts
                .iter()
                .enumerate()
                .map(|(i, part)| PartReport::new(part, component(i)))
                .collect(),
            fingerprint: layout.fingerprint.map(str::to_string),
        }
    }

    /// The result in half a line.
    pub fn headline(&self) -> String {
        match &self.mesh {
            Some(metrics) => format!(
                "conformality {:.3}, {} of {} triangles flipped, {} overlapping pairs, {} torn edges",
                metrics.conformality,
                metrics.flipped_triangles,
                metrics.triangles,
                metrics.overlapping_pairs,
                self.torn_edges.unwrap_or(0),
            ),
            None => format!("{} of {} points on seams", self.seam_points, self.points),
        }
    }

    /// What was done to the input, if anything.
    pub fn conditioned(&self) -> Option<String> {
        let found = self.conditioning?;
        let all = [
            (found.welded_vertices, "coinciding vertices taken for one"),
            (found.non_manifold_edges, "non-manifold edges split"),
            (found.non_manifold_vertices, "non-manifold vertices split"),
            (found.duplicate_triangles, "repeated triangles"),
            (found.zero_area_triangles, "triangles without area"),
            (found.unreferenced_vertices, "vertices in no face"),
        ];
        let some: Vec<String> = all
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        (!some.is_empty()).then(|| some.join(", "))
    }

    /// How many components were trained, and how many were flat, if there are several.
    pub fn composition(&self) -> Option<String> {
        let trained = self.components.iter().filter(|c| c.iterations > 0).count();
        let flat = self.components.len() - trained;
        (self.components.len() > 1).then(|| format!("{trained} trained, {flat} flat"))
    }
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
    pub fn write(&self, layout: &Layout) -> Result<Report, Failure> {
        self.invalidate()?;
        let Flattened {
            seams, thresholds, ..
        } = layout.flattened;
        let surface = layout.document.surface();
        let options = WriteOptions {
            seam_lines: if self.seam_lines {
                seams.edges.clone()
            } else {
                Vec::new()
            },
            ..self.options.clone()
        };
        let drawn_seams = picture::Seams {
            points: &seams.points,
            edges: &seams.edges,
        };
        let (metrics, uv_png, preview_png) = match (surface, &layout.flattened.uvs) {
            (Surface::Mesh(mesh), Uvs::Mesh(map)) => {
                let file = self.file();
                layout
                    .document
                    .write_mesh_uvs(map, file, &options)
                    .map_err(Failure::work)?;
                let row = in_a_row(map, layout)?;
                let drawn = Drawn::Mesh(mesh, &row);
                (
                    Some(Metrics::measure(mesh, &row).map_err(Failure::work)?),
                    uv_picture(drawn, UV_PICTURE_SIDE),
                    preview_picture(drawn, drawn_seams),
                )
            }
            (Surface::PointCloud(cloud), Uvs::Points(uvs)) => {
                layout
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
        let report = Report::new(layout, metrics);

        let thresholds: Vec<Option<Threshold>> = thresholds
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
            points: &seams.points,
            edges: &seams.edges,
            thresholds: &thresholds,
        };
        write_seams_json(self.folder.join("seams.json"), &seams).map_err(Failure::work)?;
        write_seams_obj(self.folder.join("seams.obj"), &seams).map_err(Failure::work)?;
        self.save("model.safetensors", &layout.flattened.model)?;
        self.save("config.toml", layout.config_toml.as_bytes())?;
        self.save("uv.png", &encode_png(&uv_png).map_err(Failure::work)?)?;
        self.save(
            "preview.png",
            &encode_png(&preview_png).map_err(Failure::work)?,
        )?;
        self.save_json(REPORT, &report)?;
        Ok(report)
    }

    fn save(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        write_atomically(self.folder.join(name), |out| out.write_all(bytes)).map_err(Failure::work)
    }
}

fn squares(parting: &Parting) -> usize {
    parting
        .squares
        .iter()
        .max()
        .map_or(1, |&last| last as usize + 1)
}

/// The map with its UV squares side by side, so that triangles of different squares do not count
/// as overlapping.
fn in_a_row(map: &UvMap, layout: &Layout) -> Result<UvMap, Failure> {
    if squares(layout.parting) == 1 {
        return Ok(map.clone());
    }
    let mut uvs = map.uvs().to_vec();
    let mut moved = vec![false; uvs.len()];
    for (triangle, &label) in map.triangles().iter().zip(&layout.parting.labels) {
        for &corner in triangle {
            let corner = corner as usize;
            if !std::mem::replace(&mut moved[corner], true) {
                uvs[corner][0] += layout.parting.squares[label as usize] as f32;
            }
        }
    }
    UvMap::new(uvs, map.triangles().to_vec()).map_err(Failure::work)
}
