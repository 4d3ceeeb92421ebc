//! What the user sees while a command runs.

mod finishing;
mod training;

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use fam::Progress;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use finishing::FinishingProgress;
use training::TrainingProgress;

/// Shows how far a surface is, and stops when the user interrupts.
pub struct UnwrapProgress<'a> {
    quiet: bool,
    stop: &'a AtomicBool,
    training: Option<TrainingProgress>,
    layout: Option<FinishingProgress>,
}

impl<'a> UnwrapProgress<'a> {
    /// Progress until `stop` is set.
    pub fn new(quiet: bool, stop: &'a AtomicBool) -> Self {
        Self {
            quiet,
            stop,
            training: None,
            layout: None,
        }
    }

    /// Shows what is going on; says whether to go on.
    pub fn show(&mut self, now: Progress) -> ControlFlow<()> {
        let quiet = self.quiet;
        match now {
            Progress::Planning => {}
            Progress::Training { steps, now } => self
                .training
                .get_or_insert_with(|| TrainingProgress::new(quiet, steps))
                .step(&now),
            Progress::Layout(now) => {
                self.end_training();
                self.layout
                    .get_or_insert_with(|| FinishingProgress::new(quiet))
                    .show(&now);
            }
        }
        match self.stop.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// After everything.
    pub fn end(mut self) {
        self.end_training();
        if let Some(layout) = self.layout {
            layout.finish();
        }
    }

    fn end_training(&mut self) {
        if let Some(training) = self.training.take() {
            training.finish();
        }
    }
}

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
