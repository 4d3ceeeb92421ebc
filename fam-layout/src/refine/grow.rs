//! Cuts to where the distortion is.

use rayon::prelude::*;

use super::problem::{Effort, Problem};
use crate::cut::paths::{cheapest_path, distances};
use crate::refine::diffusion::Diffusion;
use crate::refine::peaks::peaks;
use crate::solve::layout::Layout;
use fam_surface::vector::{length, sub};

/// Lengths over which the distortion is spread before its peaks are looked for, in units of
/// the square root of the area: the first finds limbs, the second what is left at their ends.
const SPREADS: [f64; 2] = [0.06, 0.03];

/// Peaks that are looked at.
const PEAKS: usize = 12;

/// Cuts that start nearer to each other than this are one; two that are added together keep
/// this distance.
const APART: f64 = 0.03;

/// Added to the length of a cut when its worth per length is judged, so that a long one that
/// brings much is preferred to a notch.
const OFFSET: f64 = 0.03;

/// Above this energy cuts are made without trying them first, several at a time.
const ROUGH: f64 = 4.25;

/// How many cuts are tried, of which the best is made.
const TRIED: usize = 4;

/// The share of what the best cut brings per length that another must bring to be made with it.
const ALMOST: f64 = 0.5;

/// How far around a cut that is only tried vertices move: farther away it changes little, and what
/// it brings is compared only.
const AROUND: f64 = 0.15;

/// How far below the bound a cut may go and be worth it: other cuts can be shortened then.
const SLACK: f64 = 0.04;

/// The solve after a cut that is only tried.
const TRIAL: Effort = Effort {
    iterations: 5,
    decrease: 1e-4,
};

/// The solve between cuts.
const BETWEEN: Effort = Effort {
    iterations: 12,
    decrease: 1e-3,
};

/// Finds cuts.
pub struct Growth {
    diffusions: [Diffusion; 2],
}

impl Growth {
    pub fn new(problem: &Problem) -> Self {
        let patch = problem.patch;
        let over = |spread: f64| {
            Diffusion::new(
                &patch.topology,
                &patch.lengths,
                &patch.areas,
                spread * spread,
            )
        };
        Self {
            diffusions: SPREADS.map(over),
        }
    }

    /// Cuts a layout once more, or several times where it is far above the bound. `None` if no
    /// cut decreases the energy by `worth` per length.
    pub fn round(
        &self,
        problem: &Problem,
        layout: &Layout,
        bound: f64,
        worth: f64,
    ) -> Option<Layout> {
        let paths = self.candidates(problem, layout);
        let rough = if layout.energy > ROUGH {
            let count = if layout.energy > ROUGH + 1.5 { 4 } else { 2 };
            let union = several(problem, &paths, count);
            let pays = |new: &Layout| layout.energy - new.energy > worth * cost(problem, &union);
            problem.extended(layout, &union, TRIAL).filter(pays)
        } else {
            None
        };
        let mut next = match rough {
            Some(next) => next,
            None => self.best(problem, layout, &paths, bound, worth)?,
        };
        // What was reached stays valid when a step fails.
        if problem.relax(&mut next, BETWEEN).is_err() {
            problem.measure(&mut next);
        }
        Some(next)
    }

    /// The layout after the cut that brings most per length, of the first few among which
    /// there is one that is worth it, and after others that bring almost as much.
    fn best(
        &self,
        problem: &Problem,
        layout: &Layout,
        paths: &[Vec<u32>],
        bound: f64,
        worth: f64,
    ) -> Option<Layout> {
        paths.chunks(TRIED).find_map(|paths| {
            let mut tried: Vec<(f64, usize, Layout)> = paths
                .par_iter()
                .enumerate()
                .filter_map(|(i, path)| {
                    let next = problem.extended_nearby(layout, path, AROUND, TRIAL)?;
                    if !next.energy.is_finite() {
                        return None;
                    }
                    let gain = layout.energy - next.energy.max(bound - SLACK);
                    Some((gain / (cost(problem, path) + OFFSET), i, next))
                })
                .collect();
            tried.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let best = tried.first().filter(|best| best.0 > worth)?;
            let mut expected = layout.energy;
            let good: Vec<Vec<u32>> = tried
                .iter()
                .filter(|other| other.0 > worth.max(ALMOST * best.0))
                .take_while(|other| {
                    let needed = expected > bound;
                    expected -= layout.energy - other.2.energy;
                    needed
                })
                .map(|other| paths[other.1].clone())
                .collect();
            let union = several(problem, &good, TRIED);
            let together = if union.len() > paths[best.1].len() {
                problem.extended(layout, &union, TRIAL)
            } else {
                None
            };
            let better = |together: &Layout| together.energy < best.2.energy;
            Some(together.filter(better).unwrap_or_else(|| best.2.clone()))
        })
    }

    /// Paths from places of high distortion to the cut or the boundary, the most promising
    /// first.
    fn candidates(&self, problem: &Problem, layout: &Layout) -> Vec<Vec<u32>> {
        let topology = &problem.patch.topology;
        let mut reached = vec![false; topology.vertices()];
        for h in 0..topology.half_edges() {
            if layout.cut.contains(h) || topology.twin(h).is_none() {
                reached[topology.origin(h) as usize] = true;
                reached[topology.target(h) as usize] = true;
            }
        }
        let sources: Vec<u32> = (0..topology.vertices() as u32)
            .filter(|&v| reached[v as usize])
            .collect();
        let depth = depths(problem, &problem.cost, &sources);
        let worthwhile = worthwhile_depths(problem, &sources, &depth);
        let excess = problem.excess(layout);
        let mut starts: Vec<(f64, u32)> = Vec::new();
        for diffusion in &self.diffusions {
            for peak in peaks(topology, diffusion, &excess, &worthwhile)
                .iter()
                .take(PEAKS)
            {
                for v in [peak.vertex].into_iter().chain(peak.deep.iter().copied()) {
                    let depth = depth[v as usize];
                    if depth > 0.0 {
                        starts.push((peak.mass / (depth + OFFSET), v));
                    }
                }
            }
        }
        starts.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let at = |v: u32| problem.patch.positions[v as usize];
        let mut kept: Vec<u32> = Vec::new();
        for (_, v) in starts {
            if kept.iter().all(|&k| length(sub(at(k), at(v))) >= APART) {
                kept.push(v);
            }
        }
        kept.truncate(4 * TRIED);
        kept.par_iter()
            .filter_map(|&v| cheapest_path(topology, &problem.cost, &[v], |v| reached[v as usize]))
            .filter(|path| !path.is_empty())
            .collect()
    }
}

/// How far every vertex is from the cut and the boundary, by what edges cost; 0 where that is out of
/// reach without a forbidden edge, and no place to cut to.
fn depths(problem: &Problem, cost: &[f64], sources: &[u32]) -> Vec<f64> {
    distances(&problem.patch.topology, cost, sources)
        .into_iter()
        .map(|depth| if depth.is_finite() { depth } else { 0.0 })
        .collect()
}

/// How much it is worth to cut to a vertex for its depth: what lies deep is relieved by a cut.
///
/// Where seams are to be hidden, `depth`, by their cost, is great where all is seen. What counts is the
/// depth by length then, and that more where it costs less to get there.
fn worthwhile_depths(problem: &Problem, sources: &[u32], depth: &[f64]) -> Vec<f64> {
    if !problem.patch.hides_seams {
        return depth.to_vec();
    }
    let worth = |(length, &cost): (f64, &f64)| match cost > 0.0 {
        true => length * length / (cost + OFFSET),
        false => 0.0,
    };
    let lengths = depths(problem, &problem.patch.lengths, sources);
    lengths.into_iter().zip(depth).map(worth).collect()
}

fn cost(problem: &Problem, path: &[u32]) -> f64 {
    path.iter().map(|&h| problem.cost[h as usize]).sum()
}

/// The half-edges of the first of the paths, and of more that keep apart from them.
fn several(problem: &Problem, paths: &[Vec<u32>], count: usize) -> Vec<u32> {
    let at = |h: u32| problem.patch.positions[problem.patch.topology.origin(h) as usize];
    let mut union: Vec<u32> = Vec::new();
    let mut chosen = 0;
    for path in paths {
        let near = |h: &u32| union.iter().any(|&g| length(sub(at(*h), at(g))) < APART);
        if chosen < count && !path.iter().any(near) {
            union.extend(path);
            chosen += 1;
        }
    }
    union
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Patch;
    use fam_surface::shapes;

    /// Its left half costs a tenth of its right half.
    #[test]
    fn of_places_as_deep_the_cheap_one_is_worth_a_cut() {
        let sheet = Patch::of(&shapes::rectangle(1.0, 1.0, 20, 20));
        let goes_on = || true;
        let depths_of = |patch: &Patch| {
            let problem = Problem::new(patch, patch.prices.clone(), &goes_on);
            let boundary = boundary_of(patch);
            let depth = depths(&problem, &problem.cost, &boundary);
            (worthwhile_depths(&problem, &boundary, &depth), depth)
        };
        let at = |x: f64, y: f64| {
            let away = |v: &u32| {
                let p = sheet.positions[*v as usize];
                (p[0] - x).hypot(p[1] - y)
            };
            let all = 0..sheet.positions.len() as u32;
            all.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap() as usize
        };
        let [cheap, dear] = [at(0.3, 0.5), at(0.7, 0.5)];
        let (worth, depth) = depths_of(&sheet);
        assert_eq!(worth, depth);
        let rate = |v: u32| match sheet.positions[v as usize][0] < 0.5 {
            true => 0.2,
            false => 2.0,
        };
        let mut hiding = Patch::of(&shapes::rectangle(1.0, 1.0, 20, 20));
        hiding = hiding.priced(|ends| 0.5 * (rate(ends[0]) + rate(ends[1])));
        hiding.hides_seams = true;
        let (worth, depth) = depths_of(&hiding);
        assert!(depth[dear] > 2.0 * depth[cheap]);
        assert!(worth[cheap] > 2.0 * worth[dear]);
    }

    fn boundary_of(patch: &Patch) -> Vec<u32> {
        let topology = &patch.topology;
        let border = (0..topology.half_edges()).filter(|&h| topology.twin(h).is_none());
        border.map(|h| topology.origin(h)).collect()
    }
}
