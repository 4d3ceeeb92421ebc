//! Points and vectors of the plane.

use robust::Coord;

pub(super) type Point = [f64; 2];

pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

/// a + t · d.
pub(super) fn along(a: Point, t: f64, d: Point) -> Point {
    [a[0] + t * d[0], a[1] + t * d[1]]
}

pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(super) fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(super) fn length(a: Point) -> f64 {
    a[0].hypot(a[1])
}

/// Positive exactly if a, b, c lie counter-clockwise, 0 exactly if on a line.
pub(super) fn orientation(a: Point, b: Point, c: Point) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    robust::orient2d(a, b, c)
}
