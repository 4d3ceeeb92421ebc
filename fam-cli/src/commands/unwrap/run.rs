use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fam_core::training::TrainingError;
use fam_io::{Document, Format, WriteOptions};
use fam_surface::Surface;

use crate::args;
use crate::backend::Backend;
use crate::budget::{self, Plan, Stop};
use crate::config::{self, Config, FinishMode};
use crate::failure::Failure;
use crate::finish::Finish;
use crate::flatten::Flatten;
use crate::interrupt::{INTERRUPTED, stop_on_interrupt};
use crate::marks::MarkFiles;
use crate::output::{Output, Results};
use crate::progress::short;
use crate::report::{Report, Summary};
use crate::surface::Parting;

/// What all files of a run have in common.
pub struct Run {
    pub arguments: args::Unwrap,
    pub config: Config,
    pub config_toml: String,
    pub marks: MarkFiles,
    pub backend: Backend,
    pub stop: Arc<AtomicBool>,
}

/// A file that was flattened and written.
pub struct Done {
    pub report: Report,
    pub took: Duration,
    pub interrupted: bool,
    pub error: Option<TrainingError>,
}

impl Run {
    pub fn new(arguments: args::Unwrap) -> Result<Self, Failure> {
        let config = config::resolve(&arguments)?;
        let marks = MarkFiles::read(&arguments)?;
        if let (FinishMode::None, Some(option)) = (config.finish.mode, marks.option()) {
            let reason = format!("{option} has no use with --finish none: nothing is cut then");
            return Err(Failure::input(reason));
        }
        Ok(Self {
            marks,
            config_toml: config.to_toml()?,
            config,
            backend: Backend::choose(arguments.backend)?,
            stop: stop_on_interrupt(arguments.quiet)?,
            arguments,
        })
    }

    pub fn single(
        &self,
        document: &Document,
        input: &str,
        stem: &str,
        path: Option<&Path>,
    ) -> Result<ExitCode, Failure> {
        let folder = self.arguments.out.clone();
        let folder = folder.unwrap_or_else(|| PathBuf::from(format!("{stem}.fam")));
        let output = self.output(document, stem, &folder);
        let done = self.one(document, input, path, &output, None)?;
        match done.error {
            Some(error) => Err(Failure::Work(format!(
                "{input}: {error}; the last good weights were written"
            ))),
            None if done.interrupted => Ok(ExitCode::from(INTERRUPTED)),
            None => Ok(ExitCode::SUCCESS),
        }
    }

    pub fn output(&self, document: &Document, stem: &str, folder: &Path) -> Output {
        let arguments = &self.arguments;
        Output {
            folder: folder.to_owned(),
            stem: stem.to_string(),
            format: Output::format(document, arguments.format.map(Format::from)),
            options: WriteOptions {
                uv_set: arguments.uv_set,
                checker: arguments.checker,
                ..WriteOptions::default()
            },
            seam_lines: arguments.seam_lines,
        }
    }

    /// Flattens a document and writes the folder of its results.
    pub fn one(
        &self,
        document: &Document,
        input: &str,
        path: Option<&Path>,
        output: &Output,
        fingerprint: Option<&str>,
    ) -> Result<Done, Failure> {
        let arguments = &self.arguments;
        let folder = output.folder.as_path();
        let existed = folder.exists();
        let surface = document.surface();
        let marked = self
            .marks
            .on(document)
            .map_err(|failure| failure.of(input))?;
        output
            .prepare(document, path)
            .map_err(|failure| failure.of(input))?;
        if !arguments.quiet {
            eprintln!("{input}: {}; on {}", describe(surface), self.backend);
            if let Some(summary) = marked.summary() {
                eprintln!("{summary}");
            }
        }
        let parting = Parting::of(document.labels(), arguments.per_material);
        let abandon = |failure: Failure| {
            if !existed {
                // Only goes if it is empty.
                let _ = std::fs::remove_dir(folder);
            }
            failure.of(input)
        };
        let started = Instant::now();
        let config = self.planned(surface, &parting).map_err(abandon)?;
        let config_toml = config.to_toml()?;
        let flattened = self
            .backend
            .run(Flatten {
                config: &config.training,
                surface,
                parting: &parting,
                seam_rule: arguments.seam_rule.into(),
                quiet: arguments.quiet,
                stop: &self.stop,
            })
            .map_err(abandon)?;
        let training = started.elapsed();
        let finish = Finish {
            settings: &config.finish,
            surface,
            squares: &parting.squares,
            marked: &marked,
            seam_rule: arguments.seam_rule.into(),
            quiet: arguments.quiet,
            stop: Stop {
                interrupt: &self.stop,
                deadline: arguments
                    .time_budget
                    .map(|budget| budget::deadline(started, budget)),
            },
        };
        let layout = finish.run(&flattened).map_err(abandon)?;
        let took = started.elapsed();
        let finishing = took - training;
        let interrupted = self.stop.load(Ordering::Relaxed);
        let error = flattened.parts.iter().find_map(|part| part.error.clone());
        let complete = !interrupted && error.is_none();
        let report = output.write(&Results {
            document,
            parting: &parting,
            flattened: &flattened,
            layout: &layout,
            config_toml: &config_toml,
            fingerprint: fingerprint.filter(|_| complete),
        })?;
        for warning in report.warnings() {
            eprintln!("warning: {input}: {warning}");
        }
        if arguments.json {
            let summary = Summary {
                state: if interrupted { "interrupted" } else { "done" },
                input,
                folder,
                file: output.file(),
                backend: self.backend.name(),
                training_seconds: training.as_secs_f64(),
                finishing_seconds: finishing.as_secs_f64(),
                interrupted,
                report: &report,
            };
            let json = serde_json::to_string_pretty(&summary).map_err(Failure::work)?;
            println!("{json}");
        } else if !arguments.quiet {
            for line in [report.conditioned(), report.composition()]
                .into_iter()
                .flatten()
            {
                eprintln!("{line}");
            }
            let (training, finishing) = (short(training), short(finishing));
            eprintln!(
                "{training} training, {finishing} finishing; {}",
                report.headline()
            );
            eprintln!("wrote {}", folder.display());
        }
        Ok(Done {
            report,
            took,
            interrupted,
            error,
        })
    }
}

impl Run {
    /// The configuration, with what there is time for.
    fn planned(&self, surface: &Surface, parting: &Parting) -> Result<Config, Failure> {
        let mut config = self.config.clone();
        if let Some(budget) = self.arguments.time_budget {
            config.training = self.backend.run(Plan {
                config: &self.config.training,
                surface,
                parting,
                finished: config.finish.mode == FinishMode::Full,
                budget,
                interrupt: &self.stop,
            })?;
        }
        Ok(config)
    }
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
