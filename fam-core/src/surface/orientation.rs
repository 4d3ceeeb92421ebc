//! Coherent orientation of triangles.

use std::collections::{HashMap, VecDeque};

/// In the place of a half-edge: there is none.
pub(crate) const NONE: u32 = u32::MAX;

/// Where half-edge `h` starts and ends: `3 t + c` runs along triangle `t` from its corner `c` to the
/// next.
pub(crate) fn ends(triangles: &[[u32; 3]], h: u32) -> [u32; 2] {
    let corners = triangles[h as usize / 3];
    [corners[h as usize % 3], corners[(h as usize + 1) % 3]]
}

/// For every half-edge the other one between the same vertices, in either direction; [`NONE`] where it
/// is alone or one of several.
pub(crate) fn across(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut sides: HashMap<[u32; 2], Sides> = HashMap::new();
    let count = 3 * triangles.len() as u32;
    let edge = |h: u32| {
        let [a, b] = ends(triangles, h);
        [a.min(b), a.max(b)]
    };
    for h in 0..count {
        sides
            .entry(edge(h))
            .and_modify(|sides| {
                *sides = match *sides {
                    Sides::One(one) => Sides::Two(one, h),
                    _ => Sides::More,
                }
            })
            .or_insert(Sides::One(h));
    }
    let other = |h: u32| match sides[&edge(h)] {
        Sides::Two(one, other) if one == h => other,
        Sides::Two(one, _) => one,
        _ => NONE,
    };
    (0..count).map(other).collect()
}

/// The half-edges of an edge.
enum Sides {
    One(u32),
    Two(u32, u32),
    More,
}

/// Which triangles are to be turned over so that neighbours [`across`] edges agree: in each connected
/// part the fewer. Where a part is not orientable, as a Möbius strip, some edges stay between two
/// that do not.
pub(crate) fn turned(triangles: &[[u32; 3]], across: &[u32]) -> Vec<bool> {
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    for start in 0..triangles.len() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let mut part = Vec::new();
        let mut queue = VecDeque::from([start]);
        while let Some(t) = queue.pop_front() {
            part.push(t);
            let own = turned[t] == Some(true);
            for h in (3 * t as u32)..(3 * t as u32 + 3) {
                let twin = across[h as usize];
                if twin != NONE && turned[twin as usize / 3].is_none() {
                    let same = ends(triangles, h)[0] == ends(triangles, twin)[0];
                    turned[twin as usize / 3] = Some(own != same);
                    queue.push_back(twin as usize / 3);
                }
            }
        }
        let over = part.iter().filter(|&&t| turned[t] == Some(true)).count();
        if 2 * over > part.len() {
            for t in part {
                turned[t] = turned[t].map(|over| !over);
            }
        }
    }
    turned.into_iter().map(|over| over == Some(true)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewer_of_each_part_are_turned() {
        // A strip of four, the second of them turned, and a pair that is not.
        let triangles = [
            [0, 1, 2],
            [1, 2, 3],
            [2, 3, 4],
            [3, 5, 4],
            [10, 11, 12],
            [10, 12, 13],
        ];
        let found = turned(&triangles, &across(&triangles));
        assert_eq!(found, [false, true, false, false, false, false]);
        // From the turned one on.
        let [a, b, c, d, ..] = triangles;
        let found = turned(&[b, a, c, d], &across(&[b, a, c, d]));
        assert_eq!(found, [true, false, false, false]);
    }

    #[test]
    fn an_edge_of_three_triangles_joins_none() {
        let triangles = [[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        assert_eq!(across(&triangles), [NONE; 9]);
        assert_eq!(turned(&triangles, &[NONE; 9]), [false; 3]);
        assert_eq!(across(&triangles[..2])[..2], [3, NONE]);
    }
}
