//! A surface divided in two where it is narrow.

use super::cut::paths::distances;
use super::patch::Patch;

/// The smaller part has at least this share of the area.
const LEAST_SHARE: f64 = 0.2;

/// A forbidden edge counts as this many times as long, so that one contour with a few is longer
/// than most others without.
const FORBIDDEN: f64 = 100.0;

/// Which triangles lie beyond the shortest contour of the distance from one end of a patch:
/// two connected parts if there are two triangles or more.
pub fn split(patch: &Patch) -> Vec<bool> {
    let topology = &patch.topology;
    let count = topology.triangles().len();
    let farthest = |from: u32| {
        let distance = distances(topology, &patch.lengths, &[from]);
        let end = (0..distance.len() as u32)
            .max_by(|&a, &b| distance[a as usize].total_cmp(&distance[b as usize]));
        (distance, end.unwrap_or(from))
    };
    let (_, end) = farthest(0);
    let (distance, _) = farthest(end);
    let height = |t: usize| -> f64 {
        topology.triangles()[t]
            .iter()
            .map(|&v| distance[v as usize])
            .sum()
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| height(a).total_cmp(&height(b)).then(a.cmp(&b)));
    let mut rank = vec![0; count];
    for (position, &t) in order.iter().enumerate() {
        rank[t] = position;
    }
    let price = |h: u32| {
        let factor = if patch.forbidden[h as usize] {
            FORBIDDEN
        } else {
            1.0
        };
        factor * patch.lengths[h as usize]
    };
    // The length of the contour below every place in the order: of the edges that cross it.
    let mut change = vec![0.0; count + 1];
    for h in topology.edges() {
        if let Some(twin) = topology.twin(h) {
            let (a, b) = (rank[h as usize / 3], rank[twin as usize / 3]);
            change[a.min(b) + 1] += price(h);
            change[a.max(b) + 1] -= price(h);
        }
    }
    let total: f64 = patch.areas.iter().sum();
    let (mut area, mut length) = (0.0, 0.0);
    let mut best = (f64::INFINITY, count / 2);
    for place in 1..count {
        area += patch.areas[order[place - 1]];
        length += change[place];
        let share = area.min(total - area);
        if share >= LEAST_SHARE * total && length < best.0 {
            best = (length, place);
        }
    }
    let beyond: Vec<bool> = rank.into_iter().map(|rank| rank >= best.1).collect();
    let far = largest_piece(patch, &beyond, true);
    let near = largest_piece(patch, &far, false);
    // What else there is hangs on the far part.
    near.into_iter().map(|near| !near).collect()
}

/// The triangles of the connected piece of largest area among those that are on one `side`.
fn largest_piece(patch: &Patch, beyond: &[bool], side: bool) -> Vec<bool> {
    let topology = &patch.topology;
    let across = |h: u32| topology.twin(h).map(|twin| beyond[twin as usize / 3]);
    let divided = topology.open(|h| across(h) == Some(!beyond[h as usize / 3]));
    let (piece, count) = divided.topology.pieces();
    let mut areas = vec![(0.0, 0_usize); count];
    for t in (0..beyond.len()).filter(|&t| beyond[t] == side) {
        let (area, triangles) = &mut areas[piece[t] as usize];
        *area += patch.areas[t];
        *triangles += 1;
    }
    let larger = |a: &usize, b: &usize| {
        let ((a, m), (b, n)) = (areas[*a], areas[*b]);
        a.total_cmp(&b).then(m.cmp(&n))
    };
    let largest = (0..count).max_by(larger);
    piece.iter().map(|&p| Some(p as usize) == largest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{TriangleMesh, shapes};

    #[test]
    fn both_parts_have_their_share() {
        for mesh in [
            shapes::torus(1.0, 0.3, 30, 14),
            shapes::rectangle(5.0, 1.0, 40, 8),
            shapes::rectangle(1.0, 1.0, 1, 1),
        ] {
            let patch = Patch::of(&mesh);
            let beyond = split(&patch);
            let share: f64 = (0..beyond.len())
                .filter(|&t| beyond[t])
                .map(|t| patch.areas[t])
                .sum();
            assert!((0.19..0.81).contains(&share), "{share}");
        }
    }

    /// The legs of a star are as far from one another as its middle is from each.
    #[test]
    fn both_parts_are_connected() {
        let wave = |p: &[f64; 3]| {
            let height = 2.0 * (4.0 * p[1].atan2(p[0])).sin() * p[0].hypot(p[1]);
            [p[0], p[1], height]
        };
        let flat = shapes::cone(1.0, 0.0, 48, 8);
        let positions = flat.positions().iter().map(wave).collect();
        let ruff = TriangleMesh::new(positions, flat.triangles().to_vec()).unwrap();
        let patch = Patch::of(&ruff);
        let beyond = split(&patch);
        let other_side = |h: u32| {
            let twin = patch.topology.twin(h);
            twin.is_some_and(|twin| beyond[h as usize / 3] != beyond[twin as usize / 3])
        };
        assert_eq!(patch.topology.open(other_side).topology.pieces().1, 2);
    }

    /// A long strip is divided across.
    #[test]
    fn the_contour_is_short() {
        let patch = Patch::of(&shapes::rectangle(8.0, 1.0, 64, 8));
        let beyond = split(&patch);
        let length: f64 = patch
            .topology
            .edges()
            .filter(|&h| {
                let twin = patch.topology.twin(h);
                twin.is_some_and(|twin| beyond[h as usize / 3] != beyond[twin as usize / 3])
            })
            .map(|h| patch.lengths[h as usize])
            .sum();
        assert!(length < 2.0 / 8.0_f64.sqrt(), "{length}");
    }

    /// It is the same length everywhere, but only a band is free.
    #[test]
    fn the_contour_avoids_forbidden_edges() {
        let strip = shapes::rectangle(8.0, 1.0, 64, 8);
        let x = |v: u32| strip.positions()[v as usize][0];
        let is_free = |v: u32| (1.0..2.0).contains(&x(v));
        let patch = Patch::of(&strip).forbidding(|a, b| !is_free(a) || !is_free(b));
        let beyond = split(&patch);
        let mut across = patch.topology.edges().filter(|&h| {
            let twin = patch.topology.twin(h);
            twin.is_some_and(|twin| beyond[h as usize / 3] != beyond[twin as usize / 3])
        });
        assert!(across.all(|h| !patch.forbidden[h as usize]));
    }
}
