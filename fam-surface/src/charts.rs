//! The charts of a UV map.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use crate::sets::Sets;
use crate::uv_map::UvMap;

/// The chart of every triangle, counting from 0 in the order of their first triangles. Triangles
/// with an edge at one place in the plane are in one chart, whatever the indices of its ends.
pub fn charts(uvs: &UvMap) -> Vec<u32> {
    let triangles = uvs.triangles();
    // Adding zero makes −0 and 0 one.
    let place = |v: u32| uvs.uvs()[v as usize].map(|c| (c + 0.0).to_bits());
    let mut sets = Sets::new(triangles.len());
    let mut sides: HashMap<[[u32; 2]; 2], u32> = HashMap::new();
    for (t, corners) in (0..).zip(triangles) {
        let places = corners.map(place);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let mut side = [places[a], places[b]];
            side.sort_unstable();
            match sides.entry(side) {
                Entry::Occupied(first) => sets.join(*first.get(), t),
                Entry::Vacant(free) => {
                    free.insert(t);
                }
            }
        }
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    (0..triangles.len() as u32)
        .map(|t| {
            let next = numbers.len() as u32;
            *numbers.entry(sets.root(t)).or_insert(next)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_with_a_common_edge_are_one_chart() {
        let uvs = vec![
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [0.0, 1.0],
            // The first again, and far away.
            [-0.0, 0.0],
            [1.0, 1.0],
            [5.0, 5.0],
        ];
        let of =
            |triangles: &[[u32; 3]]| charts(&UvMap::new(uvs.clone(), triangles.into()).unwrap());
        assert_eq!(of(&[[0, 1, 2], [4, 5, 3]]), [0, 0]);
        // A corner in common is not enough.
        assert_eq!(of(&[[0, 1, 2], [3, 6, 4]]), [0, 1]);
        assert_eq!(of(&[[3, 6, 4], [0, 1, 2], [5, 1, 0]]), [0, 1, 1]);
        assert!(of(&[]).is_empty());
    }
}
