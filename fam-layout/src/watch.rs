//! Telling how far finishing is, and asking whether it goes on.

use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

use crate::{Progress, Stage};

/// What is told of progress. It is not to wait for tasks of `rayon`: one of these may be waiting for it.
pub type Observer<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// Passes on what is reached to who observes. Once they break off, nothing goes on any more.
pub struct Watch<'a>(Mutex<State<'a>>);

struct State<'a> {
    observe: &'a mut Observer<'a>,
    now: Progress,
    going: bool,
}

impl<'a> Watch<'a> {
    /// A watch over so many components.
    pub fn new(components: usize, observe: &'a mut Observer<'a>) -> Self {
        Self(Mutex::new(State {
            observe,
            now: Progress {
                component: 0,
                components,
                stage: Stage::Refine,
                energy: f64::INFINITY,
                seam_length: 0.0,
            },
            going: true,
        }))
    }

    /// A stage of a component begins.
    pub fn enters(&self, component: usize, stage: Stage) {
        self.tell(|now| {
            *now = Progress {
                component,
                stage,
                energy: f64::INFINITY,
                seam_length: 0.0,
                ..*now
            }
        });
    }

    /// Energy and seam length (over the square root of the area) were reached; whether to go on.
    pub fn reaches(&self, energy: f64, seam_length: f64) -> bool {
        self.tell(|now| (now.energy, now.seam_length) = (energy, seam_length))
    }

    /// Whether to go on; asked often, from any thread, so that stopping is quick.
    pub fn goes_on(&self) -> bool {
        self.tell(|_| {})
    }

    fn tell(&self, change: impl FnOnce(&mut Progress)) -> bool {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut state.now);
        let now = state.now;
        state.going = state.going && (state.observe)(now).is_continue();
        state.going
    }
}
