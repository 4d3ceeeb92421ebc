//! Where to cut a patch so that its distortion is within a bound, by as short a seam as can
//! be found.
//!
//! First the cut grows towards the peaks of the distortion while parts of the layout may still
//! overlap; that finds where cuts are needed. Straightened, it is flattened again without
//! overlaps, grown where it still has to, and shortened where it need not be. The result is
//! straightened and gone over again as long as it gets shorter.

mod coarse;
mod grow;
mod problem;
mod shorten;

use std::cell::Cell;

use super::cut::Cut;
use super::cut::disk::cut_to_disk;
use super::cut::segments::{BranchKind, branches};
use super::cut::straighten::straighten;
use super::layout::Layout;
use super::patch::Patch;
use super::solve::SolveError;
use super::topology::Topology;
use grow::Growth;
use problem::{Effort, Problem};
use shorten::shortened;

/// Rounds of cuts at most.
const ROUNDS: usize = 60;

/// Newton steps over all triangles that there may be: some 12 ms each for ten thousand.
pub const MOST_STEPS: u64 = 700;

/// The share of them in which it is looked for where to cut.
const SHARE_OF_SEARCH: f64 = 0.5;

/// The share of them after which the cut is not gone over again.
const SHARE_OF_STEPS: f64 = 0.6;

/// How often the cut is straightened and gone over.
const CYCLES: usize = 3;

/// The decrease of the energy per length (in units of the square root of the area) that a cut
/// must bring at a seam weight of 1, as a multiple of what the bound is above 4.
const WORTH: f64 = 0.1;

/// The share of its cost by which a cut must get shorter to be gone over again.
const LEAST_GAIN: f64 = 0.003;

/// A start.
const START: Effort = Effort {
    iterations: 60,
    decrease: 1e-3,
};

/// The last solve.
const LAST: Effort = Effort {
    iterations: 30,
    decrease: 1e-6,
};

/// What a layout is to reach.
pub struct Goal {
    /// The mean symmetric Dirichlet energy.
    pub bound: f64,
    /// What a cut must bring, in multiples of what it usually must.
    pub seam_weight: f64,
}

impl Goal {
    /// By how much a cut must lower the energy per length.
    pub fn worth(&self) -> f64 {
        self.seam_weight * WORTH * (self.bound - 4.0)
    }
}

/// Cuts a patch and lays it out without flipped triangles and overlaps. `cost` is that of a
/// cut along every half-edge while it is looked for; the seams that are found are straightened
/// by their length. `map` has a coordinate for every vertex of the patch, to start from if it is
/// valid. `budget` is how many Newton steps there may be, each times the triangles it is over;
/// what is used up is taken off. `proceed` sees energy and length of cut on the way; after it says no, what
/// there is is brought to a valid end.
///
/// # Errors
/// No valid layout was found in one piece.
pub fn refined(
    patch: &Patch,
    cost: Vec<f64>,
    map: Option<&[[f64; 2]]>,
    goal: &Goal,
    budget: &mut u64,
    mut proceed: impl FnMut(f64, f64) -> bool,
) -> Result<Layout, SolveError> {
    let mut problem = Problem::new(patch, cost);
    let result = coarse::found(&mut problem, map, goal, *budget, &mut proceed);
    *budget = budget.saturating_sub(problem.work());
    result
}

fn found(
    problem: &mut Problem,
    map: Option<&[[f64; 2]]>,
    goal: &Goal,
    budget: u64,
    proceed: &mut dyn FnMut(f64, f64) -> bool,
) -> Result<Layout, SolveError> {
    let patch = problem.patch;
    let growth = Growth::new(problem);
    let going = Cell::new(true);
    let limit = Cell::new((SHARE_OF_SEARCH * budget as f64) as u64);
    let mut proceed = |problem: &Problem, layout: &Layout| {
        going.set(going.get() && proceed(layout.energy, layout.cut.cost(&patch.lengths)));
        going.get() && problem.work() < limit.get()
    };
    let rough = searched(problem, &growth, map, goal, &mut proceed)?;
    problem.injective = true;
    limit.set(budget);
    // Tears say where to cut; how, their noise says badly.
    problem.cost.clone_from(&patch.lengths);
    let mut best: Option<Layout> = None;
    let mut cut = rough.cut;
    for _ in 0..CYCLES {
        let straight = straightened(&patch.topology, &problem.cost, &cut);
        let layout = match problem.flattened(straight, START) {
            Ok(layout) => layout,
            Err(_) if best.is_some() => break,
            Err(_) => problem.flattened(cut.clone(), START)?,
        };
        let layout = completed(problem, &growth, layout, goal, &going, &mut proceed);
        let gain = best
            .as_ref()
            .map(|best| gain(problem, best, &layout, goal.bound));
        cut = layout.cut.clone();
        if gain.is_none_or(|gain| gain > 0.0) {
            best = Some(layout);
        }
        let settled = gain.is_some_and(|gain| gain < LEAST_GAIN);
        let spent = problem.work() as f64 > SHARE_OF_STEPS * budget as f64;
        if settled || spent || !going.get() {
            break;
        }
    }
    best.ok_or(SolveError::NotSimple)
}

/// A layout within the bound, as far as one is found, that may overlap itself: it shows where
/// cuts are needed.
fn searched(
    problem: &Problem,
    growth: &Growth,
    map: Option<&[[f64; 2]]>,
    goal: &Goal,
    proceed: &mut impl FnMut(&Problem, &Layout) -> bool,
) -> Result<Layout, SolveError> {
    let cut = cut_to_disk(&problem.patch.topology, &problem.cost, &[], |_| false);
    let taken = map.and_then(|map| problem.taken_from(map, &cut, START));
    let start = match taken {
        Some(layout) => layout,
        None => problem.flattened(cut, START)?,
    };
    Ok(grown(problem, growth, start, goal, proceed))
}

/// By how much a layout is better than another: less above the bound, or a shorter cut.
fn gain(problem: &Problem, old: &Layout, new: &Layout, bound: f64) -> f64 {
    match (old.is_within(bound), new.is_within(bound)) {
        (true, true) => {}
        (false, true) => return f64::INFINITY,
        (true, false) => return f64::NEG_INFINITY,
        (false, false) => return old.energy - new.energy,
    }
    1.0 - problem.cost_of(new) / problem.cost_of(old)
}

/// Cuts until the energy is within the bound or no cut pays.
fn grown(
    problem: &Problem,
    growth: &Growth,
    mut layout: Layout,
    goal: &Goal,
    proceed: &mut impl FnMut(&Problem, &Layout) -> bool,
) -> Layout {
    for _ in 0..ROUNDS {
        if layout.is_within(goal.bound) || !proceed(problem, &layout) {
            break;
        }
        match growth.round(problem, &layout, goal.bound, goal.worth()) {
            Some(next) => layout = next,
            None => break,
        }
    }
    layout
}

/// A layout grown until it is within the bound, and shortened as long as it stays so.
fn completed(
    problem: &Problem,
    growth: &Growth,
    layout: Layout,
    goal: &Goal,
    going: &Cell<bool>,
    proceed: &mut impl FnMut(&Problem, &Layout) -> bool,
) -> Layout {
    let mut layout = grown(problem, growth, layout, goal, proceed);
    if going.get() {
        let _ = problem.relax(&mut layout, LAST);
    }
    if going.get() && layout.is_within(goal.bound) {
        layout = shortened(problem, layout, goal.bound, |layout| {
            proceed(problem, layout)
        });
    }
    layout
}

/// The cut made shorter without moving its ends.
fn straightened(topology: &Topology, cost: &[f64], cut: &Cut) -> Cut {
    let tips: Vec<u32> = branches(topology, cut, |_| false)
        .iter()
        .filter(|branch| branch.kind == BranchKind::Slit)
        .flat_map(|slit| [slit.root(topology), slit.tip(topology)])
        .collect();
    straighten(topology, cost, cut, &tips)
}
