//! A patch that is to be laid out, and the solves that do it.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::cut::Cut;
use crate::pace::Pace;
use crate::patch::Patch;
use crate::patch::topology::{Opened, next, previous};
use crate::simplify::Simplification;
use crate::solve::SolveError;
use crate::solve::blocks::Blockwise;
use crate::solve::boundary::{Boundary, open_contacts, open_slits};
use crate::solve::energy::{energy_of, mean_energy};
use crate::solve::layout::Layout;
use crate::solve::newton::{Flattening, Stop};
use crate::solve::orientation::first_flipped;
use crate::solve::rest::RestShapes;
use crate::solve::stretch::even_out;
use crate::solve::tutte;
use fam_surface::vector::{cross, dot, length, sub};

/// Thinner triangles than this share of their longest edge count as this thick.
const THINNEST: f64 = 0.01;

/// Newton steps that a first layout gets when nothing else goes on: an embedding of Tutte's alone
/// is valid, but of no use.
const LEAST_STEPS: usize = 10;

/// Cut patches of at least this many triangles are flattened with `FEW` triangles first, then
/// with `FINER` times as many at a time.
const MANY: usize = 6_000;
const FEW: usize = 2_500;
const FINER: usize = 4;

/// The solve with an intermediate number of triangles.
const LEVEL: Effort = Effort {
    iterations: 15,
    decrease: 1e-3,
};

/// Layouts of at least this many triangles that are nearly where they should be are relaxed block by
/// block: one system for all of them takes long. Simpler surfaces that stand for larger ones have
/// fewer.
const IN_BLOCKS: usize = 14_000;

/// How far to solve.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Most Newton steps.
    pub iterations: usize,
    /// The relative decrease of the energy that ends it.
    pub decrease: f64,
}

/// Where a layout lies before it is solved.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// Nearly where it should be, so that what is left to do is local.
    Near,
    /// Perhaps far from there.
    Anywhere,
}

/// A patch that is to be laid out.
pub struct Problem<'a> {
    pub patch: &'a Patch,
    /// What a cut along every half-edge costs; infinite where it is forbidden.
    pub cost: Vec<f64>,
    /// Whether the boundary must not touch itself.
    pub injective: bool,
    rest: RestShapes,
    /// The angles of every triangle on the surface.
    angles: Vec<[f64; 3]>,
    work: AtomicU64,
    /// Says whether to look for something better still, and is told of every Newton step.
    pub pace: &'a dyn Pace,
}

impl<'a> Problem<'a> {
    pub fn new(patch: &'a Patch, cost: Vec<f64>, pace: &'a dyn Pace) -> Self {
        let corners: Vec<[[f64; 3]; 3]> = patch
            .topology
            .triangles()
            .iter()
            .map(|t| t.map(|v| patch.positions[v as usize]))
            .collect();
        Self {
            patch,
            cost,
            injective: false,
            rest: RestShapes::new(&corners, Some(1.0)),
            angles: corners.iter().map(|&corners| angles(corners)).collect(),
            work: AtomicU64::new(0),
            pace,
        }
    }

    /// Newton steps so far, each times the triangles it was over.
    pub fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// Adds steps that were taken elsewhere for this.
    pub fn charge(&self, work: u64) {
        self.work.fetch_add(work, Ordering::Relaxed);
    }

    /// Whether to look for something better still.
    pub fn goes_on(&self) -> bool {
        self.pace.goes_on()
    }

    /// How long the cut of a layout is.
    pub fn length_of(&self, layout: &Layout) -> f64 {
        layout.cut.cost(&self.patch.lengths)
    }

    /// What the cut of a layout costs; by their price where edges are forbidden.
    pub fn cost_of(&self, layout: &Layout) -> f64 {
        let cost = |h: u32| match self.cost[h as usize] {
            cost if cost.is_finite() => cost,
            _ => self.patch.prices[h as usize],
        };
        0.5 * layout.cut.half_edges().map(cost).sum::<f64>()
    }

    /// Along how many forbidden edges a layout is cut.
    pub fn forbidden_edges(&self, layout: &Layout) -> usize {
        let half_edges = layout.cut.half_edges();
        half_edges
            .filter(|&h| self.patch.forbidden[h as usize])
            .count()
            / 2
    }

    /// The boundary of a layout. It keeps a distance to itself that goes by the lengths of
    /// edges, and by the heights of triangles where these are thin.
    pub fn boundary(&self, layout: &Layout) -> Boundary {
        let length = |h: u32| self.patch.lengths[h as usize];
        Boundary::new(&layout.opened.topology, |h| {
            let longest = length(h).max(length(next(h))).max(length(previous(h)));
            let height = 2.0 * self.patch.areas[h as usize / 3] / longest;
            length(h).min(height.max(THINNEST * longest))
        })
    }

    /// Whether all triangles are positive and, where it must, the boundary is simple.
    pub fn is_valid(&self, layout: &Layout) -> bool {
        first_flipped(layout.opened.topology.triangles(), &layout.uv).is_none()
            && (!self.injective || self.boundary(layout).is_simple(&layout.uv))
    }

    /// The patch cut open and flattened, from Tutte's embedding of it or, if it is large, of a
    /// simpler one.
    pub fn flattened(&self, cut: Cut, effort: Effort) -> Result<Layout, SolveError> {
        let opened = cut.open(&self.patch.topology);
        if let Some(uv) = self.prolonged(&opened, effort) {
            let mut layout = Layout::new(cut.clone(), opened.clone(), uv);
            self.separate_contacts(&mut layout);
            if self.settled(&mut layout, effort, LEAST_STEPS).is_ok() {
                return Ok(layout);
            }
        }
        let uv = self.embedded(&opened)?;
        let mut layout = Layout::new(cut, opened, uv);
        self.solve(&mut layout, effort, LEAST_STEPS)?;
        Ok(layout)
    }

    fn embedded(&self, opened: &Opened) -> Result<Vec<[f64; 2]>, SolveError> {
        let mut uv = tutte::embed(&opened.topology, &self.rest)?;
        even_out(opened.topology.triangles(), &self.rest, &mut uv);
        Ok(uv)
    }

    /// A layout of a cut patch that is flattened with few triangles first, then with more and
    /// more. `None` if it has few, or that leads to no valid layout.
    fn prolonged(&self, opened: &Opened, effort: Effort) -> Option<Vec<[f64; 2]>> {
        let topology = &opened.topology;
        let count = topology.triangles().len();
        if count < MANY {
            return None;
        }
        let at = |&v: &u32| self.patch.positions[v as usize];
        let positions: Vec<[f64; 3]> = opened.source.iter().map(at).collect();
        let mut simpler = Simplification::new(topology, &positions, FEW);
        if 2 * simpler.triangles() > count {
            return None;
        }
        let mut uv = vec![[0.0; 2]; topology.vertices()];
        let mut first = true;
        while simpler.triangles() < count {
            let patch = simpler.simplified(self.patch.scale).patch;
            let mut problem = Problem::new(&patch, patch.lengths.clone(), self.pace);
            problem.injective = self.injective;
            let whole = Cut::none(&patch.topology);
            let layout = if first {
                problem.flattened(whole, effort).ok()?
            } else {
                let opened = whole.open(&patch.topology);
                let place = |&v: &u32| uv[patch.source[v as usize] as usize];
                let map = opened.source.iter().map(place).collect();
                let mut layout = Layout::new(whole, opened, map);
                problem.separate_contacts(&mut layout);
                problem.settled(&mut layout, LEVEL, LEAST_STEPS).ok()?;
                layout
            };
            first = false;
            self.charge(problem.work());
            for (q, &v) in layout.uv.iter().zip(&layout.opened.source) {
                uv[patch.source[v as usize] as usize] = *q;
            }
            let left = simpler.triangles();
            let most = if 2 * FINER * left > count {
                count
            } else {
                FINER * left
            };
            simpler.refine(most, &mut uv)?;
        }
        first_flipped(topology.triangles(), &uv)
            .is_none()
            .then_some(uv)
    }

    /// Moves the boundary apart where it touches itself: rounding may put a vertex that comes back on
    /// another part of it. If it cannot be moved apart, nothing moves.
    fn separate_contacts(&self, layout: &mut Layout) {
        if !self.injective {
            return;
        }
        let boundary = self.boundary(layout);
        if !boundary.is_simple(&layout.uv) {
            // Whoever goes on from here finds out whether it is valid.
            let _ = open_contacts(&layout.opened.topology, &boundary, &mut layout.uv);
        }
    }

    /// A layout, or its mirror image, relaxed, if one of them is valid.
    pub fn taken(&self, layout: &Layout, effort: Effort) -> Option<Layout> {
        [false, true].into_iter().find_map(|mirrored| {
            let mut layout = layout.clone();
            if mirrored {
                for [u, _] in &mut layout.uv {
                    *u = -*u;
                }
            }
            let valid = self.is_valid(&layout);
            let solved = valid && self.solve(&mut layout, effort, LEAST_STEPS).is_ok();
            solved.then_some(layout)
        })
    }

    /// A layout with other cuts, where it was.
    pub fn recut(&self, layout: &Layout, cut: Cut) -> Layout {
        let opened = cut.open(&self.patch.topology);
        layout.recut(cut, opened)
    }

    /// A layout cut further along half-edges, opened there, and relaxed.
    pub fn extended(&self, layout: &Layout, path: &[u32], effort: Effort) -> Option<Layout> {
        let mut layout = self.opened_along(layout, path)?;
        self.relax(&mut layout, effort).ok()?;
        Some(layout)
    }

    /// The same, relaxed only as far as `around` the new cut. Of what is known of the layout only
    /// the energy is new.
    pub fn extended_nearby(
        &self,
        layout: &Layout,
        path: &[u32],
        around: f64,
        effort: Effort,
    ) -> Option<Layout> {
        let mut extended = self.opened_along(layout, path)?;
        let at = |v: u32| self.patch.positions[v as usize];
        let topology = &self.patch.topology;
        let ends = path
            .iter()
            .flat_map(|&h| [topology.origin(h), topology.target(h)]);
        let mut places: Vec<[f64; 3]> = Vec::new();
        for p in ends.map(at) {
            // No more than it takes to find what is around.
            if places
                .last()
                .is_none_or(|&last| length(sub(p, last)) > 0.3 * around)
            {
                places.push(p);
            }
        }
        let near: Vec<bool> = self
            .patch
            .positions
            .iter()
            .map(|&p| places.iter().any(|&place| length(sub(p, place)) < around))
            .collect();
        self.relax_near(&mut extended, &near, &[], effort).ok()?;
        let sum = |layout: &Layout| self.excess(layout).iter().sum::<f64>();
        let area = self.rest.total_area();
        extended.energy = layout.energy + (sum(&extended) - sum(layout)) / area;
        Some(extended)
    }

    fn opened_along(&self, layout: &Layout, path: &[u32]) -> Option<Layout> {
        if !self.goes_on() {
            return None;
        }
        let mut cut = layout.cut.clone();
        cut.add(&self.patch.topology, path);
        let mut layout = self.recut(layout, cut);
        if self.injective {
            let boundary = self.boundary(&layout);
            let opened = &layout.opened;
            open_slits(&opened.topology, &opened.source, &boundary, &mut layout.uv).ok()?;
        }
        Some(layout)
    }

    /// Decreases the energy of a layout.
    pub fn relax(&self, layout: &mut Layout, effort: Effort) -> Result<(), SolveError> {
        self.solve(layout, effort, 0)
    }

    /// Decreases the energy that a layout would have if every triangle had the size on the surface
    /// that it has in the layout: the distortion of angles alone.
    pub fn relax_angles(&self, layout: &mut Layout, effort: Effort) -> Result<(), SolveError> {
        let triangles = layout.opened.topology.triangles();
        let sizes: Vec<f64> = triangles
            .iter()
            .enumerate()
            .map(|(t, corners)| {
                let area = flat_area(corners.map(|v| layout.uv[v as usize]));
                (area / self.rest.area(t)).sqrt()
            })
            .collect();
        self.solve_for(&self.rest.resized(&sizes), layout, effort, 0, Place::Near)
    }

    /// Decreases the energy of a layout that is nearly where it should be, as one that comes from a
    /// coarser surface: block by block if it is large.
    pub fn settled(
        &self,
        layout: &mut Layout,
        effort: Effort,
        least: usize,
    ) -> Result<(), SolveError> {
        self.solve_for(&self.rest, layout, effort, least, Place::Near)
    }

    fn stop(&self, effort: Effort, least: usize) -> Stop<'_> {
        Stop {
            iterations: effort.iterations,
            relative_decrease: effort.decrease,
            least,
            pace: self.pace,
        }
    }

    /// The layout on the way from one to another of the same cut, if it is valid.
    pub fn between(&self, from: &Layout, to: &Layout, share: f64) -> Option<Layout> {
        let mut layout = from.clone();
        for (q, end) in layout.uv.iter_mut().zip(&to.uv) {
            *q = [0, 1].map(|axis| (1.0 - share) * q[axis] + share * end[axis]);
        }
        self.measure(&mut layout);
        self.is_valid(&layout).then_some(layout)
    }

    /// Sets what is known of the distortion of a layout.
    pub fn measure(&self, layout: &mut Layout) {
        let triangles = layout.opened.topology.triangles();
        layout.energy = mean_energy(triangles, &self.rest, &layout.uv);
        layout.area_distortion = self.area_distortion(layout);
        layout.conformality = self.conformality(layout);
    }

    /// Decreases the energy of a layout, with a least number of steps even if it is not to go on.
    fn solve(&self, layout: &mut Layout, effort: Effort, least: usize) -> Result<(), SolveError> {
        self.solve_for(&self.rest, layout, effort, least, Place::Anywhere)
    }

    /// The same for given rest shapes; what is known of the layout then is by its own.
    fn solve_for(
        &self,
        rest: &RestShapes,
        layout: &mut Layout,
        effort: Effort,
        least: usize,
        place: Place,
    ) -> Result<(), SolveError> {
        let triangles = layout.opened.topology.triangles();
        let boundary = self.injective.then(|| self.boundary(layout));
        let stop = self.stop(effort, least);
        let steps = if place == Place::Near && triangles.len() >= IN_BLOCKS {
            let blocks = Blockwise::new(triangles, rest, boundary.as_ref());
            blocks.minimize(&mut layout.uv, &stop)?
        } else {
            let mut flattening = Flattening::new(triangles, rest.clone(), &[])?;
            let solved = flattening.minimize(&mut layout.uv, boundary.as_ref(), &stop)?;
            solved.iterations
        };
        self.count(steps, triangles.len());
        self.measure(layout);
        Ok(())
    }

    /// Decreases the energy of a layout by moving the vertices that are `near` (of the patch)
    /// and not `held` (of the layout).
    pub fn relax_near(
        &self,
        layout: &mut Layout,
        near: &[bool],
        held: &[bool],
        effort: Effort,
    ) -> Result<(), SolveError> {
        let boundary = self.injective.then(|| self.boundary(layout));
        let opened = &layout.opened;
        let near: Vec<bool> = opened.source.iter().map(|&v| near[v as usize]).collect();
        let all = opened.topology.triangles();
        let chosen: Vec<u32> = (0..all.len() as u32)
            .filter(|&t| all[t as usize].iter().any(|&v| near[v as usize]))
            .collect();
        let is_held = |v: usize| held.get(v).is_some_and(|&held| held);
        let fixed: Vec<bool> = (0..near.len()).map(|v| !near[v] || is_held(v)).collect();
        let triangles: Vec<[u32; 3]> = chosen.iter().map(|&t| all[t as usize]).collect();
        let rest = self.rest.subset(&chosen);
        let mut flattening = Flattening::new(&triangles, rest, &fixed)?;
        let stop = self.stop(effort, 0);
        let solved = flattening.minimize(&mut layout.uv, boundary.as_ref(), &stop)?;
        self.count(solved.iterations, triangles.len());
        Ok(())
    }

    fn area_distortion(&self, layout: &Layout) -> f64 {
        let image = |t: &[u32; 3]| flat_area(t.map(|v| layout.uv[v as usize]));
        let triangles = layout.opened.topology.triangles();
        let total: f64 = triangles.iter().map(image).sum();
        let area = self.rest.total_area();
        let sum: f64 = triangles
            .iter()
            .enumerate()
            .map(|(t, corners)| {
                let share = self.rest.area(t) / area;
                share * (image(corners) / total / share).ln().abs()
            })
            .sum();
        sum.exp()
    }

    fn conformality(&self, layout: &Layout) -> f64 {
        let triangles = layout.opened.topology.triangles();
        let sum: f64 = triangles
            .iter()
            .zip(&self.angles)
            .map(|(corners, on_surface)| {
                let flat = corners
                    .map(|v| layout.uv[v as usize])
                    .map(|[u, v]| [u, v, 0.0]);
                let image = angles(flat);
                (0..3)
                    .map(|c| (image[c] - on_surface[c]).abs())
                    .sum::<f64>()
            })
            .sum();
        sum / (3 * triangles.len()) as f64
    }

    fn count(&self, iterations: usize, triangles: usize) {
        self.charge(iterations as u64 * triangles as u64);
    }

    /// For every triangle its energy above that of an isometry, times its area.
    pub fn excess(&self, layout: &Layout) -> Vec<f64> {
        let triangles = layout.opened.topology.triangles();
        (0..triangles.len())
            .map(|t| {
                let corners = triangles[t].map(|v| layout.uv[v as usize]);
                (energy_of(&self.rest, t, corners) - 4.0 * self.rest.area(t)).max(0.0)
            })
            .collect()
    }
}

/// The area of a triangle in the plane, negative where it is flipped.
fn flat_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

/// The angles of a triangle at its corners, by its corners.
fn angles([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    [(a, b, c), (b, c, a), (c, a, b)].map(|(at, one, other)| {
        let (u, v) = (sub(one, at), sub(other, at));
        length(cross(u, v)).atan2(dot(u, v))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cut::disk::cut_to_disk;
    use crate::cut::paths::cheapest_path;
    use fam_surface::shapes;

    const EFFORT: Effort = Effort {
        iterations: 30,
        decrease: 1e-6,
    };

    #[test]
    fn what_a_cut_brings_is_known_from_its_surroundings() {
        let patch = Patch::of(&shapes::torus(1.0, 0.5, 40, 20));
        let goes_on = || true;
        let problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
        let cut = cut_to_disk(&patch.topology, &patch.lengths, &[]);
        let layout = problem.flattened(cut, EFFORT).unwrap();
        let on_cut = |v: u32| {
            let around = |h: &u32| layout.cut.contains(*h) && patch.topology.origin(*h) == v;
            (0..patch.topology.half_edges()).any(|h| around(&h))
        };
        let excess = problem.excess(&layout);
        let worst = (0..excess.len()).max_by(|&a, &b| excess[a].total_cmp(&excess[b]));
        let from = patch.topology.triangles()[worst.unwrap()];
        let start: Vec<u32> = from.into_iter().filter(|&v| !on_cut(v)).collect();
        let path = cheapest_path(&patch.topology, &patch.lengths, &start, on_cut).unwrap();
        assert!(!path.is_empty());
        let whole = problem.extended(&layout, &path, EFFORT).unwrap();
        // No further than everything reaches, it is the same.
        let all = problem
            .extended_nearby(&layout, &path, 10.0, EFFORT)
            .unwrap();
        assert!((all.energy - whole.energy).abs() < 1e-3 * whole.energy);
        let near = problem
            .extended_nearby(&layout, &path, 0.2, EFFORT)
            .unwrap();
        assert!(near.energy < layout.energy && near.energy > whole.energy - 1e-9);
        assert!(problem.is_valid(&near));
    }
}
