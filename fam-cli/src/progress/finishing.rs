use std::time::{Duration, Instant};

use fam_layout::{Progress, Stage};

use super::{BAR, Display, ProgressMode, send, short};

/// Time between plain lines of one stage.
const BETWEEN_LINES: Duration = Duration::from_secs(2);

/// Fraction of the time, and the time, before which nothing is said of the time left: an estimate
/// from so little is wrong.
const LEAST: f64 = 0.02;
const EARLY: Duration = Duration::from_secs(1);

/// Components up to which every change of stage has a line.
const FEW: usize = 3;

/// Shows what finishing is at.
pub struct FinishingProgress {
    display: Display,
    started: Instant,
    /// When cutting and flattening began.
    refines: Option<Instant>,
    last: Option<(Instant, Stage)>,
}

impl FinishingProgress {
    pub fn new(kind: ProgressMode) -> Self {
        Self {
            display: Display::new(kind, "{bar:24} {msg}"),
            started: Instant::now(),
            refines: None,
            last: None,
        }
    }

    /// Often, whether there is something new or not.
    pub fn show(&mut self, now: &Progress) {
        if now.stage == Stage::Refine {
            self.refines.get_or_insert_with(Instant::now);
        }
        let (started, refines) = (self.started, self.refines);
        let line = || line(now, started, refines);
        match &mut self.display {
            Display::Silent => {}
            Display::Bar(bar) => {
                bar.set_length(BAR);
                bar.set_position((now.fraction * BAR as f64) as u64);
                bar.set_message(line());
            }
            Display::Messages { last } => send(last, now.fraction, line),
            Display::Lines => {
                let due = self.last.is_none_or(|(at, stage)| {
                    at.elapsed() >= BETWEEN_LINES || now.components <= FEW && stage != now.stage
                });
                if due {
                    eprintln!("{}", line());
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
}

/// What the user reads, of a layout that started at a time and has cut and flattened since another.
fn line(now: &Progress, started: Instant, refines: Option<Instant>) -> String {
    let time = short(started.elapsed());
    if now.stage == Stage::Pack {
        return format!("finishing  packing  {time}");
    }
    if now.stage == Stage::Reconstruct {
        return format!("finishing  finding the surface  {time}");
    }
    let mut line = String::from("finishing");
    if now.components > 1 {
        line.push_str(&format!("  {}/{} parts", now.done, now.components));
    } else if now.energy.is_finite() {
        let (energy, seam_length) = (now.energy, now.seam_length);
        line.push_str(&format!(
            "  energy {energy:.3}  seam length {seam_length:.2}"
        ));
    }
    line.push_str(&format!("  {time}"));
    let elapsed = refines.map(|since| since.elapsed());
    if let Some(left) = elapsed.and_then(|elapsed| left(now.fraction, elapsed)) {
        line.push_str(&format!(", about {} left", short(left)));
    }
    line
}

/// The time left after a fraction of it, if that says anything yet.
fn left(fraction: f64, elapsed: Duration) -> Option<Duration> {
    let is_known = (LEAST..1.0).contains(&fraction) && elapsed >= EARLY;
    is_known.then(|| elapsed.mul_f64((1.0 - fraction) / fraction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_goes_by_the_fraction_that_is_over() {
        let elapsed = Duration::from_secs(4);
        assert_eq!(left(0.0, elapsed), None);
        assert_eq!(left(0.2, elapsed), Some(Duration::from_secs(16)));
        assert_eq!(left(0.2, Duration::from_millis(10)), None);
        assert_eq!(left(1.0, elapsed), None);
    }
}
