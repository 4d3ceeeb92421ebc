//! `fam`: UVs for any mesh or point cloud. The program as a function, and its choice of backends.

mod again;
mod args;
mod backend;
mod batch;
mod checkpoints;
mod commands;
mod config;
mod direction;
#[cfg(test)]
mod documents;
mod failure;
mod inputs;
mod interrupt;
mod jobs;
mod kept;
mod machine;
mod manifest;
mod marks;
mod output;
mod paint;
mod parting;
mod progress;
mod pytorch;
mod shard;
mod symmetry;
mod terminal;
mod time;
mod timeout;
mod weights;

use std::ffi::OsString;

use clap::Parser;

pub use args::BackendName;
pub use backend::{Backend, Job};
pub use failure::Failure;
pub use kept::all_but;
pub use marks::marks;
pub use parting::{Squares, parting, weighted};
pub use weights::Weight;

use again::Again;
use args::{Arguments, Command};
use failure::USAGE;
use terminal::print_line;

/// Runs the program with arguments, of which the first is its name. `program` starts it again, as
/// a process for each file of many: the path of an executable, and arguments before all others.
/// Returns the exit code: 0 done, 1 the work failed, 2 bad input or usage, 130 interrupted.
///
/// Ctrl-C is the program's from then on, and the threads of `rayon` are set up: it is for a process
/// that does nothing else.
pub fn run(program: Vec<OsString>, arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let again = Again(program);
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Nothing is left to be done where the terminal is gone.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(USAGE);
        }
    };
    let result = share_work().and_then(|()| match arguments.command {
        None => commands::unwrap(args::Unwrap::default(), &again),
        Some(Command::Unwrap(arguments)) => commands::unwrap(*arguments, &again),
        Some(Command::Map(arguments)) => commands::map(&arguments),
        Some(Command::Pack(arguments)) => commands::pack(&arguments),
        Some(Command::Metrics(arguments)) => commands::metrics(&arguments),
        Some(Command::Evaluate(arguments)) => commands::evaluate(&arguments),
        Some(Command::Report(arguments)) => commands::report(&arguments),
        Some(Command::Import(arguments)) => commands::import(&arguments),
        Some(Command::Export(arguments)) => commands::export(&arguments),
        Some(Command::Bench(arguments)) => commands::bench(&arguments),
        Some(Command::Backends) => commands::backends(),
    });
    result.unwrap_or_else(|failure| {
        print_line(&format!("fam: {failure}"));
        failure.exit_code()
    })
}

/// Makes this thread, which trains one map at a time, one of those that share the work of its steps: it
/// need not wake another for each of a hundred small pieces of a step, nor wait until that is awake.
fn share_work() -> Result<(), Failure> {
    let threads = rayon::ThreadPoolBuilder::new().use_current_thread();
    threads
        .build_global()
        .map_err(|error| Failure::work(format!("cannot start threads: {error}")))
}
