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
                bar.set_length(now.triangles as u64);
                bar.set_position(now.triangles_done as u64);
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
        let elapsed = self.started.elapsed();
        let time = short(elapsed);
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
        if let Some(left) = left(now, elapsed) {
            line.push_str(&format!(", {} left", short(left)));
        }
        line
    }
}

/// The time that the parts which are not flat yet will take, if some are: about as long for a
/// triangle as the others took.
fn left(now: &Progress, elapsed: Duration) -> Option<Duration> {
    let (done, all) = (now.triangles_done as f64, now.triangles as f64);
    (done > 0.0 && done < all).then(|| elapsed.mul_f64((all - done) / done))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_goes_by_triangles() {
        let mut now = Progress {
            stage: Stage::Refine,
            components: 3,
            done: 0,
            triangles: 100,
            triangles_done: 0,
            component: 0,
            energy: f64::INFINITY,
            seam_length: 0.0,
        };
        let elapsed = Duration::from_secs(4);
        assert_eq!(left(&now, elapsed), None);
        now.triangles_done = 20;
        assert_eq!(left(&now, elapsed), Some(Duration::from_secs(16)));
        now.triangles_done = 100;
        assert_eq!(left(&now, elapsed), None);
    }
}
