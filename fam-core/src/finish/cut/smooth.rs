//! Cuts without needless turns.
//!
//! On a regular mesh many ways along edges are about equally long: of a staircase and of two
//! straight lines an artist wants the lines.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::super::topology::Topology;
use super::paths::{EdgeGraph, Search, at};
use super::segments::{BranchKind, branches};
use super::straighten::character;
use super::{Cut, boundary_vertices, finite};

/// A part of a cut is replaced only by one that costs less by this fraction.
const LEAST_GAIN: f64 = 1e-9;

/// A cut between the same nodes that opens the surface in the same way, whose branches take the
/// way that is cheapest with what turning costs: `turn` from one half-edge into the next. They
/// stay within `reach`, by `cost`, of where they are. The cut goes on reaching the `pinned`
/// vertices that it reaches.
pub fn smooth(
    topology: &Topology,
    cost: &[f64],
    turn: impl Fn(u32, u32) -> f64,
    reach: f64,
    cut: &Cut,
    pinned: &[u32],
) -> Cut {
    let mut is_pinned = vec![false; topology.vertices()];
    for &v in pinned {
        is_pinned[v as usize] = true;
    }
    let graph = EdgeGraph::of(topology);
    let cost = &finite(cost);
    let boundary = boundary_vertices(topology);
    let mut smooth = cut.clone();
    for branch in branches(topology, cut, |v| is_pinned[v as usize]) {
        let path = &branch.half_edges;
        let least = match branch.kind {
            // One edge inside the surface would leave but two vertices.
            BranchKind::Slit => 2,
            BranchKind::Leaf | BranchKind::Bridge => 1,
        };
        let is_closed = branch.root(topology) == branch.tip(topology);
        let arms = match is_closed {
            true => path.split_at(path.len() / 2),
            false => (&path[..], &path[..0]),
        };
        for arm in [arms.0, arms.1] {
            let Some(&last) = arm.last() else { continue };
            let mut taken = boundary.clone();
            let mut rest = smooth.clone();
            rest.remove(topology, arm);
            for h in rest.half_edges() {
                taken[topology.origin(h) as usize] = true;
            }
            let on_arm: Vec<u32> = arm.iter().map(|&h| topology.origin(h)).collect();
            let near = Search {
                graph: &graph,
                cost,
                limit: reach,
            };
            let (near, _) = near.until(&at(&on_arm), |_, _| true, |_| false);
            let end = topology.target(last);
            let way = Way {
                topology,
                graph: &graph,
                cost,
                turn: &turn,
                start: on_arm[0],
                end,
                free: &|v| v == end || near.distance[v as usize].is_finite() && !taken[v as usize],
            };
            let better = way.cheapest(way.cost_of(arm) * (1.0 - LEAST_GAIN));
            if let Some(better) = better.filter(|better| better.len() >= least) {
                smooth.remove(topology, arm);
                smooth.add(topology, &better);
            }
        }
    }
    if character(topology, &smooth) == character(topology, cut) {
        smooth
    } else {
        cut.clone()
    }
}

/// A way from a vertex to another that turns cost something on.
struct Way<'a, T> {
    topology: &'a Topology,
    graph: &'a EdgeGraph,
    /// Of every half-edge; finite.
    cost: &'a [f64],
    turn: &'a T,
    start: u32,
    end: u32,
    /// The vertices that it may go through.
    free: &'a dyn Fn(u32) -> bool,
}

impl<T: Fn(u32, u32) -> f64> Way<'_, T> {
    fn cost_of(&self, path: &[u32]) -> f64 {
        let edges: f64 = path.iter().map(|&h| self.cost[h as usize]).sum();
        let turns = path.windows(2).map(|pair| (self.turn)(pair[0], pair[1]));
        edges + turns.sum::<f64>()
    }

    /// The half-edges of the cheapest way, if there is one that costs less than `limit`:
    /// Dijkstra's search over half-edges instead of vertices.
    fn cheapest(&self, limit: f64) -> Option<Vec<u32>> {
        let mut known: HashMap<u32, (f64, Option<u32>)> = HashMap::new();
        let mut heap = BinaryHeap::new();
        let mut last = None;
        let mut from = (self.start, 0.0);
        loop {
            let (v, distance) = from;
            for (h, to) in self.graph.leaving(v) {
                let back = last.is_some_and(|last| self.topology.twin(last) == Some(h));
                if back || self.topology.twin(h).is_none() || !(self.free)(to) {
                    continue;
                }
                let turn = last.map_or(0.0, |last| (self.turn)(last, h));
                let through = distance + turn + self.cost[h as usize];
                let shorter = known.get(&h).is_none_or(|&(other, _)| through < other);
                if shorter && through < limit {
                    known.insert(h, (through, last));
                    // The bits of non-negative numbers are ordered as they are.
                    heap.push(Reverse((through.to_bits(), h)));
                }
            }
            let Reverse((bits, h)) = heap.pop()?;
            let distance = f64::from_bits(bits);
            let end = self.topology.target(h);
            if end == self.end {
                let before = |&h: &u32| known.get(&h).and_then(|&(_, before)| before);
                let mut path: Vec<u32> = std::iter::successors(Some(h), before).collect();
                path.reverse();
                return Some(path);
            }
            (last, from) = (Some(h), (end, distance));
        }
    }
}
