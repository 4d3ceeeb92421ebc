//! Starting this program again, for one file of many.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// How this program is started: the path of an executable, and arguments before all others.
pub struct Again(pub Vec<OsString>);

impl Again {
    /// The command of a worker that unwraps `file` into `folder` on so many threads, or none where
    /// the program cannot be started again. A worker reads its options from its standard input: the
    /// command line of a batch may name more files than that of a process can hold.
    pub fn worker(&self, file: &Path, folder: &Path, threads: usize) -> Option<Command> {
        let (program, before) = self.0.split_first()?;
        let mut worker = Command::new(program);
        worker.args(before).args(["unwrap", "--worker"]);
        worker.arg(file).arg(folder);
        worker.env("RAYON_NUM_THREADS", threads.to_string());
        Some(worker)
    }
}
