//! Surfaces of fewer triangles, and the way back.
//!
//! Vertices are moved into neighbours one by one, so that what is left is a subset of them.
//! That is done only where the surface stays the manifold it was, with the same handles and
//! holes. Undone in reverse, every such collapse carries a cut and a layout to the finer
//! surface: the cut opens it as before, and where triangles were positive and nothing
//! overlapped that stays so, too.

mod carried_cut;
mod collapse;
mod placed;
mod quadric;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::patch::Patch;
use crate::patch::topology::{Opened, Topology};
use collapse::{Collapse, Sides};
use quadric::Quadric;

/// In the place of a vertex or half-edge: there is none.
const NONE: u32 = u32::MAX;

/// What a collapse costs by the length of its edge, as against the distance from the surface:
/// where that is flat, triangles become no larger than where it is bent a little.
const EVENNESS: f64 = 2e-3;

/// How much more the sides of the boundary count as against the surface.
const BOUNDARY: f64 = 4.0;

/// The cosine of the angle that a triangle may turn by.
const LEAST_COSINE: f64 = 0.3;

/// The quality that a triangle must have (1 for an equilateral one) if it gets worse.
const LEAST_QUALITY: f64 = 0.2;

/// A surface some of whose vertices were moved into neighbours.
#[derive(Clone)]
pub struct Simplification<'a> {
    /// Of all vertices.
    positions: &'a [[f64; 3]],
    /// With the triangles that are gone.
    surface: Topology,
    gone: Vec<bool>,
    left: usize,
    collapses: Vec<Collapse>,
}

/// What is left of a surface.
pub struct Simplified {
    /// It as a patch; the sources of its vertices are those of the surface.
    pub patch: Patch,
    /// For every triangle that of the surface.
    pub triangles: Vec<u32>,
}

impl<'a> Simplification<'a> {
    /// Simplifies a surface whose vertices have positions until `wanted` triangles are left, or
    /// none can be taken out any more.
    pub fn new(surface: &Topology, positions: &'a [[f64; 3]], wanted: usize) -> Self {
        let mut simplification = Self {
            positions,
            surface: surface.clone(),
            gone: vec![false; surface.triangles().len()],
            left: surface.triangles().len(),
            collapses: Vec::new(),
        };
        if simplification.left > wanted {
            Queue::new(&simplification).run(&mut simplification, wanted);
        }
        simplification
    }

    /// With at least `wanted` triangles, if the surface has as many: some vertices are back.
    pub fn restored(mut self, wanted: usize) -> Self {
        while self.left < wanted
            && let Some(collapse) = self.collapses.pop()
        {
            self.restore(&collapse);
        }
        self
    }

    /// How many triangles are left.
    pub fn triangles(&self) -> usize {
        self.left
    }

    /// What is left, at the scale that positions have.
    pub fn simplified(&self, scale: f64) -> Simplified {
        let triangles: Vec<u32> = (0..self.gone.len() as u32)
            .filter(|&t| !self.gone[t as usize])
            .collect();
        let part: Opened = self.surface.part(&triangles);
        let at = |&v: &u32| self.positions[v as usize];
        let positions = part.source.iter().map(at).collect();
        Simplified {
            patch: Patch::over(part, positions, scale),
            triangles,
        }
    }
}

/// The collapses that can be made, the cheapest first.
struct Queue {
    quadrics: Vec<Quadric>,
    /// The area that every vertex stands for.
    areas: Vec<f64>,
    /// For every vertex a half-edge that leaves it.
    leaving: Vec<u32>,
    /// How often the surroundings of every vertex changed.
    stamps: Vec<u32>,
    heap: BinaryHeap<Reverse<(u64, u32, u32)>>,
}

impl Queue {
    fn new(state: &Simplification) -> Self {
        let surface = &state.surface;
        let mut queue = Self {
            quadrics: vec![Quadric::default(); surface.vertices()],
            areas: vec![0.0; surface.vertices()],
            leaving: vec![NONE; surface.vertices()],
            stamps: vec![0; surface.vertices()],
            heap: BinaryHeap::new(),
        };
        for (t, corners) in surface.triangles().iter().enumerate() {
            let places = corners.map(|v| state.positions[v as usize]);
            let (plane, area) = Quadric::of_triangle(places);
            for (c, &v) in corners.iter().enumerate() {
                queue.quadrics[v as usize].add(&plane);
                queue.areas[v as usize] += area / 3.0;
                queue.leaving[v as usize] = (3 * t + c) as u32;
            }
        }
        for h in (0..surface.half_edges()).filter(|&h| surface.twin(h).is_none()) {
            let ends = [surface.origin(h), surface.target(h)];
            let side = Quadric::of_side(ends.map(|v| state.positions[v as usize]), BOUNDARY);
            for v in ends {
                queue.quadrics[v as usize].add(&side);
            }
        }
        for v in 0..surface.vertices() as u32 {
            queue.push(state, v);
        }
        queue
    }

    /// The half-edges along which a vertex could be moved, cheapest first.
    fn ways(&self, state: &Simplification, v: u32) -> Vec<(f64, Sides)> {
        let mut ways: Vec<(f64, Sides)> = Sides::around(&state.surface, self.leaving[v as usize])
            .into_iter()
            .map(|sides| (self.cost(state, v, sides.into), sides))
            .collect();
        ways.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.into.cmp(&b.1.into)));
        ways
    }

    fn cost(&self, state: &Simplification, from: u32, into: u32) -> f64 {
        let [p, q] = [from, into].map(|v| state.positions[v as usize]);
        let squared: f64 = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum();
        let away = self.quadrics[from as usize].at(q).max(0.0);
        let cost = away + EVENNESS * squared * self.areas[from as usize];
        if cost.is_finite() {
            cost.max(0.0)
        } else {
            f64::MAX
        }
    }

    /// Enters the cheapest way of a vertex, whether or not it is open.
    fn push(&mut self, state: &Simplification, v: u32) {
        if self.leaving[v as usize] == NONE {
            return;
        }
        let ways = Sides::around(&state.surface, self.leaving[v as usize]);
        let costs = ways.iter().map(|sides| self.cost(state, v, sides.into));
        let least = costs.fold(f64::INFINITY, f64::min);
        // The bits of non-negative numbers are ordered as they are.
        self.heap
            .push(Reverse((least.to_bits(), v, self.stamps[v as usize])));
    }

    fn run(mut self, state: &mut Simplification, wanted: usize) {
        while state.left > wanted
            && let Some(Reverse((bits, v, stamp))) = self.heap.pop()
        {
            if stamp != self.stamps[v as usize] || self.leaving[v as usize] == NONE {
                continue;
            }
            let open = self
                .ways(state, v)
                .into_iter()
                .find(|(_, sides)| sides.may_collapse(&state.surface, state.positions));
            match open {
                Some((cost, _)) if cost.to_bits() > bits => {
                    self.heap.push(Reverse((cost.to_bits(), v, stamp)));
                }
                Some((_, sides)) => self.collapse(state, &sides),
                None => {}
            }
        }
    }

    fn collapse(&mut self, state: &mut Simplification, sides: &Sides) {
        let (from, into) = (sides.from, sides.into);
        for (v, leaving) in sides.leaving_after(&state.surface) {
            self.leaving[v as usize] = leaving;
        }
        self.leaving[from as usize] = NONE;
        let quadric = self.quadrics[from as usize];
        self.quadrics[into as usize].add(&quadric);
        self.areas[into as usize] += self.areas[from as usize];
        let collapse = Collapse::made(&mut state.surface, sides);
        for h in collapse.half_edges() {
            state.gone[h as usize / 3] = true;
            state.left -= 1;
        }
        state.collapses.push(collapse);
        let around = Sides::around(&state.surface, self.leaving[into as usize]);
        let near = around.iter().map(|sides| sides.into);
        for v in near.chain([into]) {
            self.stamps[v as usize] += 1;
            self.push(state, v);
        }
    }
}

#[cfg(test)]
mod tests;
