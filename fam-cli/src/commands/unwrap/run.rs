use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use burn::tensor::backend::AutodiffBackend;
use fam::{
    FinishMode, Options, Parting, Report, Training, UnwrapError, Unwrapped, Used, unwrap,
    unwrap_direct,
};
use fam_core::training::{Strategies, TrainingError};
use fam_io::{Document, Format, WriteOptions};
use fam_surface::{Duplicates, Surface};

use super::fingerprint::{Content, checkpoint_file};
use super::summary::Summary;
use crate::args;
use crate::args::BackendName;
use crate::backend::{Backend, Job};
use crate::checkpoints::{self, Checkpoints};
use crate::config::{self, Config};
use crate::failure::{Failure, SUCCESS};
use crate::interrupt::{INTERRUPTED, stop_on_interrupt};
use crate::kept::kept;
use crate::marks::MarkFiles;
use crate::output::{Output, Results};
use crate::parting::{parting, weighted};
use crate::progress::{ProgressMode, UnwrapProgress, short};
use crate::terminal::{print_json, print_line};

/// What all files of a run have in common.
pub struct Run {
    pub arguments: args::Unwrap,
    pub config: Config,
    pub marks: MarkFiles,
    pub stop: Arc<AtomicBool>,
    /// How progress is shown.
    pub progress: ProgressMode,
    /// Held while results are written.
    pub writing: Arc<Mutex<()>>,
}

/// Where a document comes from.
pub struct Source<'a> {
    /// As messages name it.
    pub name: &'a str,
    pub path: Option<&'a Path>,
    /// What it was read from, unless that cannot be read twice.
    pub content: Option<&'a Content>,
    /// Of the content and all that shapes the result, where it is to be told from others.
    pub fingerprint: Option<&'a str>,
}

/// A file that was unwrapped and written.
pub struct Done {
    pub report: Report,
    /// What `--json` prints.
    pub summary: serde_json::Value,
    pub interrupted: bool,
    pub error: Option<TrainingError>,
}

impl Run {
    pub fn new(arguments: args::Unwrap, progress: ProgressMode) -> Result<Self, Failure> {
        let config = config::resolve(&arguments)?;
        Self::with_config(arguments, config, progress)
    }

    /// A run of which the configuration is known.
    pub fn with_config(
        arguments: args::Unwrap,
        config: Config,
        progress: ProgressMode,
    ) -> Result<Self, Failure> {
        let marks = MarkFiles::read(&arguments)?;
        if let (FinishMode::None, Some(option)) = (config.finish.mode, marks.option()) {
            let reason = format!("{option} has no use with --finish none: nothing is cut then");
            return Err(Failure::input(reason));
        }
        // A backend that is asked for by name has to be there even where nothing is trained.
        if arguments.backend != BackendName::Auto {
            Backend::choose(arguments.backend)?;
        }
        Ok(Self {
            marks,
            config,
            stop: stop_on_interrupt(progress != ProgressMode::Terminal)?,
            progress,
            writing: Arc::default(),
            arguments,
        })
    }

    pub fn single(
        &self,
        document: &Document,
        input: &str,
        stem: &str,
        path: Option<&Path>,
    ) -> Result<u8, Failure> {
        let folder = self.arguments.out.clone();
        let folder = folder.unwrap_or_else(|| PathBuf::from(format!("{stem}.fam")));
        let output = self.output(document, stem, &folder);
        let content = Content::of_document(path, document)?;
        let source = Source {
            name: input,
            path,
            content: content.as_ref(),
            fingerprint: None,
        };
        let done = self.one(document, &source, &output)?;
        match done.error {
            Some(error) => Err(Failure::Work(format!(
                "{input}: {error}; the last good weights were written"
            ))),
            None if done.interrupted => Ok(INTERRUPTED),
            None => Ok(SUCCESS),
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

    /// Unwraps a document and writes the folder of its results.
    pub fn one(
        &self,
        document: &Document,
        source: &Source,
        output: &Output,
    ) -> Result<Done, Failure> {
        let arguments = &self.arguments;
        let input = source.name;
        let folder = output.folder.as_path();
        let existed = folder.exists();
        let surface = document.surface();
        let marked = self
            .marks
            .on(document)
            .map_err(|failure| failure.of(input))?;
        let used = self.config.method.on(surface, self.config.finish.mode);
        let backend = match used {
            Used::Direct => None,
            Used::Neural => Some(Backend::choose(arguments.backend)?),
        };
        output
            .prepare(document, source.path)
            .map_err(|failure| failure.of(input))?;
        if self.progress == ProgressMode::Terminal {
            let how = match &backend {
                Some(backend) => format!("training on {backend}"),
                None => String::from("direct layout"),
            };
            print_line(&format!("{input}: {}; {how}", describe(surface)));
            if let Some(summary) = marked.summary() {
                print_line(&summary);
            }
        }
        let mut checkpoints = match (&backend, source.content) {
            (Some(backend), Some(content)) => Some(self.checkpoints(content, backend, folder)?),
            _ => None,
        };
        let resume = match &checkpoints {
            Some(checkpoints) if arguments.resume => checkpoints.found()?,
            None if arguments.resume && self.progress == ProgressMode::Terminal => {
                print_line("warning: --resume has no use: there is no training to save");
                None
            }
            _ => None,
        };
        let in_squares = parting(document.labels(), arguments.squares());
        let parting = weighted(document, in_squares, &arguments.weight)
            .map_err(|failure| failure.of(input))?;
        let bound = self.config.finish.config.distortion_bound;
        let kept = kept(arguments, document, bound).map_err(|failure| failure.of(input))?;
        let options = Options {
            method: self.config.method,
            training: self.config.training.clone(),
            finish: self.config.finish.mode,
            layout: self.config.finish.config.clone(),
            parting: Parting {
                duplicates: match arguments.separate_duplicates {
                    true => Duplicates::Separate,
                    false => Duplicates::Share,
                },
                ..parting
            },
            seam_rule: arguments.seam_rule.into(),
            time_budget: arguments.time_budget,
            marks: marked.marks.clone(),
            kept,
            resume,
        };
        for warning in document.warnings() {
            print_line(&format!("warning: {input}: {warning}"));
        }
        let unwrapped = self
            .unwrapped(surface, &options, backend.as_ref(), checkpoints.as_mut())
            .map_err(|error| {
                if !existed {
                    // Only goes if it is empty.
                    let _ = std::fs::remove_dir(folder);
                }
                match error.is_input() {
                    true => Failure::input(error).of(input),
                    false => Failure::work(error),
                }
            })?;
        let interrupted = self.stop.load(Ordering::Relaxed);
        let error = unwrapped.training_error().cloned();
        let complete = !interrupted && error.is_none();
        let mut report = Report::new(surface, &options.parting, &unwrapped);
        report.warn(marked.unmatched().to_vec());
        let config_toml = self.config.as_used(&unwrapped).to_toml(used)?;
        let writing = self.writing.lock();
        output.write(&Results {
            document,
            parting: &options.parting,
            unwrapped: &unwrapped,
            report: &report,
            config_toml: &config_toml,
            fingerprint: source.fingerprint.filter(|_| complete),
        })?;
        drop(writing);
        if !interrupted {
            checkpoints::remove(&checkpoint_file(folder));
        }
        for warning in report.warnings() {
            print_line(&format!("warning: {input}: {warning}"));
        }
        let summary = Summary {
            state: if interrupted { "interrupted" } else { "done" },
            input,
            folder,
            file: output.file(),
            backend: backend.as_ref().map(Backend::name),
            training_seconds: seconds_of(unwrapped.training.as_ref()),
            finishing_seconds: unwrapped.layout_time.as_secs_f64(),
            interrupted,
            report: &report,
        };
        let summary = serde_json::to_value(&summary).map_err(Failure::work)?;
        if arguments.json && self.progress != ProgressMode::Messages {
            print_json(&summary)?;
        } else if self.progress == ProgressMode::Terminal {
            say(&unwrapped, &report, folder);
            if interrupted && used == Used::Neural {
                print_line("--resume goes on with the training");
            }
        }
        Ok(Done {
            report,
            summary,
            interrupted,
            error,
        })
    }

    /// The surface, unwrapped; its trained map as the bytes of a file.
    fn unwrapped(
        &self,
        surface: &Surface,
        options: &Options,
        backend: Option<&Backend>,
        checkpoints: Option<&mut Checkpoints>,
    ) -> Result<Unwrapped<Vec<u8>>, UnwrapError> {
        let mut progress = UnwrapProgress::new(self.progress, &self.stop);
        let unwrapped = match backend {
            None => unwrap_direct(surface, options, &mut |now| progress.show(now)),
            Some(backend) => backend.run(Neural {
                surface,
                options,
                progress: &mut progress,
                checkpoints,
            }),
        };
        progress.end();
        unwrapped
    }
}

/// Unwrapping with networks, on any backend.
struct Neural<'a, 'p> {
    surface: &'a Surface,
    options: &'a Options,
    progress: &'a mut UnwrapProgress<'p>,
    checkpoints: Option<&'a mut Checkpoints>,
}

impl Neural<'_, '_> {
    /// After a step.
    fn observe(&mut self, now: fam::Progress) -> ControlFlow<()> {
        let flow = self.progress.show(now);
        if let fam::Progress::Training { now, .. } = now
            && let (Some(checkpoints), Some(checkpoint)) = (&mut self.checkpoints, &now.checkpoint)
        {
            checkpoints.save(checkpoint, flow.is_break());
        }
        flow
    }
}

impl Job for Neural<'_, '_> {
    type Output = Result<Unwrapped<Vec<u8>>, UnwrapError>;

    fn run<B: AutodiffBackend>(
        mut self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let (surface, options) = (self.surface, self.options);
        let mut observe = |now: fam::Progress<'_>| self.observe(now);
        let unwrapped = unwrap::<B>(surface, options, device, strategies, &mut observe)?;
        Ok(unwrapped.try_map(|atlas| atlas.to_safetensors())?)
    }
}

/// Tells the user what came of a surface.
fn say(unwrapped: &Unwrapped<Vec<u8>>, report: &Report, folder: &Path) {
    let notes = [report.conditioned(), report.composition()];
    for line in notes.into_iter().flatten() {
        print_line(&line);
    }
    let layout = short(unwrapped.layout_time);
    let headline = report.headline();
    match &unwrapped.training {
        Some(training) => {
            let training = short(training.time);
            print_line(&format!(
                "{training} training, {layout} finishing; {headline}"
            ));
        }
        None => print_line(&format!("{layout}; {headline}")),
    }
    print_line(&format!("wrote {}", folder.display()));
    if unwrapped.method == Used::Direct {
        print_line("without a trained map; --method neural makes model.safetensors, for `fam map`");
    }
}

fn seconds_of(training: Option<&Training>) -> Option<f64> {
    training.map(|training| training.time.as_secs_f64())
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
