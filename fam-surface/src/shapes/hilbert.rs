//! The Hilbert curve in three dimensions.

use super::fields::Point;

/// The 8^order points of a cubic grid 1 apart, each the neighbour of the one before.
///
/// A cube is passed octant by octant in the order of a Gray code. In each octant the curve is
/// the same again, turned so that it ends beside the next one: `entry` is the corner where it
/// starts, a bit for each axis, and `axis` the one along which its ends lie.
pub(super) fn hilbert_curve(order: u32) -> Vec<Point> {
    (0..1_u64 << (3 * order))
        .map(|index| {
            let (mut entry, mut axis) = (0, 0);
            let mut point = [0_u32; 3];
            for level in (0..order).rev() {
                let octant = (index >> (3 * level)) as u32 & 7;
                let corner = turned(gray(octant), axis) ^ entry;
                for (k, coordinate) in point.iter_mut().enumerate() {
                    *coordinate |= (corner >> k & 1) << level;
                }
                entry ^= turned(octant_entry(octant), axis);
                axis = (axis + octant_axis(octant) + 1) % 3;
            }
            point.map(f64::from)
        })
        .collect()
}

/// Numbers of which neighbours differ in one bit.
fn gray(number: u32) -> u32 {
    number ^ (number >> 1)
}

/// Three bits rotated by an axis and one more.
fn turned(bits: u32, axis: u32) -> u32 {
    let by = (axis + 1) % 3;
    (bits << by | bits >> (3 - by)) & 7
}

/// The corner of an octant where the curve enters it.
fn octant_entry(octant: u32) -> u32 {
    octant.checked_sub(1).map_or(0, |before| gray(before & !1))
}

/// The axis along which the ends of the curve lie in an octant.
fn octant_axis(octant: u32) -> u32 {
    let odd = if octant.is_multiple_of(2) {
        octant.saturating_sub(1)
    } else {
        octant
    };
    if octant == 0 {
        0
    } else {
        odd.trailing_ones() % 3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{length, sub};

    #[test]
    fn the_curve_goes_once_through_every_point_of_the_grid_to_a_neighbour() {
        for order in 1..=4 {
            let mut points = hilbert_curve(order);
            for ends in points.windows(2) {
                assert_eq!(length(sub(ends[1], ends[0])), 1.0, "order {order}");
            }
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            points.dedup();
            assert_eq!(points.len(), 8_usize.pow(order));
            let side = f64::from(1_u32 << order);
            assert!(points.iter().flatten().all(|c| (0.0..side).contains(c)));
        }
    }
}
