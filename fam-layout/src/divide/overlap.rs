//! A layout that overlaps itself, divided between the parts that do.

use std::collections::BTreeMap;

use crate::cut::paths::distances;
use crate::divide::split::{ends, split_between};
use crate::patch::Patch;
use crate::solve::layout::Layout;
use fam_surface::UvMap;
use fam_surface::metrics::for_each_overlapping_pair;

/// The smaller side of a division has at least this share of the area: less would be confetti.
const LEAST_SHARE: f64 = 0.03;

/// Which triangles lie beyond the shortest contour between the two parts of a layout that overlap
/// most; none if nothing overlaps. Where the layout is cut already costs nothing.
pub fn divided_where_overlapping(patch: &Patch, layout: &Layout) -> Option<Vec<bool>> {
    let opened = &layout.opened.topology;
    let (one, other) = most_overlapping(layout)?;
    let from = |triangles: &[u32]| {
        let corners = triangles
            .iter()
            .flat_map(|&t| opened.triangles()[t as usize]);
        distances(opened, &patch.lengths, &corners.collect::<Vec<u32>>())
    };
    let height: Vec<f64> = std::iter::zip(from(&one), from(&other))
        .map(|(one, other)| one - other)
        .collect();
    let [mut near, mut far] = ends(opened, patch, &height, LEAST_SHARE);
    for t in one {
        (near[t as usize], far[t as usize]) = (true, false);
    }
    for t in other {
        (near[t as usize], far[t as usize]) = (false, true);
    }
    Some(split_between(opened, patch, &near, &far))
}

/// Two parts of a layout, as triangles, that overlap one another.
fn most_overlapping(layout: &Layout) -> Option<(Vec<u32>, Vec<u32>)> {
    let opened = &layout.opened.topology;
    let rounded = layout.uv.iter().map(|q| q.map(|c| c as f32)).collect();
    let uv = UvMap::new(rounded, opened.triangles().to_vec()).ok()?;
    let mut involved = vec![false; opened.triangles().len()];
    for_each_overlapping_pair(&uv, |pair| {
        for t in pair {
            involved[t as usize] = true;
        }
    });
    // Regions that overlap something.
    let edge_of_region = |h: u32| {
        let beyond = opened.twin(h).map(|twin| involved[twin as usize / 3]);
        beyond != Some(involved[h as usize / 3])
    };
    let (region, _) = opened.open(edge_of_region).topology.pieces();
    let mut pairs: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for_each_overlapping_pair(&uv, |[a, b]| {
        let [a, b] = [region[a as usize], region[b as usize]];
        *pairs.entry([a.min(b), a.max(b)]).or_default() += 1;
    });
    let apart = |pair: &[u32; 2]| pair[0] != pair[1];
    let (&[a, b], _) = pairs
        .iter()
        .max_by_key(|(pair, count)| (apart(pair), **count))?;
    let of = |r: u32| -> Vec<u32> {
        let all = 0..region.len() as u32;
        all.filter(|&t| region[t as usize] == r).collect()
    };
    if a != b {
        return Some((of(a), of(b)));
    }
    // A region that lies over itself: its two ends.
    let mut farthest: Option<(f64, [u32; 2])> = None;
    let start = opened.triangles()[*of(a).first()? as usize][0];
    let lengths = vec![1.0; opened.half_edges() as usize];
    let depth = distances(opened, &lengths, &[start]);
    let depth_of = |t: u32| depth[opened.triangles()[t as usize][0] as usize];
    for_each_overlapping_pair(&uv, |[t, u]| {
        let between = (depth_of(t) - depth_of(u)).abs();
        if region[t as usize] == a && farthest.is_none_or(|(most, _)| between > most) {
            farthest = Some((between, [t, u]));
        }
    });
    farthest.map(|(_, [t, u])| (vec![t], vec![u]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cut::Cut;
    use fam_surface::shapes;

    /// A strip laid out as a ring of so many turns.
    fn ring(patch: &Patch, turns: f64) -> Layout {
        let end = patch.positions.iter().map(|p| p[0]).fold(0.0, f64::max);
        let corners: Vec<[f64; 2]> = (0..patch.topology.half_edges())
            .map(|h| {
                let [x, y, _] = patch.positions[patch.topology.origin(h) as usize];
                let (angle, radius) = (std::f64::consts::TAU * turns * x / end, 2.0 - y);
                [radius * angle.sin(), -radius * angle.cos()]
            })
            .collect();
        let cut = Cut::none(&patch.topology);
        Layout::of(&patch.topology, cut, &corners)
    }

    fn overlaps(layout: &Layout, side: impl Fn(u32) -> bool) -> bool {
        let uv = layout.uv.iter().map(|q| q.map(|c| c as f32)).collect();
        let triangles = layout.opened.topology.triangles().to_vec();
        let mut found = false;
        for_each_overlapping_pair(&UvMap::new(uv, triangles).unwrap(), |[a, b]| {
            found |= side(a) == side(b);
        });
        found
    }

    #[test]
    fn the_ends_of_a_ring_of_more_than_one_turn_are_divided() {
        let patch = Patch::of(&shapes::rectangle(10.0, 1.0, 60, 6));
        let layout = ring(&patch, 1.3);
        assert!(overlaps(&layout, |_| true));
        let beyond = divided_where_overlapping(&patch, &layout).unwrap();
        assert!(!overlaps(&layout, |t| beyond[t as usize]));
        let across = |h: &u32| {
            let twin = patch.topology.twin(*h);
            twin.is_some_and(|twin| beyond[*h as usize / 3] != beyond[twin as usize / 3])
        };
        let edges: Vec<u32> = patch.topology.edges().filter(across).collect();
        assert_eq!(edges.len(), 6, "straight across");
    }

    #[test]
    fn what_does_not_overlap_is_not_divided() {
        let patch = Patch::of(&shapes::rectangle(10.0, 1.0, 60, 6));
        assert_eq!(divided_where_overlapping(&patch, &ring(&patch, 0.9)), None);
    }
}
