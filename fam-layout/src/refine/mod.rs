//! Where to cut a patch so that its distortion is within a bound, by as short a seam as can
//! be found.
//!
//! First the cut grows towards the peaks of the distortion while parts of the layout may still
//! overlap; that finds where cuts are needed. Straightened, it is flattened again without
//! overlaps, grown where it still has to, and shortened where it need not be. The result is
//! straightened and gone over again as long as it gets shorter.

mod coarse;
mod diffusion;
mod grow;
mod peaks;
pub mod problem;
mod shorten;
mod tidy;

use std::cell::Cell;
use std::cmp::Ordering;

use crate::costs::creases::crease_costs;
use crate::cut::Cut;
use crate::cut::disk::cut_to_disk;
use crate::cut::paths::{cheapest_path, distances};
use crate::distortion::Distortion;
use crate::patch::Patch;
use crate::solve::SolveError;
use crate::solve::layout::Layout;
use crate::watch::Watch;
use grow::Growth;
use problem::{Effort, Problem};
use shorten::shortened;
use tidy::straightened;

/// Rounds of cuts at most.
const ROUNDS: usize = 60;

/// Most Newton steps over all triangles at the usual bound; one takes some 12 ms for ten thousand
/// triangles. Twice as many make no seam shorter; two thirds make some longer.
pub const MOST_STEPS: u64 = 300;

/// Fraction of the Newton steps spent searching for cuts.
const SHARE_OF_SEARCH: f64 = 0.5;

/// Fraction of the Newton steps after which no new cycle begins.
const SHARE_OF_STEPS: f64 = 0.6;

/// Fraction of the remaining Newton steps spent finding self-overlaps.
const SHARE_OF_FREEDOM: f64 = 0.3;

/// A first layout above this energy is given up: some of its triangles are thousands of times
/// smaller than others, and Newton steps do not even that out.
const HOPELESS: f64 = 1e4;

/// A vertex farther from the cut than this lies on a limb that needs a cut. In units of the square
/// root of the area: a quarter of the radius of a disk of that area.
const LIMB: f64 = 0.15;

/// Most limbs that are cut.
const MOST_LIMBS: usize = 100;

/// Most cycles of straightening, cutting further and shortening.
const CYCLES: usize = 3;

/// The decrease of the energy per length (in units of the square root of the area) that a cut
/// must bring at a seam weight of 1, as a multiple of what the bound is above 4.
const WORTH: f64 = 0.1;

/// Relative decrease of the cut's cost below which no further cycle begins.
const LEAST_GAIN: f64 = 0.003;

/// The solve of a first layout.
const START: Effort = Effort {
    iterations: 60,
    decrease: 1e-3,
};

/// The last solve.
const LAST: Effort = Effort {
    iterations: 30,
    decrease: 1e-6,
};

/// Rounds that trade areas for angles, and the solve in each: a few steps, since the next round
/// starts from better sizes.
const ANGLE_ROUNDS: usize = 12;
const ANGLES: Effort = Effort {
    iterations: 3,
    decrease: 1e-6,
};

/// What a layout is to reach.
pub struct Goal {
    /// The mean symmetric Dirichlet energy.
    pub bound: f64,
    /// What a cut must bring, in multiples of what it usually must.
    pub seam_weight: f64,
    /// Whether to give up early where one chart will not do.
    pub gives_up: bool,
}

impl Goal {
    /// By how much a cut must lower the energy per length.
    pub fn worth(&self) -> f64 {
        self.seam_weight * WORTH * (self.bound - 4.0)
    }
}

/// Where to start from. A coordinate belongs to a half-edge: to the corner of the triangle in
/// which it starts.
pub enum Start<'a> {
    /// Nothing is known.
    Nothing,
    /// A map, to start the search for cuts from if it is valid.
    Map(&'a [[f64; 2]]),
    /// A layout, cut where corners at a vertex have different coordinates, to go on from; if it
    /// is not valid, from its cut.
    Layout(&'a [[f64; 2]]),
}

/// Cuts a patch and lays it out without flipped triangles and overlaps. `cost` is that of a
/// cut along every half-edge during the search; the seams that are found are straightened
/// by their price and by creases. Forbidden edges of the patch are cut where there is no other
/// way. `budget` is how many Newton steps there may be, each times the triangles it is over;
/// what is used up is taken off. `watch` is told the progress so far; after it says no, what
/// there is is brought to a valid end.
///
/// # Errors
/// No valid layout was found in one piece.
pub fn refined(
    patch: &Patch,
    cost: Vec<f64>,
    start: Start,
    goal: &Goal,
    budget: &mut u64,
    watch: &Watch,
) -> Result<Layout, SolveError> {
    let mut problem = Problem::new(patch, patch.without_forbidden(cost), watch);
    let report = |energy: f64, seam_length: f64| watch.reaches(energy, seam_length);
    let result = coarse::found(&mut problem, &start, goal, *budget, &report);
    *budget = budget.saturating_sub(problem.work());
    result
}

/// A layout of which the angles are less distorted, and the areas more, as far as `allowed` goes.
///
/// Where the energy is least, it hardly grows with the first steps away from there, but the
/// distortion of angles falls with each.
pub fn with_better_angles(
    patch: &Patch,
    layout: Layout,
    allowed: &Distortion,
    watch: &Watch,
) -> Layout {
    if layout.energy >= allowed.energy || layout.area_distortion >= allowed.area {
        return layout;
    }
    let mut problem = Problem::new(patch, patch.lengths.clone(), watch);
    problem.injective = true;
    let is_better = |new: &Layout, old: &Layout| {
        let [new, old] = [new, old].map(Layout::distortion);
        let within = new.energy <= allowed.energy && new.area <= allowed.area;
        within && new.conformality < old.conformality
    };
    let mut best = layout;
    for _ in 0..ANGLE_ROUNDS {
        let mut next = best.clone();
        if !problem.goes_on() || problem.relax_angles(&mut next, ANGLES).is_err() {
            break;
        }
        let shares = [1.0, 0.5, 0.25, 0.125];
        let steps = shares
            .iter()
            .map(|&share| problem.between(&best, &next, share));
        match steps.flatten().find(|step| is_better(step, &best)) {
            Some(better) => best = better,
            None => break,
        }
    }
    best
}

/// A layout that may overlap itself, relaxed and cut further until it is within the bound.
pub fn without_regard_to_overlaps(
    patch: &Patch,
    mut layout: Layout,
    goal: &Goal,
    budget: &mut u64,
    watch: &Watch,
) -> Layout {
    let cost = patch.without_forbidden(crease_costs(patch));
    let problem = Problem::new(patch, cost, watch);
    let _ = problem.relax(&mut layout, LAST);
    let limit = (SHARE_OF_FREEDOM * *budget as f64) as u64;
    let mut proceed = |problem: &Problem, _: &Layout| problem.goes_on() && problem.work() < limit;
    layout = grown(&problem, &Growth::new(&problem), layout, goal, &mut proceed);
    *budget = budget.saturating_sub(problem.work());
    layout
}

/// Is told energy and seam length so far and says whether to go on.
type Report<'a> = dyn Fn(f64, f64) -> bool + Sync + 'a;

fn found(
    problem: &mut Problem,
    start: &Start,
    goal: &Goal,
    budget: u64,
    report: &Report,
) -> Result<Layout, SolveError> {
    let patch = problem.patch;
    let growth = Growth::new(problem);
    let before = problem.work();
    let limit = Cell::new((SHARE_OF_SEARCH * budget as f64) as u64);
    let mut proceed = |problem: &Problem, layout: &Layout| {
        report(layout.energy, problem.length_of(layout)) && problem.work() - before < limit.get()
    };
    problem.injective = true;
    let mut given = match start {
        Start::Layout(corners) => {
            let cut = Cut::between(&patch.topology, corners);
            let layout = Layout::of(&patch.topology, cut.clone(), corners);
            let taken = problem.taken(&layout, START);
            taken.or_else(|| problem.flattened(cut, START).ok())
        }
        Start::Nothing | Start::Map(_) => None,
    };
    let mut cut = match &given {
        Some(layout) => layout.cut.clone(),
        None => {
            problem.injective = false;
            let rough = searched(problem, &growth, start, goal, &mut proceed)?;
            problem.injective = true;
            if !problem.goes_on() && problem.is_valid(&rough) {
                return Ok(rough);
            }
            rough.cut
        }
    };
    limit.set(budget);
    // Tears say where to cut; how, their noise says badly.
    problem.cost = patch.without_forbidden(crease_costs(patch));
    let mut best: Option<Layout> = None;
    for _ in 0..CYCLES {
        let layout = match given.take() {
            Some(layout) => layout,
            None => match problem
                .flattened(straightened(patch, &problem.cost, &cut, goal.bound), START)
            {
                Ok(layout) => layout,
                Err(_) if best.is_some() => break,
                Err(_) => problem.flattened(cut.clone(), START)?,
            },
        };
        let layout = completed(problem, &growth, layout, goal, &mut proceed);
        let gain = best
            .as_ref()
            .map(|best| gain(problem, best, &layout, goal.bound));
        cut = layout.cut.clone();
        if gain.is_none_or(|gain| gain > 0.0) {
            best = Some(layout);
        }
        let settled = cut.is_empty() || gain.is_some_and(|gain| gain < LEAST_GAIN);
        let spent = (problem.work() - before) as f64 > SHARE_OF_STEPS * budget as f64;
        if settled || spent || !problem.goes_on() {
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
    start: &Start,
    goal: &Goal,
    proceed: &mut impl FnMut(&Problem, &Layout) -> bool,
) -> Result<Layout, SolveError> {
    let topology = &problem.patch.topology;
    let cut = cut_to_disk(topology, &problem.cost, &[]);
    let taken = match start {
        Start::Map(corners) => problem.taken(&Layout::of(topology, cut.clone(), corners), START),
        Start::Nothing | Start::Layout(_) => None,
    };
    let start = match taken {
        Some(layout) => layout,
        None => match first_layout(problem, cut) {
            Ok(layout) if !goal.gives_up || layout.energy <= HOPELESS || !problem.goes_on() => {
                layout
            }
            Err(error) if !goal.gives_up || !matches!(error, SolveError::Collapsed { .. }) => {
                return Err(error);
            }
            Ok(_) | Err(_) => return Err(SolveError::Unbounded),
        },
    };
    Ok(grown(problem, growth, start, goal, proceed))
}

/// A layout along a cut. Where there is none, or none that leads anywhere, the cut reaches into
/// all limbs: a long limb that is not cut shrinks exponentially along its length, down to what
/// double precision cannot tell apart.
fn first_layout(problem: &Problem, cut: Cut) -> Result<Layout, SolveError> {
    let first = problem.flattened(cut.clone(), START);
    let is_hopeless = |first: &Result<Layout, SolveError>| match first {
        Ok(layout) => layout.energy > HOPELESS,
        Err(_) => true,
    };
    if !is_hopeless(&first) || !problem.goes_on() {
        return first;
    }
    let longer = problem.flattened(into_limbs(problem, cut), START);
    match (first, longer) {
        (Ok(first), Ok(longer)) if first.energy < longer.energy => Ok(first),
        (first, longer) => longer.or(first),
    }
}

/// A cut extended to the vertices farthest from it until none is far.
fn into_limbs(problem: &Problem, mut cut: Cut) -> Cut {
    let topology = &problem.patch.topology;
    for _ in 0..MOST_LIMBS {
        let is_border = |h: &u32| cut.contains(*h) || topology.twin(*h).is_none();
        let border: Vec<u32> = (0..topology.half_edges()).filter(is_border).collect();
        let mut is_reached = vec![false; topology.vertices()];
        for &h in &border {
            is_reached[topology.origin(h) as usize] = true;
            is_reached[topology.target(h) as usize] = true;
        }
        let reached: Vec<u32> = (0..topology.vertices() as u32)
            .filter(|&v| is_reached[v as usize])
            .collect();
        let depth = distances(topology, &problem.patch.lengths, &reached);
        let depth_of = |v: u32| match depth[v as usize] {
            depth if depth.is_finite() => depth,
            _ => 0.0,
        };
        let deepest = (0..topology.vertices() as u32)
            .max_by(|&a, &b| depth_of(a).total_cmp(&depth_of(b)).then(b.cmp(&a)));
        let Some(tip) = deepest.filter(|&tip| depth_of(tip) > LIMB) else {
            break;
        };
        match cheapest_path(topology, &problem.cost, &[tip], |v| is_reached[v as usize]) {
            Some(path) if !path.is_empty() => cut.add(topology, &path),
            _ => break,
        }
    }
    cut
}

/// By how much a layout is better than another: less above the bound, fewer forbidden edges, or
/// a cheaper cut.
fn gain(problem: &Problem, old: &Layout, new: &Layout, bound: f64) -> f64 {
    match (old.suits(bound), new.suits(bound)) {
        (true, true) => {}
        (false, true) => return f64::INFINITY,
        (true, false) => return f64::NEG_INFINITY,
        (false, false) => return old.least_bound() - new.least_bound(),
    }
    let [before, after] = [old, new].map(|layout| problem.forbidden_edges(layout));
    match after.cmp(&before) {
        Ordering::Less => f64::INFINITY,
        Ordering::Greater => f64::NEG_INFINITY,
        Ordering::Equal => 1.0 - problem.cost_of(new) / problem.cost_of(old),
    }
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
        if layout.suits(goal.bound) || !proceed(problem, &layout) {
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
    proceed: &mut impl FnMut(&Problem, &Layout) -> bool,
) -> Layout {
    let mut layout = grown(problem, growth, layout, goal, proceed);
    if problem.goes_on() {
        let _ = problem.relax(&mut layout, LAST);
    }
    if problem.goes_on() && layout.suits(goal.bound) {
        layout = shortened(problem, layout, goal.bound, |layout| {
            proceed(problem, layout)
        });
    }
    layout
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use fam_surface::shapes;

    #[test]
    fn angles_get_better_as_far_as_areas_may_get_worse() {
        let patch = Patch::of(&shapes::open_sphere(1.2, 40, 20));
        let goal = Goal {
            bound: 4.06,
            seam_weight: 1.0,
            gives_up: false,
        };
        let mut observe = |_| ControlFlow::Continue(());
        let mut observe: &mut (dyn FnMut(_) -> _ + Send) = &mut observe;
        let watch = Watch::new(1, &mut observe);
        let mut budget = MOST_STEPS * patch.areas.len() as u64;
        let (cost, start) = (patch.lengths.clone(), Start::Nothing);
        let old = refined(&patch, cost, start, &goal, &mut budget, &watch).unwrap();
        let allowed = Distortion::allowed(4.1);
        let new = with_better_angles(&patch, old.clone(), &allowed, &watch);
        assert!(new.energy <= allowed.energy && new.area_distortion <= allowed.area);
        assert!(
            new.conformality < 0.9 * old.conformality,
            "{} {}",
            new.conformality,
            old.conformality
        );
        let goes_on = || true;
        let mut problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
        problem.injective = true;
        assert!(problem.is_valid(&new));
        // Nothing is left to be had.
        let same = with_better_angles(&patch, old.clone(), &old.distortion(), &watch);
        assert_eq!(same.uv, old.uv);
    }
}
