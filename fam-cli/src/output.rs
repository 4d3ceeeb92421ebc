//! The folder that `unwrap` writes.

use std::path::{Path, PathBuf};

use fam_core::metrics::Metrics;
use fam_core::seams::{SeamThreshold, Seams};
use fam_core::surface::{Surface, UvMap};
use fam_core::training::Step;
use fam_io::atomic::write_atomically;
use fam_io::picture::{self, Flattened, encode_png, preview_picture, uv_picture};
use fam_io::seams::{write_seams_json, write_seams_obj};
use fam_io::{Document, WriteOptions};
use serde::Serialize;

use crate::failure::Failure;

/// Side of uv.png in pixels.
const UV_PICTURE_SIDE: u32 = 1024;

/// A flattened surface and how it came about.
pub struct Layout<'a> {
    pub uvs: &'a [[f32; 2]],
    pub seams: &'a Seams,
    pub threshold: SeamThreshold,
    pub model: &'a [u8],
    pub config_toml: &'a str,
    pub last: &'a Step,
}

/// metrics.json. It holds no times, so that the same run writes the same bytes.
#[derive(Debug, Serialize)]
pub struct Report {
    version: u32,
    points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<Metrics>,
    seam_points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    torn_edges: Option<usize>,
    iterations: usize,
    loss: serde_json::Map<String, serde_json::Value>,
}

/// What `unwrap --json` prints.
#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    pub input: &'a str,
    pub folder: &'a Path,
    pub backend: &'a str,
    pub training_seconds: f64,
    pub interrupted: bool,
    #[serde(flatten)]
    pub report: &'a Report,
}

impl Report {
    fn new(surface: &Surface, mesh: Option<Metrics>, layout: &Layout) -> Self {
        let mut loss = serde_json::Map::new();
        loss.insert("total".to_string(), layout.last.total.into());
        for (term, value) in &layout.last.terms {
            loss.insert(term.name().to_string(), (*value).into());
        }
        Self {
            version: 1,
            points: surface.positions().len(),
            torn_edges: mesh.is_some().then_some(layout.seams.edges.len()),
            mesh,
            seam_points: layout.seams.points.len(),
            iterations: layout.last.iteration + 1,
            loss,
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
}

/// Makes the folder, so that a bad one is noticed before training. A folder in which the result
/// would take the place of the input is refused.
pub fn prepare(
    folder: &Path,
    stem: &str,
    document: &Document,
    input: Option<&Path>,
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::input(format!("{}: {error}", folder.display())))?;
    let same = |input: &Path| {
        let output = mesh_path(folder, stem, document).canonicalize();
        matches!((output, input.canonicalize()), (Ok(a), Ok(b)) if a == b)
    };
    match input {
        Some(input) if same(input) => Err(Failure::input(format!(
            "{}: it would be overwritten; choose another folder with -o",
            input.display()
        ))),
        _ => Ok(()),
    }
}

/// Where the input with UVs goes: its own name, unless that is the name of the seams' file.
fn mesh_path(folder: &Path, stem: &str, document: &Document) -> PathBuf {
    let suffix = if stem.eq_ignore_ascii_case("seams") {
        "-uv"
    } else {
        ""
    };
    folder.join(format!("{stem}{suffix}.{}", document.format().extension()))
}

/// Writes every file of the folder, each whole or not at all.
pub fn write(
    folder: &Path,
    stem: &str,
    document: &Document,
    layout: &Layout,
) -> Result<Report, Failure> {
    let surface = document.surface();
    let mesh_path = mesh_path(folder, stem, document);
    let seams = picture::Seams {
        points: &layout.seams.points,
        edges: &layout.seams.edges,
    };
    let (metrics, uv_png, preview_png) = match surface {
        Surface::Mesh(mesh) => {
            let map = UvMap::new(layout.uvs.to_vec(), mesh.triangles().to_vec())
                .map_err(Failure::work)?;
            document
                .write_mesh_uvs(&map, mesh_path, &WriteOptions::default())
                .map_err(Failure::work)?;
            let flattened = Flattened::Mesh(mesh, &map);
            (
                Some(Metrics::measure(mesh, &map).map_err(Failure::work)?),
                uv_picture(flattened, UV_PICTURE_SIDE),
                preview_picture(flattened, seams),
            )
        }
        Surface::PointCloud(cloud) => {
            document
                .write_point_uvs(layout.uvs, mesh_path, &WriteOptions::default())
                .map_err(Failure::work)?;
            let flattened = Flattened::Cloud(cloud, layout.uvs);
            (
                None,
                uv_picture(flattened, UV_PICTURE_SIDE),
                preview_picture(flattened, seams),
            )
        }
    };
    let report = Report::new(surface, metrics, layout);

    let seams = fam_io::seams::Seams {
        positions: surface.positions(),
        points: &layout.seams.points,
        edges: &layout.seams.edges,
        threshold: layout.threshold.distance,
        spacing: layout.threshold.spacing,
    };
    write_seams_json(folder.join("seams.json"), &seams).map_err(Failure::work)?;
    write_seams_obj(folder.join("seams.obj"), &seams).map_err(Failure::work)?;
    let save = |name: &str, bytes: &[u8]| {
        write_atomically(folder.join(name), |out| out.write_all(bytes)).map_err(Failure::work)
    };
    save("model.safetensors", layout.model)?;
    save("config.toml", layout.config_toml.as_bytes())?;
    let mut json = serde_json::to_vec_pretty(&report).map_err(Failure::work)?;
    json.push(b'\n');
    save("metrics.json", &json)?;
    save("uv.png", &encode_png(&uv_png).map_err(Failure::work)?)?;
    save(
        "preview.png",
        &encode_png(&preview_png).map_err(Failure::work)?,
    )?;
    Ok(report)
}
