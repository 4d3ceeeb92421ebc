//! Vertices at equal positions as one.

use std::collections::HashMap;

/// Per vertex, the first vertex at an equal position (0 equals −0).
pub fn weld(positions: &[[f64; 3]]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    (0..)
        .zip(positions)
        .map(|(v, p)| *first.entry(p.map(|c| (c + 0.0).to_bits())).or_insert(v))
        .collect()
}
