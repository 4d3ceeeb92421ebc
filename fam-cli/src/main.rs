//! `fam`: UVs for any mesh or point cloud.

use std::ffi::OsString;
use std::process::ExitCode;

/// Large temporaries come and go in every training step; this allocator keeps their pages.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    // Without a path, only batches are impossible.
    let program = std::env::current_exe().map(OsString::from);
    ExitCode::from(fam_cli::run(
        program.into_iter().collect(),
        std::env::args_os(),
    ))
}
