use std::time::Instant;

use fam_core::atlas;
use fam_core::losses::Term;

use super::{Display, ProgressMode, send, short};

/// Plain lines printed over one training, when the output is no terminal.
const PLAIN_LINES: usize = 20;

/// Shows training steps.
pub struct TrainingProgress {
    display: Display,
    steps: usize,
    started: Instant,
    /// Points that the steps so far have seen, over all components.
    seen: usize,
    /// Steps so far, over all components.
    done: usize,
    /// Those of an earlier run, which this one goes on with.
    earlier: Option<usize>,
}

impl TrainingProgress {
    /// Progress of components of so many steps each.
    pub fn new(kind: ProgressMode, steps: usize) -> Self {
        let template = "{bar:24} {pos}/{len}  {msg}  {eta} left";
        Self {
            display: Display::new(kind, template),
            steps,
            started: Instant::now(),
            seen: 0,
            done: 0,
            earlier: None,
        }
    }

    /// After a step.
    pub fn step(&mut self, now: &atlas::Progress) {
        let total = now.components * self.steps;
        let done = now.component * self.steps + now.step.before + 1;
        let is_first = self.earlier.is_none();
        let earlier = *self.earlier.get_or_insert(done - 1);
        let before = std::mem::replace(&mut self.done, done).max(earlier);
        // After it broke down, training is some steps back.
        self.seen += done.saturating_sub(before) * now.points;
        let rate = self.rate();
        match &mut self.display {
            Display::Silent => {}
            Display::Bar(bar) => {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
                bar.set_message(format!("{}  {rate}", terms(now)));
            }
            Display::Messages { last } => {
                let fraction = done as f64 / total as f64;
                send(last, fraction, || {
                    format!("training  {}  {rate}", terms(now))
                });
            }
            Display::Lines => {
                let every = total.div_ceil(PLAIN_LINES);
                if is_first || done / every > before / every || done == total {
                    let left = self.started.elapsed().mul_f64(
                        (total - done) as f64 / done.saturating_sub(earlier).max(1) as f64,
                    );
                    eprintln!(
                        "{done}/{total}  {}  {rate}  {} left",
                        terms(now),
                        short(left)
                    );
                }
            }
        }
    }

    /// After the last step.
    pub fn finish(self) {
        if let Display::Bar(bar) = self.display {
            bar.abandon();
        }
    }

    fn rate(&self) -> String {
        let rate = self.seen as f64 / self.started.elapsed().as_secs_f64().max(1e-9);
        if rate < 1e4 {
            format!("{rate:.0} points/s")
        } else {
            format!("{:.0}k points/s", rate / 1e3)
        }
    }
}

/// The component, if there are several, and the loss terms in the paper's four groups.
fn terms(now: &atlas::Progress) -> String {
    let step = now.step;
    let group = |accepted: &dyn Fn(Term) -> bool| {
        let values: Vec<f32> = step
            .terms
            .iter()
            .filter(|(term, _)| accepted(*term))
            .map(|(_, value)| *value)
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f32>())
    };
    let groups = [
        ("wrap", group(&|term| term == Term::Wrap)),
        (
            "unwrap",
            group(&|term| {
                matches!(
                    term,
                    Term::Unwrap | Term::UnwrapQHat | Term::UnwrapQHatCycle
                )
            }),
        ),
        (
            "cycle",
            group(&|term| matches!(term, Term::CyclePoints | Term::CycleUv | Term::CycleNormals)),
        ),
        (
            "conf",
            group(&|term| matches!(term, Term::ConformalityF | Term::ConformalityG)),
        ),
        ("flat", group(&|term| term == Term::Flattening)),
        ("added", group(&|term| matches!(term, Term::Added { .. }))),
    ];
    let mut line = String::new();
    if now.components > 1 {
        line = format!("component {}/{}  ", now.component + 1, now.components);
    }
    line.push_str(&format!("loss {:.4}", step.total));
    for (name, value) in groups {
        if let Some(value) = value {
            line.push_str(&format!("  {name} {value:.4}"));
        }
    }
    line
}
