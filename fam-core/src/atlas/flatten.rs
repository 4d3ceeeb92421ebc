use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use burn::tensor::backend::{AutodiffBackend, Backend};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::checkpoint::{self, Checkpointer, Restored, Start, Trained};
use super::groups::{groups, joined};
use super::layout::{side_by_side, texel_density};
use super::{Atlas, Chart, ComponentMap, Placement, Projection};
use crate::map::TrainedMap;
use crate::sampling::poisson_disk;
use crate::training::{CheckpointError, Step, Strategies, Trainer, TrainingConfig, TrainingError};
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};
use fam_surface::{Component, Components, Duplicates, Surface, SurfaceError, TriangleMesh};

/// Points of a component that tell it from the others when other points are mapped.
const LANDMARKS: usize = 256;

/// Fewest landmarks of a component, however many components there are.
const FEWEST_LANDMARKS: usize = 16;

/// About how many landmarks all components have together at most.
const MOST_LANDMARKS: usize = 25_600;

/// Fewest points that a component is trained on: its share by area may be next to nothing.
const FEWEST_POINTS: usize = 64;

/// What belongs together, beside what hangs together.
#[derive(Debug, Clone, Copy, Default)]
pub struct Division<'a> {
    /// For every triangle a label; triangles of different labels are never in one component.
    /// Empty if all are alike.
    pub labels: &'a [u32],
    /// For every label the UV square that its components share. Empty if all share one.
    pub squares: &'a [u32],
    /// What becomes of triangles that repeat others.
    pub duplicates: Duplicates,
}

/// Where [`flatten`] is.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Which of the groups of components that are trained together, counting from 0.
    pub component: usize,
    /// How many groups there are.
    pub components: usize,
    /// Points of the iteration.
    pub points: usize,
    /// What the iteration did.
    pub step: &'a Step,
    /// Makes the bytes from which [`flatten`] goes on after this iteration. None once the observer broke
    /// off another component, whose networks are not trained to their end.
    pub checkpoint: Option<Checkpointer<'a>>,
}

/// How a component was flattened.
#[derive(Debug, Clone)]
pub struct Part {
    /// Points per iteration after the opening; 0 if it was not trained.
    pub points: usize,
    /// The last iteration; none if it was not trained.
    pub last: Option<Step>,
    /// Why training broke off, if it did; the map is that of the last good weights.
    pub error: Option<TrainingError>,
    /// The points (normalised) that it was trained on, with others; none if it was not.
    pub(super) sample: Arc<[[f32; 3]]>,
}

/// A flattened surface, as the networks map it: [`Components::vertex_maps`] and
/// [`Components::uv_map`] make one map of a mesh, `fam_layout` a layout.
#[derive(Debug, Clone)]
pub struct Flattened<B: Backend> {
    /// The maps.
    pub atlas: Atlas<B>,
    /// The components of a mesh; none for a cloud, which is one.
    pub components: Option<Components>,
    /// How each component was flattened.
    pub parts: Vec<Part>,
    /// The UVs of each component's vertices (of all points of a cloud).
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// The edges between components (see [`Components::cuts`]); those between labels if these
    /// have UV squares of their own.
    pub cuts: Vec<[u32; 2]>,
}

/// Flattens a surface: every component on its own, all in the unit square (one for each of
/// `division.squares`) at one texel density, their bounding boxes apart.
///
/// Networks are trained for every large component and once for all small ones together; flat ones
/// need none. They share the configured number of points by their area, and are trained one after
/// the other. `observe` is called after every step that is read; after it breaks off, the networks
/// that are left are trained until the first of theirs.
///
/// # Errors
/// The surface or the configuration cannot be trained on, or the checkpoint is of another surface. A component whose training diverges
/// is no error: its [`Part`] tells.
pub fn flatten<B: AutodiffBackend>(
    start: Start,
    surface: &Surface,
    division: Division,
    device: &B::Device,
    strategies: Strategies<B>,
    observe: impl FnMut(Progress) -> ControlFlow<()>,
) -> Result<Flattened<B::InnerBackend>, TrainingError> {
    let config = start.config();
    if let Some(problem) = config.problem() {
        return Err(TrainingError::Config(problem));
    }
    surface.normalization()?;
    let restored = match start {
        Start::Checkpoint(checkpoint) => checkpoint.restored::<B>(device).map(Some),
        Start::Fresh(_) => Ok(None),
    };
    let mut job = Job::<B, _> {
        config,
        device,
        strategies,
        observe,
        components: 1,
        restored: restored.map_err(unusable)?,
        finished: Vec::new(),
        stopped: false,
    };
    match surface {
        Surface::Mesh(mesh) => flatten_mesh(job, mesh, division),
        Surface::PointCloud(_) => {
            let (map, part) = job.train(surface, config.points)?;
            let uvs = map.uvs(surface.positions());
            let chart = Chart {
                map,
                placement: Placement::IDENTITY,
                landmarks: Vec::new(),
            };
            Ok(Flattened {
                atlas: Atlas {
                    charts: vec![chart],
                },
                components: None,
                parts: vec![part],
                uvs: vec![uvs],
                cuts: Vec::new(),
            })
        }
    }
}

fn unusable(error: CheckpointError) -> TrainingError {
    TrainingError::Checkpoint(error.to_string())
}

fn flatten_mesh<B: AutodiffBackend, F: FnMut(Progress) -> ControlFlow<()>>(
    mut job: Job<B, F>,
    mesh: &TriangleMesh,
    division: Division,
) -> Result<Flattened<B::InnerBackend>, TrainingError> {
    let components = Components::with(mesh, division.labels, division.duplicates)?;
    if components.conditioning.zero_area_triangles == mesh.triangles().len() {
        return Err(SurfaceError::TooSmall("its triangles have no area").into());
    }
    let list = &components.list;
    let mut maps: Vec<Option<(ComponentMap<B::InnerBackend>, Part)>> = list
        .iter()
        .map(|component| {
            let projection = Projection::of(&component.mesh)?;
            Some((ComponentMap::Projected(projection), Part::untrained()))
        })
        .collect();
    let trained: Vec<usize> = (0..list.len()).filter(|&i| maps[i].is_none()).collect();
    let groups = groups(list, &trained);
    let area = |&i: &usize| list[i].mesh.triangle_areas().iter().sum::<f64>();
    let trained_area: f64 = trained.iter().map(area).sum();
    let config = job.config;
    job.components = groups.len();
    for group in &groups {
        let share = group.iter().map(area).sum::<f64>() / trained_area * config.points as f64;
        let fewest = FEWEST_POINTS.min(config.points);
        let points = (share.round() as usize).clamp(fewest, config.points);
        match job.train(&Surface::Mesh(joined(list, group)?), points) {
            // Next to nothing beside the others, for it has no area to speak of.
            Err(TrainingError::Surface(_)) if list.len() > 1 => {
                for &i in group {
                    let projection = Projection::along_mean_normal(&list[i].mesh);
                    maps[i] = Some((ComponentMap::Projected(projection), Part::untrained()));
                }
            }
            trained => {
                let (map, part) = trained?;
                for &i in group {
                    maps[i] = Some((map.clone(), part.clone()));
                }
            }
        }
    }
    let (maps, parts): (Vec<_>, Vec<_>) = maps.into_iter().flatten().unzip();
    let raw: Vec<Vec<[f32; 2]>> = maps
        .iter()
        .zip(&components.list)
        .map(|(map, component)| map.uvs(component.mesh.positions()))
        .collect();
    let placements = placements(&components.list, &raw, division.squares);
    let uvs = raw
        .iter()
        .zip(&placements)
        .map(|(uvs, placement)| uvs.iter().map(|&q| placement.place(q)).collect())
        .collect();
    // Enough to tell a component from others; fewer of each where there are many.
    let count = (MOST_LANDMARKS / maps.len()).clamp(FEWEST_LANDMARKS, LANDMARKS);
    let several = maps.len() > 1;
    let charts = maps
        .into_iter()
        .zip(placements)
        .zip(&components.list)
        .map(|((map, placement), component)| Chart {
            map,
            placement,
            landmarks: if several {
                landmarks(&component.mesh, count, config.seed)
            } else {
                Vec::new()
            },
        })
        .collect();
    Ok(Flattened {
        atlas: Atlas { charts },
        cuts: components.cuts(mesh, !division.squares.is_empty()),
        components: Some(components),
        parts,
        uvs,
    })
}

/// The placements of components, each in the square of its label.
fn placements(components: &[Component], uvs: &[Vec<[f32; 2]>], squares: &[u32]) -> Vec<Placement> {
    let square = |c: &Component| squares.get(c.label as usize).copied().unwrap_or(0);
    let mut placements = vec![Placement::IDENTITY; components.len()];
    let mut all: Vec<u32> = components.iter().map(square).collect();
    all.sort_unstable();
    all.dedup();
    for wanted in all {
        let members: Vec<usize> = (0..components.len())
            .filter(|&i| square(&components[i]) == wanted)
            .collect();
        let own: Vec<&[[f32; 2]]> = members.iter().map(|&i| uvs[i].as_slice()).collect();
        let densities: Vec<_> = members
            .iter()
            .map(|&i| texel_density(&components[i].mesh, &uvs[i]))
            .collect();
        for (i, placement) in members.into_iter().zip(side_by_side(&own, &densities)) {
            placements[i] = placement;
        }
    }
    placements
}

/// Points spread over a component; its vertices where it has no area.
fn landmarks(mesh: &TriangleMesh, count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut rng = Pcg64::seed_from_u64(seed);
    match poisson_disk(mesh, count, &mut rng) {
        Ok(points) => points.into_iter().map(|point| point.position).collect(),
        Err(_) => mesh.positions().iter().copied().take(count).collect(),
    }
}

impl Part {
    fn untrained() -> Self {
        Self {
            points: 0,
            last: None,
            error: None,
            sample: Arc::new([]),
        }
    }
}

/// The training of one component after the other.
struct Job<'a, B: AutodiffBackend, F> {
    config: &'a TrainingConfig,
    device: &'a B::Device,
    strategies: Strategies<B>,
    observe: F,
    components: usize,
    /// Of the checkpoint that is gone on from.
    restored: Option<Restored<'a, B>>,
    finished: Vec<Trained<B::InnerBackend>>,
    stopped: bool,
}

impl<B: AutodiffBackend, F: FnMut(Progress) -> ControlFlow<()>> Job<'_, B, F> {
    fn train(
        &mut self,
        surface: &Surface,
        points: usize,
    ) -> Result<(ComponentMap<B::InnerBackend>, Part), TrainingError> {
        let config = TrainingConfig {
            points,
            ..self.config.clone()
        };
        let strategies = self.strategies.clone();
        let mut trainer =
            Trainer::<B>::with_strategies(config.clone(), surface, self.device, strategies)?;
        let restored = self.restored.as_ref();
        let known = restored.and_then(|restored| restored.finished.get(self.finished.len()));
        if let Some((map, part)) = known.cloned() {
            let same =
                part.points == trainer.points() && map.normalization() == trainer.normalization();
            if !same {
                return Err(unusable(CheckpointError::Surface));
            }
            self.finished.push((map.clone(), part.clone()));
            return Ok((ComponentMap::Trained(map), part));
        }
        if let Some(restored) = &mut self.restored {
            trainer = restored.resumed(trainer).map_err(unusable)?;
        }
        let points = trainer.points();
        let (whole, finished) = (self.config, &self.finished);
        let (observe, stopped) = (&mut self.observe, &mut self.stopped);
        let components = self.components;
        let outcome = trainer.run_observed(|trainer, step| {
            let bytes = |label: &str| checkpoint::write(label, whole, finished, trainer);
            let progress = Progress {
                component: finished.len(),
                components,
                points: config.points_at(step.iteration, points),
                step,
                checkpoint: (!*stopped).then_some(Checkpointer(&bytes)),
            };
            *stopped |= observe(progress).is_break();
            match *stopped {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        });
        let last = trainer.last_step().cloned();
        let sample = trainer.sample().points.into();
        let (map, last_step) = trainer.finish(surface);
        // Weights that no step has changed have the losses of the first step.
        let part = Part {
            points,
            last,
            error: outcome.err().or(last_step.err()),
            sample,
        };
        let map = Arc::new(map);
        self.finished.push((map.clone(), part.clone()));
        Ok((ComponentMap::Trained(map), part))
    }
}

impl<B: Backend> Flattened<B> {
    /// The seams of the trained components and the cuts between components, by the vertices
    /// (points) of the whole surface, and per component the threshold that they were found
    /// with, in UV units of the square and input units; projected components have none.
    ///
    /// # Errors
    /// A component's vertices coincide, as those of no trained one do.
    pub fn seams(
        &self,
        surface: &Surface,
        rule: SeamRule,
    ) -> Result<(Seams, Vec<Option<SeamThreshold>>), SurfaceError> {
        let mut all = Seams {
            points: self.cuts.iter().flatten().copied().collect(),
            edges: self.cuts.clone(),
        };
        let mut thresholds = Vec::new();
        let mut of_map: HashMap<*const TrainedMap<B>, (SeamThreshold, f64)> = HashMap::new();
        for (i, (part, chart)) in self.parts.iter().zip(&self.atlas.charts).enumerate() {
            let ComponentMap::Trained(map) = &chart.map else {
                thresholds.push(None);
                continue;
            };
            let normalization = map.normalization();
            // Of components that share a map, it differs by their scales only.
            let scale = f64::from(chart.placement.scale);
            let (first, first_scale) = *of_map.entry(Arc::as_ptr(map)).or_insert_with(|| {
                let sample = part.sample.iter();
                let in_units: Vec<_> = sample.map(|&p| normalization.invert(p)).collect();
                let uvs = chart.uvs(&in_units);
                (SeamThreshold::of(rule, &part.sample, &uvs), scale)
            });
            let threshold = SeamThreshold {
                distance: first.distance * (scale / first_scale),
                ..first
            };
            let component = self
                .components
                .as_ref()
                .map(|components| &components.list[i]);
            let seams = match component {
                Some(component) => {
                    Seams::of_mesh(&component.mesh, normalization, &self.uvs[i], threshold)?
                }
                None => {
                    let points = surface.positions().iter().map(|&p| normalization.apply(p));
                    Seams::of_points(&points.collect::<Vec<_>>(), &self.uvs[i], threshold)
                }
            };
            let whole = |v: u32| component.map_or(v, |component| component.vertices[v as usize]);
            all.points.extend(seams.points.into_iter().map(whole));
            let edges = seams.edges.into_iter().map(|edge| {
                let [a, b] = edge.map(whole);
                [a.min(b), a.max(b)]
            });
            all.edges.extend(edges);
            thresholds.push(Some(SeamThreshold {
                spacing: threshold.spacing.map(|s| s * normalization.radius),
                ..threshold
            }));
        }
        all.points.sort_unstable();
        all.points.dedup();
        all.edges.sort_unstable();
        all.edges.dedup();
        Ok((all, thresholds))
    }
}
