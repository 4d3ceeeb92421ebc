//! A worker's side of a batch: one file, told to the process that started it.

use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use fam_io::Document;
use serde::{Deserialize, Serialize};

use super::fingerprint::Content;
use super::run::{Run, Source};
use super::stem;
use crate::args;
use crate::config::Config;
use crate::failure::{Failure, SUCCESS};
use crate::jobs::{Message, Outcome, STOP};
use crate::manifest::State;
use crate::output;
use crate::progress::ProgressMode;

/// What a worker reads first: a line of JSON with what its run has in common with all others.
#[derive(Serialize, Deserialize)]
struct WorkerOptions<A, C> {
    arguments: A,
    config: C,
}

impl Run {
    /// The line that makes a worker of this run.
    pub fn worker_options(&self) -> Result<String, Failure> {
        let options = WorkerOptions {
            arguments: &self.arguments,
            config: &self.config,
        };
        let fail = |error| Failure::input(format!("the options of a batch: {error}"));
        serde_json::to_string(&options).map_err(fail)
    }

    /// The run of a worker, from the line on its standard input.
    pub fn of_worker() -> Result<Self, Failure> {
        let mut line = String::new();
        std::io::stdin()
            .read_line(&mut line)
            .map_err(Failure::work)?;
        let options: WorkerOptions<args::Unwrap, Config> =
            serde_json::from_str(&line).map_err(Failure::work)?;
        Self::with_config(options.arguments, options.config, ProgressMode::Messages)
    }

    /// Unwraps one file of a batch and tells what came of it.
    pub fn work(&self, path: &Path, folder: &Path) -> u8 {
        listen(self.stop.clone(), self.writing.clone(), folder.to_owned());
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
        tell_hash(content.as_ref());
        let document = fam_io::read_surface(path).map_err(Failure::input)?;
        if let Some(content) = &mut content {
            content.add_companions(&document)?;
        }
        tell_hash(content.as_ref());
        self.one_of_many(&document, path, folder, content.as_ref())
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
        let source = Source {
            name: &input,
            path: Some(path),
            content,
            fingerprint,
        };
        let done = self.one(document, &source, &output)?;
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

fn tell_hash(content: Option<&Content>) {
    if let Some(content) = content {
        Message::Hash(content.hash()).send();
    }
}

/// Stops when the process that started this one says so, and ends when that is gone. Results that
/// are being written are written whole first.
fn listen(stop: Arc<AtomicBool>, writing: Arc<Mutex<()>>, folder: PathBuf) {
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            match line {
                Ok(line) if line == STOP => stop.store(true, Ordering::Relaxed),
                _ => break,
            }
        }
        // No result is begun any more.
        let _writing = writing.lock();
        output::sweep(&folder);
        std::process::exit(1);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Arguments, Command, Preset};
    use clap::Parser;

    /// All options that shape a result but do not belong to the configuration.
    #[test]
    fn a_worker_has_the_options_of_its_batch() {
        let line = "fam unwrap --format glb --uv-set 3 --checker --seam-lines --per-material \
            --separate-duplicates --force --backend flex --time-budget 90s --seam-rule paper \
            --seams a.obj --no-seams b.json";
        let parsed = Arguments::try_parse_from(line.split_whitespace()).unwrap();
        let Some(Command::Unwrap(arguments)) = parsed.command else {
            panic!("{line}");
        };
        let mut config = Config::of(Preset::Paper);
        config.finish.config.distortion_bound = 4.0 + 0.1_f64.sqrt();
        config.finish.config.hide_seams = 0.1_f64.sqrt();
        config.finish.config.seen_from = Some([0.1_f64.sqrt(), -1.0, 0.0]);
        let options = WorkerOptions {
            arguments: &*arguments,
            config: &config,
        };
        let json = serde_json::to_string(&options).unwrap();
        let read: WorkerOptions<args::Unwrap, Config> = serde_json::from_str(&json).unwrap();
        assert_eq!(format!("{:?}", read.arguments), format!("{arguments:?}"));
        assert_eq!(read.config, config);
    }
}
