use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use burn::tensor::backend::AutodiffBackend;
use fam_core::seams::{SeamRule, SeamThreshold, Seams};
use fam_core::surface::{Surface, shapes};
use fam_core::training::{Step, Trainer, TrainingConfig, TrainingError};
use fam_io::Document;

use crate::args;
use crate::backend::{Backend, Job};
use crate::config;
use crate::failure::Failure;
use crate::output::{self, Layout};
use crate::progress::{Progress, short};

/// Exit code after Ctrl-C: 128 and the number of the signal, as shells count.
const INTERRUPTED: u8 = 130;

/// Trains on a surface and writes its UVs and all that goes with them.
pub fn unwrap(arguments: args::Unwrap) -> Result<ExitCode, Failure> {
    let config = config::resolve(&arguments)?;
    let config_toml = config::to_toml(&config)?;
    let (document, stem) = match &arguments.input {
        Some(path) => {
            let document = fam_io::read_surface(path).map_err(Failure::input)?;
            let stem = path.file_stem().unwrap_or(path.as_os_str());
            (document, stem.to_string_lossy().into_owned())
        }
        None => (sample(), "sample".to_string()),
    };
    let input = match &arguments.input {
        Some(path) => path.display().to_string(),
        None => "the built-in sample".to_string(),
    };
    let backend = Backend::choose(arguments.backend)?;
    let folder = arguments
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{stem}.fam")));
    output::prepare(&folder, &stem, &document, arguments.input.as_deref())?;
    if !arguments.quiet {
        eprintln!("{input}: {}; on {backend}", describe(document.surface()));
    }

    let started = Instant::now();
    let trained = backend
        .run(Train {
            config,
            surface: document.surface(),
            seam_rule: arguments.seam_rule.into(),
            quiet: arguments.quiet,
            stop: stop_on_interrupt()?,
        })
        .map_err(|failure| {
            // Only goes if it is empty, as it is when it was made for this run.
            let _ = std::fs::remove_dir(&folder);
            match failure {
                Failure::Input(reason) => Failure::Input(format!("{input}: {reason}")),
                work => work,
            }
        })?;
    let seconds = started.elapsed().as_secs_f64();

    let written = output::write(
        &folder,
        &stem,
        &document,
        &Layout {
            uvs: &trained.uvs,
            seams: &trained.seams,
            threshold: trained.threshold,
            model: &trained.model,
            config_toml: &config_toml,
            last: &trained.last,
        },
    )?;
    if arguments.json {
        let summary = output::Summary {
            input: &input,
            folder: &folder,
            backend: backend.name(),
            training_seconds: seconds,
            interrupted: trained.outcome == Outcome::Interrupted,
            report: &written,
        };
        println!(
            "{}",
            serde_json::to_string_pretty(&summary).map_err(Failure::work)?
        );
    } else if !arguments.quiet {
        eprintln!(
            "{} iterations in {}; {}",
            trained.last.iteration + 1,
            short(started.elapsed()),
            written.headline()
        );
        eprintln!("wrote {}", folder.display());
    }
    match trained.outcome {
        Outcome::Finished => Ok(ExitCode::SUCCESS),
        Outcome::Interrupted => Ok(ExitCode::from(INTERRUPTED)),
        Outcome::Failed(error) => Err(Failure::Work(format!(
            "{input}: {error}; the last good weights were written"
        ))),
    }
}

/// The built-in surface: closed and of genus 1, so that seams have to be found.
fn sample() -> Document {
    Document::of_surface(Surface::Mesh(shapes::torus(1.0, 0.4, 96, 48)))
}

fn describe(surface: &Surface) -> String {
    match surface {
        Surface::Mesh(mesh) => format!(
            "{} vertices, {} triangles",
            mesh.positions().len(),
            mesh.triangles().len()
        ),
        Surface::PointCloud(cloud) => format!("{} points", cloud.points().len()),
    }
}

/// A flag that Ctrl-C sets; a second Ctrl-C ends the program at once.
fn stop_on_interrupt() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
    })
    .map_err(Failure::work)?;
    Ok(stop)
}

struct Train<'a> {
    config: TrainingConfig,
    surface: &'a Surface,
    seam_rule: SeamRule,
    quiet: bool,
    stop: Arc<AtomicBool>,
}

/// A trained surface, off the backend.
struct Trained {
    uvs: Vec<[f32; 2]>,
    seams: Seams,
    /// With its spacing in input units.
    threshold: SeamThreshold,
    model: Vec<u8>,
    last: Step,
    outcome: Outcome,
}

#[derive(Debug, PartialEq)]
enum Outcome {
    Finished,
    Interrupted,
    Failed(TrainingError),
}

impl Job for Train<'_> {
    type Output = Result<Trained, Failure>;

    fn run<B: AutodiffBackend>(self, device: &B::Device) -> Self::Output {
        let iterations = self.config.iterations;
        let mut trainer =
            Trainer::<B>::new(self.config, self.surface, device).map_err(Failure::input)?;
        let progress = Progress::new(self.quiet, iterations, trainer.points());
        let mut outcome = Outcome::Finished;
        let mut last = None;
        for _ in 0..iterations {
            match trainer.step() {
                Ok(step) => {
                    progress.step(&step);
                    last = Some(step);
                }
                Err(error) => {
                    outcome = Outcome::Failed(error);
                    break;
                }
            }
            if self.stop.load(Ordering::Relaxed) {
                outcome = Outcome::Interrupted;
                break;
            }
        }
        progress.finish();
        let Some(last) = last else {
            return Err(match outcome {
                Outcome::Failed(error) => Failure::work(error),
                _ => Failure::work("no iteration was trained"),
            });
        };

        let sample = trainer.sample().points;
        let (map, last_step) = trainer.finish(self.surface);
        if let (Outcome::Finished, Err(error)) = (&outcome, last_step) {
            outcome = Outcome::Failed(error);
        }
        let normalization = *map.normalization();
        let sample_in_units: Vec<_> = sample.iter().map(|&p| normalization.invert(p)).collect();
        let threshold = SeamThreshold::of(self.seam_rule, &sample, &map.uvs(&sample_in_units));
        let uvs = map.uvs(self.surface.positions());
        let seams = match self.surface {
            Surface::Mesh(mesh) => {
                Seams::of_mesh(mesh, &normalization, &uvs, threshold).map_err(Failure::input)?
            }
            Surface::PointCloud(cloud) => {
                let place = |&p: &[f64; 3]| normalization.apply(p);
                let points: Vec<_> = cloud.points().iter().map(place).collect();
                Seams::of_points(&points, &uvs, threshold)
            }
        };
        Ok(Trained {
            uvs,
            seams,
            threshold: SeamThreshold {
                spacing: threshold.spacing.map(|s| s * normalization.radius),
                ..threshold
            },
            model: map.to_safetensors().map_err(Failure::work)?,
            last,
            outcome,
        })
    }
}
