//! Telling how far finishing is, and asking whether it goes on.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::pace::Pace;
use crate::{Progress, Stage};

/// Newton steps, each times the triangles it is over, that the search for cuts takes: the median of 18
/// surfaces of 5,000 to 280,000 triangles (0.8 to 2.5 million), since all are searched on a few thousand.
/// Small components are searched themselves, with about so many steps over each triangle.
const SEARCH: f64 = 1.4e6;
const SEARCH_OF_SMALL: f64 = 200.0;

/// Newton steps over all triangles of a large component after the search.
const FLATTENING: f64 = 6.0;

/// How long a step over a triangle takes in the search, against one after it: what is small stays in
/// the processor's caches, and has no boundaries of many edges to look after.
const PACE_OF_SEARCH: f64 = 0.3;

/// How fast the fraction that is over grows with the first steps, as a multiple of that of the expected
/// steps. Some components take three times as many as expected, so it nears 1 ever more slowly: after as
/// many as expected it is 0.7, after three times as many 0.97.
const EARLY_GROWTH: f64 = 1.2;

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
    /// Of every component.
    parts: Vec<Part>,
    /// Triangles of all components.
    all: usize,
    /// How much of the work on them is over, in triangles.
    over: f64,
}

/// How far a component is.
#[derive(Clone, Default)]
struct Part {
    triangles: usize,
    /// Newton steps so far, each times the triangles it was over.
    work: f64,
}

impl Part {
    /// How much of the work is over, in triangles, as far as one can tell.
    fn over(&self) -> f64 {
        let triangles = self.triangles as f64;
        let search = SEARCH.min(SEARCH_OF_SMALL * triangles);
        let expected = PACE_OF_SEARCH * search + FLATTENING * triangles;
        let beyond = (self.work - search).max(0.0);
        let work = PACE_OF_SEARCH * self.work.min(search) + beyond;
        triangles * (1.0 - (-EARLY_GROWTH * work / expected.max(1.0)).exp())
    }
}

impl<'a> Watch<'a> {
    /// A watch over so many components.
    pub fn new(components: usize, observe: &'a mut Observer<'a>) -> Self {
        let now = Progress {
            stage: Stage::Refine,
            components,
            done: 0,
            component: 0,
            fraction: 0.0,
            energy: f64::INFINITY,
            seam_length: 0.0,
        };
        let state = State {
            observe,
            now,
            going: true,
            parts: vec![Part::default(); components],
            all: 0,
            over: 0.0,
        };
        Self {
            component: 0,
            shared: Arc::new(Mutex::new(state)),
        }
    }

    /// A watch over the search for the surface of a cloud, of which no component is known yet.
    pub fn of_reconstruction(observe: &'a mut Observer<'a>) -> Self {
        let watch = Self::new(0, observe);
        watch.tell(|state| state.now.stage = Stage::Reconstruct);
        watch
    }

    /// The watch of one of the components.
    pub fn of(&self, component: usize) -> Self {
        Self {
            component,
            shared: Arc::clone(&self.shared),
        }
    }

    /// Says how many triangles every component has.
    pub fn counts(&self, triangles: &[usize]) {
        self.tell(|state| {
            for (part, &triangles) in state.parts.iter_mut().zip(triangles) {
                part.triangles = triangles;
            }
            state.all = triangles.iter().sum();
        });
    }

    /// The component is flat.
    pub fn finishes(&self) {
        self.tell(|state| {
            let part = &state.parts[self.component];
            state.now.done += 1;
            state.over += part.triangles as f64 - part.over();
        });
    }

    /// All components are flat; packing begins.
    pub fn packs(&self) {
        self.tell(|state| {
            state.now = Progress {
                stage: Stage::Pack,
                energy: f64::INFINITY,
                seam_length: 0.0,
                ..state.now
            }
        });
    }

    /// The component reached an energy and a seam length (over the square root of the area);
    /// whether to go on.
    pub fn reaches(&self, energy: f64, seam_length: f64) -> bool {
        self.tell(|state| {
            let now = &mut state.now;
            now.component = self.component;
            (now.energy, now.seam_length) = (energy, seam_length);
        })
    }

    /// Whether to go on; asked often, from any thread, so that stopping is quick.
    pub fn goes_on(&self) -> bool {
        self.tell(|_| {})
    }

    fn tell(&self, change: impl FnOnce(&mut State)) -> bool {
        let mut state = self.state();
        change(&mut state);
        let fraction = state.over / state.all.max(1) as f64;
        state.now.fraction = fraction.clamp(0.0, 1.0);
        let now = state.now;
        state.going = state.going && (state.observe)(now).is_continue();
        state.going
    }

    fn state(&self) -> MutexGuard<'_, State<'a>> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Pace for Watch<'_> {
    fn goes_on(&self) -> bool {
        Watch::goes_on(self)
    }

    fn works(&self, triangles: usize) {
        let mut state = self.state();
        // In the reconstruction of a cloud no component is known.
        let Some(part) = state.parts.get_mut(self.component) else {
            return;
        };
        let before = part.over();
        part.work += triangles as f64;
        let more = part.over() - before;
        state.over += more;
    }
}
