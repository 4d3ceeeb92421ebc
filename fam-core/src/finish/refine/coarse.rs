//! Large patches: where to cut is found on a simpler surface.

use std::cell::Cell;

use super::super::cut::Cut;
use super::super::cut::paths::distances;
use super::super::layout::Layout;
use super::super::simplify::Simplification;
use super::super::solve::SolveError;
use super::grow::Growth;
use super::problem::Problem;
use super::shorten::shortened;
use super::{Goal, LAST, START, completed, straightened};

/// Patches of at least this many triangles are simplified to about `SIMPLE`.
const LARGE: usize = 8_000;
const SIMPLE: usize = 4_000;

/// How often the bound on the simpler surface is lowered, so that the patch comes within its
/// own.
const CORRECTIONS: usize = 3;

/// How far a cut found on the simpler surface may move for its length alone: some of the edges
/// there; what it costs to go further, as a multiple.
const NEARBY: f64 = 0.03;
const BEYOND: f64 = 5.0;

/// The share of what the bound is above the energy of an isometry to which that may go.
const LEAST_EXCESS: f64 = 0.3;

/// Newton steps over all triangles of the patch there may be, after the first layout.
const STEPS: u64 = 60;

/// The same as [`super::found`].
pub(super) fn found(
    problem: &mut Problem,
    map: Option<&[[f64; 2]]>,
    goal: &Goal,
    budget: u64,
    proceed: &mut dyn FnMut(f64, f64) -> bool,
) -> Result<Layout, SolveError> {
    let patch = problem.patch;
    let count = patch.topology.triangles().len();
    if count < LARGE {
        return super::found(problem, map, goal, budget, proceed);
    }
    let simplification = Simplification::new(&patch.topology, &patch.positions, SIMPLE);
    let left = simplification.triangles();
    if 3 * left > 2 * count {
        return super::found(problem, map, goal, budget, proceed);
    }
    let simplified = simplification.simplified(patch.scale);
    let simple = &simplified.patch;
    let costs = carried_costs(
        problem,
        simple.source.as_slice(),
        &simplified.patch.lengths,
        simple,
    );
    let mut coarse = Problem::new(simple, costs);
    let coarse_map: Option<Vec<[f64; 2]>> =
        map.map(|map| simple.source.iter().map(|&v| map[v as usize]).collect());
    let share = budget / count as u64 * left as u64;
    let going = Cell::new(true);
    let mut report = |energy: f64, seam: f64| {
        going.set(going.get() && proceed(energy, seam));
        going.get()
    };
    let mut layout = super::found(&mut coarse, coarse_map.as_deref(), goal, share, &mut report)?;
    problem.injective = true;
    problem.cost.clone_from(&patch.lengths);
    let growth = Growth::new(&coarse);
    let within = layout.is_within(goal.bound);
    let mut best: Option<Layout> = None;
    for _ in 0..CORRECTIONS {
        let cut = simplification
            .clone()
            .carried(&layout.cut, &simplified.triangles);
        let straight = straightened_nearby(problem, &cut);
        let mut fine = match problem.flattened(straight, START) {
            Ok(fine) => fine,
            Err(_) => problem.flattened(cut, START)?,
        };
        if going.get() {
            let _ = problem.relax(&mut fine, LAST);
        }
        report(fine.energy, fine.cut.cost(&patch.lengths));
        let missing = fine.least_bound() - goal.bound;
        let better =
            |best: &Layout| fine.is_within(goal.bound) || fine.least_bound() < best.least_bound();
        if best.as_ref().is_none_or(better) {
            best = Some(fine);
        }
        let lower = layout.least_bound().min(goal.bound) - missing;
        let lowest = 4.0 + LEAST_EXCESS * (goal.bound - 4.0);
        if missing <= 0.0 || !within || lower < lowest || !going.get() {
            break;
        }
        let tighter = Goal {
            bound: lower,
            seam_weight: goal.seam_weight,
        };
        let mut proceed =
            |problem: &Problem, layout: &Layout| report(layout.energy, problem.cost_of(layout));
        layout = completed(&coarse, &growth, layout, &tighter, &going, &mut proceed);
    }
    let layout = best.ok_or(SolveError::NotSimple)?;
    let spent = problem.work();
    if going.get() && layout.is_within(goal.bound) {
        let lengths = &patch.lengths;
        return Ok(shortened(problem, layout, goal.bound, |layout| {
            report(layout.energy, layout.cut.cost(lengths))
                && problem.work() - spent < STEPS * count as u64
        }));
    }
    Ok(layout)
}

/// A cut straightened by its length, but so that it stays near to where it is.
fn straightened_nearby(problem: &Problem, cut: &Cut) -> Cut {
    let topology = &problem.patch.topology;
    let on_cut: Vec<u32> = cut.half_edges().map(|h| topology.origin(h)).collect();
    let away = distances(topology, &problem.patch.lengths, &on_cut);
    let is_near = |v: u32| away[v as usize] <= NEARBY;
    let cost: Vec<f64> = (0..topology.half_edges())
        .map(|h| {
            let near = is_near(topology.origin(h)) && is_near(topology.target(h));
            problem.patch.lengths[h as usize] * if near { 1.0 } else { BEYOND }
        })
        .collect();
    straightened(topology, &cost, cut)
}

/// What cuts cost along the half-edges of a simpler surface: as much per length as on average
/// around the ends of an edge.
fn carried_costs(
    problem: &Problem,
    source: &[u32],
    lengths: &[f64],
    simple: &super::super::patch::Patch,
) -> Vec<f64> {
    let patch = problem.patch;
    let mut sums = vec![[0.0; 2]; patch.topology.vertices()];
    for h in 0..patch.topology.half_edges() {
        for v in [patch.topology.origin(h), patch.topology.target(h)] {
            let sum = &mut sums[v as usize];
            sum[0] += problem.cost[h as usize];
            sum[1] += patch.lengths[h as usize];
        }
    }
    let rate = |v: u32| {
        let [cost, length] = sums[source[v as usize] as usize];
        if length > 0.0 { cost / length } else { 1.0 }
    };
    (0..simple.topology.half_edges())
        .map(|h| {
            let ends = [simple.topology.origin(h), simple.topology.target(h)];
            0.5 * lengths[h as usize] * (rate(ends[0]) + rate(ends[1]))
        })
        .collect()
}
