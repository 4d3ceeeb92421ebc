use std::time::{Duration, Instant};

use fam_layout::{Progress, Stage};

use super::{Display, short};

/// Time between plain lines of one stage.
const BETWEEN_LINES: Duration = Duration::from_secs(2);

/// Components up to which every change of stage has a line.
const FEW: usize = 3;

/// Shows what finishing is at.
pub struct FinishingProgress {
    display: Display,
    started: Instant,
    last: Option<(Instant, Stage)>,
}

impl FinishingProgress {
    pub fn new(quiet: bool) -> Self {
        Self {
            display: Display::new(quiet, "{bar:24} {msg}"),
            started: Instant::now(),
            last: None,
        }
    }

    /// Often, whether there is something new or not.
    pub fn show(&mut self, now: &Progress) {
        match &self.display {
            Display::Silent => {}
            Display::Bar(bar) => {
                bar.set_length(now.components as u64);
                bar.set_position(now.component as u64);
                bar.set_message(self.line(now));
            }
            Display::Lines => {
                let due = self.last.is_none_or(|(at, stage)| {
                    at.elapsed() >= BETWEEN_LINES || now.components <= FEW && stage != now.stage
                });
                if due {
                    eprintln!("{}", self.line(now));
                    self.last = Some((Instant::now(), now.stage));
                }
            }
        }
    }

    /// After the last stage.
    pub fn finish(self) {
        if let Display::Bar(bar) = self.display {
            bar.finish_and_clear();
        }
    }

    fn line(&self, now: &Progress) -> String {
        let time = short(self.started.elapsed());
        if now.stage == Stage::Pack {
            return format!("finishing  packing  {time}");
        }
        let mut line = String::from("finishing");
        if now.components > 1 {
            line.push_str(&format!(
                "  component {}/{}",
                now.component + 1,
                now.components
            ));
        }
        if now.energy.is_finite() {
            let (energy, seam_length) = (now.energy, now.seam_length);
            line.push_str(&format!(
                "  energy {energy:.3}  seam length {seam_length:.2}"
            ));
        }
        format!("{line}  {time}")
    }
}
