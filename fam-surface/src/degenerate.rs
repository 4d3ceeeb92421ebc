//! Which triangles have no area to the precision of their coordinates.

use super::vector::{cross, length, sub};

/// Positions divided by a power of two near their largest coordinate, so that no product of
/// theirs overflows.
pub fn rescaled(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let largest = positions
        .iter()
        .flatten()
        .fold(0.0, |m: f64, c| m.max(c.abs()));
    // The lower bound keeps the factor finite.
    let factor = (-largest.log2().floor().max(-1000.0)).exp2();
    positions.iter().map(|p| p.map(|c| c * factor)).collect()
}

/// Twice the area of a triangle; 0 where its height on the longest edge does not exceed
/// the rounding of its coordinates.
pub fn double_area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let edges = [sub(b, a), sub(c, b), sub(a, c)];
    let longest = edges.iter().fold(0.0, |m: f64, &e| m.max(length(e)));
    let magnitude = [a, b, c]
        .iter()
        .flatten()
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    let area = length(cross(edges[0], edges[1]));
    if area > 4.0 * f64::EPSILON * magnitude * longest {
        area
    } else {
        0.0
    }
}
