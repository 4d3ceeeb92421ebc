//! Better triangles over the same surface: edges turn to where they leave the wider angles, and
//! vertices move towards the middle of their neighbours along the surface.

use std::collections::HashSet;

use super::{Net, cosine, onto, onto_both, slope};
use crate::orientation::{NONE, across, next};
use crate::shapes::fields::Point;
use crate::vector::{add, cross, dot, length, normalize, scale, sub};

/// How far a vertex moves towards the middle of its neighbours in one round.
const SHARE: f64 = 0.6;

/// An edge turns only where the new triangles are within 60 degrees of the old ones together.
const FLAT: f64 = 0.5;

/// Improves a net over a body, whose boundary, if it has one, lies where `outside` is zero.
pub(super) fn relax(
    net: &mut Net,
    body: &dyn Fn(Point) -> f64,
    outside: &dyn Fn(Point) -> f64,
    spacing: f64,
    rounds: usize,
) {
    for _ in 0..rounds {
        turn_edges(net);
        move_vertices(net, body, outside, spacing);
    }
    turn_edges(net);
}

/// Turns every edge whose opposite angles are more than half a turn together.
fn turn_edges(net: &mut Net) {
    let mut across = across(&net.triangles);
    let mut known: HashSet<[u32; 2]> = net
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(sorted)
        .collect();
    for h in 0..across.len() as u32 {
        let g = across[h as usize];
        if g == NONE {
            continue;
        }
        let corner = |h: u32| net.triangles[h as usize / 3][h as usize % 3];
        let place = |v: u32| net.positions[v as usize];
        // The edge runs from a to b; c and d are across from it.
        let [a, b, c, d] = [h, next(h), next(next(h)), next(next(g))].map(corner);
        let ends = [place(a), place(b)];
        // Cosines of two angles sum to less than zero where the angles are beyond half a turn.
        let wide = cosine(place(c), ends) + cosine(place(d), ends) < -1e-9;
        let area = |[a, b, c]: [u32; 3]| cross(sub(place(b), place(a)), sub(place(c), place(a)));
        let turned = [[d, b, c], [c, a, d]];
        let before = normalize(add(area([a, b, c]), area([b, a, d])));
        let folds = turned.map(|t| dot(normalize(area(t)), before) < FLAT);
        if !wide || known.contains(&sorted([c, d])) || folds != [false; 2] {
            continue;
        }
        known.remove(&sorted([a, b]));
        known.insert(sorted([c, d]));
        let [bc, ca] = [next(h), next(next(h))].map(|h| across[h as usize]);
        let [ad, db] = [next(g), next(next(g))].map(|g| across[g as usize]);
        let (one, other) = (h - h % 3, g - g % 3);
        net.triangles[one as usize / 3] = turned[0];
        net.triangles[other as usize / 3] = turned[1];
        let mut pair = |h: u32, g: u32| {
            across[h as usize] = g;
            if g != NONE {
                across[g as usize] = h;
            }
        };
        pair(one, db);
        pair(one + 1, bc);
        pair(one + 2, other + 2);
        pair(other, ca);
        pair(other + 1, ad);
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Moves every vertex towards the middle of its neighbours, those far away counting for more, so
/// that vertices go where the net is stretched, and back onto the surface; those of
/// the boundary stay on it.
fn move_vertices(
    net: &mut Net,
    body: &dyn Fn(Point) -> f64,
    outside: &dyn Fn(Point) -> f64,
    spacing: f64,
) {
    let across = across(&net.triangles);
    let count = net.positions.len();
    let mut sums = [vec![([0.0; 3], 0.0); count], vec![([0.0; 3], 0.0); count]];
    for h in 0..across.len() as u32 {
        let at = |h: u32| net.triangles[h as usize / 3][h as usize % 3] as usize;
        let (a, b) = (at(h), at(next(h)));
        // A vertex of the boundary has its neighbours along the boundary only.
        let kind = usize::from(across[h as usize] == NONE);
        for (v, w) in [(a, b), (b, a)] {
            let (sum, weight) = &mut sums[kind][v];
            let away = sub(net.positions[w], net.positions[v]);
            // Along a boundary, far neighbours would make vertices swing to and fro.
            let share = if kind == 0 { length(away) } else { 1.0 };
            *sum = add(*sum, scale(away, share));
            *weight += share;
        }
    }
    let [inner, outer] = sums;
    for v in 0..count {
        let at = net.positions[v];
        let on_boundary = outer[v].1 > 0.0;
        let (sum, weight) = if on_boundary { outer[v] } else { inner[v] };
        let mut way = scale(sum, SHARE / weight.max(f64::MIN_POSITIVE));
        if on_boundary {
            net.positions[v] = onto_both([body, outside], add(at, way), spacing);
        } else {
            let normal = normalize(slope(body, at, spacing).1);
            way = sub(way, scale(normal, dot(way, normal)));
            net.positions[v] = onto(body, add(at, way), spacing);
        }
    }
}
