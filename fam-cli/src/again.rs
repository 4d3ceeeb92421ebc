//! Starting this program again, for one file of many.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// The command line of this program, to be started again with the same options.
pub struct Again {
    /// The program and what comes before its arguments.
    program: Vec<OsString>,
    /// The command `unwrap` and all that follows it.
    arguments: Vec<OsString>,
}

impl Again {
    /// `program` starts this program; `arguments` are those of this run, of which the first is its
    /// name.
    pub fn new(program: Vec<OsString>, arguments: &[OsString]) -> Self {
        Self {
            program,
            arguments: arguments.get(1..).unwrap_or_default().to_vec(),
        }
    }

    /// The command that unwraps `file` into `folder` on so many threads, or none where the program
    /// cannot be started again.
    pub fn worker(&self, file: &Path, folder: &Path, threads: usize) -> Option<Command> {
        let (program, before) = self.program.split_first()?;
        let (command, options) = self.arguments.split_first()?;
        let mut worker = Command::new(program);
        worker.args(before).arg(command);
        // Before the options, which may end with `--` and names of files.
        worker.arg("--worker").arg(file).arg(folder).args(options);
        worker.env("RAYON_NUM_THREADS", threads.to_string());
        Some(worker)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worker_has_the_options_of_the_run() {
        let words = |text: &str| -> Vec<OsString> { text.split(' ').map(OsString::from).collect() };
        let again = Again::new(
            words("python -m flatten_anything"),
            &words("fam unwrap --checker -- a.obj"),
        );
        let worker = again.worker(Path::new("-x.obj"), Path::new("out/x"), 2);
        let worker = worker.unwrap();
        let given: Vec<&str> = worker.get_args().map(|a| a.to_str().unwrap()).collect();
        let expected = "-m flatten_anything unwrap --worker -x.obj out/x --checker -- a.obj";
        assert_eq!(given.join(" "), expected);
        assert_eq!(worker.get_program(), "python");
    }
}
