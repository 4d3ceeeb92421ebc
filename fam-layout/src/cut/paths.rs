//! Cheapest paths along edges (Dijkstra).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::finite;
use crate::patch::topology::Topology;

/// In the place of a half-edge or a vertex: there is none.
const NONE: u32 = u32::MAX;

/// The half-edges, in order, of the cheapest path from one of the `sources` to a vertex for
/// which `reached` holds; empty if it holds for a source, `None` if there is no path.
///
/// Every half-edge runs onwards; an edge of the boundary has but one, which may run back.
pub fn cheapest_path(
    topology: &Topology,
    cost: &[f64],
    sources: &[u32],
    reached: impl Fn(u32) -> bool,
) -> Option<Vec<u32>> {
    let search = Search {
        graph: &EdgeGraph::of(topology),
        cost: &finite(cost),
        limit: f64::INFINITY,
    };
    let (paths, end) = search.until(&at(sources), |_, _| true, reached);
    end.map(|end| paths.path_to(end))
}

/// For every vertex what the cheapest path from the nearest of the `sources` costs; infinite
/// where there is none without a forbidden edge.
pub fn distances(topology: &Topology, cost: &[f64], sources: &[u32]) -> Vec<f64> {
    CheapestPaths::from(&EdgeGraph::of(topology), cost, sources).distance
}

/// The vertices and the edges that lead from one to another.
pub(super) struct EdgeGraph {
    starts: Vec<u32>,
    steps: Vec<Step>,
}

#[derive(Clone, Copy)]
struct Step {
    half_edge: u32,
    to: u32,
}

impl EdgeGraph {
    /// Of a surface.
    pub(super) fn of(topology: &Topology) -> Self {
        let steps_along = |h: u32| {
            let (a, b) = (topology.origin(h), topology.target(h));
            let back = topology.twin(h).unwrap_or(h);
            let step = |half_edge, from, to| (from, Step { half_edge, to });
            [step(h, a, b), step(back, b, a)]
        };
        let all = || topology.edges().flat_map(steps_along);
        let mut starts = vec![0; topology.vertices() + 1];
        for (from, _) in all() {
            starts[from as usize + 1] += 1;
        }
        for v in 0..topology.vertices() {
            starts[v + 1] += starts[v];
        }
        let nowhere = Step {
            half_edge: NONE,
            to: NONE,
        };
        let mut steps = vec![nowhere; starts[topology.vertices()] as usize];
        let mut free = starts.clone();
        for (from, step) in all() {
            steps[free[from as usize] as usize] = step;
            free[from as usize] += 1;
        }
        Self { starts, steps }
    }

    fn steps(&self, v: u32) -> &[Step] {
        &self.steps[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }

    /// The half-edges that lead away from a vertex, each with the vertex that it leads to.
    pub(super) fn leaving(&self, v: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.steps(v).iter().map(|step| (step.half_edge, step.to))
    }

    fn vertices(&self) -> usize {
        self.starts.len() - 1
    }
}

/// Where paths start.
#[derive(Clone, Copy)]
pub(super) enum Start {
    /// At a vertex.
    At(u32),
    /// With a half-edge, which runs to a vertex.
    Along(u32, u32),
}

/// Paths that start at vertices.
pub(super) fn at(vertices: &[u32]) -> Vec<Start> {
    vertices.iter().map(|&v| Start::At(v)).collect()
}

/// What paths may be made of.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) graph: &'a EdgeGraph,
    /// Of every half-edge; finite.
    pub(super) cost: &'a [f64],
    /// Paths that cost more are left out.
    pub(super) limit: f64,
}

impl Search<'_> {
    /// Paths to the vertices in the order of what they cost, until one for which `reached`
    /// holds, which is returned as well. `enters` says of a half-edge and the vertex that it
    /// runs to whether paths may take it.
    pub(super) fn until(
        &self,
        starts: &[Start],
        enters: impl Fn(u32, u32) -> bool,
        reached: impl Fn(u32) -> bool,
    ) -> (CheapestPaths, Option<u32>) {
        let mut paths = CheapestPaths {
            distance: vec![f64::INFINITY; self.graph.vertices()],
            arrival: vec![[NONE; 2]; self.graph.vertices()],
        };
        // The bits of non-negative numbers are ordered as they are.
        let mut heap = BinaryHeap::new();
        for &start in starts {
            let (distance, half_edge, v) = match start {
                Start::At(v) => (0.0, NONE, v),
                Start::Along(half_edge, v) => (self.cost[half_edge as usize], half_edge, v),
            };
            let in_reach = distance <= self.limit && (half_edge == NONE || enters(half_edge, v));
            let known = paths.distance.get(v as usize);
            if in_reach && known.is_some_and(|&known| distance < known) {
                paths.distance[v as usize] = distance;
                paths.arrival[v as usize] = [half_edge, NONE];
                heap.push(Reverse((distance.to_bits(), v)));
            }
        }
        while let Some(Reverse((bits, v))) = heap.pop() {
            let distance = f64::from_bits(bits);
            if distance > paths.distance[v as usize] {
                continue;
            }
            if reached(v) {
                return (paths, Some(v));
            }
            for &Step { half_edge, to } in self.graph.steps(v) {
                let through = distance + self.cost[half_edge as usize];
                let shorter = through < paths.distance[to as usize] && through <= self.limit;
                if shorter && enters(half_edge, to) {
                    paths.distance[to as usize] = through;
                    paths.arrival[to as usize] = [half_edge, v];
                    heap.push(Reverse((through.to_bits(), to)));
                }
            }
        }
        (paths, None)
    }
}

/// Cheapest paths from a set of vertices or half-edges. Of equally cheap ones the first found
/// is kept, in the order of the vertices' numbers.
pub(super) struct CheapestPaths {
    /// For every vertex what the path to it costs; infinite where there is none.
    pub(super) distance: Vec<f64>,
    /// For every vertex the last half-edge and the last vertex before.
    arrival: Vec<[u32; 2]>,
}

impl CheapestPaths {
    /// To all vertices.
    pub(super) fn from(graph: &EdgeGraph, cost: &[f64], sources: &[u32]) -> Self {
        let limit = f64::INFINITY;
        let search = Search { graph, cost, limit };
        search.until(&at(sources), |_, _| true, |_| false).0
    }

    /// The last half-edge of the path to a vertex and the vertex before; none at a source and
    /// where there is no path.
    pub(super) fn arrival(&self, v: u32) -> Option<(u32, u32)> {
        let [half_edge, before] = self.arrival[v as usize];
        (half_edge != NONE).then_some((half_edge, before))
    }

    /// The half-edges of the path to a vertex, from its source on.
    pub(super) fn path_to(&self, v: u32) -> Vec<u32> {
        let mut path = Vec::new();
        let mut at = v;
        while at != NONE
            && let Some((half_edge, before)) = self.arrival(at)
        {
            path.push(half_edge);
            at = before;
        }
        path.reverse();
        path
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_surfaces::{oriented, random_costs};
    use super::*;
    use fam_surface::shapes;

    /// Bellman–Ford.
    fn distances_by_relaxation(topology: &Topology, cost: &[f64], sources: &[u32]) -> Vec<f64> {
        let mut distance = vec![f64::INFINITY; topology.vertices()];
        for &v in sources {
            distance[v as usize] = 0.0;
        }
        for _ in 0..topology.vertices() {
            for h in 0..topology.half_edges() {
                let (a, b) = (topology.origin(h) as usize, topology.target(h) as usize);
                distance[a] = distance[a].min(distance[b] + cost[h as usize]);
                distance[b] = distance[b].min(distance[a] + cost[h as usize]);
            }
        }
        distance
    }

    #[test]
    fn distances_are_those_of_relaxation() {
        let sheet = Topology::oriented(&shapes::rectangle(1.0, 1.0, 9, 7)).topology;
        for seed in 0..5 {
            let cost = random_costs(&sheet, seed);
            let expected = distances_by_relaxation(&sheet, &cost, &[3, 70]);
            for (found, expected) in distances(&sheet, &cost, &[3, 70]).iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_path_is_connected_and_costs_the_distance() {
        let torus = Topology::oriented(&shapes::torus(1.0, 0.4, 24, 12)).topology;
        let cost = random_costs(&torus, 1);
        let far = |v: u32| (100..110).contains(&v);
        let path = cheapest_path(&torus, &cost, &[0, 1], far).unwrap();
        assert!(torus.origin(path[0]) < 2);
        for pair in path.windows(2) {
            assert_eq!(torus.target(pair[0]), torus.origin(pair[1]));
        }
        assert!(far(torus.target(path[path.len() - 1])));
        let all = distances(&torus, &cost, &[0, 1]);
        let nearest = all[100..110].iter().fold(f64::INFINITY, |a, &b| a.min(b));
        let sum: f64 = path.iter().map(|&h| cost[h as usize]).sum();
        assert!((sum - nearest).abs() < 1e-12);
    }

    #[test]
    fn a_forbidden_edge_is_used_only_where_there_is_no_other_way() {
        let (sheet, mut cost) = oriented(&shapes::rectangle(1.0, 1.0, 4, 4));
        let around = |h: u32| [sheet.origin(h), sheet.target(h)].contains(&12);
        for h in 0..sheet.half_edges() {
            if around(h) {
                cost[h as usize] = f64::INFINITY;
            }
        }
        let to_corner = cheapest_path(&sheet, &cost, &[0], |v| v == 24).unwrap();
        assert!(!to_corner.iter().any(|&h| around(h)));
        let to_middle = cheapest_path(&sheet, &cost, &[0], |v| v == 12).unwrap();
        assert_eq!(to_middle.iter().filter(|&&h| around(h)).count(), 1);
        assert_eq!(distances(&sheet, &cost, &[0])[12], f64::INFINITY);
    }

    #[test]
    fn no_way_no_path() {
        let sheet = Topology::oriented(&shapes::rectangle(1.0, 1.0, 2, 2)).topology;
        let cost = vec![1.0; sheet.half_edges() as usize];
        assert_eq!(cheapest_path(&sheet, &cost, &[0], |_| false), None);
        assert_eq!(cheapest_path(&sheet, &cost, &[99], |_| true), None);
        assert_eq!(cheapest_path(&sheet, &cost, &[4], |_| true), Some(vec![]));
    }
}
