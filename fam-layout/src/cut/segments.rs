//! A cut taken apart into branches.

use super::{Cut, boundary_vertices};
use crate::patch::topology::Topology;

/// A part of a cut between two nodes: vertices where other than two cut edges meet, or on the
/// boundary.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Branch {
    /// Its half-edges in order, each running onwards; for a leaf from the root to the tip.
    pub half_edges: Vec<u32>,
    /// How it hangs together with the rest.
    pub kind: BranchKind,
}

/// How a branch hangs together with the rest of the cut and the boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BranchKind {
    /// At one end only. It can be shortened from its tip, or left out; the surface stays as
    /// connected as it was, and has as many holes.
    Leaf,
    /// At both ends, or closed in itself.
    Bridge,
    /// At neither end: the whole of its part of the cut.
    Slit,
}

impl Branch {
    /// The vertex where it starts.
    pub fn root(&self, topology: &Topology) -> u32 {
        topology.origin(self.half_edges[0])
    }

    /// The vertex where it ends.
    pub fn tip(&self, topology: &Topology) -> u32 {
        topology.target(self.half_edges[self.half_edges.len() - 1])
    }

    /// What its edges cost together.
    pub fn cost(&self, cost: &[f64]) -> f64 {
        self.half_edges.iter().map(|&h| cost[h as usize]).sum()
    }
}

/// The branches of a cut, every edge in one of them. Vertices for which `pinned` holds are
/// nodes as well.
pub fn branches(topology: &Topology, cut: &Cut, pinned: impl Fn(u32) -> bool) -> Vec<Branch> {
    let boundary = boundary_vertices(topology);
    let graph = CutGraph::of(topology, cut);
    let is_node = |v: u32| boundary[v as usize] || pinned(v) || graph.leaving(v).len() != 2;
    let is_tip = |v: u32| !boundary[v as usize] && graph.leaving(v).len() == 1;
    let mut seen = Cut::none(topology);
    let mut branches = Vec::new();
    let from_nodes = graph.leaving.iter().filter(|&&(v, _)| is_node(v));
    // Closed branches without a node come last.
    for &(_, start) in from_nodes.chain(&graph.leaving) {
        if seen.contains(start) {
            continue;
        }
        let half_edges = graph.follow(topology, start, is_node);
        seen.add(topology, &half_edges);
        let mut branch = Branch {
            half_edges,
            kind: BranchKind::Bridge,
        };
        let tips = (is_tip(branch.root(topology)), is_tip(branch.tip(topology)));
        branch.kind = match tips {
            (true, true) => BranchKind::Slit,
            (false, false) => BranchKind::Bridge,
            _ => BranchKind::Leaf,
        };
        if tips == (true, false) {
            branch.half_edges = reversed(topology, &branch.half_edges);
        }
        branches.push(branch);
    }
    branches
}

/// What of a cut can be closed from an end, each running towards it: leaves and slits from their
/// tips, and bridges from where they end on the boundary, which makes leaves of them. What has
/// two such ends is there both ways.
pub fn closable(topology: &Topology, cut: &Cut) -> Vec<Branch> {
    let boundary = boundary_vertices(topology);
    let ways = |branch: Branch| {
        let back = Branch {
            half_edges: reversed(topology, &branch.half_edges),
            kind: branch.kind,
        };
        let may = |way: &Branch| match way.kind {
            BranchKind::Leaf => way.half_edges[0] == branch.half_edges[0],
            BranchKind::Bridge => boundary[way.tip(topology) as usize],
            BranchKind::Slit => true,
        };
        let both = [may(&branch), may(&back)];
        let ways = [branch, back].into_iter().zip(both);
        ways.filter_map(|(way, may)| may.then_some(way))
    };
    branches(topology, cut, |_| false)
        .into_iter()
        .flat_map(ways)
        .collect()
}

/// The half-edges of a path the other way.
fn reversed(topology: &Topology, path: &[u32]) -> Vec<u32> {
    let back = path.iter().rev();
    back.filter_map(|&h| topology.twin(h)).collect()
}

/// The cut half-edges by the vertices that they leave.
pub(super) struct CutGraph {
    /// Sorted.
    leaving: Vec<(u32, u32)>,
}

impl CutGraph {
    pub(super) fn of(topology: &Topology, cut: &Cut) -> Self {
        let mut leaving: Vec<(u32, u32)> =
            cut.half_edges().map(|h| (topology.origin(h), h)).collect();
        leaving.sort_unstable();
        Self { leaving }
    }

    /// The vertices on the cut, ascending, each with the half-edges that leave it.
    pub(super) fn vertices(&self) -> impl Iterator<Item = &[(u32, u32)]> {
        self.leaving.chunk_by(|a, b| a.0 == b.0)
    }

    /// The cut half-edges that leave a vertex, each after the vertex.
    pub(super) fn leaving(&self, v: u32) -> &[(u32, u32)] {
        let start = self.leaving.partition_point(|&(other, _)| other < v);
        let count = self.leaving[start..].partition_point(|&(other, _)| other == v);
        &self.leaving[start..start + count]
    }

    /// The half-edges from `start` on up to a vertex where `ends` holds, or around to `start`.
    pub(super) fn follow(
        &self,
        topology: &Topology,
        start: u32,
        ends: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        let mut path = vec![start];
        let mut last = start;
        loop {
            let v = topology.target(last);
            let onwards = self.leaving(v).iter().map(|&(_, h)| h);
            let next = onwards
                .into_iter()
                .find(|&h| topology.twin(h) != Some(last));
            match next {
                Some(h) if !ends(v) && h != start => path.push(h),
                _ => return path,
            }
            last = path[path.len() - 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    /// Columns and rows of nine vertices, numbered one column after the other from the third
    /// on, with a path through some of them.
    fn sheet_with(paths: &[&[[u32; 2]]]) -> (Topology, Cut) {
        let sheet = Topology::oriented(&shapes::rectangle(8.0, 8.0, 8, 8)).topology;
        let mut cut = Cut::none(&sheet);
        for pair in paths.iter().flat_map(|path| path.windows(2)) {
            let [from, to] = [pair[0], pair[1]].map(|[row, column]| 9 * column + row);
            let along: Vec<u32> = (0..sheet.half_edges())
                .filter(|&h| sheet.origin(h) == from && sheet.target(h) == to)
                .collect();
            assert!(!along.is_empty());
            cut.add(&sheet, &along);
        }
        (sheet, cut)
    }

    fn summary(topology: &Topology, branches: &[Branch]) -> Vec<(BranchKind, u32, u32, usize)> {
        for branch in branches {
            for pair in branch.half_edges.windows(2) {
                assert_eq!(topology.target(pair[0]), topology.origin(pair[1]));
            }
        }
        let one = |b: &Branch| {
            (
                b.kind,
                b.root(topology),
                b.tip(topology),
                b.half_edges.len(),
            )
        };
        branches.iter().map(one).collect()
    }

    #[test]
    fn a_fork_from_the_boundary_has_one_bridge_and_two_leaves() {
        let (sheet, cut) =
            sheet_with(&[&[[0, 4], [1, 4], [2, 4], [3, 4]], &[[2, 4], [2, 5], [2, 6]]]);
        let found = summary(&sheet, &branches(&sheet, &cut, |_| false));
        let fork = 9 * 4 + 2;
        assert_eq!(
            found,
            [
                (BranchKind::Bridge, 36, fork, 2),
                (BranchKind::Leaf, fork, fork + 1, 1),
                (BranchKind::Leaf, fork, fork + 18, 2),
            ]
        );
    }

    #[test]
    fn a_cut_that_touches_the_boundary_has_a_node_there() {
        let (sheet, cut) = sheet_with(&[&[[1, 4], [0, 4]], &[[0, 4], [1, 5], [2, 5]]]);
        let found = summary(&sheet, &branches(&sheet, &cut, |_| false));
        assert_eq!(
            found,
            [(BranchKind::Leaf, 36, 37, 1), (BranchKind::Leaf, 36, 47, 2)]
        );
    }

    #[test]
    fn slits_loops_and_pinned_vertices() {
        let (sheet, slit) = sheet_with(&[&[[2, 2], [3, 2], [4, 2]]]);
        let found = summary(&sheet, &branches(&sheet, &slit, |_| false));
        assert_eq!(found, [(BranchKind::Slit, 20, 22, 2)]);
        let found = summary(&sheet, &branches(&sheet, &slit, |v| v == 21));
        assert_eq!(
            found,
            [(BranchKind::Leaf, 21, 20, 1), (BranchKind::Leaf, 21, 22, 1)]
        );
        let around = [
            [2, 2],
            [3, 2],
            [4, 2],
            [4, 3],
            [4, 4],
            [3, 4],
            [2, 4],
            [2, 3],
            [2, 2],
        ];
        let (sheet, closed) = sheet_with(&[&around]);
        let found = summary(&sheet, &branches(&sheet, &closed, |_| false));
        assert_eq!(found, [(BranchKind::Bridge, 20, 20, 8)]);
        let (sheet, lasso) = sheet_with(&[&around, &[[4, 4], [5, 5], [6, 5]]]);
        let found = summary(&sheet, &branches(&sheet, &lasso, |_| false));
        assert_eq!(
            found,
            [
                (BranchKind::Bridge, 40, 40, 8),
                (BranchKind::Leaf, 40, 51, 2)
            ]
        );
    }

    #[test]
    fn bridges_are_closed_from_the_boundary_and_leaves_from_their_tips() {
        let (sheet, fork) =
            sheet_with(&[&[[0, 4], [1, 4], [2, 4], [3, 4]], &[[2, 4], [2, 5], [2, 6]]]);
        let found = summary(&sheet, &closable(&sheet, &fork));
        let at = 9 * 4 + 2;
        assert_eq!(
            found,
            [
                (BranchKind::Bridge, at, 36, 2),
                (BranchKind::Leaf, at, at + 1, 1),
                (BranchKind::Leaf, at, at + 18, 2),
            ]
        );
        let across: Vec<[u32; 2]> = (0..9).map(|row| [row, 4]).collect();
        let (sheet, across) = sheet_with(&[&across]);
        let found = summary(&sheet, &closable(&sheet, &across));
        assert_eq!(
            found,
            [
                (BranchKind::Bridge, 36, 44, 8),
                (BranchKind::Bridge, 44, 36, 8)
            ]
        );
        let (sheet, slit) = sheet_with(&[&[[2, 2], [3, 2], [4, 2]]]);
        let found = summary(&sheet, &closable(&sheet, &slit));
        assert_eq!(
            found,
            [(BranchKind::Slit, 20, 22, 2), (BranchKind::Slit, 22, 20, 2)]
        );
    }

    #[test]
    fn no_cut_no_branches() {
        let (sheet, cut) = sheet_with(&[]);
        assert_eq!(branches(&sheet, &cut, |_| false), []);
    }
}
