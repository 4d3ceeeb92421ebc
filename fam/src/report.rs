//! What is written down of an unwrapped surface.

use fam_core::atlas::Part;
use fam_layout::{ComponentLayout, LayoutConfig, MeshLayout};
use fam_surface::metrics::Metrics;
use fam_surface::{Component, Conditioning, Surface};
use serde::Serialize;

use crate::layout::{LaidOut, MarksReport};
use crate::method::Used;
use crate::parting::Parting;
use crate::unwrapped::Unwrapped;

/// What metrics.json says (docs/metrics.md). It holds no times, so that the same run writes the
/// same bytes.
#[derive(Debug, Serialize)]
pub struct Report {
    version: u32,
    method: Used,
    points: usize,
    /// The metrics of a mesh's UVs.
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
    components: Vec<PartReport>,
}

/// How the surface was laid out.
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
    tiles: Vec<u32>,
    resolution: Vec<u32>,
}

/// One component.
#[derive(Debug, Serialize)]
struct PartReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<usize>,
    #[serde(flatten)]
    training: Option<PartTraining>,
    #[serde(skip_serializing_if = "Option::is_none")]
    finish: Option<PartFinish>,
}

/// How one component was trained.
#[derive(Debug, Serialize)]
struct PartTraining {
    points: usize,
    iterations: usize,
    loss: serde_json::Map<String, serde_json::Value>,
}

/// How one component was laid out.
#[derive(Debug, Serialize)]
struct PartFinish {
    charts: usize,
    energy: f64,
    area_distortion: f64,
    conformality: f64,
    seam_length: f64,
}

impl Report {
    /// The report on an unwrapped surface.
    pub fn new<M>(surface: &Surface, parting: &Parting, unwrapped: &Unwrapped<M>) -> Self {
        let components = unwrapped.components.as_ref();
        let laid_out = unwrapped.layout.as_ref();
        // The surface through a cloud is not the user's.
        let layout = laid_out.filter(|laid_out| laid_out.unreached.is_none());
        let parts = unwrapped.training.as_ref().map(|training| &training.parts);
        let count = components.map_or(1, |components| components.list.len());
        let part = |i: usize| {
            let component = components.map(|components| &components.list[i]);
            PartReport {
                triangles: component.map(|c: &Component| c.mesh.triangles().len()),
                training: parts.map(|parts| PartTraining::new(&parts[i])),
                finish: layout
                    .and_then(|one| one.layout.components.get(i))
                    .map(PartFinish::new),
            }
        };
        let seams = &unwrapped.seams;
        let warnings = unwrapped.warnings();
        Self {
            version: 4,
            method: unwrapped.method,
            points: surface.positions().len(),
            mesh: unwrapped.metrics.clone(),
            raw: unwrapped.raw_metrics.clone(),
            finish: laid_out.map(|laid_out| {
                FinishReport::new(laid_out, warnings.iter().map(ToString::to_string).collect())
            }),
            conditioning: components.map(|components| components.conditioning),
            uv_squares: parting.uv_squares(),
            seam_points: seams.points.len(),
            torn_edges: unwrapped.metrics.is_some().then_some(seams.edges.len()),
            components: (0..count).map(part).collect(),
        }
    }

    /// Adds what a caller has to say about the layout, ahead of what the layout says itself.
    pub fn warn(&mut self, sentences: Vec<String>) {
        if let Some(finish) = &mut self.finish {
            finish.warnings.splice(0..0, sentences);
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
                metrics.unintended_overlaps(),
                self.torn_edges.unwrap_or(0),
                if self.finish.is_some() { "cut" } else { "torn" },
            ),
            None => format!("{} of {} points on seams", self.seam_points, self.points),
        }
    }

    /// What the user has to know about the layout.
    pub fn warnings(&self) -> &[String] {
        self.finish.as_ref().map_or(&[], |finish| &finish.warnings)
    }

    /// What was done to the input, if anything.
    pub fn conditioned(&self) -> Option<String> {
        let found = self.conditioning?;
        let all = [
            (found.welded_vertices, "coinciding vertices taken for one"),
            (found.non_manifold_edges, "non-manifold edges"),
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

    /// How many components there are, if there are several, and how many of them were trained.
    pub fn composition(&self) -> Option<String> {
        let all = self.components.len();
        if all == 1 {
            return None;
        }
        let trainings = self.components.iter().map(|part| part.training.as_ref());
        let trained = |training: Option<&PartTraining>| Some(usize::from(training?.iterations > 0));
        Some(match trainings.map(trained).sum::<Option<usize>>() {
            Some(trained) => format!("{trained} trained, {} flat", all - trained),
            None => format!("{all} parts"),
        })
    }
}

impl FinishReport {
    fn new(laid_out: &LaidOut, warnings: Vec<String>) -> Self {
        let of_mesh = laid_out.unreached.is_none();
        Self {
            config: laid_out.config.clone(),
            layout: of_mesh.then(|| LayoutReport::new(&laid_out.layout)),
            unreached_points: laid_out.unreached,
            marks: laid_out.marks,
            warnings,
        }
    }
}

impl LayoutReport {
    fn new(layout: &MeshLayout) -> Self {
        let squares = layout.squares.iter();
        Self {
            charts: layout.components.iter().map(|one| one.charts).sum(),
            energy: layout.energy(),
            seam_length: layout.relative_seam_length(),
            coverage: squares.clone().map(|one| one.coverage).collect(),
            margin: squares.clone().map(|one| one.margin).collect(),
            tiles: squares.clone().map(|one| one.tiles).collect(),
            resolution: squares.map(|one| one.resolution).collect(),
        }
    }
}

impl PartFinish {
    fn new(component: &ComponentLayout) -> Self {
        Self {
            charts: component.charts,
            energy: component.distortion.energy,
            area_distortion: component.distortion.area,
            conformality: component.distortion.conformality,
            seam_length: component.relative_seam_length(),
        }
    }
}

impl PartTraining {
    fn new(part: &Part) -> Self {
        let mut loss = serde_json::Map::new();
        if let Some(last) = &part.last {
            loss.insert("total".to_string(), last.total.into());
            for (term, value) in &last.terms {
                loss.insert(term.name().to_string(), (*value).into());
            }
        }
        Self {
            points: part.points,
            iterations: part.last.as_ref().map_or(0, |last| last.iteration + 1),
            loss,
        }
    }
}
