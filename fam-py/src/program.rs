//! The program `fam`.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program with arguments, of which the first is its name; returns the exit code.
#[pyfunction]
pub fn run_program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| fam_cli::run(arguments))
}
