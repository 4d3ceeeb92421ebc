//! The two ways from a surface to its layout.

use std::time::Instant;

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::{Atlas, Flattened, Start};
use fam_core::training::{CheckpointError, Strategies, TrainingError};
use fam_layout::Beside;
use fam_surface::metrics::Metrics;
use fam_surface::{Components, Surface, SurfaceError, TriangleMesh};

use crate::error::UnwrapError;
use crate::kept::{Kept, There};
use crate::layout::{self, Placed, Uvs};
use crate::measured::measured;
use crate::method::{FinishMode, Used};
use crate::options::Options;
use crate::plan::{self, Plan};
use crate::progress::{Observer, Progress, Watch};
use crate::training::{Trained, train};
use crate::unwrapped::{Training, Unwrapped};

/// Unwraps a surface by the method that the options and the surface ask for. Networks are trained
/// on `device`.
///
/// # Errors
/// The surface is not one that can be unwrapped, the configuration makes no sense, or training
/// failed from the start.
pub fn unwrap<B: AutodiffBackend>(
    surface: &Surface,
    options: &Options,
    device: &B::Device,
    strategies: Strategies<B>,
    observe: &mut Observer,
) -> Result<Unwrapped<Atlas<B::InnerBackend>>, UnwrapError> {
    match options.method.on(surface, options.finish) {
        Used::Direct => unwrap_direct(surface, options, observe),
        Used::Neural => neural::<B>(surface, options, device, strategies, observe),
    }
}

/// Unwraps a mesh without networks, whatever [`Options::method`] says.
///
/// # Errors
/// It is a point cloud, it has no area, or the configuration makes no sense.
pub fn unwrap_direct<M>(
    surface: &Surface,
    options: &Options,
    observe: &mut Observer,
) -> Result<Unwrapped<M>, UnwrapError> {
    let started = Instant::now();
    check(options)?;
    if options.finish == FinishMode::None {
        return Err(UnwrapError::NoRawMap);
    }
    let Surface::Mesh(mesh) = surface else {
        return Err(UnwrapError::CloudWithoutMap);
    };
    let deadline = options.time_budget.map(|b| plan::deadline(started, b));
    let mut watch = Watch::new(observe, deadline);
    let (placed, components) = match &options.kept {
        None => laid_out(mesh, options, None, &mut watch)?,
        Some(kept) => laid_out_beside(mesh, options, kept, &mut watch)?,
    };
    let layout_time = started.elapsed();
    let (metrics, _) = both_metrics(surface, options, &placed.uvs, options.layout.tiles, None)?;
    Ok(Unwrapped {
        method: Used::Direct,
        map: None,
        training: None,
        components,
        uvs: placed.uvs,
        layout: placed.laid_out,
        seams: placed.seams,
        thresholds: placed.thresholds,
        metrics,
        raw_metrics: None,
        interrupted: watch.interrupted,
        layout_time,
    })
}

/// The layout of a mesh, charts `beside` staying where they are, and what it was taken apart into.
fn laid_out(
    mesh: &TriangleMesh,
    options: &Options,
    beside: Option<Beside>,
    watch: &mut Watch,
) -> Result<(Placed, Option<Components>), UnwrapError> {
    let parting = &options.parting;
    let components = Components::with(mesh, &parting.labels, parting.duplicates)?;
    if components.conditioning.zero_area_triangles == mesh.triangles().len() {
        return Err(SurfaceError::TooSmall("its triangles have no area").into());
    }
    let cuts = components.cuts(mesh, !parting.squares.is_empty());
    let placed = layout::mesh(options, &components, None, &cuts, beside, watch)?;
    Ok((placed, Some(components)))
}

/// The layout of what does not keep its UVs, beside what does.
fn laid_out_beside(
    mesh: &TriangleMesh,
    options: &Options,
    kept: &Kept,
    watch: &mut Watch,
) -> Result<(Placed, Option<Components>), UnwrapError> {
    let Some(others) = kept.others(mesh)? else {
        return Ok((layout::untouched(options, mesh, kept.uvs())?, None));
    };
    let own = Options {
        parting: kept.parting(&options.parting),
        ..options.clone()
    };
    let there = kept.there(mesh, &options.parting)?;
    let beside = there.as_ref().map(There::beside);
    let (mut placed, mut components) = laid_out(&others, &own, beside, watch)?;
    if let Some(components) = &mut components {
        let used = mesh.used_vertices().len();
        components.conditioning.unreferenced_vertices = mesh.positions().len() - used;
    }
    if let Uvs::Mesh(new) = &placed.uvs {
        let merged = kept.merged(new)?;
        placed.seams = layout::seams(mesh, &merged)?;
        placed.uvs = Uvs::Mesh(merged);
    }
    Ok((placed, components))
}

fn neural<B: AutodiffBackend>(
    surface: &Surface,
    options: &Options,
    device: &B::Device,
    strategies: Strategies<B>,
    observe: &mut Observer,
) -> Result<Unwrapped<Atlas<B::InnerBackend>>, UnwrapError> {
    let started = Instant::now();
    check(options)?;
    if options.kept.is_some() {
        return Err(UnwrapError::KeptByNetworks);
    }
    let deadline = options.time_budget.map(|b| plan::deadline(started, b));
    let mut watch = Watch::new(observe, deadline);
    let config = match (&options.resume, options.time_budget) {
        (Some(checkpoint), None) if *checkpoint.config() != options.training => {
            let reason = CheckpointError::Config.to_string();
            return Err(UnwrapError::Training(TrainingError::Checkpoint(reason)));
        }
        (Some(checkpoint), _) => checkpoint.config().clone(),
        (None, Some(budget)) => {
            let plan = Plan {
                config: &options.training,
                surface,
                parting: &options.parting,
                finished: options.finish == FinishMode::Full,
                budget,
            };
            let mut observe = || watch.tell(Progress::Planning);
            plan::planned::<B>(&plan, device, &strategies, &mut observe)?
        }
        (None, None) => options.training.clone(),
    };
    let steps = config.steps();
    let start = match &options.resume {
        Some(checkpoint) => Start::Checkpoint(checkpoint),
        None => Start::Fresh(&config),
    };
    let trained = train::<B>(
        start,
        surface,
        &options.parting,
        options.seam_rule,
        device,
        strategies,
        |now| watch.tell(Progress::Training { steps, now }),
    )?;
    let time = started.elapsed();
    let raw = raw_map(surface, &trained)?;
    let placed = placed::<B>(surface, options, &trained, &raw, &mut watch)?;
    let layout_time = started.elapsed() - time;
    let is_finished = placed.laid_out.is_some();
    let earlier = is_finished.then_some(&raw);
    let tiles = if is_finished { options.layout.tiles } else { 1 };
    let (metrics, raw_metrics) = both_metrics(surface, options, &placed.uvs, tiles, earlier)?;
    let Flattened {
        atlas,
        components,
        parts,
        ..
    } = trained.flattened;
    Ok(Unwrapped {
        method: Used::Neural,
        map: Some(atlas),
        training: Some(Training {
            config,
            parts,
            time,
        }),
        components,
        uvs: placed.uvs,
        layout: placed.laid_out,
        seams: placed.seams,
        thresholds: placed.thresholds,
        metrics,
        raw_metrics,
        interrupted: watch.interrupted,
        layout_time,
    })
}

/// The UVs of the raw map.
fn raw_map<B: AutodiffBackend>(
    surface: &Surface,
    trained: &Trained<B>,
) -> Result<Uvs, SurfaceError> {
    let flattened = &trained.flattened;
    Ok(match (surface, &flattened.components) {
        (Surface::Mesh(_), Some(components)) => {
            let maps = components.vertex_maps(&flattened.uvs)?;
            Uvs::Mesh(components.uv_map(&maps)?)
        }
        _ => Uvs::Points(flattened.uvs.first().cloned().unwrap_or_default()),
    })
}

/// The layout that the raw map leads to, or the raw map.
fn placed<B: AutodiffBackend>(
    surface: &Surface,
    options: &Options,
    trained: &Trained<B>,
    raw: &Uvs,
    watch: &mut Watch,
) -> Result<Placed, UnwrapError> {
    let flattened = &trained.flattened;
    match (options.finish, surface, raw, &flattened.components) {
        (FinishMode::Full, Surface::Mesh(_), _, Some(components)) => {
            let map = Some(flattened.uvs.as_slice());
            layout::mesh(options, components, map, &flattened.cuts, None, watch)
        }
        (FinishMode::Full, Surface::PointCloud(cloud), Uvs::Points(raw), _) => {
            layout::cloud(options, cloud, raw, watch)
        }
        _ => Ok(Placed {
            uvs: raw.clone(),
            seams: trained.seams.clone(),
            thresholds: trained.thresholds.clone(),
            laid_out: None,
        }),
    }
}

/// The metrics of a mesh's UVs, which are in so many `tiles`, and of the raw map where that is another.
fn both_metrics(
    surface: &Surface,
    options: &Options,
    uvs: &Uvs,
    tiles: u32,
    raw: Option<&Uvs>,
) -> Result<(Option<Metrics>, Option<Metrics>), SurfaceError> {
    let of = |uvs: &Uvs, tiles: u32| match (surface, uvs) {
        (Surface::Mesh(mesh), Uvs::Mesh(map)) => {
            measured(mesh, map, &options.parting, tiles).map(Some)
        }
        _ => Ok(None),
    };
    Ok((of(uvs, tiles)?, raw.map_or(Ok(None), |raw| of(raw, 1))?))
}

fn check(options: &Options) -> Result<(), UnwrapError> {
    match options.layout.problem().or(options.parting.problem()) {
        Some(problem) => Err(UnwrapError::Config(problem)),
        None => Ok(()),
    }
}
