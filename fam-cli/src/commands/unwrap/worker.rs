//! A worker's side of a batch: one file, told to the process that started it.

use std::io::BufRead;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use fam_io::Document;

use super::fingerprint::Content;
use super::run::Run;
use super::stem;
use crate::failure::{Failure, SUCCESS};
use crate::jobs::{Message, Outcome, STOP};
use crate::manifest::State;

impl Run {
    /// Unwraps one file of a batch and tells what came of it.
    pub fn work(&self, path: &Path, folder: &Path) -> u8 {
        listen(self.stop.clone());
        let outcome = self.outcome(path, folder);
        Message::Ended(outcome.unwrap_or_else(failed)).send();
        SUCCESS
    }

    fn outcome(&self, path: &Path, folder: &Path) -> Result<Outcome, Failure> {
        // A pipe cannot be read twice.
        let mut content = match path.is_file() {
            true => Some(Content::of(path)?),
            false => None,
        };
        let outcome = match fam_io::read_surface(path) {
            Err(error) => failed(Failure::input(error)),
            Ok(document) => {
                if let Some(content) = &mut content {
                    content.add_companions(&document)?;
                }
                let outcome = self.one_of_many(&document, path, folder, content.as_ref());
                outcome.unwrap_or_else(failed)
            }
        };
        Ok(Outcome {
            hash: content.as_ref().map(Content::hash),
            ..outcome
        })
    }

    fn one_of_many(
        &self,
        document: &Document,
        path: &Path,
        folder: &Path,
        content: Option<&Content>,
    ) -> Result<Outcome, Failure> {
        let input = path.display().to_string();
        let fingerprint = match content {
            Some(content) => Some(self.fingerprint(content)?),
            None => None,
        };
        let fingerprint = fingerprint.as_deref();
        let output = self.output(document, &stem(path), folder);
        let done = fingerprint.and_then(|fingerprint| output.done(fingerprint));
        if let (Some(report), false) = (done, self.arguments.force) {
            return Ok(Outcome {
                skipped: true,
                summary: Some(report),
                ..Outcome::new(State::Done, String::from("done before"))
            });
        }
        let done = self.one(document, &input, Some(path), &output, fingerprint)?;
        let (state, message) = match done.error {
            Some(error) => (State::Failed, format!("{input}: {error}")),
            None if done.interrupted => (State::Interrupted, String::new()),
            None => (State::Done, done.report.headline()),
        };
        Ok(Outcome {
            summary: Some(done.summary),
            ..Outcome::new(state, message)
        })
    }
}

fn failed(failure: Failure) -> Outcome {
    Outcome::new(State::Failed, failure.to_string())
}

/// Stops when the process that started this one says so, and ends when it is gone.
fn listen(stop: Arc<AtomicBool>) {
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            match line {
                Ok(line) if line == STOP => stop.store(true, Ordering::Relaxed),
                _ => break,
            }
        }
        std::process::exit(1);
    });
}
