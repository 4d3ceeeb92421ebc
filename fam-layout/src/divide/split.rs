//! A surface divided in two where it is narrow.

use crate::cut::paths::distances;
use crate::divide::min_cut::beyond_cheapest_contour;
use crate::patch::Patch;
use crate::patch::topology::Topology;

/// The smaller part has at least this share of the area.
const LEAST_SHARE: f64 = 0.2;

/// A forbidden edge counts as this many times as long, so that one contour with a few is longer
/// than most others without.
const FORBIDDEN: f64 = 100.0;

/// Which triangles lie beyond the shortest contour between one end of a patch and the other:
/// two connected parts if there are two triangles or more.
pub fn split(patch: &Patch) -> Vec<bool> {
    let topology = &patch.topology;
    let farthest = |from: u32| {
        let distance = distances(topology, &patch.lengths, &[from]);
        let end = (0..distance.len() as u32)
            .max_by(|&a, &b| distance[a as usize].total_cmp(&distance[b as usize]));
        (distance, end.unwrap_or(from))
    };
    let (_, end) = farthest(0);
    let (distance, _) = farthest(end);
    let [low, high] = ends(topology, patch, &distance, LEAST_SHARE);
    split_between(topology, patch, &low, &high)
}

/// Which triangles lie beyond the cheapest contour between two sets of them. Both parts are
/// connected in `topology`, the patch's or that of the patch cut open.
pub fn split_between(
    topology: &Topology,
    patch: &Patch,
    one: &[bool],
    other: &[bool],
) -> Vec<bool> {
    let forbidden = FORBIDDEN * patch.highest_rate();
    let price = |h: usize| match patch.forbidden[h] {
        true => forbidden * patch.lengths[h],
        false => patch.prices[h],
    };
    let cost: Vec<f64> = (0..patch.prices.len()).map(price).collect();
    let beyond = beyond_cheapest_contour(topology, &cost, one, other);
    let far = largest_piece(topology, patch, &beyond, true);
    let near = largest_piece(topology, patch, &far, false);
    // What else there is hangs on the far part.
    near.into_iter().map(|near| !near).collect()
}

/// The triangles where `height` (of every vertex) is least and those where it is greatest: so
/// many of each that they have at least a share of the area, or half of all.
pub fn ends(
    topology: &Topology,
    patch: &Patch,
    height: &[f64],
    least_share: f64,
) -> [Vec<bool>; 2] {
    let count = topology.triangles().len();
    let of = |t: usize| -> f64 {
        let corners = topology.triangles()[t];
        corners.iter().map(|&v| height[v as usize]).sum()
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| of(a).total_cmp(&of(b)).then(a.cmp(&b)));
    let least = least_share * patch.areas.iter().sum::<f64>();
    let end = |order: &mut dyn Iterator<Item = &usize>| {
        let (mut end, mut area) = (vec![false; count], 0.0);
        for &t in order.take(count / 2) {
            end[t] = true;
            area += patch.areas[t];
            if area >= least {
                break;
            }
        }
        end
    };
    [end(&mut order.iter()), end(&mut order.iter().rev())]
}

/// The triangles of the connected piece of largest area among those that are on one `side`.
fn largest_piece(topology: &Topology, patch: &Patch, beyond: &[bool], side: bool) -> Vec<bool> {
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
    use fam_surface::{TriangleMesh, shapes};

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

    /// Of the edges between the two parts of a patch: whether all fulfil a condition.
    fn all_across(patch: &Patch, condition: impl Fn(u32) -> bool) -> bool {
        let beyond = split(patch);
        let mut across = patch.topology.edges().filter(|&h| {
            let twin = patch.topology.twin(h);
            twin.is_some_and(|twin| beyond[h as usize / 3] != beyond[twin as usize / 3])
        });
        across.all(condition)
    }

    /// It is the same length everywhere, but only a band is free: also where seams there cost more
    /// than elsewhere.
    #[test]
    fn the_contour_avoids_forbidden_edges() {
        let strip = shapes::rectangle(8.0, 1.0, 64, 8);
        let x = |v: u32| strip.positions()[v as usize][0];
        let is_free = |v: u32| (1.0..2.0).contains(&x(v));
        let patch = Patch::of(&strip).forbidding(|a, b| !is_free(a) || !is_free(b));
        assert!(all_across(&patch, |h| !patch.forbidden[h as usize]));
        let priced = patch.priced(|ends| {
            if ends.into_iter().all(is_free) {
                1e6
            } else {
                1.0
            }
        });
        assert!(all_across(&priced, |h| !priced.forbidden[h as usize]));
    }

    #[test]
    fn the_contour_runs_where_seams_cost_least() {
        let strip = shapes::rectangle(8.0, 1.0, 64, 8);
        let is_cheap = |v: u32| (-2.0..-1.0).contains(&strip.positions()[v as usize][0]);
        let priced = Patch::of(&strip).priced(|ends| {
            if ends.into_iter().any(is_cheap) {
                0.5
            } else {
                1.0
            }
        });
        let ends = |h: u32| [priced.topology.origin(h), priced.topology.target(h)];
        let source = |v: u32| priced.source[v as usize];
        assert!(all_across(&priced, |h| ends(h)
            .iter()
            .any(|&v| is_cheap(source(v)))));
    }
}
