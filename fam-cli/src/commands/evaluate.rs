use std::process::ExitCode;

use crate::args;
use crate::failure::Failure;

pub fn evaluate(_arguments: &args::Evaluate) -> Result<ExitCode, Failure> {
    Err(Failure::input("not yet"))
}
