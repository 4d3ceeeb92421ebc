//! `fam`: UVs for any mesh or point cloud.

use std::process::ExitCode;

/// Large temporaries come and go in every training step; this allocator keeps their pages.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    ExitCode::from(fam_cli::run(std::env::args_os()))
}
