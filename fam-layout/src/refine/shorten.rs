//! Cuts that do not pay are closed again, from their ends. A cut between two boundary loops may
//! be closed from a boundary: they need not be joined if the layout is valid with a hole.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::problem::{Effort, Problem};
use crate::cut::segments::{Branch, closable};
use crate::patch::topology::{Topology, next};
use crate::solve::layout::Layout;
use crate::solve::orientation::{first_flipped, longest_step};
use fam_surface::vector::{length, sub};

/// How much of a branch is closed at first, in units of the square root of the area.
const FIRST: f64 = 0.04;

/// How far around what is closed vertices move.
const AROUND: f64 = 0.1;

/// Rounds at most.
const ROUNDS: usize = 40;

/// Branches are closed together if this factor and term take the cost of the cheapest to theirs.
const ALIKE: (f64, f64) = (1.5, 0.05);

/// A branch whose closing raises the energy by less than this for what its edges cost is closed twice
/// as far the next time.
const CHEAP: f64 = 0.05;

/// How often the sides of a cut are drawn together before it is given up.
const DRAWS: usize = 6;

const LOCAL: Effort = Effort {
    iterations: 5,
    decrease: 1e-6,
};
const DRAW: Effort = Effort {
    iterations: 2,
    decrease: 1e-6,
};
const AFTER: Effort = Effort {
    iterations: 4,
    decrease: 1e-5,
};

/// Layouts of at least this many triangles are relaxed as a whole only once the bound is reached.
/// With fewer, that saves little time, and the seams come out longer; so do those of large surfaces if
/// the simpler ones that stand for them are shortened like that.
const MANY: usize = 14_000;

/// What is known of a branch, by its first half-edge.
struct Known {
    /// How much of it to close next.
    step: f64,
    /// The rise of the energy over what its edges cost, once it was tried.
    rate: Option<f64>,
}

/// Closes branches from their ends, those first that cost least distortion for their price,
/// as far as the energy stays within the bound. `proceed` is asked after every round.
pub fn shortened(
    problem: &Problem,
    mut layout: Layout,
    bound: f64,
    mut proceed: impl FnMut(&Layout) -> bool,
) -> Layout {
    let mut known = BTreeMap::new();
    // Whether all of the layout was relaxed since branches were closed.
    let mut is_relaxed = true;
    for _ in 0..ROUNDS {
        match round(problem, &layout, bound, is_relaxed, &mut known) {
            Round::Shorter(shorter, relaxed) => (layout, is_relaxed) = (*shorter, relaxed),
            Round::Again => {}
            Round::Done => break,
        }
        if !proceed(&layout) {
            break;
        }
    }
    if is_relaxed {
        layout
    } else {
        relaxed(problem, layout, bound)
    }
}

/// A layout with all of it relaxed; as it was if that fails or ends above the bound.
fn relaxed(problem: &Problem, layout: Layout, bound: f64) -> Layout {
    let mut relaxed = layout.clone();
    match problem.relax(&mut relaxed, AFTER) {
        Ok(()) if relaxed.suits(bound) => relaxed,
        Ok(()) | Err(_) => layout,
    }
}

enum Round {
    /// With shorter cuts, and whether all of it was relaxed.
    Shorter(Box<Layout>, bool),
    /// Nothing was closed, but less may be.
    Again,
    Done,
}

fn round(
    problem: &Problem,
    layout: &Layout,
    bound: f64,
    is_relaxed: bool,
    known: &mut BTreeMap<u32, Known>,
) -> Round {
    let topology = &problem.patch.topology;
    let branches = closable(topology, &layout.cut);
    let tips: Vec<&[u32]> = branches
        .iter()
        .map(|branch| {
            let first = known.entry(branch.half_edges[0]).or_insert(Known {
                step: FIRST,
                rate: None,
            });
            tip(problem, branch, first.step)
        })
        .collect();
    let prices: Vec<f64> = tips
        .iter()
        .map(|tip| tip.iter().map(|&h| problem.patch.prices[h as usize]).sum())
        .collect();
    let rates: Vec<Option<f64>> = (0..branches.len())
        .into_par_iter()
        .map(|i| match known[&branches[i].half_edges[0]].rate {
            Some(rate) => Some(rate),
            None => closed(problem, layout, tips[i])
                .map(|closed| (closed.energy - layout.energy) / prices[i]),
        })
        .collect();
    let mut again = false;
    for (i, rate) in rates.iter().enumerate() {
        let Some(known) = known.get_mut(&branches[i].half_edges[0]) else {
            continue;
        };
        known.rate = *rate;
        if rate.is_none() {
            again |= known.shorten(tips[i]);
        }
    }
    let mut order: Vec<usize> = (0..branches.len()).collect();
    let rate = |i: usize| rates[i].unwrap_or(f64::INFINITY);
    order.sort_by(|&a, &b| rate(a).total_cmp(&rate(b)).then(a.cmp(&b)));
    let most = order
        .first()
        .map_or(0.0, |&i| ALIKE.0 * rate(i).max(0.0) + ALIKE.1);
    let mut energy = layout.energy;
    let mut chosen = Vec::new();
    for i in order {
        let Some(known) = known.get_mut(&branches[i].half_edges[0]) else {
            continue;
        };
        if !rate(i).is_finite() || rate(i) > most {
            break;
        }
        if energy + rate(i) * prices[i] > bound {
            // With the rest relaxed there may be room for it.
            if is_relaxed {
                again |= known.shorten(tips[i]);
            }
            continue;
        }
        if chosen
            .iter()
            .any(|&j| is_reverse(topology, &branches[i], &branches[j]))
        {
            continue;
        }
        energy += rate(i) * prices[i];
        if rate(i) < CHEAP {
            known.step *= 2.0;
        }
        known.rate = None;
        chosen.push(i);
    }
    if chosen.is_empty() && !is_relaxed {
        let relaxed = relaxed(problem, layout.clone(), bound);
        return Round::Shorter(Box::new(relaxed), true);
    }
    if chosen.is_empty() {
        return if again { Round::Again } else { Round::Done };
    }
    let mut shorter = layout.clone();
    for &i in &chosen {
        if let Some(closed) = closed(problem, &shorter, tips[i]) {
            shorter = closed;
        }
    }
    if problem.patch.areas.len() >= MANY {
        problem.measure(&mut shorter);
        if shorter.suits(bound) {
            return Round::Shorter(Box::new(shorter), false);
        }
    }
    if problem.relax(&mut shorter, AFTER).is_ok() && shorter.suits(bound) {
        return Round::Shorter(Box::new(shorter), true);
    }
    for &i in &chosen {
        if let Some(known) = known.get_mut(&branches[i].half_edges[0]) {
            again |= known.shorten(tips[i]);
        }
    }
    if again { Round::Again } else { Round::Done }
}

impl Known {
    /// Whether less than `tip` can be tried.
    fn shorten(&mut self, tip: &[u32]) -> bool {
        self.step *= 0.4;
        self.rate = if tip.len() > 1 {
            None
        } else {
            Some(f64::INFINITY)
        };
        tip.len() > 1
    }
}

/// Whether two branches are the same but for their directions.
fn is_reverse(topology: &Topology, one: &Branch, other: &Branch) -> bool {
    let last = other.half_edges.last();
    last.and_then(|&h| topology.twin(h)) == one.half_edges.first().copied()
}

/// The end of a branch, of about a given length.
fn tip<'a>(problem: &Problem, branch: &'a Branch, wanted: f64) -> &'a [u32] {
    let edges = &branch.half_edges;
    let mut sum = 0.0;
    let mut start = edges.len();
    while start > 0 && (start == edges.len() || sum < 0.75 * wanted) {
        start -= 1;
        sum += problem.patch.lengths[edges[start] as usize];
    }
    &edges[start..]
}

/// A layout whose cut ends before `tip`, relaxed around it; its energy is that much higher. None
/// if the surface has a handle then, or if its sides cannot be joined.
fn closed(problem: &Problem, layout: &Layout, tip: &[u32]) -> Option<Layout> {
    if !problem.goes_on() {
        return None;
    }
    let patch = problem.patch;
    let mut cut = layout.cut.clone();
    cut.remove(&patch.topology, tip);
    let middle = patch.positions[patch.topology.origin(tip[tip.len() / 2]) as usize];
    let reach = AROUND + tip.iter().map(|&h| patch.lengths[h as usize]).sum::<f64>();
    let near: Vec<bool> = patch
        .positions
        .iter()
        .map(|&p| length(sub(p, middle)) < reach)
        .collect();
    let mut closed = problem.recut(layout, cut);
    if !is_planar(&closed.opened.topology) {
        return None;
    }
    if !problem.is_valid(&closed) {
        let drawn = drawn_together(problem, layout, &closed, tip, &near)?;
        closed = problem.recut(&drawn, closed.cut);
    }
    problem.relax_near(&mut closed, &near, &[], LOCAL).ok()?;
    let sum = |layout: &Layout| problem.excess(layout).iter().sum::<f64>();
    closed.energy = layout.energy + sum(&closed) - sum(layout);
    Some(closed)
}

/// Whether a connected surface is a disk, with or without holes: no other has a valid layout.
fn is_planar(topology: &Topology) -> bool {
    let loops = topology.boundary_loops().len() as i64;
    loops > 0 && topology.euler_characteristic() == 2 - loops
}

/// Moves the sides of the cut at `tip` towards each other, until they can be joined as in
/// `closed`.
fn drawn_together(
    problem: &Problem,
    layout: &Layout,
    closed: &Layout,
    tip: &[u32],
    near: &[bool],
) -> Option<Layout> {
    let sides = sides(problem, layout, closed, tip);
    let mut held = vec![false; layout.uv.len()];
    for &v in sides.iter().flatten() {
        held[v as usize] = true;
    }
    let boundary = problem.boundary(layout);
    let mut drawn = layout.clone();
    for _ in 0..DRAWS {
        let start = drawn.uv.clone();
        let mut direction = vec![[0.0; 2]; start.len()];
        for side in &sides {
            let middle = [0, 1].map(|axis| {
                let sum: f64 = side.iter().map(|&v| start[v as usize][axis]).sum();
                sum / side.len() as f64
            });
            for &v in side {
                direction[v as usize] = [0, 1].map(|axis| middle[axis] - start[v as usize][axis]);
            }
        }
        let triangles = drawn.opened.topology.triangles();
        let mut step = (0.7 * longest_step(triangles, &start, &direction)).min(0.85);
        loop {
            for ((q, p), d) in drawn.uv.iter_mut().zip(&start).zip(&direction) {
                *q = [p[0] + step * d[0], p[1] + step * d[1]];
            }
            if first_flipped(triangles, &drawn.uv).is_none() && boundary.is_simple(&drawn.uv) {
                break;
            }
            step *= 0.6;
            if step < 1e-2 {
                return None;
            }
        }
        problem.relax_near(&mut drawn, near, &held, DRAW).ok()?;
        let joined = problem.recut(&drawn, closed.cut.clone());
        if problem.is_valid(&joined) {
            return Some(drawn);
        }
    }
    None
}

/// The vertices of a layout that become one where the cut at `tip` is closed.
fn sides(problem: &Problem, layout: &Layout, closed: &Layout, tip: &[u32]) -> Vec<Vec<u32>> {
    let (before, after) = (&layout.opened.topology, &closed.opened.topology);
    let mut pairs: Vec<(u32, u32)> = tip
        .iter()
        .flat_map(|&h| [Some(h), problem.patch.topology.twin(h)])
        .flatten()
        .flat_map(|h| [h, next(h)])
        .map(|h| (after.origin(h), before.origin(h)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|group| group.len() > 1)
        .map(|group| group.iter().map(|pair| pair.1).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::START;
    use super::*;
    use crate::cut::disk::cut_to_disk;
    use crate::cut::paths::cheapest_path;
    use crate::patch::Patch;
    use fam_surface::shapes;

    /// With room to the bound, what is closed is not relaxed as a whole until the end.
    #[test]
    fn a_large_layout_is_shortened_within_the_bound() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 120, 60));
        assert!(patch.areas.len() >= MANY);
        let goes_on = || true;
        let mut problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
        problem.injective = true;
        let topology = &patch.topology;
        let mut cut = cut_to_disk(topology, &patch.lengths, &[]);
        let is_on_cut = |v: u32| {
            let mut all = 0..topology.half_edges();
            all.any(|h| cut.contains(h) && topology.origin(h) == v)
        };
        // A branch that does not pay.
        let far = (0..topology.vertices() as u32)
            .find(|&v| !is_on_cut(v))
            .unwrap();
        let path = cheapest_path(topology, &patch.lengths, &[far], is_on_cut).unwrap();
        cut.add(topology, &path);
        let layout = problem.flattened(cut, START).unwrap();
        let before = problem.length_of(&layout);
        let bound = layout.least_bound() + 0.3;
        let rounds = std::cell::Cell::new(0);
        let mut proceed = |layout: &Layout| {
            rounds.set(rounds.get() + 1);
            assert!(problem.is_valid(layout) && layout.suits(bound));
            rounds.get() < 6
        };
        let shorter = shortened(&problem, layout, bound, &mut proceed);
        assert!(problem.length_of(&shorter) < before);
        assert!(problem.is_valid(&shorter) && shorter.suits(bound));
        let mut again = shorter.clone();
        problem.measure(&mut again);
        assert_eq!(again.energy, shorter.energy);
        // Nothing is left to be gained by relaxing.
        let _ = problem.relax(&mut again, AFTER);
        assert!(
            shorter.energy - again.energy < 1e-3,
            "{} {}",
            shorter.energy,
            again.energy
        );
    }
}
