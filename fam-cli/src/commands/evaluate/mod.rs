//! What the method makes of surfaces: a table of meshes, or the paper's evaluation.

mod meshes;
mod reference;
mod suite;
mod table;
mod trial;

use std::path::Path;

use crate::args;
use crate::config::Config;
use crate::failure::Failure;

/// Evaluates a suite, or the meshes that were given.
pub fn evaluate(arguments: &args::Evaluate) -> Result<u8, Failure> {
    match arguments.suite {
        Some(suite) => suite::evaluate(arguments, suite),
        None => meshes::meshes(arguments),
    }
}

fn configuration(arguments: &args::Evaluate) -> Result<Config, Failure> {
    let mut config = Config::of(arguments.preset);
    if let Some(iterations) = arguments.iterations {
        config.training.iterations = iterations;
    }
    config.checked()
}

/// The table's folder must exist, so that nothing is trained for nothing.
fn check_folder(out: Option<&Path>) -> Result<(), Failure> {
    let folder = out.and_then(Path::parent);
    match folder.filter(|folder| *folder != Path::new("") && !folder.is_dir()) {
        Some(folder) => Err(Failure::input(format!(
            "{}: it is no folder",
            folder.display()
        ))),
        None => Ok(()),
    }
}
