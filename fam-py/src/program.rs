//! The program `fam`.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program with arguments, of which the first is its name; returns the exit code. `program`
/// starts it again: an executable, and arguments before all others.
#[pyfunction]
pub fn run_program(py: Python<'_>, program: Vec<OsString>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| fam_cli::run(program, arguments))
}
