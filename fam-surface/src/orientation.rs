//! Coherent orientation of triangles.

use rayon::prelude::*;

/// In the place of a half-edge: there is none.
pub const NONE: u32 = u32::MAX;

/// Where half-edge `h` starts and ends: `3 t + c` runs along triangle `t` from its corner `c` to the
/// next.
pub fn ends(triangles: &[[u32; 3]], h: u32) -> [u32; 2] {
    let corners = triangles[h as usize / 3];
    [corners[h as usize % 3], corners[(h as usize + 1) % 3]]
}

/// The next half-edge of the same triangle. A corner has the number of the half-edge that starts
/// there, so this is also the next corner.
pub fn next(h: u32) -> u32 {
    h - h % 3 + (h + 1) % 3
}

/// The corners of two half-edges between the same vertices that meet at either end, those at the start
/// of the first one first.
pub fn meeting(triangles: &[[u32; 3]], a: u32, b: u32) -> [[u32; 2]; 2] {
    let start = |h| ends(triangles, h)[0];
    let [near, far] = match start(a) == start(b) {
        true => [b, next(b)],
        false => [next(b), b],
    };
    [[a, near], [next(a), far]]
}

/// For every half-edge the other one between the same vertices, in either direction; [`NONE`] where it
/// is alone or one of several. Triangles that have a vertex twice are left out.
pub fn across(triangles: &[[u32; 3]]) -> Vec<u32> {
    let whole = |h: &u32| {
        let [a, b, c] = triangles[*h as usize / 3];
        a != b && b != c && c != a
    };
    let mut sides: Vec<([u32; 2], u32)> = (0..3 * triangles.len() as u32)
        .filter(whole)
        .map(|h| {
            let [a, b] = ends(triangles, h);
            ([a.min(b), a.max(b)], h)
        })
        .collect();
    sides.par_sort_unstable();
    let mut across = vec![NONE; 3 * triangles.len()];
    for edge in sides.chunk_by(|(one, _), (other, _)| one == other) {
        if let [(_, one), (_, other)] = *edge {
            across[one as usize] = other;
            across[other as usize] = one;
        }
    }
    across
}

/// Which triangles are to be turned over so that neighbours [`across`] edges agree: in each connected
/// part the fewer. Where a part is not orientable, as a Möbius strip, some edges stay between two
/// that do not.
pub fn turned(triangles: &[[u32; 3]], across: &[u32]) -> Vec<bool> {
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    for start in 0..triangles.len() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let mut part = vec![start];
        let mut next = 0;
        while let Some(&t) = part.get(next) {
            next += 1;
            let own = turned[t] == Some(true);
            for h in (3 * t as u32)..(3 * t as u32 + 3) {
                let twin = across[h as usize];
                if twin != NONE && turned[twin as usize / 3].is_none() {
                    let same = ends(triangles, h)[0] == ends(triangles, twin)[0];
                    turned[twin as usize / 3] = Some(own != same);
                    part.push(twin as usize / 3);
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

/// Whether all neighbours [`across`] edges agree once these are [`turned`]: whether each part is
/// orientable.
pub fn agree(triangles: &[[u32; 3]], across: &[u32], turned: &[bool]) -> bool {
    let agrees = |(h, &twin): (usize, &u32)| {
        let same = ends(triangles, h as u32)[0] == ends(triangles, twin)[0];
        same == (turned[h / 3] != turned[twin as usize / 3])
    };
    let mut pairs = across.iter().enumerate().filter(|(_, twin)| **twin != NONE);
    pairs.all(agrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TriangleMesh, shapes};

    #[test]
    fn the_fewer_of_each_part_are_turned() {
        // A strip of four, the second of them turned.
        let strip = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 5, 4]];
        let of = |triangles: &[[u32; 3]]| turned(triangles, &across(triangles));
        assert_eq!(of(&strip), [false, true, false, false]);
        let [a, b, c, d] = strip;
        assert_eq!(of(&[b, a, c, d]), [true, false, false, false]);
        // Beside a larger part that agrees.
        let fan = (10..18).map(|i| [9, i, i + 1]);
        let both: Vec<_> = [b, a, c, d].into_iter().chain(fan).collect();
        let found = of(&both);
        assert!(found[0] && !found[1..].contains(&true), "{found:?}");
    }

    #[test]
    fn an_edge_of_three_triangles_joins_none() {
        let triangles = [[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        assert_eq!(across(&triangles), [NONE; 9]);
        assert_eq!(turned(&triangles, &[NONE; 9]), [false; 3]);
        assert_eq!(across(&triangles[..2]), [3, NONE, NONE, 0, NONE, NONE]);
        // Nor does a triangle with a vertex twice take part.
        assert_eq!(
            across(&[[0, 1, 1], [0, 1, 2], [1, 0, 3]])[3..],
            [6, NONE, NONE, 3, NONE, NONE]
        );
    }

    #[test]
    fn a_moebius_strip_does_not_agree() {
        let agree = |mesh: &TriangleMesh| {
            let triangles = mesh.triangles();
            let across = across(triangles);
            agree(triangles, &across, &turned(triangles, &across))
        };
        assert!(agree(&shapes::torus(1.0, 0.4, 12, 8)));
        assert!(!agree(&shapes::moebius_strip(0.5, 40, 4)));
    }
}
