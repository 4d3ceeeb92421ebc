//! One trial: a training and the layouts that follow from it, or a layout without one.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use burn::tensor::backend::AutodiffBackend;
use fam::{Options, Parting, Progress, UnwrapError, Uvs, train, unwrap_direct};
use fam_core::atlas::{Checkpoint, Start};
use fam_core::training::{Strategies, TrainingConfig};
use fam_io::picture::{self, Flattened, encode_png, preview_picture};
use fam_layout::{LayoutConfig, MeshInput, lay_out, lay_out_cloud};
use fam_surface::metrics::Metrics;
use fam_surface::seams::{SeamRule, Seams};
use fam_surface::{Components, PointCloud, Surface, TriangleMesh, UvMap};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::plan::{Trial, Variant};
use super::record::{Layout, LayoutKind, Measured, save};
use super::surfaces::Loaded;
use super::unseen::{NewPoints, Unseen};
use crate::backend::{Backend, Job};
use crate::checkpoints::{self, Checkpoints, Label};
use crate::failure::Failure;
use crate::progress::{ProgressMode, UnwrapProgress};

/// Time between checkpoints of a training.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(30);

/// Side of a panel of the pictures, in pixels: four side by side fill a page.
const PANEL: u32 = 256;

/// How trials are run.
pub struct Runner<'a> {
    pub backend: &'a Backend,
    pub quiet: bool,
    pub stop: &'a AtomicBool,
}

/// The files that a trial writes beside its record.
pub struct Files<'a> {
    pub picture: &'a Path,
    pub checkpoint: &'a Path,
}

/// A mesh with the UVs of its direct layout.
pub struct Direct {
    pub measured: Measured,
    pub uvs: UvMap,
}

/// The raw map of a training.
struct Learnt {
    /// None of a cloud.
    components: Option<Components>,
    /// The UVs of every component's vertices, or of all points.
    uvs: Vec<Vec<[f32; 2]>>,
    /// Where the map is torn.
    seams: Seams,
    /// The UVs of other points.
    others: Vec<Vec<[f32; 2]>>,
    /// How long training took; none of one that went on from a checkpoint.
    seconds: Option<f64>,
}

impl Runner<'_> {
    /// A mesh laid out without networks. None if the user broke it off.
    pub fn direct(&self, loaded: &Loaded) -> Result<Option<Direct>, Failure> {
        let mut progress = self.progress();
        let surface = Surface::Mesh(loaded.mesh.clone());
        let unwrapped =
            unwrap_direct::<()>(&surface, &Options::default(), &mut |now| progress.show(now));
        progress.end();
        let unwrapped = unwrapped.map_err(Failure::work)?;
        let (Uvs::Mesh(uvs), Some(metrics)) = (unwrapped.uvs, unwrapped.metrics) else {
            return Err(Failure::work("the layout is not that of a mesh"));
        };
        let layout = Layout {
            kind: LayoutKind::Direct,
            seconds: Some(unwrapped.layout_time.as_secs_f64()),
            metrics,
        };
        let measured = Measured {
            training_seconds: None,
            layouts: vec![layout],
            unseen: Vec::new(),
        };
        Ok((!self.is_stopped()).then_some(Direct { measured, uvs }))
    }

    /// A training and the layout that it leads to. None if the user broke it off.
    pub fn trained(
        &self,
        loaded: &Loaded,
        trial: Trial,
        config: &TrainingConfig,
        fingerprint: &str,
        files: &Files,
    ) -> Result<Option<Measured>, Failure> {
        let Trial::Trained(variant, seed) = trial else {
            return Err(Failure::work("a direct layout is no training"));
        };
        let noisy = match variant {
            Variant::Noise(percent) => Some(with_noise(&loaded.surface, percent, seed)?),
            Variant::Whole | Variant::Without(_) => None,
        };
        let surface = noisy.as_ref().unwrap_or(&loaded.surface);
        let new_points = match surface {
            Surface::Mesh(mesh) if variant == Variant::Whole => {
                NewPoints::on(mesh).map_err(Failure::work)?
            }
            _ => Vec::new(),
        };
        let mut others: Vec<_> = new_points.iter().map(NewPoints::positions).collect();
        if noisy.is_some() {
            others.push(loaded.surface.positions().to_vec());
        }
        let learnt = self.learn(surface, config, &others, fingerprint, files)?;
        if self.is_stopped() {
            return Ok(None);
        }
        let (layouts, unseen) = match (surface, &learnt.components) {
            (Surface::Mesh(mesh), Some(components)) => {
                let raw = raw_map(components, &learnt.uvs)?;
                draw(files.picture, Flattened::Mesh(mesh, &raw), &learnt.seams)?;
                let mut layouts = vec![raw_layout(mesh, &raw)?];
                if variant == Variant::Whole {
                    layouts.push(self.finished(mesh, components, &learnt.uvs)?);
                }
                (layouts, at_new_points(mesh, &raw, &learnt, &new_points))
            }
            (Surface::PointCloud(cloud), _) => (
                self.of_cloud(cloud, loaded, &learnt, noisy.is_some(), files)?,
                Vec::new(),
            ),
            (Surface::Mesh(_), None) => return Err(Failure::work("the mesh has no components")),
        };
        // A layout that was broken off is not what the method makes.
        if self.is_stopped() {
            return Ok(None);
        }
        checkpoints::remove(files.checkpoint);
        Ok(Some(Measured {
            training_seconds: learnt.seconds,
            layouts,
            unseen,
        }))
    }

    /// The raw map of a cloud and, without noise, the layout that it leads to.
    fn of_cloud(
        &self,
        cloud: &PointCloud,
        loaded: &Loaded,
        learnt: &Learnt,
        is_noisy: bool,
        files: &Files,
    ) -> Result<Vec<Layout>, Failure> {
        let no_uvs = || Failure::work("there are no UVs");
        let uvs = learnt.uvs.first().ok_or_else(no_uvs)?;
        draw(files.picture, Flattened::Cloud(cloud, uvs), &learnt.seams)?;
        let mesh = &loaded.mesh;
        // Noise moves points by more than they are apart, so that no map of them keeps the angles
        // between them. What a map learnt of the surface shows where the points were.
        if is_noisy {
            let uvs = learnt.others.first().ok_or_else(no_uvs)?;
            return Ok(vec![raw_layout(mesh, &of_points(mesh, uvs.clone())?)?]);
        }
        let raw = raw_layout(mesh, &of_points(mesh, uvs.clone())?)?;
        Ok(vec![raw, self.finished_cloud(cloud, mesh, uvs)?])
    }

    /// Trains, from the checkpoint where there is one of the same training.
    fn learn(
        &self,
        surface: &Surface,
        config: &TrainingConfig,
        others: &[Vec<[f64; 3]>],
        fingerprint: &str,
        files: &Files,
    ) -> Result<Learnt, Failure> {
        let label = Label {
            input: fingerprint.to_string(),
            options: self.backend.name().to_string(),
        };
        let writing = Arc::new(Mutex::new(()));
        let file = files.checkpoint.to_owned();
        let mut checkpoints = Checkpoints::new(file, label, CHECKPOINT_EVERY, writing);
        // One of another training is of no use.
        let resume = checkpoints.found().unwrap_or(None);
        let mut progress = self.progress();
        let learnt = self.backend.run(Train {
            config,
            surface,
            others,
            resume: resume.as_ref(),
            checkpoints: &mut checkpoints,
            progress: &mut progress,
        });
        progress.end();
        learnt.map_err(Failure::work)
    }

    fn finished(
        &self,
        mesh: &TriangleMesh,
        components: &Components,
        map: &[Vec<[f32; 2]>],
    ) -> Result<Layout, Failure> {
        let mut progress = self.progress();
        let started = Instant::now();
        let input = MeshInput {
            map: Some(map),
            ..MeshInput::of(components)
        };
        let layout = lay_out(&LayoutConfig::default(), &input, &mut |now| {
            progress.show(Progress::Layout(now))
        });
        let seconds = started.elapsed().as_secs_f64();
        progress.end();
        let layout = layout.map_err(Failure::work)?;
        let maps: Vec<UvMap> = layout.components.into_iter().map(|c| c.uvs).collect();
        let uvs = components.uv_map(&maps).map_err(Failure::work)?;
        Ok(Layout {
            kind: LayoutKind::Finished,
            seconds: Some(seconds),
            metrics: Metrics::measure(mesh, &uvs).map_err(Failure::work)?,
        })
    }

    fn finished_cloud(
        &self,
        cloud: &PointCloud,
        mesh: &TriangleMesh,
        raw: &[[f32; 2]],
    ) -> Result<Layout, Failure> {
        let mut progress = self.progress();
        let started = Instant::now();
        let config = LayoutConfig::default();
        let layout = lay_out_cloud(&config, cloud.points(), raw, &mut |now| {
            progress.show(Progress::Layout(now))
        });
        let seconds = started.elapsed().as_secs_f64();
        progress.end();
        let uvs = of_points(mesh, layout.map_err(Failure::work)?.uvs)?;
        Ok(Layout {
            kind: LayoutKind::Finished,
            seconds: Some(seconds),
            metrics: Metrics::measure(mesh, &uvs).map_err(Failure::work)?,
        })
    }

    /// Whether the user asked to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn progress(&self) -> UnwrapProgress<'_> {
        UnwrapProgress::new(ProgressMode::of_user(self.quiet), self.stop)
    }
}

fn raw_map(components: &Components, uvs: &[Vec<[f32; 2]>]) -> Result<UvMap, Failure> {
    let maps = components.vertex_maps(uvs).map_err(Failure::work)?;
    components.uv_map(&maps).map_err(Failure::work)
}

fn raw_layout(mesh: &TriangleMesh, uvs: &UvMap) -> Result<Layout, Failure> {
    Ok(Layout {
        kind: LayoutKind::Raw,
        seconds: None,
        metrics: Metrics::measure(mesh, uvs).map_err(Failure::work)?,
    })
}

/// One UV for each point, on triangles that join the points.
fn of_points(mesh: &TriangleMesh, uvs: Vec<[f32; 2]>) -> Result<UvMap, Failure> {
    UvMap::new(uvs, mesh.triangles().to_vec()).map_err(Failure::work)
}

/// The map at new points. Empty where a mesh has several components: new points do not tell which of
/// their maps they belong to.
fn at_new_points(
    mesh: &TriangleMesh,
    raw: &UvMap,
    learnt: &Learnt,
    new_points: &[NewPoints],
) -> Vec<Unseen> {
    let one = learnt
        .components
        .as_ref()
        .is_some_and(|components| components.list.len() == 1);
    let measured = new_points.iter().zip(&learnt.others).filter(|_| one);
    measured
        .filter_map(|(new, uvs)| new.measure(mesh, raw, &learnt.seams.edges, uvs))
        .collect()
}

fn draw(path: &Path, surface: Flattened, seams: &Seams) -> Result<(), Failure> {
    let seams = picture::Seams {
        points: &seams.points,
        edges: &seams.edges,
    };
    let picture = preview_picture(surface, seams, PANEL);
    save(path, &encode_png(&picture).map_err(Failure::work)?)
}

/// The points of a surface, moved by a Gaussian with a standard deviation of so many percent of the
/// radius of its bounding sphere.
fn with_noise(surface: &Surface, percent: u32, seed: u64) -> Result<Surface, Failure> {
    let radius = surface.normalization().map_err(Failure::work)?.radius;
    let deviation = f64::from(percent) / 100.0 * radius;
    let mut rng = Pcg64::seed_from_u64(seed);
    // Box and Muller's transform of two uniform numbers.
    let mut gaussian = || {
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    let moved = surface.positions().iter();
    let moved = moved
        .map(|p| p.map(|c| c + deviation * gaussian()))
        .collect();
    Ok(Surface::PointCloud(
        PointCloud::new(moved, None).map_err(Failure::work)?,
    ))
}

/// Training on any backend.
struct Train<'a, 'p> {
    config: &'a TrainingConfig,
    surface: &'a Surface,
    others: &'a [Vec<[f64; 3]>],
    resume: Option<&'a Checkpoint>,
    checkpoints: &'a mut Checkpoints,
    progress: &'a mut UnwrapProgress<'p>,
}

impl Job for Train<'_, '_> {
    type Output = Result<Learnt, UnwrapError>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let started = Instant::now();
        let steps = self.config.steps();
        let start = match self.resume {
            Some(checkpoint) => Start::Checkpoint(checkpoint),
            None => Start::Fresh(self.config),
        };
        let trained = train::<B>(
            start,
            self.surface,
            &Parting::default(),
            SeamRule::Spacing,
            device,
            strategies,
            |now| -> ControlFlow<()> {
                let flow = self.progress.show(Progress::Training { steps, now });
                if let Some(checkpoint) = &now.checkpoint {
                    self.checkpoints.save(checkpoint, flow.is_break());
                }
                flow
            },
        )?;
        let seconds = started.elapsed().as_secs_f64();
        let flattened = trained.flattened;
        if let Some(error) = flattened.parts.iter().find_map(|part| part.error.clone()) {
            return Err(UnwrapError::NothingLearnt(error));
        }
        let others = self.others.iter().map(|points| flattened.atlas.uvs(points));
        Ok(Learnt {
            others: others.collect(),
            seconds: self.resume.is_none().then_some(seconds),
            components: flattened.components,
            uvs: flattened.uvs,
            seams: trained.seams,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn noise_has_the_deviation_that_was_asked_for() {
        let points = shapes::sphere(30).positions().to_vec();
        let cloud = Surface::PointCloud(PointCloud::new(points.clone(), None).unwrap());
        let noisy = with_noise(&cloud, 2, 1).unwrap();
        let moved = noisy
            .positions()
            .iter()
            .flatten()
            .zip(points.iter().flatten());
        let offsets: Vec<f64> = moved.map(|(a, b)| a - b).collect();
        let count = offsets.len() as f64;
        let mean = offsets.iter().sum::<f64>() / count;
        let variance = offsets.iter().map(|d| d * d).sum::<f64>() / count;
        // Of 16,000 numbers: four standard errors.
        assert!(mean.abs() < 0.02 * 4.0 / count.sqrt(), "{mean}");
        assert!((variance.sqrt() / 0.02 - 1.0).abs() < 4.0 / (2.0 * count).sqrt());
        let fourth = offsets.iter().map(|d| d.powi(4)).sum::<f64>() / count;
        assert!(
            (fourth / variance.powi(2) - 3.0).abs() < 0.2,
            "not Gaussian"
        );
        assert_eq!(
            with_noise(&cloud, 2, 1).unwrap().positions(),
            noisy.positions()
        );
        assert_ne!(
            with_noise(&cloud, 2, 2).unwrap().positions(),
            noisy.positions()
        );
    }
}
