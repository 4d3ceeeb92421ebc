//! Triangles on the surface of a body that a function describes: it is below zero inside and
//! above zero outside.
//!
//! The function should be smooth and grow about as fast as the distance from the surface does.
//! Features that are thinner than two or three times the spacing get lost.

mod clip;
mod nets;
mod relax;

use super::fields::Point;
use crate::TriangleMesh;
use crate::vector::{add, dot, length, scale, sub};

/// Side of a cell of the sampling grid over the mean edge length that it leads to: measured.
const CELL: f64 = 1.1;

/// Rounds of moving vertices and turning edges: more change little.
const ROUNDS: usize = 12;

/// Steps in which a body grows its folds: the surface moves less than the spacing in each.
const GROWTH: u32 = 24;

/// Triangles while they are being made.
struct Net {
    positions: Vec<Point>,
    triangles: Vec<[u32; 3]>,
}

/// The whole surface of a body, with edges about `spacing` long. The body lies in the box
/// between two corners, and its surface is not empty.
pub(super) fn closed(
    body: &dyn Fn(Point) -> f64,
    corners: [Point; 2],
    spacing: f64,
) -> TriangleMesh {
    let mut net = nets::net(body, corners, CELL * spacing);
    relax::relax(&mut net, body, &|_| 0.0, spacing, ROUNDS);
    mesh(net)
}

/// As [`closed`], for a body with folds too narrow for the grid: `body` is simple at 0, where
/// the net is laid, and grows its folds until 1 while the net follows. Both have the same genus.
pub(super) fn grown(
    body: &dyn Fn(f64, Point) -> f64,
    corners: [Point; 2],
    spacing: f64,
) -> TriangleMesh {
    let mut net = nets::net(&|at| body(0.0, at), corners, CELL * spacing);
    let nowhere = |_| 0.0;
    for step in 0..=GROWTH {
        let share = f64::from(step) / f64::from(GROWTH);
        relax::relax(&mut net, &|at| body(share, at), &nowhere, spacing, 1);
    }
    relax::relax(&mut net, &|at| body(1.0, at), &nowhere, spacing, ROUNDS);
    mesh(net)
}

/// The part of the surface of a body where `outside` is below zero. Its boundary lies where
/// both functions are zero.
pub(super) fn open(
    body: &dyn Fn(Point) -> f64,
    outside: &dyn Fn(Point) -> f64,
    corners: [Point; 2],
    spacing: f64,
) -> TriangleMesh {
    let mut net = nets::net(body, corners, CELL * spacing);
    relax::relax(&mut net, body, outside, spacing, ROUNDS);
    let mut net = clip::clip(&net, body, outside, spacing);
    relax::relax(&mut net, body, outside, spacing, ROUNDS);
    mesh(net)
}

fn mesh(net: Net) -> TriangleMesh {
    TriangleMesh::new(net.positions, net.triangles).expect("the surface of a body is a valid mesh")
}

/// The value of a function, and how fast and whereto it grows.
fn slope(function: &dyn Fn(Point) -> f64, at: Point, spacing: f64) -> (f64, Point) {
    let step = DIFFERENCE * spacing;
    let value = function(at);
    let gradient = [0, 1, 2].map(|k| {
        let mut ahead = at;
        ahead[k] += step;
        (function(ahead) - value) / step
    });
    (value, gradient)
}

/// A point near `at` where the function is zero; it moves at most half the spacing in a step.
fn onto(function: &dyn Fn(Point) -> f64, mut at: Point, spacing: f64) -> Point {
    for _ in 0..STEPS {
        let (value, gradient) = slope(function, at, spacing);
        let square = dot(gradient, gradient).max(FLATTEST);
        at = add(at, limited(scale(gradient, -value / square), spacing));
    }
    at
}

/// A point near `at` where both functions are zero; it moves as in [`onto`].
fn onto_both(functions: [&dyn Fn(Point) -> f64; 2], mut at: Point, spacing: f64) -> Point {
    for _ in 0..STEPS {
        let [(f, a), (g, b)] = functions.map(|function| slope(function, at, spacing));
        let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
        let determinant = (aa * bb - ab * ab).max(FLATTEST);
        let step = add(
            scale(a, (ab * g - bb * f) / determinant),
            scale(b, (ab * f - aa * g) / determinant),
        );
        at = add(at, limited(step, spacing));
    }
    at
}

/// Newton's steps on the way to zero: the error is squared in each.
const STEPS: usize = 2;

/// Width of a difference in spacings: far above rounding, far below any bend.
const DIFFERENCE: f64 = 1e-3;

/// Squared slopes below this count as this, so that nothing is divided by zero.
const FLATTEST: f64 = 1e-6;

/// A step, shortened to half the spacing if it is longer.
fn limited(step: Point, spacing: f64) -> Point {
    let longest = 0.5 * spacing;
    scale(step, (longest / length(step).max(longest)).min(1.0))
}

/// The cosine of the angle at `at` between two points.
fn cosine(at: Point, [one, other]: [Point; 2]) -> f64 {
    let (a, b) = (sub(one, at), sub(other, at));
    dot(a, b) / (length(a) * length(b)).max(f64::MIN_POSITIVE)
}
