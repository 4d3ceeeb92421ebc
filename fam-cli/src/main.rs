//! `fam`: UVs for any mesh or point cloud.

mod args;
mod backend;
mod batch;
mod budget;
mod commands;
mod config;
mod failure;
mod finish;
mod flatten;
mod inputs;
mod interrupt;
mod machine;
mod marks;
mod output;
mod progress;
mod report;
mod surface;
mod warnings;

use std::process::ExitCode;

use clap::Parser;

use args::{Arguments, Command};

/// Large temporaries come and go in every training step; this allocator keeps their pages.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // The thread that trains is one of those that share its work: it does not wake them for each of
    // a hundred small pieces of a step, and does not wait for them to be awake. Without it, the
    // pool is made where it is first used.
    let _ = rayon::ThreadPoolBuilder::new()
        .use_current_thread()
        .build_global();
    let result = match arguments.command {
        None => commands::unwrap(args::Unwrap::default()),
        Some(Command::Unwrap(arguments)) => commands::unwrap(arguments),
        Some(Command::Map(arguments)) => commands::map(&arguments),
        Some(Command::Metrics(arguments)) => commands::metrics(&arguments),
        Some(Command::Evaluate(arguments)) => commands::evaluate(&arguments),
        Some(Command::Bench(arguments)) => commands::bench(&arguments),
        Some(Command::Backends) => commands::backends(),
    };
    match result {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("fam: {failure}");
            failure.exit_code()
        }
    }
}
