//! What the user sees while a command runs.

mod batch;
mod finishing;
mod training;

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fam::Progress;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::jobs::Message;

pub use batch::BatchProgress;

use finishing::FinishingProgress;
use training::TrainingProgress;

/// Steps of the bar of a layout.
const BAR: u64 = 1000;

/// Time between messages.
const BETWEEN_MESSAGES: Duration = Duration::from_millis(200);

/// Shows how far a surface is, and stops when the user interrupts.
pub struct UnwrapProgress<'a> {
    kind: ProgressMode,
    stop: &'a AtomicBool,
    training: Option<TrainingProgress>,
    layout: Option<FinishingProgress>,
}

impl<'a> UnwrapProgress<'a> {
    /// Progress until `stop` is set.
    pub fn new(kind: ProgressMode, stop: &'a AtomicBool) -> Self {
        Self {
            kind,
            stop,
            training: None,
            layout: None,
        }
    }

    /// Shows what is going on; says whether to go on.
    pub fn show(&mut self, now: Progress) -> ControlFlow<()> {
        let kind = self.kind;
        match now {
            Progress::Planning => {}
            Progress::Training { steps, now } => self
                .training
                .get_or_insert_with(|| TrainingProgress::new(kind, steps))
                .step(&now),
            Progress::Layout(now) => {
                self.end_training();
                self.layout
                    .get_or_insert_with(|| FinishingProgress::new(kind))
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

/// How progress is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProgressMode {
    Silent,
    /// To the user, on standard error.
    Terminal,
    /// To the process that started this one.
    Messages,
}

impl ProgressMode {
    /// What a user gets who may have asked for quiet.
    pub fn of_user(quiet: bool) -> Self {
        match quiet {
            true => Self::Silent,
            false => Self::Terminal,
        }
    }
}

/// How progress is shown: a bar on a terminal, else lines; or messages.
enum Display {
    Silent,
    Bar(ProgressBar),
    Lines,
    Messages { last: Option<Instant> },
}

impl Display {
    /// A bar has the form of `template`.
    fn new(kind: ProgressMode, template: &str) -> Self {
        if kind == ProgressMode::Silent {
            Self::Silent
        } else if kind == ProgressMode::Messages {
            Self::Messages { last: None }
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

/// Tells the process that started this one how far it is, if it was not told just now.
fn send(last: &mut Option<Instant>, fraction: f64, line: impl FnOnce() -> String) {
    if last.is_none_or(|at| at.elapsed() >= BETWEEN_MESSAGES) {
        Message::Progress {
            fraction,
            line: line(),
        }
        .send();
        *last = Some(Instant::now());
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
