use std::fmt;

use serde_json::Value;

use crate::manifest::{Entry, State};
use crate::terminal::plain;

/// How many of the slowest files are named.
const SLOWEST: usize = 5;

/// Figures of which the distribution is shown: a name, and where metrics have it.
const FIGURES: [(&str, &str); 6] = [
    ("triangles", "/mesh/triangles"),
    ("charts", "/mesh/charts"),
    ("symmetric Dirichlet energy", "/mesh/symmetric_dirichlet"),
    ("conformality", "/mesh/conformality"),
    ("seam length", "/mesh/seam_length"),
    ("coverage", "/mesh/uv_coverage"),
];

/// Faults of layouts, of which the files are counted.
const FAULTS: [(&str, &str); 2] = [
    ("flipped triangles", "/mesh/flipped_triangles"),
    ("overlaps", "/mesh/overlapping_pairs"),
];

/// What came of files, as a text.
pub struct Text<'a>(pub &'a [Entry]);

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(entries) = self;
        let states = [
            State::Done,
            State::Failed,
            State::TimedOut,
            State::Interrupted,
        ];
        let counts = states.map(|state| entries.iter().filter(|e| e.state == state).count());
        let counted = states.iter().zip(counts).filter(|(_, count)| *count > 0);
        let counted: Vec<String> = counted.map(|(s, count)| format!("{count} {s}")).collect();
        if entries.is_empty() {
            return writeln!(f, "0 files");
        }
        let plural = if entries.len() == 1 { "" } else { "s" };
        writeln!(f, "{} file{plural}: {}", entries.len(), counted.join(", "))?;

        writeln!(
            f,
            "\n{:28}{:>10}{:>10}{:>10}{:>10}",
            "", "least", "median", "95 %", "most"
        )?;
        let seconds = numbers(entries, |entry| entry.seconds);
        row(f, "seconds", &seconds)?;
        for (name, place) in FIGURES {
            row(f, name, &numbers(entries, |entry| figure(entry, place)))?;
        }
        writeln!(
            f,
            "\n{:28}{:>10.1}",
            "seconds of all",
            seconds.iter().sum::<f64>()
        )?;
        for (name, place) in FAULTS {
            let has_any = |entry: &&Entry| figure(entry, place).is_some_and(|count| count > 0.0);
            let count = entries.iter().filter(has_any).count();
            writeln!(f, "{:28}{count:>10}", format!("files with {name}"))?;
        }

        let mut slowest: Vec<(f64, &Entry)> = entries
            .iter()
            .filter_map(|entry| Some((entry.seconds?, entry)))
            .collect();
        slowest.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        if !slowest.is_empty() {
            writeln!(f, "\nslowest")?;
        }
        for (seconds, entry) in slowest.iter().take(SLOWEST) {
            writeln!(f, "{seconds:>10.1} s  {}", plain(&entry.input))?;
        }
        let mut missing = entries
            .iter()
            .filter(|entry| entry.state != State::Done)
            .peekable();
        if missing.peek().is_some() {
            writeln!(f, "\nnot done")?;
        }
        for entry in missing {
            let line = format!("{:>12}  {}  {}", entry.state, entry.input, entry.message);
            writeln!(f, "{}", plain(line.trim_end()))?;
        }
        Ok(())
    }
}

/// The numbers that entries have, in order of size.
fn numbers(entries: &[Entry], number: impl Fn(&Entry) -> Option<f64>) -> Vec<f64> {
    let mut numbers: Vec<f64> = entries.iter().filter_map(number).collect();
    numbers.sort_by(f64::total_cmp);
    numbers
}

fn figure(entry: &Entry, place: &str) -> Option<f64> {
    entry
        .metrics
        .as_ref()?
        .pointer(place)
        .and_then(Value::as_f64)
}

/// A line on the distribution of sorted numbers, if there are any.
fn row(f: &mut fmt::Formatter<'_>, name: &str, sorted: &[f64]) -> fmt::Result {
    let Some(last) = sorted.len().checked_sub(1) else {
        return Ok(());
    };
    write!(f, "{name:28}")?;
    for quantile in [0.0, 0.5, 0.95, 1.0] {
        // The smallest number that so many do not exceed.
        let at = (quantile * sorted.len() as f64).ceil() as usize;
        let number = sorted[at.saturating_sub(1).min(last)];
        match number.fract() == 0.0 && number.abs() < 1e9 {
            true => write!(f, "{number:>10}")?,
            false => write!(f, "{number:>10.3}")?,
        }
    }
    writeln!(f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn entry(input: &str, state: State, seconds: f64, message: &str) -> Entry {
        Entry {
            input: input.to_owned(),
            folder: String::new(),
            hash: None,
            state,
            seconds: Some(seconds),
            message: message.to_owned(),
            metrics: (state == State::Done)
                .then(|| json!({"mesh": {"charts": 2, "flipped_triangles": 1}})),
            finished: 0.0,
        }
    }

    #[test]
    fn a_report_counts_and_names() {
        let entries = [
            entry("a.obj", State::Done, 1.0, "fine"),
            entry("b.obj", State::Done, 3.0, "fine"),
            entry("c.obj", State::Failed, 0.5, "it has no vertices"),
            entry("d.obj", State::TimedOut, 9.25, "not done"),
        ];
        let text = Text(&entries).to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "4 files: 2 done, 1 failed, 1 timed out");
        let row = |name: &str| -> Vec<&str> {
            let line = lines.iter().find(|line| line.starts_with(name)).unwrap();
            line[name.len()..].split_whitespace().collect()
        };
        assert_eq!(row("seconds "), ["0.500", "1", "9.250", "9.250"]);
        assert_eq!(row("charts"), ["2", "2", "2", "2"]);
        assert_eq!(row("seconds of all"), ["13.8"]);
        assert_eq!(row("files with flipped triangles"), ["2"]);
        assert_eq!(row("files with overlaps"), ["0"]);
        assert!(text.contains("9.2 s  d.obj"), "{text}");
        let (_, missing) = text.split_once("\nnot done\n").unwrap();
        assert_eq!(
            missing,
            "      failed  c.obj  it has no vertices\n   timed out  d.obj  not done\n"
        );
    }

    #[test]
    fn no_files_are_a_report_too() {
        assert!(Text(&[]).to_string().starts_with("0 files\n"));
    }
}
