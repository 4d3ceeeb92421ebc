//! Telling how far finishing is, and asking whether it goes on.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use crate::{Progress, Stage};

/// What is told of progress. It is not to wait for tasks of `rayon`: one of these may be waiting for it.
pub type Observer<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// Passes on what is reached to who observes. Once they break off, nothing goes on any more.
///
/// Several components are worked on at once: each has a watch of its own, [`Watch::of`] one that
/// all share.
pub struct Watch<'a> {
    component: usize,
    shared: Arc<Mutex<State<'a>>>,
}

struct State<'a> {
    observe: &'a mut Observer<'a>,
    now: Progress,
    going: bool,
}

impl<'a> Watch<'a> {
    /// A watch over so many components.
    pub fn new(components: usize, observe: &'a mut Observer<'a>) -> Self {
        let now = Progress {
            stage: Stage::Refine,
            components,
            done: 0,
            triangles: 0,
            triangles_done: 0,
            component: 0,
            energy: f64::INFINITY,
            seam_length: 0.0,
        };
        let state = State {
            observe,
            now,
            going: true,
        };
        Self {
            component: 0,
            shared: Arc::new(Mutex::new(state)),
        }
    }

    /// A watch over the search for the surface of a cloud, of which no component is known yet.
    pub fn of_reconstruction(observe: &'a mut Observer<'a>) -> Self {
        let watch = Self::new(0, observe);
        watch.tell(|now| now.stage = Stage::Reconstruct);
        watch
    }

    /// The watch of one of the components.
    pub fn of(&self, component: usize) -> Self {
        Self {
            component,
            shared: Arc::clone(&self.shared),
        }
    }

    /// Says how many triangles all components have.
    pub fn counts(&self, triangles: usize) {
        self.tell(|now| now.triangles = triangles);
    }

    /// The component, of so many triangles, is flat.
    pub fn finishes(&self, triangles: usize) {
        self.tell(|now| {
            now.done += 1;
            now.triangles_done += triangles;
        });
    }

    /// All components are flat; packing begins.
    pub fn packs(&self) {
        self.tell(|now| {
            *now = Progress {
                stage: Stage::Pack,
                energy: f64::INFINITY,
                seam_length: 0.0,
                ..*now
            }
        });
    }

    /// The component reached an energy and a seam length (over the square root of the area);
    /// whether to go on.
    pub fn reaches(&self, energy: f64, seam_length: f64) -> bool {
        self.tell(|now| {
            now.component = self.component;
            (now.energy, now.seam_length) = (energy, seam_length);
        })
    }

    /// Whether to go on; asked often, from any thread, so that stopping is quick.
    pub fn goes_on(&self) -> bool {
        self.tell(|_| {})
    }

    fn tell(&self, change: impl FnOnce(&mut Progress)) -> bool {
        let mut state = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut state.now);
        let now = state.now;
        state.going = state.going && (state.observe)(now).is_continue();
        state.going
    }
}
