//! What metrics.json and `unwrap --json` say.

use std::path::{Path, PathBuf};

use fam_core::atlas::Part;
use fam_core::finish::{FinishConfig, FinishedAtlas};
use fam_core::metrics::Metrics;
use fam_core::surface::{Component, Components, Conditioning};
use serde::Serialize;

use crate::finish::{Finished, Outcome};
use crate::marks::MarksReport;
use crate::output::Results;

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
    config: FinishConfig,
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
            let finish = atlas.zip(component);
            PartReport::new(
                part,
                component,
                finish.map(|(a, c)| PartFinish::new(a, i, c)),
            )
        };
        Self {
            version: 3,
            points: results.document.surface().positions().len(),
            finish: finished.map(|finished| {
                let layout = components.zip(atlas);
                let layout = layout.map(|(components, atlas)| LayoutReport::new(components, atlas));
                FinishReport::new(finished, layout, mesh.as_ref())
            }),
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
    fn new(finished: &Finished, layout: Option<LayoutReport>, mesh: Option<&Metrics>) -> Self {
        let mut warnings = Vec::new();
        if finished.stopped {
            warnings.push("finishing was stopped early".to_string());
        }
        warnings.extend(finished.marks.iter().flat_map(MarksReport::warnings));
        let mut unreached_points = None;
        match &finished.outcome {
            Outcome::Mesh { atlas, .. } => {
                let bound = finished.config.distortion_bound;
                warnings.extend(above_bound(atlas, bound));
            }
            Outcome::Cloud { unreached } => {
                unreached_points = Some(*unreached);
                if *unreached > 0 {
                    warnings.push(format!(
                        "{unreached} points have no place in the surface and keep the raw map's UVs"
                    ));
                }
            }
        }
        if let Some(metrics) = mesh {
            let counts = [
                (
                    metrics.collapsed_triangles as u64,
                    "triangles without area in the plane",
                ),
                (metrics.flipped_triangles as u64, "flipped triangles"),
                (metrics.overlapping_pairs, "overlapping pairs of triangles"),
            ];
            let some = counts.iter().filter(|(count, _)| *count > 0);
            warnings.extend(some.map(|(count, what)| format!("{count} {what}")));
        }
        Self {
            config: finished.config.clone(),
            layout,
            unreached_points,
            marks: finished.marks.clone(),
            warnings,
        }
    }
}

/// That components did not reach the distortion bound, if any did not.
fn above_bound(atlas: &FinishedAtlas, bound: f64) -> Option<String> {
    let energies = atlas.components.iter().map(|finished| finished.energy);
    let above: Vec<f64> = energies.filter(|energy| *energy > bound).collect();
    let worst = above.iter().fold(bound, |worst, energy| worst.max(*energy));
    let all = atlas.components.len();
    match above.len() {
        0 => None,
        _ if all == 1 => Some(format!(
            "the energy is {worst:.3}, above the distortion bound of {bound}"
        )),
        some => Some(format!(
            "{some} of {all} components are above the distortion bound of {bound}, the worst with \
             an energy of {worst:.3}"
        )),
    }
}

fn area(component: &Component) -> f64 {
    component.mesh.triangle_areas().iter().sum()
}

impl LayoutReport {
    fn new(components: &Components, atlas: &FinishedAtlas) -> Self {
        let areas: Vec<f64> = components.list.iter().map(area).collect();
        let total: f64 = areas.iter().sum();
        let all = &atlas.components;
        let energies = all.iter().zip(&areas).filter(|(_, area)| **area > 0.0);
        Self {
            charts: all.iter().map(|finished| finished.charts).sum(),
            energy: energies
                .map(|(finished, area)| finished.energy * area / total)
                .sum(),
            seam_length: all.iter().map(|f| f.seam_length).sum::<f64>() / total.sqrt(),
            coverage: atlas.coverage.clone(),
        }
    }
}

impl PartFinish {
    fn new(atlas: &FinishedAtlas, i: usize, component: &Component) -> Self {
        let finished = &atlas.components[i];
        let root = area(component).sqrt();
        Self {
            charts: finished.charts,
            energy: finished.energy,
            seam_length: if root > 0.0 {
                finished.seam_length / root
            } else {
                0.0
            },
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
