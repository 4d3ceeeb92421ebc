//! `fam`: UVs for any mesh or point cloud.

mod args;
mod backend;
mod batch;
mod commands;
mod config;
mod failure;
mod inputs;
mod interrupt;
mod machine;
mod marks;
mod output;
mod parting;
mod progress;
mod time;

use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};
use failure::Failure;

/// Large temporaries come and go in every training step; this allocator keeps their pages.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = share_work().and_then(|()| match arguments.command {
        None => commands::unwrap(args::Unwrap::default()),
        Some(Command::Unwrap(arguments)) => commands::unwrap(arguments),
        Some(Command::Map(arguments)) => commands::map(&arguments),
        Some(Command::Metrics(arguments)) => commands::metrics(&arguments),
        Some(Command::Evaluate(arguments)) => commands::evaluate(&arguments),
        Some(Command::Bench(arguments)) => commands::bench(&arguments),
        Some(Command::Backends) => commands::backends(),
    });
    match result {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("fam: {failure}");
            failure.exit_code()
        }
    }
}

/// Makes this thread, which trains one map at a time, one of those that share the work of its steps: it
/// need not wake another for each of a hundred small pieces of a step, nor wait until that is awake.
fn share_work() -> Result<(), Failure> {
    let threads = rayon::ThreadPoolBuilder::new().use_current_thread();
    threads
        .build_global()
        .map_err(|error| Failure::work(format!("cannot start threads: {error}")))
}
