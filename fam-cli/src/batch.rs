//! What came of the files of a batch.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::progress::short;

/// What came of one file.
#[derive(Debug, PartialEq)]
pub enum Row {
    Done {
        took: Duration,
        headline: String,
    },
    /// It was done before.
    Skipped,
    Interrupted,
    /// With the reason, which names the file.
    Failed(String),
}

/// One row per file; displayed as a table.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<(PathBuf, Row)>,
}

impl Table {
    pub fn push(&mut self, path: &Path, row: Row) {
        self.rows.push((path.to_owned(), row));
    }

    /// How many files there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// How many files failed.
    pub fn failed(&self) -> usize {
        let failed = |(_, row): &&(PathBuf, Row)| matches!(row, Row::Failed(_));
        self.rows.iter().filter(failed).count()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self
            .rows
            .iter()
            .map(|(p, _)| p.display().to_string())
            .collect();
        let width = names
            .iter()
            .map(|name| name.chars().count())
            .max()
            .unwrap_or(0);
        for (name, (_, row)) in names.iter().zip(&self.rows) {
            let (state, took, text) = match row {
                Row::Done { took, headline } => ("done", short(*took), headline.as_str()),
                Row::Skipped => ("skipped", String::new(), "done before"),
                Row::Interrupted => ("interrupted", String::new(), ""),
                Row::Failed(reason) => {
                    let reason = reason.strip_prefix(name.as_str()).unwrap_or(reason);
                    (
                        "failed",
                        String::new(),
                        reason.trim_start_matches([':', ' ']),
                    )
                }
            };
            let line = format!("{name:width$}  {state:11}  {took:>6}  {text}");
            writeln!(f, "{}", line.trim_end())?;
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
        let headline = "conformality 0.1".to_string();
        let took = Duration::from_secs(75);
        table.push(Path::new("a/long.obj"), Row::Done { took, headline });
        table.push(
            Path::new("b.ply"),
            Row::Failed("b.ply: it has no vertices".into()),
        );
        table.push(Path::new("c.ply"), Row::Skipped);
        let expected = "\
a/long.obj  done            75s  conformality 0.1
b.ply       failed               it has no vertices
c.ply       skipped              done before
";
        assert_eq!(table.to_string(), expected);
        assert_eq!(table.failed(), 1);
    }
}
