//! Cuts that take about the same course, but are shorter or have fewer turns.

use super::problem::Problem;
use crate::costs::creases::corners;
use crate::cut::Cut;
use crate::cut::paths::distances;
use crate::cut::segments::{BranchKind, branches};
use crate::cut::smooth::smooth;
use crate::cut::straighten::straighten;
use crate::patch::Patch;
use fam_surface::vector::{dot, sub};

/// How far a cut found on a simpler surface may move to be cheaper: about an edge there.
const NEARBY: f64 = 0.02;

/// How many times as much it costs to go further.
const BEYOND: f64 = 100.0;

/// How far a cut may move to have fewer turns, by what the edges on the way cost. Twice as far, and
/// less, seams came out as long.
const REACH: f64 = 0.05;

/// What a turn by a right angle costs, as a share of the price of the cheaper of the two edges.
const TURN: f64 = 0.3;

/// The cut made shorter, by what it costs along every half-edge, without moving its ends or leaving
/// out sharp corners.
pub fn straightened(patch: &Patch, cost: &[f64], cut: &Cut, bound: f64) -> Cut {
    let topology = &patch.topology;
    let pinned: Vec<u32> = branches(topology, cut, |_| false)
        .iter()
        .filter(|branch| branch.kind == BranchKind::Slit)
        .flat_map(|slit| [slit.root(topology), slit.tip(topology)])
        .chain(corners(patch, bound))
        .collect();
    straighten(topology, cost, cut, &pinned)
}

/// The same, but so that it stays near to where it is.
pub fn straightened_nearby(problem: &Problem, cut: &Cut, bound: f64) -> Cut {
    let topology = &problem.patch.topology;
    let on_cut: Vec<u32> = cut.half_edges().map(|h| topology.origin(h)).collect();
    let away = distances(topology, &problem.patch.lengths, &on_cut);
    let is_near = |v: u32| away[v as usize] <= NEARBY;
    let beyond = BEYOND * problem.patch.highest_rate();
    let cost: Vec<f64> = (0..topology.half_edges())
        .map(|h| {
            let near = is_near(topology.origin(h)) && is_near(topology.target(h));
            problem.cost[h as usize] * if near { 1.0 } else { beyond }
        })
        .collect();
    straightened(problem.patch, &cost, cut, bound)
}

/// The cut with fewer turns, near to where it is.
pub fn smoothed(problem: &Problem, cut: &Cut, bound: f64) -> Cut {
    let Patch {
        topology,
        positions,
        lengths,
        prices,
        ..
    } = problem.patch;
    let along = |h: u32| {
        let [from, to] = [topology.origin(h), topology.target(h)];
        sub(positions[to as usize], positions[from as usize])
    };
    let turn = |one: u32, next: u32| {
        let [a, b] = [one, next].map(|h| lengths[h as usize]);
        let straight = dot(along(one), along(next)) / (a * b).max(f64::MIN_POSITIVE);
        let price = prices[one as usize].min(prices[next as usize]);
        TURN * price * (1.0 - straight).max(0.0)
    };
    let pinned = corners(problem.patch, bound);
    smooth(topology, &problem.cost, turn, REACH, cut, &pinned)
}
