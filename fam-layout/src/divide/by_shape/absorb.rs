//! Small charts, each flattened anew together with a neighbour.
//!
//! A chart of a few triangles seldom fits beside another as it is. Flattened together, both give
//! way. That takes time for every triangle of both, so it is done only where these are few.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use super::Piece;
use super::flat::{EFFORT, whole_or_disk};
use crate::patch::Patch;
use crate::refine::problem::Problem;

/// Charts of more triangles stay as they are.
const SMALL: usize = 64;

/// Two charts of more triangles together are not flattened anew.
const MOST: usize = 600;

/// Neighbours that are tried, those with the longest common border first.
const TRIED: usize = 4;

/// Makes small pieces of a patch parts of neighbours where that keeps the mean energy within the
/// bound.
pub(super) fn absorbed(
    patch: &Patch,
    pieces: Vec<Piece>,
    bound: f64,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Vec<Piece> {
    let mut of = vec![0; patch.areas.len()];
    let mut queue = BinaryHeap::new();
    for (number, piece) in (0..).zip(&pieces) {
        for &t in &piece.triangles {
            of[t as usize] = number;
        }
        if piece.triangles.len() <= SMALL {
            queue.push(Reverse((piece.triangles.len(), number)));
        }
    }
    let mut pieces: Vec<Option<Piece>> = pieces.into_iter().map(Some).collect();
    while let Some(Reverse((size, number))) = queue.pop() {
        let small = pieces[number as usize].as_ref();
        let Some(small) = small.filter(|small| small.triangles.len() == size && goes_on()) else {
            continue;
        };
        let found = neighbours(patch, small, &of).into_iter().find_map(|other| {
            let beside = pieces[other as usize].as_ref()?;
            Some((other, together(patch, small, beside, bound, goes_on)?))
        });
        let Some((other, union)) = found else {
            continue;
        };
        for &t in &union.triangles {
            of[t as usize] = other;
        }
        if union.triangles.len() <= SMALL {
            queue.push(Reverse((union.triangles.len(), other)));
        }
        pieces[number as usize] = None;
        pieces[other as usize] = Some(union);
    }
    pieces.into_iter().flatten().collect()
}

/// The charts beside one, those with the longest common border first.
fn neighbours(patch: &Patch, piece: &Piece, of: &[u32]) -> Vec<u32> {
    let own = piece.triangles.first().map(|&t| of[t as usize]);
    let mut borders: BTreeMap<u32, f64> = BTreeMap::new();
    for h in piece.triangles.iter().flat_map(|&t| 3 * t..3 * t + 3) {
        let beyond = patch.topology.twin(h).map(|twin| of[twin as usize / 3]);
        if let Some(other) = beyond.filter(|_| beyond != own) {
            *borders.entry(other).or_default() += patch.prices[h as usize];
        }
    }
    let mut order: Vec<(u32, f64)> = borders.into_iter().collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    order
        .into_iter()
        .map(|(other, _)| other)
        .take(TRIED)
        .collect()
}

/// Two neighbours as one chart, if that lies flat within the bound.
fn together(
    patch: &Patch,
    one: &Piece,
    other: &Piece,
    bound: f64,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Option<Piece> {
    if one.triangles.len() + other.triangles.len() > MOST {
        return None;
    }
    let mut triangles = [&one.triangles[..], &other.triangles].concat();
    triangles.sort_unstable();
    let own = patch.subset(&triangles);
    let mut problem = Problem::new(&own, own.without_forbidden(own.prices.clone()), &goes_on);
    problem.injective = true;
    let layout = problem.flattened(whole_or_disk(&problem), EFFORT).ok()?;
    let is_finite = layout.uv.iter().flatten().all(|c| c.is_finite());
    (is_finite && layout.energy <= bound).then_some(Piece { triangles, layout })
}

#[cfg(test)]
mod tests {
    use super::super::flat::lone_triangle;
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn triangles_become_few_charts_within_the_bound() {
        let patch = Patch::of(&shapes::open_sphere(1.2, 16, 8));
        let count = patch.areas.len() as u32;
        let alone = |bound: f64| {
            let pieces = (0..count).map(|t| lone_triangle(&patch, t)).collect();
            absorbed(&patch, pieces, bound, &|| true)
        };
        for (bound, most) in [(4.01, 60), (4.1, 20)] {
            let pieces = alone(bound);
            assert!(pieces.len() < most, "{bound} {}", pieces.len());
            assert!(pieces.iter().all(|piece| piece.layout.energy <= bound));
            let mut all: Vec<u32> = pieces.iter().flat_map(|p| p.triangles.clone()).collect();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn nothing_is_absorbed_once_it_is_to_stop() {
        let patch = Patch::of(&shapes::rectangle(1.0, 1.0, 2, 2));
        let pieces = (0..8).map(|t| lone_triangle(&patch, t)).collect();
        assert_eq!(absorbed(&patch, pieces, 4.1, &|| false).len(), 8);
    }
}
