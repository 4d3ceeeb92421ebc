//! What the user sees while training runs.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use fam_core::losses::LossTerm;
use fam_core::training::Step;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Plain lines printed over one training, when the output is no terminal.
const PLAIN_LINES: usize = 20;

/// Shows training steps on standard error: a bar on a terminal, else a line now and then.
pub enum Progress {
    Silent,
    Bar(ProgressBar, Pace),
    Lines { total: usize, pace: Pace },
}

/// Iterations over time.
pub struct Pace {
    started: Instant,
    points: usize,
}

impl Progress {
    /// Progress of `total` iterations of `points` points each.
    pub fn new(quiet: bool, total: usize, points: usize) -> Self {
        let pace = Pace {
            started: Instant::now(),
            points,
        };
        if quiet {
            Self::Silent
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(
                Some(total as u64),
                ProgressDrawTarget::stderr_with_hz(10),
            );
            let template = "{bar:24} {pos}/{len}  {msg}  {eta} left";
            bar.set_style(
                ProgressStyle::with_template(template)
                    .unwrap_or_else(|_| ProgressStyle::default_bar()),
            );
            Self::Bar(bar, pace)
        } else {
            Self::Lines { total, pace }
        }
    }

    /// After each step.
    pub fn step(&self, step: &Step) {
        let done = step.iteration + 1;
        match self {
            Self::Silent => {}
            Self::Bar(bar, pace) => {
                bar.set_position(done as u64);
                bar.set_message(format!("{}  {}", terms(step), pace.rate(done)));
            }
            Self::Lines { total, pace } => {
                let every = total.div_ceil(PLAIN_LINES);
                if done == 1 || done.is_multiple_of(every) || done == *total {
                    eprintln!(
                        "{done}/{total}  {}  {}  {} left",
                        terms(step),
                        pace.rate(done),
                        short(pace.left(done, *total))
                    );
                }
            }
        }
    }

    /// After the last step.
    pub fn finish(self) {
        if let Self::Bar(bar, _) = self {
            bar.abandon();
        }
    }
}

impl Pace {
    fn rate(&self, done: usize) -> String {
        let rate = (done * self.points) as f64 / self.started.elapsed().as_secs_f64().max(1e-9);
        if rate < 1e4 {
            format!("{rate:.0} points/s")
        } else {
            format!("{:.0}k points/s", rate / 1e3)
        }
    }

    fn left(&self, done: usize, total: usize) -> Duration {
        self.started
            .elapsed()
            .mul_f64((total - done) as f64 / done as f64)
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

/// The loss terms in the paper's four groups.
fn terms(step: &Step) -> String {
    let group = |accepted: &dyn Fn(LossTerm) -> bool| {
        let values: Vec<f32> = step
            .terms
            .iter()
            .filter(|(term, _)| accepted(*term))
            .map(|(_, value)| *value)
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f32>())
    };
    let groups = [
        ("wrap", group(&|term| term == LossTerm::Wrap)),
        (
            "unwrap",
            group(&|term| {
                matches!(
                    term,
                    LossTerm::Unwrap | LossTerm::UnwrapQHat | LossTerm::UnwrapQHatCycle
                )
            }),
        ),
        (
            "cycle",
            group(&|term| {
                matches!(
                    term,
                    LossTerm::CyclePoints | LossTerm::CycleUv | LossTerm::CycleNormals
                )
            }),
        ),
        (
            "conf",
            group(&|term| matches!(term, LossTerm::ConformalityF | LossTerm::ConformalityG)),
        ),
    ];
    let mut line = format!("loss {:.4}", step.total);
    for (name, value) in groups {
        if let Some(value) = value {
            line.push_str(&format!("  {name} {value:.4}"));
        }
    }
    line
}
