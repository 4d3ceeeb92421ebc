//! What a worker process tells the one that started it: JSON objects, one per line.

use std::io::Write;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::manifest::State;

/// A line on the standard output of a worker.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Message {
    /// How far it is, from 0 to 1, and what the user reads of it.
    Progress { fraction: f64, line: String },
    /// SHA-256 of the file; later with the files that it refers to.
    Hash(String),
    /// The last one.
    Ended(Outcome),
}

/// What came of a file.
#[derive(Debug, Serialize, Deserialize)]
pub struct Outcome {
    pub state: State,
    /// Whether it was done before.
    pub skipped: bool,
    /// The result in a line, or the reason why there is none.
    pub message: String,
    /// What `--json` prints of it.
    pub summary: Option<Value>,
}

impl Outcome {
    /// A state and its message, without a summary.
    pub fn new(state: State, message: String) -> Self {
        Self {
            state,
            skipped: false,
            message,
            summary: None,
        }
    }
}

impl Message {
    /// Sends it. Where the reader is gone, the worker's standard input ends, too, and the worker with it;
    /// until then it waits.
    pub fn send(&self) {
        let sent = serde_json::to_vec(self)
            .map_err(std::io::Error::other)
            .and_then(|mut line| {
                line.push(b'\n');
                let mut out = std::io::stdout().lock();
                out.write_all(&line)?;
                out.flush()
            });
        if sent.is_err() {
            loop {
                std::thread::park();
            }
        }
    }
}
