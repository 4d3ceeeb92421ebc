//! Tubes of round cross-section along curves.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::fields::Point;
use super::grid::grid;
use super::hilbert::hilbert_curve;
use super::sizes::within;
use crate::TriangleMesh;
use crate::vector::{add, cross, dot, length, normalize, scale, sub};

/// Most squares of a tube: what is finer than this allows gets coarser, and the mesh stays below
/// some ten million triangles.
const MOST: f64 = 5e6;

/// A trefoil knot tied of a tube of the given radius: closed, genus 1. The curve fills about
/// 5 × 5.3 × 2; tubes of a radius up to 0.6 do not touch themselves. A radius that is no number
/// or outside 0.05 to 0.6 becomes the next in there. Edges are about `spacing` long; a spacing
/// above the radius counts as the radius.
pub fn knot(radius: f64, spacing: f64) -> TriangleMesh {
    let radius = within(radius, 0.05, 0.6);
    let point = |t: f64| {
        [
            t.sin() + 2.0 * (2.0 * t).sin(),
            t.cos() - 2.0 * (2.0 * t).cos(),
            -(3.0 * t).sin(),
        ]
    };
    // A fine polyline, to measure along.
    const FINE: u32 = 20_000;
    let fine: Vec<Point> = (0..=FINE)
        .map(|i| point(TAU * f64::from(i) / f64::from(FINE)))
        .collect();
    let mut ways = vec![0.0];
    for ends in fine.windows(2) {
        ways.push(ways[ways.len() - 1] + length(sub(ends[1], ends[0])));
    }
    let total = ways[FINE as usize];
    let spacing = fitting(spacing, radius, total);
    let steps = squares(total, spacing);
    let centres = (0..steps).map(|i| {
        let way = total * f64::from(i) / f64::from(steps);
        let after = ways.partition_point(|&w| w <= way).min(FINE as usize);
        let share = (way - ways[after - 1]) / (ways[after] - ways[after - 1]);
        point(TAU * (after as f64 - 1.0 + share) / f64::from(FINE))
    });
    let mut centres: Vec<Point> = centres.collect();
    centres.push(centres[0]);
    let tangents: Vec<Point> = (0..=steps)
        .map(|i| {
            let [ahead, behind] = [i + 1, i + steps - 1].map(|j| centres[(j % steps) as usize]);
            normalize(sub(ahead, behind))
        })
        .collect();
    tube(&centres, &tangents, radius, spacing, true)
}

/// A tube along a Hilbert curve of the given order, that passes the 8^order points of a cubic
/// grid 1 apart: a long cylinder, rolled up to fill a cube, open at both ends. It turns in
/// quarter circles of radius 0.5. An order outside 1 to 4, and a radius that is no number or
/// outside 0.05 to 0.45, become the next in there: thicker tubes touch themselves. Edges are
/// about `spacing` long, on the inside of the bends shorter and on the outside longer; a spacing
/// above the radius counts as the radius.
pub fn hilbert_tube(order: u32, radius: f64, spacing: f64) -> TriangleMesh {
    let radius = within(radius, 0.05, 0.45);
    let points = hilbert_curve(order.clamp(1, 4));
    // Through the cell of each point the curve runs straight or in a quarter circle, from the
    // middle of its way in to the middle of its way out; through the first and the last half.
    let mut spans = Vec::new();
    for i in 0..points.len() {
        let ways = [
            (i > 0).then(|| sub(points[i], points[i.max(1) - 1])),
            points.get(i + 1).map(|&p| sub(p, points[i])),
        ];
        spans.push(match ways {
            [Some(a), Some(b)] => Span::through(points[i], a, b),
            [None, Some(b)] => Span::straight(points[i], b, 0.5),
            [Some(a), None] => Span::straight(sub(points[i], scale(a, 0.5)), a, 0.5),
            [None, None] => continue,
        });
    }
    let total: f64 = spans.iter().map(|s| s.length).sum();
    let spacing = fitting(spacing, radius, total);
    let steps = squares(total, spacing);
    let mut centres = Vec::new();
    let mut tangents = Vec::new();
    let (mut span, mut start) = (0, 0.0);
    for i in 0..=steps {
        let way = total * f64::from(i) / f64::from(steps);
        while span + 1 < spans.len() && way > start + spans[span].length {
            start += spans[span].length;
            span += 1;
        }
        let (centre, tangent) = spans[span].at(way - start);
        centres.push(centre);
        tangents.push(tangent);
    }
    tube(&centres, &tangents, radius, spacing, false)
}

/// A piece of a curve: straight, or a quarter circle of radius 0.5 from one direction to another
/// that is at right angles to it.
struct Span {
    start: Point,
    from: Point,
    /// The same as `from` where it is straight.
    to: Point,
    length: f64,
}

impl Span {
    fn straight(start: Point, along: Point, length: f64) -> Self {
        let [from, to] = [along; 2];
        Self {
            start,
            from,
            to,
            length,
        }
    }

    /// Half a unit along `from` to a point, half a unit along `to` away from it, the corner cut.
    fn through(point: Point, from: Point, to: Point) -> Self {
        let start = sub(point, scale(from, 0.5));
        let length = if from == to { 1.0 } else { 0.5 * FRAC_PI_2 };
        Self {
            start,
            from,
            to,
            length,
        }
    }

    /// The point and the direction after so much of its length.
    fn at(&self, way: f64) -> (Point, Point) {
        if self.from == self.to {
            return (add(self.start, scale(self.from, way)), self.from);
        }
        let (sin, cos) = (2.0 * way).sin_cos();
        let moved = add(
            scale(self.from, 0.5 * sin),
            scale(self.to, 0.5 * (1.0 - cos)),
        );
        let tangent = add(scale(self.from, cos), scale(self.to, sin));
        (add(self.start, moved), tangent)
    }
}

/// A spacing that goes with a tube; the radius for what is no number.
fn fitting(spacing: f64, radius: f64, length: f64) -> f64 {
    spacing
        .min(radius)
        .max((TAU * radius * length / MOST).sqrt())
}

/// How many squares of side `spacing` fit a length.
fn squares(length: f64, spacing: f64) -> u32 {
    (length / spacing).round() as u32
}

/// A tube around centres with unit tangents. If it is closed, the last centre is the first one
/// again.
fn tube(
    centres: &[Point],
    tangents: &[Point],
    radius: f64,
    spacing: f64,
    is_closed: bool,
) -> TriangleMesh {
    let steps = centres.len() - 1;
    // A normal that turns about the curve as little as can be.
    let mut normals = vec![any_normal(tangents[0])];
    for ends in tangents.windows(2) {
        let last = normals[normals.len() - 1];
        normals.push(rotated(last, ends[0], ends[1]));
    }
    // Where the ends meet, their normals should as well: the difference is spread over the way.
    let twist = if is_closed {
        let (first, last) = (normals[0], normals[steps]);
        let side = cross(tangents[0], last);
        dot(first, side).atan2(dot(first, last))
    } else {
        0.0
    };
    let around = squares(TAU * radius, spacing);
    let along = steps as u32;
    grid(along, around, [is_closed, true], |s, t| {
        let i = (s * f64::from(along)).round() as usize;
        let angle = TAU * t - twist * s;
        let sideways = cross(normals[i], tangents[i]);
        let out = add(scale(normals[i], angle.cos()), scale(sideways, angle.sin()));
        add(centres[i], scale(out, radius))
    })
}

/// A unit vector at right angles to another.
fn any_normal(tangent: Point) -> Point {
    let smallest = (0..3).min_by(|&a, &b| tangent[a].abs().total_cmp(&tangent[b].abs()));
    let mut axis = [0.0; 3];
    axis[smallest.unwrap_or(0)] = 1.0;
    normalize(cross(tangent, axis))
}

/// A vector after the shortest turn that takes one unit vector to another.
fn rotated(v: Point, from: Point, to: Point) -> Point {
    // Two mirrors: one swaps `from` with its opposite, the other that with `to`.
    let mirrored = sub(v, scale(from, 2.0 * dot(v, from)));
    let between = normalize(add(from, to));
    sub(mirrored, scale(between, 2.0 * dot(mirrored, between)))
}
