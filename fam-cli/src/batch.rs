//! What came of the files of a batch.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::jobs::Outcome;
use crate::manifest::State;
use crate::progress::short;
use crate::terminal::plain;

/// What came of one file.
#[derive(Debug)]
pub struct Row {
    /// The state, or that it was done before.
    label: String,
    took: Option<Duration>,
    /// The result in a line, or the reason why there is none.
    text: String,
    failed: bool,
}

impl Row {
    /// The row of a file of which a worker told what came of it.
    pub fn new(path: &Path, outcome: &Outcome, took: Option<Duration>) -> Self {
        let text = outcome
            .message
            .strip_prefix(&format!("{}: ", path.display()));
        let is_done = outcome.state == State::Done && !outcome.skipped;
        Self {
            label: match outcome.skipped {
                true => String::from("skipped"),
                false => outcome.state.to_string(),
            },
            took: took.filter(|_| is_done),
            text: text.unwrap_or(&outcome.message).to_owned(),
            failed: matches!(outcome.state, State::Failed | State::TimedOut),
        }
    }

    /// The result in a line, or the reason why there is none, without the name of the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether there is a reason why it has no result.
    pub fn failed(&self) -> bool {
        self.failed
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let took = self.took.map(short).unwrap_or_default();
        let line = format!("{:11}  {took:>6}  {}", self.label, plain(&self.text));
        f.write_str(line.trim_end())
    }
}

/// One row per file; displayed as a table, in the order of the files.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<(usize, PathBuf, Row)>,
}

impl Table {
    /// Adds the row of the file that has a place among the others.
    pub fn push(&mut self, place: usize, path: &Path, row: Row) {
        let at = self.rows.partition_point(|(before, ..)| *before <= place);
        self.rows.insert(at, (place, path.to_owned(), row));
    }

    /// How many files there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// How many files failed.
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|(.., row)| row.failed).count()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self
            .rows
            .iter()
            .map(|(_, path, _)| plain(&path.display().to_string()).into_owned());
        let names: Vec<String> = names.collect();
        let width = names.iter().map(|name| name.chars().count()).max();
        let width = width.unwrap_or(0);
        for (name, (.., row)) in names.iter().zip(&self.rows) {
            writeln!(f, "{name:width$}  {row}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_line_per_file() {
        let mut table = Table::default();
        let mut push = |place: usize, name: &str, outcome: Outcome| {
            let took = Some(Duration::from_secs(75));
            let path = Path::new(name);
            table.push(place, path, Row::new(path, &outcome, took));
        };
        let skipped = Outcome {
            skipped: true,
            ..Outcome::new(State::Done, "done before".into())
        };
        push(2, "c.ply", skipped);
        let headline = "conformality 0.1".to_string();
        push(0, "a/long.obj", Outcome::new(State::Done, headline));
        let late = Outcome::new(State::TimedOut, "d: not done within 1 s".into());
        push(3, "d", late);
        let reason = "b.ply: it has no vertices".to_string();
        push(1, "b.ply", Outcome::new(State::Failed, reason));
        let expected = "\
a/long.obj  done            75s  conformality 0.1
b.ply       failed               it has no vertices
c.ply       skipped              done before
d           timed out            not done within 1 s
";
        assert_eq!(table.to_string(), expected);
        assert_eq!(table.failed(), 2);
    }
}
