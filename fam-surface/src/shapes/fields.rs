//! Functions that describe bodies: about the distance from the surface, below zero inside.

use crate::vector::{add, dot, length, scale, sub};

/// A point in space.
pub(super) type Point = [f64; 3];

/// Two bodies as one, with a fillet about `round` wide where they meet.
pub(super) fn joined(a: f64, b: f64, round: f64) -> f64 {
    let near = (1.0 - (a - b).abs() / round).max(0.0);
    a.min(b) - 0.25 * round * near * near
}

/// Two spheres and the cone between them: about the distance, where the radii differ little.
pub(super) fn limb(p: Point, [a, b]: [Point; 2], [start, end]: [f64; 2]) -> f64 {
    let (way, from) = (sub(b, a), sub(p, a));
    let t = (dot(from, way) / dot(way, way)).clamp(0.0, 1.0);
    length(sub(p, add(a, scale(way, t)))) - (start + t * (end - start))
}

/// A ring around the z axis: radius of its centre circle and of its tube.
pub(super) fn ring(p: Point, major: f64, minor: f64) -> f64 {
    (p[0].hypot(p[1]) - major).hypot(p[2]) - minor
}

/// A rectangle around the origin of the plane, with corners of radius `round`; `half` is half
/// its size.
pub(super) fn rounded_rectangle(p: [f64; 2], half: [f64; 2], round: f64) -> f64 {
    shared(p[0].abs() - half[0], p[1].abs() - half[1], round)
}

/// What two bodies share whose surfaces meet at right angles, with an edge of radius `round`.
pub(super) fn shared(a: f64, b: f64, round: f64) -> f64 {
    let (a, b) = (a + round, b + round);
    a.max(0.0).hypot(b.max(0.0)) + a.max(b).min(0.0) - round
}

/// A polygon in the plane without crossings.
pub(super) fn polygon(p: [f64; 2], corners: &[[f64; 2]]) -> f64 {
    let mut inside = false;
    let mut distance = f64::INFINITY;
    for (i, &b) in corners.iter().enumerate() {
        let a = corners[(i + corners.len() - 1) % corners.len()];
        distance = distance.min(segment(p, [a, b]));
        if (a[1] > p[1]) != (b[1] > p[1]) {
            let crossing = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            inside ^= p[0] < crossing;
        }
    }
    if inside { -distance } else { distance }
}

/// Distance in the plane from a segment.
pub(super) fn segment(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let [way, from] = [b, p].map(|q| [q[0] - a[0], q[1] - a[1]]);
    let t = (from[0] * way[0] + from[1] * way[1]) / (way[0] * way[0] + way[1] * way[1]);
    let t = t.clamp(0.0, 1.0);
    (from[0] - t * way[0]).hypot(from[1] - t * way[1])
}
