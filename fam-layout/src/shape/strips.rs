//! A piece of surface cut across into several, one after the other along its length.

use crate::component::is_forbidden;
use crate::cut::Cut;
use crate::cut::paths::distances;
use crate::divide::split::split_between;
use crate::patch::Patch;

/// How far a cut may lie from where all pieces would have the same area, in areas of a piece: so far
/// that it finds a narrow place nearby, and so near that pieces are about equally long.
const ROOM: f64 = 0.25;

/// By how much dearer a cut is there, as a share of its length. Where a strip is equally wide, it is
/// cut into pieces of the same length.
const DEARER: f64 = 0.5;

/// The triangles of a patch in so many connected pieces, each beyond the one before; fewer where
/// that would cut forbidden edges or there are too few triangles. `triangles` are those of `patch`
/// that are to be divided; they are connected.
pub fn cut_across(patch: &Patch, triangles: Vec<u32>, count: usize) -> Vec<Vec<u32>> {
    let mut pieces = Vec::new();
    let mut open = vec![(triangles, count)];
    while let Some((triangles, count)) = open.pop() {
        match cut_once(patch, &triangles, count) {
            Some([near, far]) => {
                let first = count / 2;
                open.extend([(far, count - first), (near, first)]);
            }
            None => pieces.push(triangles),
        }
    }
    pieces
}

/// The first half of `count` pieces and the second.
fn cut_once(patch: &Patch, triangles: &[u32], count: usize) -> Option<[Vec<u32>; 2]> {
    if count < 2 || triangles.len() < 2 {
        return None;
    }
    let mut own = patch.subset(triangles);
    let levels = levels(&own);
    let middle = (count / 2) as f64 / count as f64;
    let room = ROOM / count as f64;
    let mut near: Vec<bool> = levels.iter().map(|&l| l < middle - room).collect();
    let mut far: Vec<bool> = levels.iter().map(|&l| l >= middle + room).collect();
    // Where triangles are few, there is one at each end all the same.
    let by_level = |a: &usize, b: &usize| levels[*a].total_cmp(&levels[*b]);
    let first = (0..levels.len()).min_by(by_level)?;
    let last = (0..levels.len()).max_by(by_level)?;
    if first == last {
        return None;
    }
    (near[first], far[first]) = (true, false);
    (near[last], far[last]) = (false, true);
    for h in 0..own.prices.len() {
        let away = (levels[h / 3] - middle).abs() / room;
        own.prices[h] *= 1.0 + DEARER * away.min(1.0);
    }
    let beyond = split_between(&own.topology, &own, &near, &far);
    if is_forbidden(&own, &Cut::none(&own.topology), &beyond) {
        return None;
    }
    let side = |far: bool| -> Vec<u32> {
        let chosen = triangles.iter().zip(&beyond);
        chosen
            .filter(|(_, b)| **b == far)
            .map(|(&t, _)| t)
            .collect()
    };
    let sides = [side(false), side(true)];
    sides.iter().all(|side| !side.is_empty()).then_some(sides)
}

/// How far along a patch every triangle lies: the share of the area that lies before it, from one end
/// to the other.
fn levels(patch: &Patch) -> Vec<f64> {
    let topology = &patch.topology;
    let from = |v: u32| distances(topology, &patch.lengths, &[v]);
    let start = from(topology.triangles()[0][0]);
    let end = (0..start.len())
        .max_by(|&a, &b| start[a].total_cmp(&start[b]))
        .map_or(0, |v| v as u32);
    let distance = from(end);
    let of = |t: usize| -> f64 {
        let corners = topology.triangles()[t];
        corners.iter().map(|&v| distance[v as usize]).sum()
    };
    let heights: Vec<f64> = (0..topology.triangles().len()).map(of).collect();
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|&a, &b| heights[a].total_cmp(&heights[b]).then(a.cmp(&b)));
    let total: f64 = patch.areas.iter().sum();
    let mut before = 0.0;
    let mut levels = vec![0.0; heights.len()];
    for t in order {
        levels[t] = (before + 0.5 * patch.areas[t]) / total.max(f64::MIN_POSITIVE);
        before += patch.areas[t];
    }
    levels
}

/// The length of the edges of a patch between pieces of it.
pub fn length_between(patch: &Patch, pieces: &[Vec<u32>]) -> f64 {
    let mut of = vec![None; patch.areas.len()];
    for (k, piece) in pieces.iter().enumerate() {
        for &t in piece {
            of[t as usize] = Some(k);
        }
    }
    let length = |h: u32| {
        let beyond = of[patch.topology.twin(h)? as usize / 3]?;
        (of[h as usize / 3]? < beyond).then_some(patch.lengths[h as usize])
    };
    let half_edges = pieces.iter().flatten().flat_map(|&t| 3 * t..3 * t + 3);
    half_edges.filter_map(length).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    fn all(patch: &Patch) -> Vec<u32> {
        (0..patch.areas.len() as u32).collect()
    }

    #[test]
    fn a_strip_falls_into_pieces_of_the_same_length() {
        let patch = Patch::of(&shapes::rectangle(60.0, 1.0, 240, 4));
        let width = 1.0 / 60.0_f64.sqrt();
        for count in [1, 2, 3, 7, 12] {
            let pieces = cut_across(&patch, all(&patch), count);
            assert_eq!(pieces.len(), count);
            let seams = length_between(&patch, &pieces);
            assert!((seams - (count - 1) as f64 * width).abs() < 1e-9, "{seams}");
            for piece in &pieces {
                let area: f64 = piece.iter().map(|&t| patch.areas[t as usize]).sum();
                let share = area * count as f64;
                assert!((0.85..1.15).contains(&share), "{share} of {count}");
            }
        }
    }

    #[test]
    fn forbidden_edges_stay_whole_and_single_triangles_too() {
        let patch = Patch::of(&shapes::rectangle(9.0, 1.0, 9, 1)).forbidding(|_, _| true);
        assert_eq!(cut_across(&patch, all(&patch), 5).len(), 1);
        let patch = Patch::of(&shapes::rectangle(1.0, 1.0, 1, 1));
        assert_eq!(cut_across(&patch, all(&patch), 50).len(), 2);
    }
}
