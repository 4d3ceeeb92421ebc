//! A cut that is being made shorter.

use std::collections::HashSet;

use super::Cut;
use super::paths::{EdgeGraph, Search};
use super::segments::{Branch, CutGraph, branches};
use crate::patch::topology::Topology;

/// A part of a cut is replaced only by one that costs less by this fraction.
const LEAST_GAIN: f64 = 1e-9;

/// A valid cut of a surface and what must not change about it.
pub(super) struct Straightening<'a> {
    pub(super) topology: &'a Topology,
    pub(super) cost: &'a [f64],
    pub(super) graph: EdgeGraph,
    pub(super) cut: Cut,
    pub(super) boundary: Vec<bool>,
    /// Vertices that the cut must go on reaching.
    pub(super) pinned: Vec<bool>,
    /// Branches that met in a point for which no better place was found.
    pub(super) settled: HashSet<Vec<Vec<u32>>>,
}

impl Straightening<'_> {
    /// The branches that start from a vertex; of one that comes back to it each half.
    pub(super) fn branches_from(&self, fork: u32) -> Vec<Vec<u32>> {
        let graph = CutGraph::of(self.topology, &self.cut);
        let is_node = |v: u32| {
            self.boundary[v as usize] || self.pinned[v as usize] || graph.leaving(v).len() != 2
        };
        let follow = |&(_, start): &(u32, u32)| {
            let mut path = graph.follow(self.topology, start, is_node);
            if path
                .last()
                .is_some_and(|&h| self.topology.target(h) == fork)
            {
                path.truncate(path.len() / 2);
            }
            path
        };
        graph.leaving(fork).iter().map(follow).collect()
    }

    /// The branch that an edge is part of, if it is cut.
    pub(super) fn branch_along(&self, h: u32) -> Option<Branch> {
        let own = |&other: &u32| other == h || Some(other) == self.topology.twin(h);
        let mut branches = self.branches().into_iter();
        branches.find(|branch| branch.half_edges.iter().any(own))
    }

    /// Paths on the surface, whatever the cut, that cost no more than `limit`.
    pub(super) fn search(&self, limit: f64) -> Search<'_> {
        Search {
            graph: &self.graph,
            cost: self.cost,
            limit,
        }
    }

    pub(super) fn branches(&self) -> Vec<Branch> {
        branches(self.topology, &self.cut, |v| self.pinned[v as usize])
    }

    /// Takes a part of the cut out and another in, if that is cheaper.
    pub(super) fn replace(&mut self, old: &[u32], new: &[u32]) -> bool {
        let cost = |path: &[u32]| path.iter().map(|&h| self.cost[h as usize]).sum::<f64>();
        let cheaper = cost(new) < cost(old) * (1.0 - LEAST_GAIN);
        if cheaper {
            self.cut.remove(self.topology, old);
            self.cut.add(self.topology, new);
        }
        cheaper
    }

    /// The same, but only if the surface opens to as many pieces of the same kind.
    pub(super) fn replace_if_alike(&mut self, old: &[u32], new: &[u32]) -> bool {
        let before = self.cut.clone();
        if !self.replace(old, new) {
            return false;
        }
        let [one, other] = [&before, &self.cut].map(|cut| character(self.topology, cut));
        if one != other {
            self.cut = before;
        }
        one == other
    }
}

/// The pieces, Euler characteristic and boundary loops of the surface when it is cut.
pub(super) fn character(topology: &Topology, cut: &Cut) -> (usize, i64, usize) {
    let opened = cut.open(topology).topology;
    let loops = opened.boundary_loops().len();
    (opened.pieces().1, opened.euler_characteristic(), loops)
}
