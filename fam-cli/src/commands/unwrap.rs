use std::hash::Hasher;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fam_core::surface::{Surface, shapes};
use fam_core::training::{TrainingConfig, TrainingError};
use fam_io::{Document, Format, WriteOptions};
use serde_json::json;

use crate::args;
use crate::backend::Backend;
use crate::batch::{Row, Table};
use crate::config;
use crate::failure::Failure;
use crate::flatten::Flatten;
use crate::inputs::Inputs;
use crate::output::{Layout, Output, Report, Summary};
use crate::progress::short;
use crate::surface::Parting;

/// Exit code after Ctrl-C: 128 and the number of the signal, as shells count.
const INTERRUPTED: u8 = 130;

/// Trains on surfaces and writes their UVs and all that goes with them.
pub fn unwrap(arguments: args::Unwrap) -> Result<ExitCode, Failure> {
    match Inputs::collect(&arguments.inputs, arguments.out.as_deref())? {
        Inputs::Sample => {
            let run = Run::new(arguments)?;
            // Closed and of genus 1, so that seams have to be found.
            let document = Document::of_surface(Surface::Mesh(shapes::torus(1.0, 0.4, 96, 48)));
            run.single(&document, "the built-in sample", "sample", None)
        }
        Inputs::One(path) => {
            let document = fam_io::read_surface(&path).map_err(Failure::input)?;
            let run = Run::new(arguments)?;
            run.single(
                &document,
                &path.display().to_string(),
                &stem(&path),
                Some(&path),
            )
        }
        Inputs::Batch { files, failed } => Run::new(arguments)?.batch(&files, failed),
    }
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    stem.to_string_lossy().into_owned()
}

/// What all files of a run have in common.
struct Run {
    arguments: args::Unwrap,
    config: TrainingConfig,
    config_toml: String,
    backend: Backend,
    stop: Arc<AtomicBool>,
}

/// A file that was flattened and written.
struct Done {
    report: Report,
    took: Duration,
    interrupted: bool,
    error: Option<TrainingError>,
}

impl Run {
    fn new(arguments: args::Unwrap) -> Result<Self, Failure> {
        let config = config::resolve(&arguments)?;
        Ok(Self {
            config_toml: config::to_toml(&config)?,
            config,
            backend: Backend::choose(arguments.backend)?,
            stop: stop_on_interrupt()?,
            arguments,
        })
    }

    fn single(
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

    fn batch(
        &self,
        files: &[(PathBuf, PathBuf)],
        failed: Vec<(PathBuf, String)>,
    ) -> Result<ExitCode, Failure> {
        let root = self.arguments.out.clone().unwrap_or_default();
        let mut table = Table::default();
        for (path, reason) in failed {
            self.record(
                &mut table,
                &path,
                Row::Failed(format!("{}: {reason}", path.display())),
            )?;
        }
        for (number, (path, folder)) in files.iter().enumerate() {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            if !self.arguments.quiet {
                eprintln!("[{}/{}]", number + 1, files.len());
            }
            let row = self
                .batch_file(path, &root.join(folder))
                .unwrap_or_else(|failure| Row::Failed(failure.to_string()));
            self.record(&mut table, path, row)?;
        }
        if !self.arguments.json && !self.arguments.quiet {
            print!("{table}");
        }
        if self.stop.load(Ordering::Relaxed) {
            return Ok(ExitCode::from(INTERRUPTED));
        }
        match table.failed() {
            0 => Ok(ExitCode::SUCCESS),
            failed => Err(Failure::Work(format!(
                "{failed} of {} files failed",
                table.len()
            ))),
        }
    }

    /// Adds a row to the table and says at once what the table does not say in time.
    fn record(&self, table: &mut Table, path: &Path, row: Row) -> Result<(), Failure> {
        let state = match &row {
            Row::Failed(reason) => {
                eprintln!("fam: {reason}");
                Some(
                    json!({"state": "failed", "input": path.display().to_string(), "reason": reason}),
                )
            }
            Row::Skipped => Some(json!({"state": "skipped", "input": path.display().to_string()})),
            Row::Done { .. } | Row::Interrupted => None,
        };
        if let (Some(state), true) = (state, self.arguments.json) {
            let json = serde_json::to_string_pretty(&state).map_err(Failure::work)?;
            println!("{json}");
        }
        table.push(path, row);
        Ok(())
    }

    fn batch_file(&self, path: &Path, folder: &Path) -> Result<Row, Failure> {
        let input = path.display().to_string();
        let document = fam_io::read_surface(path).map_err(Failure::input)?;
        let output = self.output(&document, &stem(path), folder);
        // A pipe cannot be read twice.
        let fingerprint = match path.is_file() {
            true => Some(self.fingerprint(path, &document)?),
            false => None,
        };
        let fingerprint = fingerprint.as_deref();
        let is_done = fingerprint.is_some_and(|fingerprint| output.is_done(fingerprint));
        if is_done && !self.arguments.force {
            return Ok(Row::Skipped);
        }
        let done = self.one(&document, &input, Some(path), &output, fingerprint)?;
        Ok(match done.error {
            Some(error) => Row::Failed(format!("{input}: {error}")),
            None if done.interrupted => Row::Interrupted,
            None => Row::Done {
                took: done.took,
                headline: done.report.headline(),
            },
        })
    }

    fn output(&self, document: &Document, stem: &str, folder: &Path) -> Output {
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
    fn one(
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
        output
            .prepare(document, path)
            .map_err(|failure| failure.of(input))?;
        if !arguments.quiet {
            eprintln!(
                "{input}: {}; on {}",
                describe(document.surface()),
                self.backend
            );
        }
        let parting = Parting::of(document.labels(), arguments.per_material);
        let started = Instant::now();
        let flattened = self
            .backend
            .run(Flatten {
                config: &self.config,
                surface: document.surface(),
                parting: &parting,
                seam_rule: arguments.seam_rule.into(),
                quiet: arguments.quiet,
                stop: &self.stop,
            })
            .map_err(|failure| {
                if !existed {
                    // Only goes if it is empty.
                    let _ = std::fs::remove_dir(folder);
                }
                failure.of(input)
            })?;
        let took = started.elapsed();
        let interrupted = self.stop.load(Ordering::Relaxed);
        let error = flattened.parts.iter().find_map(|part| part.error.clone());
        let complete = !interrupted && error.is_none();
        let report = output.write(&Layout {
            document,
            parting: &parting,
            flattened: &flattened,
            config_toml: &self.config_toml,
            fingerprint: fingerprint.filter(|_| complete),
        })?;
        if arguments.json {
            let summary = Summary {
                state: if interrupted { "interrupted" } else { "done" },
                input,
                folder,
                file: output.file(),
                backend: self.backend.name(),
                training_seconds: took.as_secs_f64(),
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
            eprintln!("{}; {}", short(took), report.headline());
            eprintln!("wrote {}", folder.display());
        }
        Ok(Done {
            report,
            took,
            interrupted,
            error,
        })
    }

    /// A number that changes with the content of a file and with all that shapes its results.
    fn fingerprint(&self, path: &Path, document: &Document) -> Result<String, Failure> {
        let fail = |error: std::io::Error| Failure::input(format!("{}: {error}", path.display()));
        let mut hasher = Hashing::default();
        let mut file = std::fs::File::open(path).map_err(fail)?;
        std::io::copy(&mut file, &mut hasher).map_err(fail)?;
        for companion in document.companions() {
            // One that is missing changes the results as well.
            if let Ok(mut file) = std::fs::File::open(companion) {
                std::io::copy(&mut file, &mut hasher).map_err(fail)?;
            }
        }
        let arguments = &self.arguments;
        let shaping = format!(
            "{}\n{}\n{:?} {} {} {} {} {:?}",
            env!("CARGO_PKG_VERSION"),
            self.config_toml,
            arguments.format,
            arguments.uv_set,
            arguments.checker,
            arguments.seam_lines,
            arguments.per_material,
            arguments.seam_rule,
        );
        hasher.0.write(shaping.as_bytes());
        Ok(format!("{:016x}", hasher.0.finish()))
    }
}

/// Hashes what is written.
#[derive(Default)]
struct Hashing(std::hash::DefaultHasher);

impl std::io::Write for Hashing {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
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
