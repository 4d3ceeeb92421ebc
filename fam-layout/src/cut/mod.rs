//! Where to cut: along edges of the mesh, as cheaply as possible.
//!
//! Costs have one entry per half-edge, equal on twins and positive: the length of the edge
//! times whatever makes a seam there welcome or not. An infinite cost forbids an edge; it is
//! cut only where there is no other way.

pub mod disk;
pub mod paths;
pub mod segments;
pub mod smooth;
pub mod straighten;

mod branch_points;
mod capped;
mod reroute;
mod straightening;
mod tree_cotree;

#[cfg(test)]
pub(super) mod test_surfaces;

use crate::patch::topology::{Opened, Topology, next};

/// Edges along which a surface is to be cut. Those of its boundary are never among them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cut {
    half_edges: Vec<bool>,
}

impl Cut {
    /// No edge.
    pub fn none(topology: &Topology) -> Self {
        Self {
            half_edges: vec![false; topology.half_edges() as usize],
        }
    }

    /// The edges on whose sides a layout is not the same. A coordinate belongs to a half-edge: to
    /// the corner of the triangle in which it starts.
    pub fn between(topology: &Topology, corners: &[[f64; 2]]) -> Self {
        let ends = |h: u32| [corners[h as usize], corners[next(h) as usize]];
        let apart = |h: u32| {
            topology.twin(h).is_some_and(|twin| {
                let [a, b] = ends(twin);
                ends(h) != [b, a]
            })
        };
        Self {
            half_edges: (0..topology.half_edges()).map(apart).collect(),
        }
    }

    /// Whether the edge of a half-edge is cut.
    pub fn contains(&self, h: u32) -> bool {
        self.half_edges[h as usize]
    }

    /// Whether no edge is cut.
    pub fn is_empty(&self) -> bool {
        !self.half_edges.contains(&true)
    }

    /// Adds the edges of half-edges; those of the boundary are left out.
    pub fn add(&mut self, topology: &Topology, half_edges: &[u32]) {
        self.set(topology, half_edges, true);
    }

    /// Takes the edges of half-edges out.
    pub fn remove(&mut self, topology: &Topology, half_edges: &[u32]) {
        self.set(topology, half_edges, false);
    }

    fn set(&mut self, topology: &Topology, half_edges: &[u32], cut: bool) {
        for &h in half_edges {
            if let Some(twin) = topology.twin(h) {
                self.half_edges[h as usize] = cut;
                self.half_edges[twin as usize] = cut;
            }
        }
    }

    /// All half-edges that are cut: two of every edge, ascending.
    pub fn half_edges(&self) -> impl Iterator<Item = u32> + '_ {
        let all = self.half_edges.iter().enumerate();
        all.filter_map(|(h, &cut)| cut.then_some(h as u32))
    }

    /// What the edges cost together.
    pub fn cost(&self, cost: &[f64]) -> f64 {
        let costs = self.half_edges().map(|h| cost[h as usize]);
        0.5 * costs.fold(0.0, |sum, cost| sum + cost)
    }

    /// The surface cut along the edges.
    pub fn open(&self, topology: &Topology) -> Opened {
        topology.open(|h| self.contains(h))
    }

    /// The vertices that the cut reaches.
    fn vertices(&self, topology: &Topology) -> Vec<bool> {
        let mut reached = vec![false; topology.vertices()];
        for h in self.half_edges() {
            reached[topology.origin(h) as usize] = true;
        }
        reached
    }

    /// Without branches that end in the surface, unless `keeps` holds for the vertex there.
    fn pruned(mut self, topology: &Topology, keeps: impl Fn(u32) -> bool) -> Self {
        let boundary = boundary_vertices(topology);
        let mut leaving: Vec<Vec<u32>> = vec![Vec::new(); topology.vertices()];
        for h in self.half_edges() {
            leaving[topology.origin(h) as usize].push(h);
        }
        let mut degree: Vec<usize> = leaving.iter().map(Vec::len).collect();
        let mut tips: Vec<u32> = (0..degree.len() as u32).collect();
        while let Some(v) = tips.pop() {
            if degree[v as usize] != 1 || boundary[v as usize] || keeps(v) {
                continue;
            }
            let last = leaving[v as usize].iter().find(|&&h| self.contains(h));
            if let Some(&h) = last {
                self.remove(topology, &[h]);
                let inner = topology.target(h);
                degree[v as usize] -= 1;
                degree[inner as usize] -= 1;
                tips.push(inner);
            }
        }
        self
    }
}

/// For every vertex whether it lies on the boundary.
fn boundary_vertices(topology: &Topology) -> Vec<bool> {
    let mut boundary = vec![false; topology.vertices()];
    for h in (0..topology.half_edges()).filter(|&h| topology.twin(h).is_none()) {
        boundary[topology.origin(h) as usize] = true;
    }
    boundary
}

/// Costs without infinite ones: those are more than all others together.
fn finite(cost: &[f64]) -> Vec<f64> {
    let allowed = |c: f64| c.is_finite() && c >= 0.0;
    let all: f64 = cost.iter().filter(|&&c| allowed(c)).sum();
    let forbidden = 2.0 * all + 1.0;
    cost.iter()
        .map(|&c| if allowed(c) { c } else { forbidden })
        .collect()
}
