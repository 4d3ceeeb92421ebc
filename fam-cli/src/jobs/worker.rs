//! A worker: this program in a process of its own, with one file.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;
use std::thread;

use super::message::{Message, Outcome};

/// Lines of standard error that are kept, for the reason of a crash.
const KEPT: usize = 20;

/// The word on its standard input that asks a worker to stop and to write what is done so far. If
/// the input ends without it, the process that started it is gone.
pub const STOP: &str = "stop";

/// The number of the signal that nothing survives, which systems send where memory is short.
const KILL: i32 = 9;

/// Something that a worker says.
pub enum Said {
    Message(Message),
    /// A line on standard error.
    Line(String),
    /// It closed its outputs.
    Closed,
}

/// A running worker. It is killed where this is dropped.
pub struct Worker {
    child: Child,
    stdin: Option<ChildStdin>,
    hash: Option<String>,
    outcome: Option<Outcome>,
    lines: VecDeque<String>,
}

impl Worker {
    /// Starts a worker with the line of its options. What it says goes into `said`, with its number.
    pub fn start(
        mut command: Command,
        options: &str,
        number: usize,
        said: Sender<(usize, Said)>,
    ) -> io::Result<Self> {
        // Ctrl-C at a terminal is for the process that was started there; it tells its workers.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let (out, err) = (child.stdout.take(), child.stderr.take());
        thread::spawn(move || {
            let lines = {
                let said = said.clone();
                thread::spawn(move || {
                    for line in err.into_iter().flat_map(|err| texts(BufReader::new(err))) {
                        // Nobody listens to a worker that was given up.
                        let _ = said.send((number, Said::Line(line)));
                    }
                })
            };
            for line in out.into_iter().flat_map(|out| texts(BufReader::new(out))) {
                let read = serde_json::from_str(&line);
                let _ = said.send((number, read.map_or(Said::Line(line), Said::Message)));
            }
            let _ = lines.join();
            let _ = said.send((number, Said::Closed));
        });
        let mut stdin = child.stdin.take();
        if let Some(stdin) = &mut stdin {
            // If the worker is gone, its exit status says why.
            let _ = writeln!(stdin, "{options}").and_then(|()| stdin.flush());
        }
        Ok(Self {
            stdin,
            child,
            hash: None,
            outcome: None,
            lines: VecDeque::new(),
        })
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Keeps a line, for the reason of a crash.
    pub fn keep(&mut self, line: String) {
        if self.lines.len() == KEPT {
            self.lines.pop_front();
        }
        self.lines.push_back(line);
    }

    /// Keeps the hash of the file.
    pub fn keep_hash(&mut self, hash: String) {
        self.hash = Some(hash);
    }

    /// The hash of the file, if the worker came so far.
    pub fn hash(&self) -> Option<&str> {
        self.hash.as_deref()
    }

    /// Keeps what came of the file.
    pub fn keep_outcome(&mut self, outcome: Outcome) {
        self.outcome = Some(outcome);
    }

    /// Asks it to stop and to write what is done so far.
    pub fn ask_to_stop(&mut self) {
        if let Some(stdin) = &mut self.stdin {
            // One that is gone needs no order.
            let _ = writeln!(stdin, "{STOP}").and_then(|()| stdin.flush());
        }
    }

    /// Ends it at once.
    pub fn kill(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
    }

    /// What came of the file, after its outputs are closed; else how the worker ended.
    pub fn end(mut self) -> Result<Outcome, Crash> {
        let status = self.child.wait();
        match (self.outcome.take(), status) {
            (Some(outcome), _) => Ok(outcome),
            (None, Ok(status)) => Err(Crash::of(status, &self.lines)),
            (None, Err(error)) => Err(Crash {
                by_system: false,
                message: error.to_string(),
            }),
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.kill();
        let _ = self.child.wait();
    }
}

/// A worker that ended without a word of its file.
#[derive(Debug)]
pub struct Crash {
    /// Whether it was killed from outside, as systems do where memory is short.
    pub by_system: bool,
    pub message: String,
}

impl Crash {
    fn of(status: ExitStatus, lines: &VecDeque<String>) -> Self {
        let by_system = signal(status) == Some(KILL);
        let mut message = match signal(status) {
            Some(KILL) => {
                String::from("the worker was killed, as systems do where memory is short")
            }
            Some(signal) => format!("the worker ended by signal {signal}"),
            None => format!("the worker ended by itself: {status}"),
        };
        let last = lines.iter().rev().find(|line| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with("note: ")
        });
        if let Some(last) = last.filter(|_| !by_system) {
            message.push_str(&format!(": {}", last.trim()));
        }
        Self { by_system, message }
    }
}

#[cfg(unix)]
fn signal(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal(_: ExitStatus) -> Option<i32> {
    None
}

/// Lines of text; bytes that are no UTF-8 are replaced.
fn texts(reader: impl BufRead) -> impl Iterator<Item = String> {
    let lines = reader.split(b'\n').map_while(Result::ok);
    lines.map(|line| String::from_utf8_lossy(&line).trim_end().to_owned())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    fn crash_of(script: &str) -> Crash {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let (sender, receiver) = channel();
        let mut worker = Worker::start(command, "options", 0, sender).unwrap();
        for (_, said) in receiver {
            match said {
                Said::Line(line) => worker.keep(line),
                Said::Message(_) | Said::Closed => {}
            }
        }
        worker.end().unwrap_err()
    }

    #[test]
    fn a_worker_reads_its_options_first() {
        let crash = crash_of("read options; echo \"has $options\" >&2; exit 1");
        assert!(crash.message.ends_with(": has options"), "{crash:?}");
    }

    #[test]
    fn a_crash_has_a_reason() {
        let crash =
            crash_of("echo 'warning: x' >&2; echo 'out of luck' >&2; echo 'note: y' >&2; exit 3");
        assert!(!crash.by_system);
        assert!(
            crash.message.ends_with("exit status: 3: out of luck"),
            "{crash:?}"
        );
        let crash = crash_of("kill -9 $$");
        assert!(
            crash.by_system && crash.message.contains("memory"),
            "{crash:?}"
        );
        let crash = crash_of("kill -11 $$");
        assert!(crash.message.contains("signal 11"), "{crash:?}");
    }

    #[test]
    fn a_worker_that_is_dropped_is_gone() {
        let mut command = Command::new("sleep");
        command.arg("1000");
        let (sender, receiver) = channel();
        let worker = Worker::start(command, "", 7, sender).unwrap();
        drop(worker);
        let (number, said) = receiver.recv().unwrap();
        assert!(number == 7 && matches!(said, Said::Closed));
    }
}
