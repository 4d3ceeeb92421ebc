//! Open shells: parts of the surfaces of bodies.

use super::fields::{Point, joined, limb, polygon, rounded_rectangle, shared};
use super::implicit::open;
use super::solids::fitting;
use crate::TriangleMesh;
use crate::vector::{dot, length, sub};

/// A shirt: a torso open at waist and neck, and two sleeves open at the cuffs. Genus 0, four
/// boundary loops. About 2.3 × 0.7 × 2, in triangles of edges about `spacing` long; a spacing
/// above 0.1 counts as 0.1.
pub fn shirt(spacing: f64) -> TriangleMesh {
    /// Depth of the torso over its width.
    const DEPTH: f64 = 0.6;
    const SHOULDER: Point = [0.4, 0.0, 0.62];
    const HAND: Point = [1.35, 0.0, -0.05];
    const CUFF: Point = [1.15, 0.0, 0.09];
    const NECK: Point = [0.0, -0.1, 1.12];
    let body = |[x, y, z]: Point| {
        let folds = 0.012 * (9.0 * x + 4.0 * y + 5.0 * z).sin() * (7.0 * z - 3.0 * x).cos();
        let flat = [x, y / DEPTH, z];
        let torso = limb(flat, [[0.0, 0.0, -1.2], [0.0, 0.0, 0.5]], [0.56, 0.6]);
        let sleeve = limb([x.abs(), y, z], [SHOULDER, HAND], [0.3, 0.22]);
        joined(DEPTH * torso, sleeve, 0.15) + folds
    };
    let outside = |[x, y, z]: Point| {
        let waist = z + 1.0;
        let along = sub(HAND, SHOULDER);
        let arm = -dot(sub([x.abs(), y, z], CUFF), along) / length(along);
        // The plane through the cuff meets the torso as well.
        let cuff = arm.max(0.75 - x.abs());
        let neck = length(sub([x, y, z], NECK)) - 0.36;
        -waist.min(cuff).min(neck)
    };
    let corners = [[-1.7, -0.5, -1.9], [1.7, 0.5, 1.3]];
    open(&body, &outside, corners, fitting(spacing, 0.1))
}

/// The shell of a car, open below, with wheel arches, and with openings for the windscreen, the
/// rear window and four side windows. Genus 0, seven boundary loops. About 4.2 × 1.7 × 1.2, in
/// triangles of edges about `spacing` long; a spacing above 0.07 counts as 0.07.
pub fn car_shell(spacing: f64) -> TriangleMesh {
    /// From the front bumper over the roof to the rear one: lengthwise and height.
    const SIDE: [[f64; 2]; 8] = [
        [2.1, -0.2],
        [2.1, 0.62],
        [1.15, 0.82],
        [0.45, 1.35],
        [-1.0, 1.38],
        [-1.75, 0.95],
        [-2.1, 0.88],
        [-2.1, -0.2],
    ];
    const FRONT_WINDOW: [[f64; 2]; 4] = [[0.72, 0.9], [0.4, 1.16], [-0.18, 1.18], [-0.18, 0.9]];
    const BACK_WINDOW: [[f64; 2]; 4] = [[-0.4, 0.9], [-0.4, 1.18], [-0.85, 1.18], [-1.15, 0.98]];
    let body = |[x, y, z]: Point| {
        let inset = 0.1;
        let side = polygon([x, z], &SIDE.map(|[x, z]| [x * 0.95, z - inset])) - inset;
        let cabin = (z - 0.75).max(0.0);
        let width = 0.85 - 0.4 * cabin - 0.02 * x * x;
        shared(side, y.abs() - width, 0.25)
    };
    let outside = |[x, y, z]: Point| {
        let floor = z - 0.2;
        let wheels = [-1.25, 1.25].map(|axle| (x - axle).hypot(z - 0.2) - 0.36);
        let below = joined(floor, wheels[0].min(wheels[1]), 0.1);
        let sides = polygon([x, z], &FRONT_WINDOW).min(polygon([x, z], &BACK_WINDOW)) - 0.04;
        let ends = rounded_rectangle([y, z - 1.07], [0.46, 0.14], 0.06);
        -below.min(sides).min(ends)
    };
    let corners = [[-2.2, -1.0, -0.4], [2.2, 1.0, 1.5]];
    open(&body, &outside, corners, fitting(spacing, 0.07))
}
