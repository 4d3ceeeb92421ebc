use std::collections::HashMap;

use crate::UvMap;
use crate::sides::{edges, places};

use super::edges::Side;
use super::layout::Layout;
use super::stacks::Extent;

/// The connected pieces of a layout: triangles joined across the mesh edges at both ends
/// of which their UV coordinates are equal.
///
/// Disjoint sets, with the winding of each triangle relative to its parent.
pub(super) struct Charts {
    parents: Vec<u32>,
    sizes: Vec<u32>,
    opposed: Vec<bool>,
}

impl Charts {
    /// The charts of a layout. A triangle that repeats another (`first_alike`) is in its chart,
    /// of whatever winding. Two halves that are folded onto each other are not joined: see [`halves`].
    pub(super) fn new(layout: &Layout, uv: &UvMap, sides: &[Side], first_alike: &[u32]) -> Self {
        let mut charts = Self {
            parents: (0..layout.len() as u32).collect(),
            sizes: vec![1; layout.len()],
            opposed: vec![false; layout.len()],
        };
        let first = |side: &&Side| {
            let triangle = side.half_edge / 3;
            first_alike[triangle as usize] == triangle
        };
        for (t, &first) in (0..).zip(first_alike) {
            let is_left = |t: u32| layout.uv_double_area(t as usize) > 0.0;
            charts.join(t, first, is_left(t) != is_left(first));
        }
        let mut folds = Vec::new();
        for joined in edges(sides).flat_map(places) {
            let mut joined = joined.iter().filter(first);
            let Some(mut one) = joined.next() else {
                continue;
            };
            for other in joined {
                // Neighbours of the same winding run along their edge in opposite directions.
                let opposed = one.reversed == other.reversed;
                let [t, u] = [one, other].map(|side| side.half_edge / 3);
                let [a, b] = [t, u].map(|t| layout.uv_double_area(t as usize));
                let has_area = a != 0.0 && b != 0.0;
                let is_folded = has_area && ((a > 0.0) == (b > 0.0)) == opposed;
                match is_folded {
                    true => folds.push((t, u, opposed)),
                    false => charts.join(t, u, opposed),
                }
                one = other;
            }
        }
        if !folds.is_empty() {
            let are_halves = halves(&charts, uv, &folds, first_alike);
            for ((t, u, opposed), _) in folds.into_iter().zip(are_halves).filter(|(_, are)| !are) {
                charts.join(t, u, opposed);
            }
        }
        charts
    }

    /// How many charts there are, without those made of degenerate triangles only.
    pub(super) fn count(&self, layout: &Layout) -> usize {
        let mut counted = vec![false; self.parents.len()];
        for t in layout.measured() {
            counted[self.find(t as u32).0] = true;
        }
        counted.iter().filter(|&&chart| chart).count()
    }

    /// The chart of every triangle, counting from 0 in the order of their first triangles.
    pub(super) fn numbers(&self) -> Vec<u32> {
        let mut numbers = vec![None; self.parents.len()];
        let mut count = 0;
        (0..self.parents.len() as u32)
            .map(|t| {
                *numbers[self.find(t).0].get_or_insert_with(|| {
                    count += 1;
                    count - 1
                })
            })
            .collect()
    }

    /// The chart of a triangle, named by one of its triangles, and whether the windings of
    /// the two oppose each other.
    pub(super) fn find(&self, triangle: u32) -> (usize, bool) {
        let (mut at, mut opposed) = (triangle as usize, false);
        while self.parents[at] as usize != at {
            opposed ^= self.opposed[at];
            at = self.parents[at] as usize;
        }
        (at, opposed)
    }

    fn join(&mut self, a: u32, b: u32, opposed: bool) {
        let ((a, a_opposed), (b, b_opposed)) = (self.find(a), self.find(b));
        if a == b {
            return;
        }
        let (small, large) = if self.sizes[a] < self.sizes[b] {
            (a, b)
        } else {
            (b, a)
        };
        self.parents[small] = large as u32;
        self.sizes[large] += self.sizes[small];
        self.opposed[small] = opposed ^ a_opposed ^ b_opposed;
    }
}

/// For neighbours that are folded over, whether the pieces of the two are halves that share their
/// place. Pieces of a single triangle are none, since a triangle that is folded over looks just so.
fn halves(
    pieces: &Charts,
    uv: &UvMap,
    folds: &[(u32, u32, bool)],
    first_alike: &[u32],
) -> Vec<bool> {
    let folded = folds.iter().flat_map(|&(t, u, _)| [t, u]);
    let mut extents: HashMap<usize, Extent> = folded
        .map(|t| (pieces.find(t).0, Extent::default()))
        .collect();
    for (t, &first) in (0..).zip(first_alike) {
        if first == t
            && let Some(extent) = extents.get_mut(&pieces.find(t).0)
        {
            extent.add(uv.corners(t as usize));
        }
    }
    extents.values_mut().for_each(Extent::settle);
    let are_halves = |&(t, u, _): &(u32, u32, bool)| {
        let [one, other] = [t, u].map(|t| &extents[&pieces.find(t).0]);
        one.triangles() > 1 && one == other
    };
    folds.iter().map(are_halves).collect()
}
