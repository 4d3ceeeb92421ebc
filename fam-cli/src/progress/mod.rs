//! What the user sees while a command runs.

mod finishing;
mod training;

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

pub use finishing::FinishingProgress;
pub use training::TrainingProgress;

/// How progress is shown on standard error: a bar on a terminal, else lines.
enum Display {
    Silent,
    Bar(ProgressBar),
    Lines,
}

impl Display {
    /// A bar has the form of `template`.
    fn new(quiet: bool, template: &str) -> Self {
        if quiet {
            Self::Silent
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            bar.set_style(
                ProgressStyle::with_template(template)
                    .unwrap_or_else(|_| ProgressStyle::default_bar()),
            );
            Self::Bar(bar)
        } else {
            Self::Lines
        }
    }
}

/// Whole seconds or minutes.
pub fn short(duration: Duration) -> String {
    let seconds = duration.as_secs_f64().round() as u64;
    match seconds {
        0..=99 => format!("{seconds}s"),
        _ => format!("{}m{:02}s", seconds / 60, seconds % 60),
    }
}
