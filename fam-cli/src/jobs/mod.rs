//! Many files, several at once, each in a worker process of its own. What one file does to its
//! worker (no end, no memory, a crash) is nothing to the others.

mod memory;
mod message;
mod worker;

use std::cmp::Reverse;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use crate::again::Again;
use crate::failure::Failure;
use crate::manifest::State;
use crate::output;
use crate::timeout::not_done;

use memory::{Gauge, Share};
use worker::{Said, Worker};

pub use message::{Message, Outcome};
pub use worker::STOP;

/// Time between two looks at the clock and at the memory: short beside any file, long beside a look.
const TICK: Duration = Duration::from_millis(100);

/// A file to be worked on.
pub struct Task {
    pub file: PathBuf,
    /// Where its results go.
    pub folder: PathBuf,
    /// Of the file, in bytes.
    pub size: u64,
}

/// How workers are started, and what they may take.
pub struct WorkerSettings<'a> {
    /// Starts this program again.
    pub again: &'a Again,
    /// A line with the options of all.
    pub options: String,
    /// WorkerSettings at the same time.
    pub jobs: usize,
    /// Threads of all of them together.
    pub threads: usize,
    /// Time for a file.
    pub timeout: Option<Duration>,
}

/// What happens.
pub enum Event {
    /// The workers were told to stop.
    Stopping,
    /// To the file of a number.
    File(usize, FileEvent),
}

/// What happens to a file.
pub enum FileEvent {
    Started,
    Progress {
        fraction: f64,
        line: String,
    },
    /// A line for the user.
    Line(String),
    /// It was stopped and waits for memory.
    Waits,
    Ended {
        /// SHA-256 of the file, if it could be read.
        hash: Option<String>,
        outcome: Outcome,
        took: Duration,
    },
}

/// Works on all files, the largest first, so that none is left to run alone at the end. `tell`
/// learns what happens. After `stop`, workers write what is done so far, and no others start.
pub fn run(
    tasks: &[Task],
    settings: &WorkerSettings,
    stop: &AtomicBool,
    tell: impl FnMut(Event) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let (sender, receiver) = channel();
    let mut queue: Vec<Waiting> = (0..tasks.len())
        .map(|number| Waiting {
            number,
            need: memory::need(tasks[number].size),
        })
        .collect();
    queue.sort_by_key(|waiting| Reverse(tasks[waiting.number].size));
    let mut pool = Pool {
        tasks,
        settings,
        tell,
        sender,
        gauge: Gauge::new(),
        queue: queue.into(),
        running: Vec::new(),
        stop,
        was_told: false,
    };
    pool.work(&receiver)
}

/// A file that is not begun.
struct Waiting {
    number: usize,
    /// Bytes of memory that it is expected to take.
    need: u64,
}

/// A file that a worker has.
struct Running {
    number: usize,
    need: u64,
    worker: Worker,
    started: Instant,
    /// Why the worker was killed.
    killed: Option<Killed>,
}

enum Killed {
    Late,
    /// With the bytes that it took.
    Large(u64),
}

struct Pool<'a, F> {
    tasks: &'a [Task],
    settings: &'a WorkerSettings<'a>,
    tell: F,
    sender: Sender<(usize, Said)>,
    gauge: Gauge,
    /// The first goes first.
    queue: VecDeque<Waiting>,
    /// The oldest first.
    running: Vec<Running>,
    stop: &'a AtomicBool,
    /// Whether the workers were told to stop.
    was_told: bool,
}

impl<F: FnMut(Event) -> Result<(), Failure>> Pool<'_, F> {
    fn work(&mut self, receiver: &Receiver<(usize, Said)>) -> Result<(), Failure> {
        let mut looked: Option<Instant> = None;
        loop {
            if self.is_stopping() && !self.was_told {
                self.was_told = true;
                self.queue.clear();
                self.running.iter_mut().for_each(|r| r.worker.ask_to_stop());
                (self.tell)(Event::Stopping)?;
            }
            if looked.is_none_or(|at| at.elapsed() >= TICK) {
                self.end_late();
                self.start_or_make_room()?;
                looked = Some(Instant::now());
            }
            if self.running.is_empty() && self.queue.is_empty() {
                return Ok(());
            }
            match receiver.recv_timeout(TICK) {
                Ok((number, said)) => {
                    if self.hear(number, said)? {
                        looked = None;
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
        }
    }

    fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Ends workers whose time is over.
    fn end_late(&mut self) {
        let Some(limit) = self.settings.timeout else {
            return;
        };
        for running in &mut self.running {
            if running.killed.is_none() && running.started.elapsed() >= limit {
                running.killed = Some(Killed::Late);
                running.worker.kill();
            }
        }
    }

    /// Starts files while there is room, or ends the youngest worker where memory is short.
    fn start_or_make_room(&mut self) -> Result<(), Failure> {
        if self.running.is_empty() && self.queue.is_empty() {
            return Ok(());
        }
        let ids: Vec<u32> = self.running.iter().map(|r| r.worker.id()).collect();
        let used = self.gauge.used(&ids);
        let own: u64 = self.gauge.used(&[std::process::id()]).iter().sum();
        let memory = self.gauge.memory(own + used.iter().sum::<u64>());
        if memory.is_short() && self.running.len() > 1 {
            let is_ending = self.running.iter().any(|running| running.killed.is_some());
            if let (Some(youngest), Some(used), false) =
                (self.running.last_mut(), used.last(), is_ending)
            {
                youngest.killed = Some(Killed::Large(*used));
                youngest.worker.kill();
            }
            return Ok(());
        }
        let share = |(running, used): (&Running, &u64)| Share {
            need: running.need,
            used: *used,
        };
        let mut shares: Vec<Share> = self.running.iter().zip(&used).map(share).collect();
        while self.running.len() < self.settings.jobs {
            let fits =
                |waiting: &Waiting| shares.is_empty() || memory.has_room(waiting.need, &shares);
            let next = self.queue.iter().position(fits);
            let Some(Waiting { number, need }) = next.and_then(|next| self.queue.remove(next))
            else {
                break;
            };
            match self.start(number, need) {
                Ok(()) => shares.push(Share { need, used: 0 }),
                // There may be too many files open, or processes.
                Err(_) if !self.running.is_empty() => {
                    self.queue.push_front(Waiting { number, need });
                    break;
                }
                Err(failure) => return Err(failure),
            }
            self.tell(number, FileEvent::Started)?;
        }
        Ok(())
    }

    fn start(&mut self, number: usize, need: u64) -> Result<(), Failure> {
        let task = &self.tasks[number];
        let unfinished = self.queue.len() + self.running.len() + 1;
        let threads = (self.settings.threads / self.settings.jobs.min(unfinished)).max(1);
        let command = self
            .settings
            .again
            .worker(&task.file, &task.folder, threads);
        let command =
            command.ok_or_else(|| Failure::work("this program cannot be started again"))?;
        let worker = Worker::start(command, &self.settings.options, number, self.sender.clone())
            .map_err(|error| Failure::work(format!("cannot start a worker: {error}")))?;
        self.running.push(Running {
            number,
            need,
            worker,
            started: Instant::now(),
            killed: None,
        });
        Ok(())
    }

    /// Takes in what a worker says. Returns whether it ended.
    fn hear(&mut self, number: usize, said: Said) -> Result<bool, Failure> {
        let Some(at) = self.running.iter().position(|r| r.number == number) else {
            return Ok(false);
        };
        match said {
            Said::Message(Message::Progress { fraction, line }) => {
                self.tell(number, FileEvent::Progress { fraction, line })?;
            }
            Said::Message(Message::Hash(hash)) => self.running[at].worker.keep_hash(hash),
            Said::Message(Message::Ended(outcome)) => self.running[at].worker.keep_outcome(outcome),
            Said::Line(line) => {
                self.running[at].worker.keep(line.clone());
                self.tell(number, FileEvent::Line(line))?;
            }
            Said::Closed => {
                let running = self.running.remove(at);
                self.end(running)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// After a worker closed its outputs.
    fn end(&mut self, running: Running) -> Result<(), Failure> {
        let number = running.number;
        let task = &self.tasks[number];
        let took = running.started.elapsed();
        let input = task.file.display().to_string();
        let hash = running.worker.hash().map(str::to_owned);
        let outcome = match running.worker.end() {
            Ok(outcome) => outcome,
            Err(crash) => {
                output::sweep(&task.folder);
                let larger = match running.killed {
                    Some(Killed::Large(used)) => Some(running.need.max(used.saturating_mul(2))),
                    // The second time it is alone.
                    None if crash.by_system && running.need < u64::MAX => Some(u64::MAX),
                    _ => None,
                };
                if let (Some(need), false) = (larger, self.is_stopping()) {
                    self.queue.push_back(Waiting { number, need });
                    return self.tell(number, FileEvent::Waits);
                }
                match (running.killed, self.settings.timeout) {
                    (Some(Killed::Late), Some(limit)) => {
                        Outcome::new(State::TimedOut, not_done(&input, limit))
                    }
                    _ if self.is_stopping() => Outcome::new(State::Interrupted, String::new()),
                    _ => Outcome::new(State::Failed, format!("{input}: {}", crash.message)),
                }
            }
        };
        let ended = FileEvent::Ended {
            hash,
            outcome,
            took,
        };
        self.tell(number, ended)
    }

    fn tell(&mut self, number: usize, event: FileEvent) -> Result<(), Failure> {
        (self.tell)(Event::File(number, event))
    }
}
