//! The paper's evaluation: `fam evaluate --suite`.
//!
//! [`plan`] says what is tried on which of the [`surfaces`]; [`trial`] does it, and every result is
//! kept as a [`record`] in a folder from which the next run goes on. [`peers`] adds layouts by other
//! tools, and [`page`] makes the tables of all that is there.

mod page;
mod peers;
mod plan;
mod printed;
mod record;
mod surfaces;
mod trial;
mod unseen;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fam_io::{Document, WriteOptions};
use fam_surface::{Surface, UvMap};

use super::{check_folder, configuration};
use crate::args::{self, Suite, name_of};
use crate::backend::Backend;
use crate::config::Config;
use crate::failure::{Failure, SUCCESS};
use crate::inputs::Inputs;
use crate::interrupt::{INTERRUPTED, stop_on_interrupt};
use crate::machine;
use crate::progress::short;
use crate::terminal::print_line;
use page::Page;
use plan::{Task, Trial};
use record::{Circumstances, Outcome, Record, Store, fingerprint};
use surfaces::{Loaded, SuiteSurface};
use trial::{Places, Runner};

/// The page where the user names none.
const PAGE: &str = "evaluation.md";

/// Runs a suite, or what is left of it, and writes its page.
pub fn evaluate(arguments: &args::Evaluate, suite: Suite) -> Result<u8, Failure> {
    let page = arguments.out.clone().unwrap_or_else(|| PAGE.into());
    check_folder(Some(&page))?;
    let config = configuration(arguments)?;
    let backend = Backend::choose(arguments.backend)?;
    let names = names(arguments)?;
    let files = files(&arguments.inputs)?;
    let stop = stop_on_interrupt(arguments.quiet)?;
    let mut run = Run {
        suite,
        arguments,
        config: &config,
        store: Store::open(page.with_extension("work"))?,
        page: &page,
        circumstances: circumstances(arguments, &config, &backend),
        runner: Runner {
            backend: &backend,
            quiet: arguments.quiet,
            stop: &stop,
        },
        records: Vec::new(),
        peers: Vec::new(),
    };
    let tasks = plan::tasks(suite, |surface| {
        names.is_empty() || names.contains(&surface.name)
    });
    run.all(&tasks, &files, &stop)?;
    if let Some(program) = arguments.peers.as_deref()
        && !stop.load(Ordering::Relaxed)
    {
        peers::call(program, &run.store)?;
    }
    run.peers = peers::measured(&run.store, &run.records);
    run.write()?;
    if arguments.json {
        println!("{}", run.result().json()?);
    }
    if stop.load(Ordering::Relaxed) {
        if !arguments.quiet {
            print_line("the same command goes on where this one stopped");
        }
        return Ok(INTERRUPTED);
    }
    match run.failed() {
        0 => Ok(SUCCESS),
        failed => {
            let count = run.records.len();
            Err(Failure::Work(format!("{failed} of {count} trials failed")))
        }
    }
}

/// A suite that is being run.
struct Run<'a> {
    suite: Suite,
    arguments: &'a args::Evaluate,
    config: &'a Config,
    store: Store,
    page: &'a Path,
    circumstances: Circumstances,
    runner: Runner<'a>,
    records: Vec<Record>,
    peers: Vec<peers::PeerLayout>,
}

impl Run<'_> {
    /// Does all tasks that have no record yet.
    fn all(&mut self, tasks: &[Task], files: &[PathBuf], stop: &AtomicBool) -> Result<(), Failure> {
        let mut loaded: BTreeMap<&str, Result<Option<Loaded>, String>> = BTreeMap::new();
        let (mut trained, mut training) = (0, Duration::ZERO);
        for (number, task) in tasks.iter().enumerate() {
            let surface = loaded.entry(task.surface.name).or_insert_with(|| {
                let surface = task.surface.load(files);
                surface.map_err(|failure| failure.to_string())
            });
            let surface = match surface {
                Ok(Some(surface)) => surface,
                // There is no file of this name: the row stays empty.
                Ok(None) => continue,
                Err(reason) => {
                    print_line(&format!("fam: {}: {reason}", task.surface.name));
                    let record = self.record(task, String::new(), Outcome::Failed(reason.clone()));
                    self.records.push(record);
                    continue;
                }
            };
            let config = task.trial.config(&self.config.training);
            let backend = self.runner.backend.name();
            let own = fingerprint(&surface.surface, task.trial, config.as_ref(), backend)?;
            let name = task.surface.name;
            if let Some(record) = self.store.record(name, task.trial, &own) {
                self.records.push(record);
                continue;
            }
            if !self.arguments.quiet {
                let left = tasks[number..]
                    .iter()
                    .filter(|task| task.trial != Trial::Direct)
                    .count();
                let left = training.checked_div(trained).map(|each| each * left as u32);
                print_line(&line(task, number, tasks.len(), left));
            }
            let started = Instant::now();
            let outcome = match self.outcome(task, surface, &own) {
                Ok(Some(outcome)) => outcome,
                // The user broke it off.
                Ok(None) => break,
                Err(failure) => {
                    print_line(&format!("fam: {name}: {failure}"));
                    Outcome::Failed(failure.to_string())
                }
            };
            if task.trial != Trial::Direct {
                trained += 1;
                training += started.elapsed();
            }
            let record = self.record(task, own, outcome);
            self.store.keep(name, task.trial, &record)?;
            self.records.push(record);
            self.write()?;
            if stop.load(Ordering::Relaxed) {
                break;
            }
        }
        Ok(())
    }

    fn outcome(
        &self,
        task: &Task,
        surface: &Loaded,
        fingerprint: &str,
    ) -> Result<Option<Outcome>, Failure> {
        let name = task.surface.name;
        let picture = self.store.picture(name, task.trial);
        let config = task.trial.config(&self.config.training);
        let Some(config) = config else {
            let direct = self.runner.direct(surface, &picture)?;
            self.hand_over(task.surface, surface, &direct.uvs)?;
            let stopped = self.runner.stop.load(Ordering::Relaxed);
            return Ok((!stopped).then_some(Outcome::Done(direct.measured)));
        };
        let places = Places {
            picture: &picture,
            checkpoint: &self.store.checkpoint(name, task.trial),
        };
        let runner = &self.runner;
        let measured = runner.trained(surface, task.trial, &config, fingerprint, &places)?;
        Ok(measured.map(Outcome::Done))
    }

    /// Writes a surface for the peers, with the UVs of its direct layout.
    fn hand_over(
        &self,
        surface: &SuiteSurface,
        loaded: &Loaded,
        uvs: &UvMap,
    ) -> Result<(), Failure> {
        let file = self.store.surfaces().join(format!("{}.obj", surface.name));
        let document = Document::of_surface(Surface::Mesh(loaded.mesh.clone()));
        let options = WriteOptions::default();
        document
            .write_mesh_uvs(uvs, file, &options)
            .map_err(Failure::work)
    }

    fn record(&self, task: &Task, fingerprint: String, outcome: Outcome) -> Record {
        Record {
            surface: task.surface.name.to_string(),
            trial: task.trial.name(),
            seed: task.trial.seed(),
            circumstances: self.circumstances.clone(),
            fingerprint,
            outcome,
        }
    }

    fn failed(&self) -> usize {
        let failed = |record: &&Record| record.measured().is_none();
        self.records.iter().filter(failed).count()
    }

    fn result(&self) -> Page<'_> {
        Page {
            suite: name_of(self.suite),
            records: &self.records,
            peers: &self.peers,
        }
    }

    fn write(&self) -> Result<(), Failure> {
        self.result().write(self.page, &self.store)
    }
}

fn line(task: &Task, number: usize, count: usize, left: Option<Duration>) -> String {
    let seed = task
        .trial
        .seed()
        .map_or(String::new(), |seed| format!(", seed {seed}"));
    let left = left.map_or(String::new(), |left| format!("  ({} left)", short(left)));
    let (surface, trial) = (task.surface.name, task.trial.name());
    format!("[{}/{count}] {surface}: {trial}{seed}{left}", number + 1)
}

/// The names of `--only`, which must be those of surfaces.
fn names(arguments: &args::Evaluate) -> Result<Vec<&str>, Failure> {
    let known = |name: &str| surfaces::all().iter().any(|surface| surface.name == name);
    let names: Vec<&str> = arguments.only.iter().map(String::as_str).collect();
    match names.iter().find(|name| !known(name)) {
        None => Ok(names),
        Some(name) => {
            let all: Vec<&str> = surfaces::all().iter().map(|surface| surface.name).collect();
            let all = all.join(", ");
            Err(Failure::input(format!(
                "no surface is called {name}; there are {all}"
            )))
        }
    }
}

/// The user's files, of which those with the names of the paper's models are tried.
fn files(inputs: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    Ok(match Inputs::collect(inputs, None)? {
        Inputs::Sample => Vec::new(),
        Inputs::One(path) => vec![path],
        Inputs::Batch { files, failed } => {
            if let Some((path, reason)) = failed.first() {
                return Err(Failure::input(format!("{}: {reason}", path.display())));
            }
            files.into_iter().map(|(path, _)| path).collect()
        }
    })
}

fn circumstances(arguments: &args::Evaluate, config: &Config, backend: &Backend) -> Circumstances {
    let training = &config.training;
    Circumstances {
        machine: machine::description(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        commit: machine::commit(),
        preset: format!(
            "{}: {} points, {} iterations, width {}",
            name_of(arguments.preset),
            training.points,
            training.iterations,
            training.networks.width
        ),
        backend: backend.to_string(),
    }
}
