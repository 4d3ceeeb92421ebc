use std::ops::ControlFlow;

use crate::finish::topology::{Topology, previous};

use super::Boundary;
use super::plane::{Point, along, cross, dot, length, minus, orientation};

/// How far the sides of a slit move off it, as a fraction of the length of the edges there.
const OPENING: f64 = 0.05;

/// What a vertex may move of the way to where a triangle of its would collapse.
const SAFETY: f64 = 0.25;

/// How often a move is halved at most; less than its last length is lost in rounding.
const HALVINGS: usize = 40;

/// The sides of a cut cannot be moved apart: the layout had collapsed or overlapping parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the sides of a cut cannot be moved apart")]
pub(crate) struct SlitsStuck;

/// Moves the two sides of closed slits apart, so that the boundary is simple.
///
/// A layout that was injective keeps its UVs when it is cut, so that the vertices on both
/// sides of the cuts coincide. Each of them moves a little into the triangles around it, and
/// less where a triangle would flip or edges would meet. `boundary` is that of `topology`,
/// `source` has the vertex before the cut (see [`crate::finish::topology::Opened`]) and `uv`
/// the position for each of its vertices. On an error the UVs are as they were.
pub(crate) fn open_slits(
    topology: &Topology,
    source: &[u32],
    boundary: &Boundary,
    uv: &mut [Point],
) -> Result<(), SlitsStuck> {
    let closed = uv.to_vec();
    let mut moves = moves(topology, source, boundary, uv);
    for _ in 0..HALVINGS {
        for (i, step) in moves.iter().enumerate() {
            let v = boundary.vertices[i] as usize;
            uv[v] = along(closed[v], step.length, step.direction);
        }
        let stuck = stuck(topology, boundary, uv, &moves);
        if stuck.is_empty() {
            if boundary.is_simple(uv) {
                return Ok(());
            }
            break;
        }
        if stuck.iter().all(|&i| moves[i].length == 0.0) {
            break;
        }
        for i in stuck {
            moves[i].length *= 0.5;
        }
    }
    uv.copy_from_slice(&closed);
    Err(SlitsStuck)
}

#[derive(Clone, Copy)]
struct Move {
    direction: Point,
    length: f64,
}

/// A move for every boundary vertex; without length for those that are on no closed slit.
fn moves(topology: &Topology, source: &[u32], boundary: &Boundary, uv: &[Point]) -> Vec<Move> {
    let mut by_source: Vec<(u32, usize)> = (0..boundary.vertices.len())
        .map(|i| (source[boundary.vertices[i] as usize], i))
        .collect();
    by_source.sort_unstable();
    let mut moves = vec![
        Move {
            direction: [0.0; 2],
            length: 0.0,
        };
        by_source.len()
    ];
    for copies in by_source.chunk_by(|a, b| a.0 == b.0) {
        for &(_, i) in copies {
            let here = boundary.point(uv, i);
            let coincides = |&(_, j): &(u32, usize)| i != j && boundary.point(uv, j) == here;
            if copies.iter().any(coincides) {
                moves[i] = inward(topology, boundary, uv, i);
            }
        }
    }
    moves
}

/// The move of a boundary vertex along the bisector of its fan.
fn inward(topology: &Topology, boundary: &Boundary, uv: &[Point], i: usize) -> Move {
    let h = boundary.half_edges[i];
    let here = boundary.point(uv, i);
    let spokes = |g: u32| {
        [topology.target(g), topology.origin(previous(g))].map(|v| minus(uv[v as usize], here))
    };
    let fan: Vec<[Point; 2]> = topology.fan(h).into_iter().map(spokes).collect();
    let angle: f64 = fan.iter().map(|&[x, y]| cross(x, y).atan2(dot(x, y))).sum();
    let (sin, cos) = (0.5 * angle).sin_cos();
    // The fan runs clockwise and ends at the edge that leaves along the boundary.
    let [[first, _], [_, last]] = [fan[fan.len() - 1], fan[0]];
    let shortest = length(first).min(length(last));
    let direction = [
        (cos * first[0] - sin * first[1]) / length(first),
        (sin * first[0] + cos * first[1]) / length(first),
    ];
    let collapse = fan.iter().filter_map(|&[x, y]| {
        let rate = cross(direction, minus(y, x));
        (rate > 0.0).then(|| cross(x, y) / rate)
    });
    let wanted = OPENING * boundary.scales[i].min(shortest) / sin.max(0.5);
    let length = collapse.fold(wanted, |least, t| least.min(SAFETY * t));
    Move { direction, length }
}

/// The boundary vertices of triangles that are not positive and of edges that meet.
fn stuck(topology: &Topology, boundary: &Boundary, uv: &[Point], moves: &[Move]) -> Vec<usize> {
    let mut stuck = Vec::new();
    for i in (0..moves.len()).filter(|&i| moves[i].length > 0.0) {
        let is_negative = |g: &u32| {
            let [a, b, c] = topology.triangles()[*g as usize / 3].map(|v| uv[v as usize]);
            orientation(a, b, c) <= 0.0
        };
        if topology.fan(boundary.half_edges[i]).iter().any(is_negative) {
            stuck.push(i);
        }
    }
    let _: ControlFlow<()> = boundary.for_each_touching_pair(uv, |i, j| {
        stuck.extend([i, j].iter().flat_map(|&i| [i, boundary.next(i)]));
        ControlFlow::Continue(())
    });
    stuck.sort_unstable();
    stuck.dedup();
    stuck
}
