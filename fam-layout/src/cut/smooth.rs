//! Cuts without needless turns.
//!
//! On a regular mesh many ways along edges are about equally long: of a staircase and of two
//! straight lines an artist wants the lines.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::paths::{EdgeGraph, Search, at};
use super::segments::{BranchKind, branches};
use super::straightening::character;
use super::{Cut, boundary_vertices, finite};
use crate::patch::topology::Topology;

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

#[cfg(test)]
mod tests {
    use super::super::disk::cut_to_disk;
    use super::super::segments::{Branch, CutGraph};
    use super::super::test_surfaces::{block, cubes, oriented, pierced_plate, random_costs};
    use super::*;
    use crate::patch::topology::Opened;
    use fam_surface::vector::{dot, sub};
    use fam_surface::{TriangleMesh, shapes};

    /// What turning costs on a mesh: as much as its angle, of a right one 0.3.
    fn turning(mesh: &TriangleMesh, topology: &Topology) -> impl Fn(u32, u32) -> f64 {
        let at = |v: u32| mesh.positions()[v as usize];
        let along: Vec<[f64; 3]> = (0..topology.half_edges())
            .map(|h| sub(at(topology.target(h)), at(topology.origin(h))))
            .collect();
        move |one, next| {
            let (a, b) = (along[one as usize], along[next as usize]);
            0.3 * (1.0 - dot(a, b) / (dot(a, a) * dot(b, b)).sqrt())
        }
    }

    fn turns(branch: &Branch, turn: impl Fn(u32, u32) -> f64) -> usize {
        let pairs = branch.half_edges.windows(2);
        pairs.filter(|pair| turn(pair[0], pair[1]) > 0.01).count()
    }

    /// A staircase over a sheet of squares, nine vertices in every column from the third on, whose
    /// diagonals are forbidden.
    #[test]
    fn a_staircase_becomes_two_lines_if_they_are_near() {
        let mesh = shapes::rectangle(8.0, 8.0, 8, 8);
        let (sheet, mut cost) = oriented(&mesh);
        for cost in cost.iter_mut().filter(|cost| **cost > 1.1) {
            *cost = f64::INFINITY;
        }
        let mut stairs = Cut::none(&sheet);
        for k in 2..7 {
            let corners = [10 * k, 10 * k + 1, 10 * k + 10];
            for pair in corners.windows(2) {
                let h = (0..sheet.half_edges())
                    .find(|&h| sheet.origin(h) == pair[0] && sheet.target(h) == pair[1]);
                stairs.add(&sheet, &[h.unwrap()]);
            }
        }
        let turn = turning(&mesh, &sheet);
        let turns_within = |reach: f64, pinned: &[u32]| {
            let smooth = smooth(&sheet, &cost, &turn, reach, &stairs, pinned);
            assert_eq!(smooth.cost(&cost), 10.0);
            assert_eq!(character(&sheet, &smooth), character(&sheet, &stairs));
            let branches = branches(&sheet, &smooth, |_| false);
            assert_eq!(branches.len(), 1);
            let mut ends = [branches[0].root(&sheet), branches[0].tip(&sheet)];
            ends.sort_unstable();
            assert_eq!(ends, [20, 70]);
            assert!(pinned.iter().all(|&v| smooth.vertices(&sheet)[v as usize]));
            turns(&branches[0], &turn)
        };
        assert_eq!(turns_within(0.0, &[]), 9);
        assert_eq!(turns_within(20.0, &[]), 1);
        let near = turns_within(1.0, &[]);
        assert!((2..7).contains(&near), "{near}");
        assert_eq!(turns_within(20.0, &[40]), 3);
    }

    #[test]
    fn a_ring_stays_around() {
        let mesh = shapes::open_cylinder(1.0, 3.0, 20, 9);
        let (cylinder, lengths) = oriented(&mesh);
        let Opened { source, .. } = Topology::oriented(&mesh);
        // Ten vertices in every column; the ring goes up and down between two rows.
        let mut ring = Cut::none(&cylinder);
        for h in 0..cylinder.half_edges() {
            let [a, b] = [cylinder.origin(h), cylinder.target(h)].map(|v| source[v as usize]);
            let row = |v: u32| 4 + (v / 10) % 2;
            let next = (b / 10 + 20 - a / 10) % 20;
            let up = next == 0 && [a % 10, b % 10] == [row(a), 9 - row(a)];
            let around = next == 1 && a % 10 == 9 - row(a) && b % 10 == row(b);
            if up || around {
                ring.add(&cylinder, &[h]);
            }
        }
        assert_eq!(character(&cylinder, &ring), (2, 0, 4));
        let turn = turning(&mesh, &cylinder);
        let smooth = smooth(&cylinder, &lengths, turn, 1.0, &ring, &[]);
        assert_eq!(character(&cylinder, &smooth), (2, 0, 4));
        assert!(smooth.cost(&lengths) < 0.6 * ring.cost(&lengths));
    }

    #[test]
    fn random_cuts_open_the_surface_as_before_and_reach_what_they_reached() {
        let mut changed = 0;
        for seed in 0..8 {
            let mut meshes = cubes([4, 3, 3], |[x, y, z]| (x * y * z + x) % 3 != 2);
            meshes.extend([block(), pierced_plate(2)]);
            for mesh in meshes {
                let topology = Topology::oriented(&mesh).topology;
                let [other, cost] = [2 * seed, 2 * seed + 1].map(|s| random_costs(&topology, s));
                let pinned = [0, topology.vertices() as u32 / 2];
                let cut = cut_to_disk(&topology, &other, &pinned);
                let nodes = |cut: &Cut| -> Vec<u32> {
                    let graph = CutGraph::of(&topology, cut);
                    let nodes = graph.vertices().filter(|leaving| leaving.len() != 2);
                    nodes.map(|leaving| leaving[0].0).collect()
                };
                let turn = |a: u32, b: u32| f64::from((a * 7 + b * 13) % 5) * 0.1;
                let smooth = smooth(&topology, &cost, turn, 2.0, &cut, &pinned);
                assert_eq!(character(&topology, &smooth), character(&topology, &cut));
                assert_eq!(nodes(&smooth), nodes(&cut));
                let [before, after] = [&cut, &smooth].map(|cut| cut.vertices(&topology));
                assert!(
                    pinned
                        .iter()
                        .all(|&v| before[v as usize] == after[v as usize])
                );
                changed += usize::from(smooth != cut);
            }
        }
        assert!(changed > 8, "{changed}");
    }
}
