use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde_json::json;

use super::run::Run;
use super::stem;
use crate::batch::{Row, Table};
use crate::failure::{Failure, SUCCESS};
use crate::interrupt::INTERRUPTED;

impl Run {
    /// Flattens files, each with a folder of its own, and says what came of each.
    pub fn batch(
        &self,
        files: &[(PathBuf, PathBuf)],
        failed: Vec<(PathBuf, String)>,
    ) -> Result<u8, Failure> {
        let root = self.arguments.out.clone().unwrap_or_default();
        let mut table = Table::default();
        for (path, reason) in failed {
            self.record(
                &mut table,
                &path,
                Row::Failed(format!("{}: {reason}", path.display())),
            )?;
        }
        for (number, (path, folder)) in files.iter().enumerate() {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            if !self.arguments.quiet {
                eprintln!("[{}/{}]", number + 1, files.len());
            }
            let row = self
                .batch_file(path, &root.join(folder))
                .unwrap_or_else(|failure| Row::Failed(failure.to_string()));
            self.record(&mut table, path, row)?;
        }
        if !self.arguments.json && !self.arguments.quiet {
            print!("{table}");
        }
        if self.stop.load(Ordering::Relaxed) {
            return Ok(INTERRUPTED);
        }
        match table.failed() {
            0 => Ok(SUCCESS),
            failed => Err(Failure::Work(format!(
                "{failed} of {} files failed",
                table.len()
            ))),
        }
    }

    /// Adds a row to the table and says at once what the table does not say in time.
    fn record(&self, table: &mut Table, path: &Path, row: Row) -> Result<(), Failure> {
        let state = match &row {
            Row::Failed(reason) => {
                eprintln!("fam: {reason}");
                Some(
                    json!({"state": "failed", "input": path.display().to_string(), "reason": reason}),
                )
            }
            Row::Skipped => Some(json!({"state": "skipped", "input": path.display().to_string()})),
            Row::Done { .. } | Row::Interrupted => None,
        };
        if let (Some(state), true) = (state, self.arguments.json) {
            let json = serde_json::to_string_pretty(&state).map_err(Failure::work)?;
            println!("{json}");
        }
        table.push(path, row);
        Ok(())
    }

    fn batch_file(&self, path: &Path, folder: &Path) -> Result<Row, Failure> {
        let input = path.display().to_string();
        let document = fam_io::read_surface(path).map_err(Failure::input)?;
        let output = self.output(&document, &stem(path), folder);
        // A pipe cannot be read twice.
        let fingerprint = match path.is_file() {
            true => Some(self.fingerprint(path, &document)?),
            false => None,
        };
        let fingerprint = fingerprint.as_deref();
        let is_done = fingerprint.is_some_and(|fingerprint| output.is_done(fingerprint));
        if is_done && !self.arguments.force {
            return Ok(Row::Skipped);
        }
        let done = self.one(&document, &input, Some(path), &output, fingerprint)?;
        Ok(match done.error {
            Some(error) => Row::Failed(format!("{input}: {error}")),
            None if done.interrupted => Row::Interrupted,
            None => Row::Done {
                took: done.took,
                headline: done.report.headline(),
            },
        })
    }
}
