use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

use fam::Method;
use serde_json::json;

use super::run::Run;
use crate::again::Again;
use crate::batch::{Row, Table};
use crate::failure::{Failure, SUCCESS};
use crate::interrupt::{INTERRUPTED, STOPPING};
use crate::jobs::{self, Event, FileEvent, Outcome, Task, WorkerSettings};
use crate::manifest::{self, Entry, Manifest, State};
use crate::progress::BatchProgress;
use crate::terminal::{print_json, print_line};

impl Run {
    /// Flattens files, each with a folder of its own, and says what came of each.
    pub fn batch(
        &self,
        files: Vec<(PathBuf, PathBuf)>,
        failed: Vec<(PathBuf, String)>,
        again: &Again,
    ) -> Result<u8, Failure> {
        let arguments = &self.arguments;
        let marks = [&arguments.seams, &arguments.no_seams];
        for path in marks.into_iter().flatten() {
            // The worker reads it again.
            if !path.is_file() {
                let reason = "a batch reads it twice, so it must be a regular file";
                return Err(Failure::input(format!("{}: {reason}", path.display())));
            }
        }
        if let Some((path, _)) = files.iter().find(|(path, _)| is_standard_input(path)) {
            let reason = "the standard input can only be unwrapped alone";
            return Err(Failure::input(format!("{}: {reason}", path.display())));
        }
        let (files, failed) = match arguments.shard {
            Some(shard) => (shard.of(files), shard.of(failed)),
            None => (files, failed),
        };
        let root = arguments.out.clone().unwrap_or_default();
        let task = |(file, folder): (PathBuf, PathBuf)| Task {
            size: file.metadata().map_or(0, |data| data.len()),
            folder: root.join(folder),
            file,
        };
        let tasks: Vec<Task> = files.into_iter().map(task).collect();
        let settings = self.worker_settings(again)?;
        let mut record = Record::new(self, &root)?;
        for (path, reason) in failed {
            let message = format!("{}: {reason}", path.display());
            print_line(&format!("fam: {message}"));
            let outcome = Outcome::new(State::Failed, message);
            // Before all files.
            record.add(0, &path, Path::new(""), None, None, outcome)?;
        }
        let sizes = tasks.iter().map(|task| task.size).collect();
        let mut progress = BatchProgress::new(arguments.quiet, sizes);
        jobs::run(&tasks, &settings, &self.stop, |event| {
            let Event::File(number, event) = event else {
                if !arguments.quiet {
                    progress.say(STOPPING);
                }
                return Ok(());
            };
            let Task { file, folder, .. } = &tasks[number];
            let name = file.display();
            match event {
                FileEvent::Started => progress.start(number, &name.to_string()),
                FileEvent::Progress { fraction, line } => progress.step(number, fraction, line),
                FileEvent::Line(line) => progress.say(&line),
                FileEvent::Waits => {
                    progress.give_up(number);
                    progress.say(&format!(
                        "warning: {name}: it waits until more memory is free"
                    ));
                }
                FileEvent::Ended {
                    hash,
                    outcome,
                    took,
                } => {
                    let row = Row::new(file, &outcome, Some(took));
                    let line = match row.failed() {
                        true => outcome.message.clone(),
                        false => format!("{name}  {row}"),
                    };
                    progress.end(number, row.failed(), &line);
                    record.add(number, file, folder, hash, Some(took), outcome)?;
                }
            }
            Ok(())
        })?;
        progress.finish();
        record.end()
    }

    fn worker_settings<'a>(&self, again: &'a Again) -> Result<WorkerSettings<'a>, Failure> {
        // As many as RAYON_NUM_THREADS says, or one per core.
        let threads = rayon::current_num_threads();
        Ok(WorkerSettings {
            again,
            options: self.worker_options()?,
            jobs: match self.arguments.jobs {
                Some(jobs) => usize::from(jobs),
                // Training uses all cores by itself, or a device.
                None if self.config.method == Method::Neural => 1,
                None => threads,
            },
            threads,
            timeout: self.arguments.timeout,
        })
    }
}

/// What came of the files so far, for the table, the manifest and scripts.
struct Record<'a> {
    run: &'a Run,
    table: Table,
    manifest: Manifest,
    /// The latest entries of files, in all manifests of the folder.
    known: HashMap<String, Entry>,
}

impl<'a> Record<'a> {
    fn new(run: &'a Run, root: &Path) -> Result<Self, Failure> {
        if !root.as_os_str().is_empty() {
            std::fs::create_dir_all(root)
                .map_err(|error| Failure::input(format!("{}: {error}", root.display())))?;
        }
        let name = match run.arguments.shard {
            Some(shard) => shard.manifest(),
            None => String::from(manifest::NAME),
        };
        let own = root.join(name);
        // Those of other shards and of earlier runs, too.
        let mut known = HashMap::new();
        for path in manifest::in_folder(root)? {
            let entries = match manifest::read(&path) {
                Ok((entries, _)) => entries,
                // Nothing is added to a file of somebody else.
                Err(failure) if path.file_name() == own.file_name() => return Err(failure),
                Err(_) => continue,
            };
            for entry in entries {
                let before: Option<&Entry> = known.get(&entry.input);
                if before.is_none_or(|before| before.finished <= entry.finished) {
                    known.insert(entry.input.clone(), entry);
                }
            }
        }
        Ok(Self {
            run,
            table: Table::default(),
            manifest: Manifest::open(&own)?,
            known,
        })
    }

    /// Adds what came of a file, and says at once what the table does not say in time.
    fn add(
        &mut self,
        place: usize,
        path: &Path,
        folder: &Path,
        hash: Option<String>,
        took: Option<Duration>,
        outcome: Outcome,
    ) -> Result<(), Failure> {
        let row = Row::new(path, &outcome, took);
        let input = path.display().to_string();
        if self.run.arguments.json {
            let (state, reason) = (outcome.state, &outcome.message);
            match &outcome.summary {
                _ if outcome.skipped => print_json(&json!({"state": "skipped", "input": input}))?,
                Some(summary) if !row.failed() => print_json(summary)?,
                _ => print_json(&json!({"state": state, "input": input, "reason": reason}))?,
            }
        }
        let full = absolute(path);
        let known = self.known.get(&full);
        let is_known = known.is_some_and(|entry| entry.state == State::Done && entry.hash == hash);
        if !(outcome.skipped && is_known) {
            self.manifest.add(&Entry {
                input: full,
                folder: absolute(folder),
                hash,
                state: outcome.state,
                seconds: took.filter(|_| !outcome.skipped).map(|t| t.as_secs_f64()),
                message: row.text().to_owned(),
                metrics: outcome.summary.map(manifest::metrics),
                finished: manifest::now(),
            })?;
        }
        self.table.push(place, path, row);
        Ok(())
    }

    /// After the last file: the table and the exit code.
    fn end(self) -> Result<u8, Failure> {
        let arguments = &self.run.arguments;
        if !arguments.json && !arguments.quiet {
            // Whoever reads it may have read enough.
            let _ = write!(std::io::stdout(), "{}", self.table);
        }
        if self.run.stop.load(Ordering::Relaxed) {
            return Ok(INTERRUPTED);
        }
        match self.table.failed() {
            0 => Ok(SUCCESS),
            failed => Err(Failure::Work(format!(
                "{failed} of {} files failed",
                self.table.len()
            ))),
        }
    }
}

/// A path that is the same from wherever the program is started. One that is not UTF-8 is quoted and
/// has its bytes escaped, so that no two are the same.
fn absolute(path: &Path) -> String {
    let absolute = std::path::absolute(path);
    let path = absolute.as_deref().unwrap_or(path);
    path.to_str()
        .map_or_else(|| format!("{path:?}"), str::to_owned)
}

/// Whether a path is the standard input, which workers have for other things.
fn is_standard_input(path: &Path) -> bool {
    ["/dev/stdin", "/dev/fd/0", "/proc/self/fd/0"]
        .iter()
        .any(|name| path == Path::new(name))
}
