//! Moving a branch of a cut to the cheapest path that does the same.

use super::paths::{EdgeGraph, Search, Start};
use super::segments::{Branch, BranchKind};
use super::straightening::Straightening;
use super::{Cut, boundary_vertices};
use crate::patch::topology::{Topology, next};

/// Between two pieces a branch may move as long as each keeps this fraction of its triangles.
const LEAST_PIECE: f64 = 0.5;

/// The cheapest path that does what a branch does, if there is another.
pub(super) fn rerouted(state: &Straightening, branch: &Branch) -> Option<Vec<u32>> {
    let mut rest = state.cut.clone();
    rest.remove(state.topology, &branch.half_edges);
    match branch.kind {
        BranchKind::Leaf => leaf(state, &rest, branch),
        BranchKind::Slit => slit(state, &rest, branch),
        BranchKind::Bridge => bridge(state, &rest, branch),
    }
}

/// From the tip to the nearest vertex of the rest or the boundary.
fn leaf(state: &Straightening, rest: &Cut, branch: &Branch) -> Option<Vec<u32>> {
    let on_rest = rest.vertices(state.topology);
    let tip = Start::At(branch.tip(state.topology));
    let search = state.search(branch.cost(state.cost));
    let (paths, end) = search.until(
        &[tip],
        |_, _| true,
        |v| on_rest[v as usize] || state.boundary[v as usize],
    );
    end.map(|end| paths.path_to(end))
}

/// From tip to tip, along two edges at least: one would leave but two vertices.
fn slit(state: &Straightening, rest: &Cut, branch: &Branch) -> Option<Vec<u32>> {
    let on_rest = rest.vertices(state.topology);
    let free = |v: u32| !on_rest[v as usize] && !state.boundary[v as usize];
    let start = Start::At(branch.root(state.topology));
    let end = branch.tip(state.topology);
    let search = state.search(branch.cost(state.cost));
    let (paths, end) = search.until(&[start], |_, v| free(v), |v| v == end);
    let path = end.map(|end| paths.path_to(end));
    path.filter(|path| path.len() > 1)
}

/// Without the branch, its ends lie on two boundary loops of one piece, or on one loop that it
/// cuts in two. In the first case any path from loop to loop will do.
fn bridge(state: &Straightening, rest: &Cut, branch: &Branch) -> Option<Vec<u32>> {
    let topology = state.topology;
    let root = *branch.half_edges.first()?;
    let tip = topology.twin(*branch.half_edges.last()?)?;
    let start = boundary_loop(topology, rest, root)?;
    let end = boundary_loop(topology, rest, tip)?;
    let mut side = vec![Side::Neither; topology.half_edges() as usize];
    for &h in &start {
        side[h as usize] = Side::Start;
    }
    if side[tip as usize] == Side::Start {
        return between_pieces(state, rest, branch);
    }
    for &h in &end {
        side[h as usize] = Side::End;
    }
    let mut on_rest = rest.vertices(topology);
    for (on_rest, boundary) in on_rest.iter_mut().zip(&state.boundary) {
        *on_rest |= boundary;
    }
    let is_open = |h: u32| !rest.contains(h) && topology.twin(h).is_some();
    let starts: Vec<Start> = start
        .into_iter()
        .filter(|&h| is_open(h))
        .map(|h| Start::Along(h, topology.target(h)))
        .collect();
    let arrives = |h: u32| {
        let back = topology.twin(h);
        back.is_some_and(|back| side[back as usize] == Side::End)
    };
    let search = state.search(branch.cost(state.cost));
    let (paths, found) = search.until(
        &starts,
        |h, v| !on_rest[v as usize] || arrives(h),
        |v| on_rest[v as usize],
    );
    found.map(|v| paths.path_to(v))
}

/// The loop from which a half-edge leaves.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Start,
    End,
    Neither,
}

/// The half-edges that leave the boundary loop, of the surface opened along `cut`, on which
/// `leaving` starts; those of the loop are among them. `None` if it starts in the interior.
fn boundary_loop(topology: &Topology, cut: &Cut, leaving: u32) -> Option<Vec<u32>> {
    let across = |h: u32| topology.twin(h).filter(|_| !cut.contains(h));
    let mut start = leaving;
    while let Some(twin) = across(start) {
        start = next(twin);
        if start == leaving {
            return None;
        }
    }
    let mut all = vec![start];
    let mut edge = start;
    loop {
        let mut h = next(edge);
        while let Some(twin) = across(h) {
            all.push(h);
            h = next(twin);
        }
        if h == start {
            return Some(all);
        }
        all.push(h);
        edge = h;
    }
}

/// Between the same ends, if both pieces keep enough of their triangles.
fn between_pieces(state: &Straightening, rest: &Cut, branch: &Branch) -> Option<Vec<u32>> {
    let before = sides(state.topology, &state.cut, branch.half_edges[0])?;
    let opened = rest.open(state.topology).topology;
    let boundary = boundary_vertices(&opened);
    let end = branch.tip(&opened);
    let search = Search {
        graph: &EdgeGraph::of(&opened),
        ..state.search(branch.cost(state.cost))
    };
    let start = Start::At(branch.root(&opened));
    let inside = |v: u32| !boundary[v as usize] || v == end;
    let (paths, found) = search.until(&[start], |_, v| inside(v), |v| v == end);
    let path = paths.path_to(found?);
    let mut cut = rest.clone();
    cut.add(state.topology, &path);
    let after = sides(state.topology, &cut, *path.first()?)?;
    let enough = |side: usize| after[side] as f64 >= LEAST_PIECE * before[side] as f64;
    (enough(0) && enough(1)).then_some(path)
}

/// How many triangles the pieces left and right of a half-edge have, if they are two.
fn sides(topology: &Topology, cut: &Cut, h: u32) -> Option<[usize; 2]> {
    let (piece, _) = cut.open(topology).topology.pieces();
    let sides = [h, topology.twin(h)?].map(|h| piece[h as usize / 3]);
    let size = |side: u32| piece.iter().filter(|&&other| other == side).count();
    (sides[0] != sides[1]).then(|| sides.map(size))
}
