//! The file from which a training goes on that was broken off.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use fam_core::atlas::{Checkpoint, Checkpointer};
use fam_io::atomic::write_atomically;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::terminal::print_line;

/// What a training is of.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Changes with the input, such as its hash.
    pub input: String,
    /// All that shapes the trained map.
    pub options: String,
}

/// Saves a training while it runs.
pub struct Checkpoints {
    path: PathBuf,
    label: Label,
    every: Duration,
    /// When the last one was saved, or training began.
    last: Instant,
    /// Whether one could not be saved, which is said once.
    failed: bool,
    /// Held while a file of the folder is written.
    writing: Arc<Mutex<()>>,
}

impl Checkpoints {
    /// Checkpoints in the file `path`, of what the label says, and the least time between two. The folder
    /// is written to only while `writing` is held.
    pub fn new(path: PathBuf, label: Label, every: Duration, writing: Arc<Mutex<()>>) -> Self {
        Self {
            path,
            label,
            every,
            last: Instant::now(),
            failed: false,
            writing,
        }
    }

    /// The one that an earlier run left, if there is one.
    pub fn found(&self) -> Result<Option<Checkpoint>, Failure> {
        let fail = |reason: String| {
            let path = self.path.display();
            let advice = "without --resume, training begins anew";
            Failure::input(format!("{path}: {reason}; {advice}"))
        };
        let bytes = match std::fs::read(&self.path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            read => read.map_err(|error| fail(error.to_string()))?,
        };
        let checkpoint = Checkpoint::read(bytes).map_err(|error| fail(error.to_string()))?;
        let label: Label = serde_json::from_str(checkpoint.label())
            .map_err(|_| fail(String::from("another program wrote it")))?;
        if label.input != self.label.input {
            return Err(fail(String::from("the input has changed since")));
        }
        if label.options != self.label.options {
            return Err(fail(String::from(
                "training had other options, or another backend",
            )));
        }
        Ok(Some(checkpoint))
    }

    /// After a step; `is_last` if training is broken off.
    pub fn save(&mut self, checkpoint: &Checkpointer, is_last: bool) {
        if !is_last && self.last.elapsed() < self.every {
            return;
        }
        if let Err(error) = self.write(checkpoint)
            && !self.failed
        {
            // The training is worth more than what would save it.
            print_line(&format!("warning: there is no checkpoint: {error}"));
            self.failed = true;
        }
        self.last = Instant::now();
    }

    fn write(&self, checkpoint: &Checkpointer) -> Result<(), Failure> {
        let label = serde_json::to_string(&self.label).map_err(Failure::work)?;
        let bytes = checkpoint.bytes(&label).map_err(Failure::work)?;
        let _writing = self.writing.lock();
        write_atomically(&self.path, |out| out.write_all(&bytes)).map_err(Failure::work)
    }
}

/// Removes a checkpoint, after the results are complete.
pub fn remove(path: &Path) {
    // One that is left is refused, or leads to the same results again.
    let _ = std::fs::remove_file(path);
}
