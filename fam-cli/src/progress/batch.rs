//! What the user sees of many files at once.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::{BAR, short};
use crate::terminal::{plain, print_line};

/// Time between plain lines on all files: a log of hours stays short.
const BETWEEN_LINES: Duration = Duration::from_secs(30);

/// Widest name beside a bar, in characters: half a terminal is left for the rest.
const NAME: usize = 24;

/// A bar for every file that is worked on, and one for all; plain lines where there is no terminal.
pub struct BatchProgress {
    shown: Shown,
    started: Instant,
    sizes: Vec<u64>,
    /// Bytes of all files, and of those that ended.
    total: u64,
    over: u64,
    ended: usize,
    failed: usize,
    running: usize,
}

enum Shown {
    Silent,
    Bars {
        bars: MultiProgress,
        all: ProgressBar,
        each: BTreeMap<usize, ProgressBar>,
    },
    Lines {
        last: Instant,
    },
}

impl BatchProgress {
    /// Progress of files of so many bytes each.
    pub fn new(quiet: bool, sizes: Vec<u64>) -> Self {
        let shown = if quiet {
            Shown::Silent
        } else if std::io::stderr().is_terminal() {
            let bars = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10));
            let all = bars.add(bar("{bar:24} {pos}/{len} files{msg}", sizes.len() as u64));
            Shown::Bars {
                bars,
                all,
                each: BTreeMap::new(),
            }
        } else {
            Shown::Lines {
                last: Instant::now(),
            }
        };
        // A file without any still takes its time.
        let sizes: Vec<u64> = sizes.into_iter().map(|size| size.max(1)).collect();
        Self {
            shown,
            started: Instant::now(),
            total: sizes.iter().sum(),
            sizes,
            over: 0,
            ended: 0,
            failed: 0,
            running: 0,
        }
    }

    /// A worker took on the file of a number.
    pub fn start(&mut self, number: usize, name: &str) {
        self.running += 1;
        if let Shown::Bars { bars, all, each } = &mut self.shown {
            let bar = bars.insert_before(all, bar("{bar:24} {prefix}  {msg}", BAR));
            bar.set_prefix(end_of(&plain(name)));
            each.insert(number, bar);
        }
    }

    /// How far a file is.
    pub fn step(&mut self, number: usize, fraction: f64, line: String) {
        if let Shown::Bars { each, .. } = &mut self.shown
            && let Some(bar) = each.get(&number)
        {
            bar.set_position((fraction * BAR as f64) as u64);
            bar.set_message(line);
        }
        self.tick();
    }

    /// A file has no worker any more, though it is not done.
    pub fn give_up(&mut self, number: usize) {
        self.running -= 1;
        self.clear(number);
    }

    /// A file ended; `line` says how.
    pub fn end(&mut self, number: usize, failed: bool, line: &str) {
        self.running -= 1;
        self.ended += 1;
        self.failed += usize::from(failed);
        self.over += self.sizes[number];
        self.clear(number);
        match (&self.shown, failed) {
            (_, true) => self.say(&format!("fam: {line}")),
            (Shown::Silent, false) => {}
            (_, false) => self.say(&format!("[{}/{}] {line}", self.ended, self.sizes.len())),
        }
        let ended = self.ended as u64;
        let rest = self.rest();
        if let Shown::Bars { all, .. } = &self.shown {
            all.set_position(ended);
            all.set_message(rest);
        }
    }

    /// A line on standard error, above the bars.
    pub fn say(&self, line: &str) {
        match &self.shown {
            Shown::Bars { bars, .. } => bars.suspend(|| print_line(line)),
            Shown::Silent | Shown::Lines { .. } => print_line(line),
        }
    }

    /// After the last file.
    pub fn finish(self) {
        if let Shown::Bars { bars, .. } = self.shown {
            // A terminal that is gone shows nothing anyway.
            let _ = bars.clear();
        }
    }

    fn clear(&mut self, number: usize) {
        if let Shown::Bars { bars, each, .. } = &mut self.shown
            && let Some(bar) = each.remove(&number)
        {
            bar.finish_and_clear();
            bars.remove(&bar);
        }
    }

    /// Says from time to time how all are, where there are no bars.
    fn tick(&mut self) {
        let (ended, all, rest) = (self.ended, self.sizes.len(), self.rest());
        let running = self.running;
        if let Shown::Lines { last } = &mut self.shown
            && last.elapsed() >= BETWEEN_LINES
        {
            print_line(&format!("{ended}/{all} files, {running} at work{rest}"));
            *last = Instant::now();
        }
    }

    /// What is said of all files beside their number.
    fn rest(&self) -> String {
        let mut line = String::new();
        if self.failed > 0 {
            line.push_str(&format!(", {} failed", self.failed));
        }
        let elapsed = self.started.elapsed();
        line.push_str(&format!("  {}", short(elapsed)));
        if self.over > 0 && self.over < self.total {
            let left = elapsed.mul_f64((self.total - self.over) as f64 / self.over as f64);
            line.push_str(&format!(", about {} left", short(left)));
        }
        line
    }
}

fn bar(template: &str, length: u64) -> ProgressBar {
    let style = ProgressStyle::with_template(template);
    ProgressBar::new(length).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// The end of a name, where names differ.
fn end_of(name: &str) -> String {
    let length = name.chars().count();
    match length <= NAME {
        true => format!("{name:NAME$}"),
        false => {
            let end: String = name.chars().skip(length - (NAME - 1)).collect();
            format!("…{end}")
        }
    }
}
