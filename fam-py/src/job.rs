//! A computation on a thread of its own.

use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use fam_layout::Stage;
use pyo3::prelude::*;

use crate::failure::Failure;
use crate::pool::pool;

/// What a job comes to, and how Python gets it.
pub trait Output: Send {
    /// The object that Python gets.
    fn object<'py>(self: Box<Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>>;
}

/// How far a job is.
#[derive(Debug, Clone, Copy)]
struct Progress {
    stage: &'static str,
    /// Estimated, of the stage.
    fraction: f64,
    parts: usize,
    parts_done: usize,
    /// Infinite before there is any.
    energy: f64,
}

/// What a computation tells and asks of whoever waits for it.
pub struct Signal {
    cancelled: AtomicBool,
    progress: Mutex<Progress>,
}

impl Signal {
    /// Takes note of progress; breaks off once the job is cancelled.
    pub fn observe(&self, now: &fam::Progress) -> ControlFlow<()> {
        let mut progress = locked(&self.progress);
        match now {
            fam::Progress::Planning => progress.stage = "plan",
            fam::Progress::Training { steps, now } => {
                let (parts, steps) = (now.components.max(1) as f64, (*steps).max(1) as f64);
                let done = (now.step.iteration + 1) as f64 / steps;
                progress.stage = "train";
                progress.fraction = ((now.component as f64 + done) / parts).min(1.0);
                (progress.parts, progress.parts_done) = (now.components, now.component);
            }
            fam::Progress::Layout(now) => {
                progress.stage = match now.stage {
                    Stage::Reconstruct => "reconstruct",
                    Stage::Refine => "flatten",
                    Stage::Pack => "pack",
                };
                progress.fraction = now.fraction;
                (progress.parts, progress.parts_done) = (now.components, now.done);
                progress.energy = now.energy;
            }
        }
        match self.cancelled.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

type Found = Result<Box<dyn Output>, Failure>;

struct Shared {
    signal: Signal,
    found: Mutex<Option<Found>>,
    ended: Condvar,
}

/// A computation that runs in the background.
#[pyclass(frozen, module = "flatten_anything._native")]
pub struct Job(Arc<Shared>);

impl Job {
    /// Starts to compute.
    pub fn start<O: Output + 'static>(
        work: impl FnOnce(&Signal) -> Result<O, Failure> + Send + 'static,
    ) -> Result<Self, Failure> {
        let pool = pool()?;
        let progress = Progress {
            stage: "start",
            fraction: 0.0,
            parts: 0,
            parts_done: 0,
            energy: f64::INFINITY,
        };
        let shared = Arc::new(Shared {
            signal: Signal {
                cancelled: AtomicBool::new(false),
                progress: Mutex::new(progress),
            },
            found: Mutex::new(None),
            ended: Condvar::new(),
        });
        let own = Arc::clone(&shared);
        let run = move || {
            let signal = &own.signal;
            let work = AssertUnwindSafe(|| pool.install(|| work(signal)));
            let found = match catch_unwind(work) {
                Ok(_) if signal.cancelled.load(Ordering::Relaxed) => Err(Failure::Cancelled),
                Ok(found) => found.map(|output| Box::new(output) as Box<dyn Output>),
                Err(panic) => Err(Failure::Internal(message(&*panic))),
            };
            *locked(&own.found) = Some(found);
            own.ended.notify_all();
        };
        std::thread::Builder::new()
            .name("flatten-anything-job".to_owned())
            .spawn(run)
            .map_err(|error| Failure::Internal(format!("cannot start a thread: {error}")))?;
        Ok(Self(shared))
    }
}

/// A job that nobody waits for any more ends soon.
impl Drop for Job {
    fn drop(&mut self) {
        self.0.signal.cancelled.store(true, Ordering::Relaxed);
    }
}

#[pymethods]
impl Job {
    /// Waits for the end, so many seconds at most; whether it has ended.
    fn wait(&self, py: Python<'_>, seconds: f64) -> bool {
        let until = Instant::now() + Duration::from_secs_f64(seconds.clamp(0.0, 1e6));
        py.detach(|| {
            let mut found = locked(&self.0.found);
            loop {
                let left = until.saturating_duration_since(Instant::now());
                if found.is_some() || left.is_zero() {
                    return found.is_some();
                }
                let woken = self.0.ended.wait_timeout(found, left);
                found = woken.unwrap_or_else(PoisonError::into_inner).0;
            }
        })
    }

    /// Asks it to end soon.
    fn cancel(&self) {
        self.0.signal.cancelled.store(true, Ordering::Relaxed);
    }

    /// The stage, its estimated fraction that is over, the number of parts, how many of them are
    /// done, and the energy so far.
    fn progress(&self) -> (&'static str, f64, usize, usize, f64) {
        let now = *locked(&self.0.signal.progress);
        (
            now.stage,
            now.fraction,
            now.parts,
            now.parts_done,
            now.energy,
        )
    }

    /// The result, once.
    ///
    /// # Errors
    /// There is none.
    fn take<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = locked(&self.0.found).take();
        match found {
            Some(Ok(output)) => output.object(py),
            Some(Err(failure)) => Err(failure.exception(py)),
            None => Err(Failure::Internal("the job has no result".to_owned()).exception(py)),
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a fault without a message").to_owned()
}
