//! Coordinates far from the origin, where single precision is not enough.

use fam_surface::vector::{add, length, scale, sub};

const FAR: f64 = 1e3;

/// What to subtract from positions so that single precision is enough for them: their centre
/// if its distance from the origin is more than [`FAR`] times their extent, else zero. It is a
/// number of single precision itself.
pub(crate) fn center(positions: &[[f64; 3]]) -> [f64; 3] {
    let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let [min, max] = positions.iter().fold(none, |[min, max], p| {
        [
            std::array::from_fn(|c| min[c].min(p[c])),
            std::array::from_fn(|c| max[c].max(p[c])),
        ]
    });
    let middle = add(scale(min, 0.5), scale(max, 0.5)).map(|c| f64::from(c as f32));
    if middle.iter().all(|c| c.is_finite()) && length(middle) > FAR * length(sub(max, min)) {
        middle
    } else {
        [0.0; 3]
    }
}
