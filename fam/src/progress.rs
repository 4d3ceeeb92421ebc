//! Progress, and when to stop.

use std::ops::ControlFlow;
use std::time::Instant;

use fam_core::atlas;

/// What is going on.
#[derive(Debug, Clone, Copy)]
pub enum Progress<'a> {
    /// Training steps are timed, to plan for a time budget.
    Planning,
    /// A training step was made.
    Training {
        /// Steps for each component.
        steps: usize,
        /// What it did.
        now: atlas::Progress<'a>,
    },
    /// The surface is being laid out.
    Layout(fam_layout::Progress),
}

/// Is told of progress, often; after it breaks off, what there is is brought to a valid end.
pub type Observer<'a> = dyn FnMut(Progress<'_>) -> ControlFlow<()> + Send + 'a;

/// An observer, and a time at which work stops as well.
pub struct Watch<'w, 'o> {
    observe: &'w mut Observer<'o>,
    /// When layouts are no longer refined.
    pub deadline: Option<Instant>,
    /// Whether the observer broke off.
    pub interrupted: bool,
    /// Whether the layout was stopped, by the observer or by the time.
    pub stopped: bool,
}

impl<'w, 'o> Watch<'w, 'o> {
    pub fn new(observe: &'w mut Observer<'o>, deadline: Option<Instant>) -> Self {
        Self {
            observe,
            deadline,
            interrupted: false,
            stopped: false,
        }
    }

    /// Before the layout.
    pub fn tell(&mut self, progress: Progress) -> ControlFlow<()> {
        self.interrupted |= (self.observe)(progress).is_break();
        match self.interrupted {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// While a surface is laid out.
    pub fn lays_out(&mut self, now: fam_layout::Progress) -> ControlFlow<()> {
        let interrupted = self.tell(Progress::Layout(now)).is_break();
        let late = self.deadline.is_some_and(|at| Instant::now() >= at);
        self.stopped |= interrupted || late;
        match self.stopped {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}
