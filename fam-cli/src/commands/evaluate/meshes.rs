//! The table of meshes.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use fam_io::atomic::write_atomically;

use super::reference::Reference;
use super::table::{Outcome, Table};
use super::trial::{Source, Trial};
use super::{check_folder, configuration};
use crate::args;
use crate::backend::Backend;
use crate::config::Config;
use crate::failure::{Failure, SUCCESS};
use crate::inputs::Inputs;
use crate::interrupt::{INTERRUPTED, stop_on_interrupt};
use crate::machine;
use crate::terminal::{plain, print_line};

/// Trains on meshes, finishes each in several ways and writes a table of what came of it.
pub fn meshes(arguments: &args::Evaluate) -> Result<u8, Failure> {
    let reference = match &arguments.reference {
        Some(path) => Reference::read(path)?,
        None => Reference::default(),
    };
    let config = configuration(arguments)?;
    let backend = Backend::choose(arguments.backend)?;
    let (files, failed) = files(arguments)?;
    check_folder(arguments.out.as_deref())?;
    let stop = stop_on_interrupt(arguments.quiet)?;
    let mut table = Table::new(circumstances(arguments, &config, &backend), reference);
    for (path, reason) in failed {
        let name = path.display().to_string();
        print_line(&format!("fam: {name}: {reason}"));
        table.push(name, Outcome::failed(reason));
    }
    let count = files.len();
    for (number, (path, folder)) in files.into_iter().enumerate() {
        let name = folder.with_extension("").display().to_string();
        if !arguments.quiet {
            print_line(&format!("[{}/{count}] {name}", number + 1));
        }
        let trial = Trial {
            config: &config.training,
            backend: &backend,
            source: match &arguments.models {
                Some(models) => Source::Model(models.join(&folder).join("model.safetensors")),
                None => Source::Training,
            },
            quiet: arguments.quiet,
            stop: &stop,
        };
        let outcome = trial.run(&path);
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let outcome = outcome.unwrap_or_else(|failure| {
            print_line(&format!("fam: {failure}"));
            Outcome::failed(failure.to_string())
        });
        table.push(name, outcome);
        // What took minutes is not lost when something ends the rest.
        save(arguments, &table)?;
    }
    save(arguments, &table)?;
    print(arguments, &table)?;
    if stop.load(Ordering::Relaxed) {
        return Ok(INTERRUPTED);
    }
    match table.failed() {
        0 => Ok(SUCCESS),
        failed => Err(Failure::Work(format!(
            "{failed} of {} meshes failed",
            table.len()
        ))),
    }
}

/// Files with the folders of their results.
type Files = Vec<(PathBuf, PathBuf)>;

/// The files to try, and those that cannot be, with the reason.
fn files(arguments: &args::Evaluate) -> Result<(Files, Vec<(PathBuf, String)>), Failure> {
    Ok(match Inputs::collect(&arguments.inputs, None)? {
        Inputs::Batch { files, failed } => (files, failed),
        Inputs::One(path) => {
            let folder = PathBuf::from(path.file_name().unwrap_or_default()).with_extension("fam");
            (vec![(path, folder)], Vec::new())
        }
        Inputs::Sample => (Vec::new(), Vec::new()),
    })
}

fn circumstances(arguments: &args::Evaluate, config: &Config, backend: &Backend) -> String {
    let training = &config.training;
    let training = match arguments.models {
        Some(_) => "networks trained before".to_string(),
        None => format!(
            "{} points, {} iterations, width {}, seed {}, on {backend}",
            training.points, training.iterations, training.networks.width, training.seed
        ),
    };
    let (version, machine) = (env!("CARGO_PKG_VERSION"), machine::description());
    format!("`fam evaluate` {version}; {training}; {machine}.")
}

/// Writes the table to its file, if there is to be one.
fn save(arguments: &args::Evaluate, table: &Table) -> Result<(), Failure> {
    let Some(out) = &arguments.out else {
        return Ok(());
    };
    let markdown = table.to_string();
    write_atomically(out.clone(), |file| file.write_all(markdown.as_bytes())).map_err(Failure::work)
}

fn print(arguments: &args::Evaluate, table: &Table) -> Result<(), Failure> {
    if arguments.json {
        let json = serde_json::to_string_pretty(table).map_err(Failure::work)?;
        println!("{json}");
    } else if arguments.out.is_none() {
        for line in table.to_string().lines() {
            println!("{}", plain(line));
        }
    }
    Ok(())
}
