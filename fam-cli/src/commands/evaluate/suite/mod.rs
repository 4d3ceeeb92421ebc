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
use std::rc::Rc;
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
use trial::{Files, Runner};

/// The page where the user names none.
const PAGE: &str = "evaluation.md";

/// Runs a suite, or what is left of it, and writes its page.
pub fn evaluate(arguments: &args::Evaluate, suite: Suite) -> Result<u8, Failure> {
    let page = arguments.out.clone().unwrap_or_else(|| PAGE.into());
    check_page(&page)?;
    let config = configuration(arguments)?;
    let backend = Backend::choose(arguments.backend)?;
    let names = names(arguments)?;
    let files = files(arguments)?;
    if let Some(program) = arguments
        .peers
        .as_ref()
        .filter(|program| !program.is_file())
    {
        let program = program.display();
        return Err(Failure::input(format!(
            "{program}: there is no such program"
        )));
    }
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
        tasks: plan::tasks(suite),
        records: BTreeMap::new(),
        peers: Vec::new(),
    };
    run.recall();
    let pending = run.pending(&names, &files)?;
    run.all(&pending)?;
    let called = match arguments
        .peers
        .as_deref()
        .filter(|_| !run.runner.is_stopped())
    {
        Some(program) => peers::call(program, &run.store),
        None => Ok(()),
    };
    run.peers = peers::measured(&run.store);
    run.write()?;
    if arguments.json {
        print!("{}", run.result().json()?);
    }
    if run.runner.is_stopped() {
        if !arguments.quiet {
            print_line("the same command goes on where this one stopped");
        }
        return Ok(INTERRUPTED);
    }
    called?;
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
    /// Those of trainings.
    circumstances: Circumstances,
    runner: Runner<'a>,
    /// All of the suite.
    tasks: Vec<Task>,
    /// What came of them, by their places in the list.
    records: BTreeMap<usize, Record>,
    peers: Vec<peers::PeerLayout>,
}

/// A task that has no record yet.
struct Pending {
    /// Its place in the list.
    number: usize,
    surface: Rc<Loaded>,
    fingerprint: String,
}

impl Run<'_> {
    /// Takes what earlier runs of the same preset and backend left, so that the page has it whatever is
    /// done now.
    fn recall(&mut self) {
        for (number, task) in self.tasks.iter().enumerate() {
            let record = self.store.record(task.surface.name, task.trial);
            let own = &self.circumstances;
            let fits = |record: &Record| match task.trial {
                Trial::Direct => true,
                Trial::Trained(..) => {
                    let theirs = &record.circumstances;
                    (&theirs.preset, &theirs.backend) == (&own.preset, &own.backend)
                }
            };
            if let Some(record) = record.filter(fits) {
                self.records.insert(number, record);
            }
        }
        self.peers = peers::measured(&self.store);
    }

    /// The tasks on the surfaces of these names (all if there are none) that are to be done.
    fn pending(&mut self, names: &[&str], files: &[PathBuf]) -> Result<Vec<Pending>, Failure> {
        let mut loaded: BTreeMap<&str, Option<Rc<Loaded>>> = BTreeMap::new();
        let mut pending = Vec::new();
        for (number, task) in self.tasks.clone().iter().enumerate() {
            let name = task.surface.name;
            if !names.is_empty() && !names.contains(&name) {
                continue;
            }
            if !loaded.contains_key(name) {
                let surface = match task.surface.load(files) {
                    Ok(surface) => surface.map(Rc::new),
                    Err(failure) => {
                        print_line(&format!("fam: {name}: {failure}"));
                        let outcome = Outcome::Failed(failure.to_string());
                        self.records
                            .insert(number, self.record(task, String::new(), outcome));
                        None
                    }
                };
                loaded.insert(name, surface);
            }
            // Without a file of this name the row stays as it is.
            let Some(surface) = loaded.get(name).cloned().flatten() else {
                continue;
            };
            let config = task.trial.config(&self.config.training);
            let backend = self.runner.backend.name();
            let fingerprint = fingerprint(&surface, task.trial, config.as_ref(), backend)?;
            let known = self.records.get(&number);
            if known.is_none_or(|record| record.fingerprint != fingerprint) {
                self.records.remove(&number);
                pending.push(Pending {
                    number,
                    surface,
                    fingerprint,
                });
            }
        }
        Ok(pending)
    }

    /// Does these tasks.
    fn all(&mut self, pending: &[Pending]) -> Result<(), Failure> {
        let (mut trained, mut training) = (0, Duration::ZERO);
        for (done, next) in pending.iter().enumerate() {
            let task = self.tasks[next.number];
            if !self.arguments.quiet {
                let left = pending[done..].iter();
                let left = left
                    .filter(|t| self.tasks[t.number].trial != Trial::Direct)
                    .count();
                let left = training.checked_div(trained).map(|each| each * left as u32);
                print_line(&line(&task, done, pending.len(), left));
            }
            let started = Instant::now();
            let outcome = match self.outcome(&task, &next.surface, &next.fingerprint) {
                Ok(Some(outcome)) => outcome,
                // The user broke it off.
                Ok(None) => break,
                Err(failure) => {
                    print_line(&format!("fam: {}: {failure}", task.surface.name));
                    Outcome::Failed(failure.to_string())
                }
            };
            if task.trial != Trial::Direct {
                trained += 1;
                training += started.elapsed();
            }
            let record = self.record(&task, next.fingerprint.clone(), outcome);
            // What failed is tried again by the next run.
            if record.measured().is_some() {
                self.store.keep(task.surface.name, task.trial, &record)?;
            }
            self.records.insert(next.number, record);
            self.write()?;
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
        let Some(config) = task.trial.config(&self.config.training) else {
            let Some(direct) = self.runner.direct(surface)? else {
                return Ok(None);
            };
            self.hand_over(task.surface, surface, &direct.uvs)?;
            return Ok(Some(Outcome::Done(direct.measured)));
        };
        let files = Files {
            picture: &self.store.picture(name, task.trial),
            checkpoint: &self.store.checkpoint(name, task.trial),
        };
        let runner = &self.runner;
        let measured = runner.trained(surface, task.trial, &config, fingerprint, &files)?;
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
        let mut circumstances = self.circumstances.clone();
        if task.trial == Trial::Direct {
            circumstances.preset = None;
        }
        Record {
            surface: task.surface.name.to_string(),
            trial: task.trial.name(),
            seed: task.trial.seed(),
            circumstances,
            fingerprint,
            outcome,
        }
    }

    fn failed(&self) -> usize {
        let failed = |record: &&Record| record.measured().is_none();
        self.records.values().filter(failed).count()
    }

    fn result(&self) -> Page<'_> {
        Page {
            suite: name_of(self.suite),
            records: self.records.values().collect(),
            peers: &self.peers,
        }
    }

    fn write(&self) -> Result<(), Failure> {
        self.result().write(self.page, &self.store)
    }
}

/// The page needs a folder that is there, and a name beside which its other files have theirs.
fn check_page(page: &Path) -> Result<(), Failure> {
    check_folder(Some(page))?;
    match page.extension() {
        Some(extension) if extension == "md" => Ok(()),
        _ => {
            let page = page.display();
            Err(Failure::input(format!(
                "{page}: the page of a suite is a file NAME.md"
            )))
        }
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
fn files(arguments: &args::Evaluate) -> Result<Vec<PathBuf>, Failure> {
    let files = match Inputs::collect(&arguments.inputs, None)? {
        Inputs::Sample => return Ok(Vec::new()),
        Inputs::One(path) => vec![path],
        Inputs::Batch { files, failed } => {
            if let Some((path, reason)) = failed.first() {
                return Err(Failure::input(format!("{}: {reason}", path.display())));
            }
            files.into_iter().map(|(path, _)| path).collect()
        }
    };
    let used: Vec<&str> = surfaces::all()
        .iter()
        .filter(|surface| surface.file(&files).is_some())
        .map(|surface| surface.name)
        .collect();
    if used.is_empty() {
        let names: Vec<&str> = surfaces::all()
            .iter()
            .filter(|surface| !surface.is_generated())
            .map(|surface| surface.name)
            .collect();
        let names = names.join(", ");
        return Err(Failure::input(format!(
            "no file has the name of one of the paper's models: {names}"
        )));
    }
    if !arguments.quiet {
        print_line(&format!(
            "models of the paper among the files: {}",
            used.join(", ")
        ));
    }
    Ok(files)
}

fn circumstances(arguments: &args::Evaluate, config: &Config, backend: &Backend) -> Circumstances {
    let training = &config.training;
    let weight = training.weights.flattening;
    Circumstances {
        machine: machine::description(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        commit: option_env!("FAM_COMMIT").map(String::from),
        preset: Some(format!(
            "{}: {} points, {} iterations, width {}, {}{}",
            name_of(arguments.preset),
            training.points,
            training.iterations,
            training.networks.width,
            match training.starts {
                1 => "one start".to_string(),
                starts => format!("the best of {starts} starts"),
            },
            match weight > 0.0 {
                true => format!(", ℓ_flat with weight {weight}"),
                false => String::new(),
            }
        )),
        backend: backend.to_string(),
    }
}
