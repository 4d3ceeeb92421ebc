//! What metrics.json and `unwrap --json` say.

use std::path::{Path, PathBuf};

use fam_core::atlas::Part;
use fam_layout::{self, LayoutConfig, MeshLayout};
use fam_surface::metrics::Metrics;
use fam_surface::{Component, Conditioning};
use serde::Serialize;

use crate::finish::{Finished, Outcome};
use crate::marks::MarksReport;
use crate::output::Results;
use crate::warnings::warnings;

/// metrics.json. It holds no times, so that the same run writes the same bytes.
#[derive(Debug, Serialize)]
pub struct Report {
    version: u32,
    points: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<Metrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    raw: Option<Metrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    finish: Option<FinishReport>,
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

/// How the surface was finished.
#[derive(Debug, Serialize)]
struct FinishReport {
    config: LayoutConfig,
    #[serde(flatten)]
    layout: Option<LayoutReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unreached_points: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    marks: Option<MarksReport>,
    warnings: Vec<String>,
}

/// What all components of a mesh came to.
#[derive(Debug, Serialize)]
struct LayoutReport {
    charts: usize,
    energy: f64,
    seam_length: f64,
    coverage: Vec<f64>,
    margin: Vec<f64>,
}

/// How one component was flattened.
#[derive(Debug, Serialize)]
pub struct PartReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<usize>,
    points: usize,
    pub iterations: usize,
    loss: serde_json::Map<String, serde_json::Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    finish: Option<PartFinish>,
}

/// How one component was finished.
#[derive(Debug, Serialize)]
struct PartFinish {
    charts: usize,
    energy: f64,
    area_distortion: f64,
    conformality: f64,
    seam_length: f64,
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
    pub finishing_seconds: f64,
    pub interrupted: bool,
    #[serde(flatten)]
    pub report: &'a Report,
}

/// The metrics of a mesh.
pub struct Measured {
    /// Of the UVs that are written.
    pub mesh: Metrics,
    /// Of the raw map, if that is another.
    pub raw: Option<Metrics>,
}

impl Report {
    /// The report on results; those of a mesh are `measured`.
    pub fn new(results: &Results, measured: Option<Measured>) -> Self {
        let components = results.flattened.components.as_ref();
        let finished = results.layout.finished.as_ref();
        let atlas = finished.and_then(|finished| match &finished.outcome {
            Outcome::Mesh { atlas, .. } => Some(atlas),
            Outcome::Cloud { .. } => None,
        });
        let (mesh, raw) = match measured {
            Some(Measured { mesh, raw }) => (Some(mesh), raw),
            None => (None, None),
        };
        let seams = &results.layout.seams;
        let part = |(i, part): (usize, &Part)| {
            let component = components.map(|components| &components.list[i]);
            let finish = atlas.map(|atlas| PartFinish::new(&atlas.components[i]));
            PartReport::new(part, component, finish)
        };
        Self {
            version: 3,
            points: results.document.surface().positions().len(),
            finish: finished.map(|finished| FinishReport::new(finished, mesh.as_ref())),
            torn_edges: mesh.is_some().then_some(seams.edges.len()),
            mesh,
            raw,
            conditioning: components.map(|components| components.conditioning),
            uv_squares: results.parting.uv_squares(),
            seam_points: seams.points.len(),
            components: results
                .flattened
                .parts
                .iter()
                .enumerate()
                .map(part)
                .collect(),
            fingerprint: results.fingerprint.map(str::to_string),
        }
    }

    /// The result in half a line.
    pub fn headline(&self) -> String {
        match &self.mesh {
            Some(metrics) => format!(
                "conformality {:.3}, {} of {} triangles flipped, {} overlapping pairs, {} {} edges",
                metrics.conformality,
                metrics.flipped_triangles,
                metrics.triangles,
                metrics.overlapping_pairs,
                self.torn_edges.unwrap_or(0),
                if self.finish.is_some() { "cut" } else { "torn" },
            ),
            None => format!("{} of {} points on seams", self.seam_points, self.points),
        }
    }

    /// What the user has to know about the finished layout.
    pub fn warnings(&self) -> &[String] {
        self.finish.as_ref().map_or(&[], |finish| &finish.warnings)
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

impl FinishReport {
    fn new(finished: &Finished, mesh: Option<&Metrics>) -> Self {
        let (layout, unreached_points) = match &finished.outcome {
            Outcome::Mesh { atlas, .. } => (Some(LayoutReport::new(atlas)), None),
            Outcome::Cloud { unreached, .. } => (None, Some(*unreached)),
        };
        Self {
            config: finished.config.clone(),
            layout,
            unreached_points,
            marks: finished.marks.clone(),
            warnings: warnings(finished, mesh),
        }
    }
}

impl LayoutReport {
    fn new(atlas: &MeshLayout) -> Self {
        Self {
            charts: atlas.components.iter().map(|one| one.charts).sum(),
            energy: atlas.energy(),
            seam_length: atlas.relative_seam_length(),
            coverage: atlas.coverage.clone(),
            margin: atlas.margin.clone(),
        }
    }
}

impl PartFinish {
    fn new(finished: &finish::Finished) -> Self {
        Self {
            charts: finished.charts,
            energy: finished.distortion.energy,
            area_distortion: finished.distortion.area,
            conformality: finished.distortion.conformality,
            seam_length: finished.relative_seam_length(),
        }
    }
}

impl PartReport {
    fn new(part: &Part, component: Option<&Component>, finish: Option<PartFinish>) -> Self {
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
            finish,
        }
    }
}
