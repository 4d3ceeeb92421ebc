//! Charts that lie on one another.

use std::collections::HashMap;

use crate::UvMap;

use super::charts::Charts;
use super::layout::Layout;

/// The three UVs of a triangle, as bit patterns in ascending order; −0 and 0 are one.
pub(super) type Place = [[u32; 2]; 3];

/// Where a triangle lies, in whatever order its corners are.
pub(super) fn place(corners: [[f32; 2]; 3]) -> Place {
    let mut place = corners.map(|q| q.map(|c| (c + 0.0).to_bits()));
    place.sort_unstable();
    place
}

/// Where a chart lies: how many triangles it has, without those that repeat another, and their UVs, as
/// bit patterns in ascending order, each once.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Extent {
    triangles: usize,
    points: Vec<[u32; 2]>,
}

impl Extent {
    /// Adds a triangle.
    pub(super) fn add(&mut self, corners: [[f32; 2]; 3]) {
        self.triangles += 1;
        self.points.extend(place(corners));
    }

    /// Puts the points in order.
    pub(super) fn settle(&mut self) {
        self.points.sort_unstable();
        self.points.dedup();
    }

    /// How many triangles there are.
    pub(super) fn triangles(&self) -> usize {
        self.triangles
    }
}

/// Charts by number, and which of them are stacked.
///
/// Charts are stacked if they have the same points, bit for bit, and as many triangles. So a mirrored
/// copy of a chart is in its stack too, also where its quads are divided along their other diagonals.
/// Triangles that repeat another one of their chart do not matter, and charts without UV area are in no
/// stack.
pub(super) struct Stacks {
    /// The chart of every triangle, counting from 0 in the order of their first triangles.
    pub of_triangle: Vec<u32>,
    /// For every chart the first of its stack; a chart that lies alone has itself.
    pub first: Vec<u32>,
}

impl Stacks {
    pub(super) fn new(layout: &Layout, uv: &UvMap, charts: &Charts, first_alike: &[u32]) -> Self {
        let of_triangle = charts.numbers();
        let count = of_triangle.iter().max().map_or(0, |&last| last + 1);
        let mut first: Vec<u32> = (0..count).collect();
        let mut has_area = vec![false; first.len()];
        let mut extents = vec![Extent::default(); first.len()];
        for (t, &chart) in of_triangle.iter().enumerate() {
            has_area[chart as usize] |= layout.uv_double_area(t) != 0.0;
            if first_alike[t] as usize == t {
                extents[chart as usize].add(uv.corners(t));
            }
        }
        let mut known: HashMap<Extent, u32> = HashMap::new();
        for (chart, mut extent) in (0..).zip(extents) {
            if has_area[chart as usize] {
                extent.settle();
                first[chart as usize] = *known.entry(extent).or_insert(chart);
            }
        }
        Self { of_triangle, first }
    }

    /// How many charts lie on an earlier one.
    pub(super) fn stacked(&self) -> usize {
        let is_stacked = |&(chart, &first): &(u32, &u32)| first != chart;
        (0..).zip(&self.first).filter(is_stacked).count()
    }

    /// How many charts are mirrored: most of their triangles are clockwise, by the winding of the mesh.
    pub(super) fn mirrored(&self, layout: &Layout, first_alike: &[u32]) -> usize {
        let mut balance = vec![0_i64; self.first.len()];
        for (t, &chart) in self.of_triangle.iter().enumerate() {
            if first_alike[t] as usize == t {
                let area = layout.uv_double_area(t);
                balance[chart as usize] += i64::from(area > 0.0) - i64::from(area < 0.0);
            }
        }
        balance.iter().filter(|&&balance| balance < 0).count()
    }

    /// The stack of a triangle, named by its first chart.
    pub(super) fn of(&self, triangle: u32) -> u32 {
        self.first[self.of_triangle[triangle as usize] as usize]
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::{Metrics, for_each_overlapping_pair};
    use crate::{TriangleMesh, UvMap};

    /// Squares of two triangles at heights of their own, with the UVs of the corners.
    fn squares(uvs: &[[[f32; 2]; 4]]) -> (TriangleMesh, UvMap) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let at = |z: usize| corners.map(|[x, y]| [x, y, z as f64]);
        let positions = (0..uvs.len()).flat_map(at).collect();
        let quad = |k: u32| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| 4 * k + v));
        let triangles: Vec<[u32; 3]> = (0..uvs.len() as u32).flat_map(quad).collect();
        (
            TriangleMesh::new(positions, triangles.clone()).unwrap(),
            UvMap::new(uvs.concat(), triangles).unwrap(),
        )
    }

    #[test]
    fn stacked_and_mirrored_charts_are_counted_apart() {
        let square = |x: f32| [[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]];
        let mirrored = |x: f32| {
            let [a, b, c, d] = square(x);
            [c, b, a, d]
        };
        let of = |uvs: &[[[f32; 2]; 4]]| {
            let (mesh, uv) = squares(uvs);
            let metrics = Metrics::measure(&mesh, &uv).unwrap();
            let mut all = 0;
            for_each_overlapping_pair(&uv, |_| all += 1);
            assert_eq!(metrics.overlapping_pairs, all);
            assert_eq!(metrics.flipped_triangles, 0);
            let stacked = metrics.overlapping_pairs - metrics.unintended_overlaps();
            assert_eq!(metrics.stacked_pairs, stacked);
            [
                metrics.overlapping_pairs,
                metrics.stacked_pairs,
                metrics.stacked_charts,
                metrics.mirrored_charts,
            ]
        };
        assert_eq!(of(&[square(0.0), square(3.0)]), [0; 4]);
        assert_eq!(of(&[square(0.0), mirrored(3.0)]), [0, 0, 0, 1]);
        // Two triangles, each over one.
        assert_eq!(of(&[square(0.0), mirrored(0.0)]), [2, 2, 1, 1]);
        assert_eq!(of(&[square(0.0); 4]), [12, 12, 3, 0]);
        // A square between two, half over each, and one that is on it. Over a square's common half lie a
        // part of each of the other's triangles.
        let beside = of(&[square(0.0), square(0.5), square(1.0), square(0.5)]);
        assert_eq!(beside[1..], [2, 1, 0]);
        assert!(beside[0] > 2);
        // Moved by the least possible, it is not stacked.
        let near = [[0.0, f32::MIN_POSITIVE], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let found = of(&[square(0.0), near]);
        assert_eq!(found[1..], [0; 3]);
        assert!(found[0] >= 2);
        // All of nothing is no stack.
        assert_eq!(of(&[[[0.0; 2]; 4]; 3]), [0; 4]);
    }

    /// A strip folded along its middle: the two halves share their place and are charts of their own.
    /// Folded elsewhere, it has flipped triangles.
    #[test]
    fn halves_that_are_folded_onto_each_other_are_a_stack() {
        let mesh = crate::shapes::rectangle(2.0, 1.0, 4, 2);
        let of = |fold: f64| {
            let place = |p: &[f64; 3]| [(p[0] - fold).abs() as f32, p[1] as f32];
            let uvs = mesh.positions().iter().map(place).collect();
            let uv = UvMap::new(uvs, mesh.triangles().to_vec()).unwrap();
            let metrics = Metrics::measure(&mesh, &uv).unwrap();
            (
                metrics.charts,
                metrics.stacked_charts,
                metrics.mirrored_charts,
                metrics.flipped_triangles,
                metrics.unintended_overlaps() > 0,
            )
        };
        assert_eq!(of(-1.0), (1, 0, 0, 0, false));
        assert_eq!(of(0.5).3, 4);
        assert!(of(0.5).4);
        // Also where diagonals run the same way on both sides.
        assert_eq!(of(0.0), (2, 1, 1, 0, false));
        let glued = crate::TriangleMesh::new(
            [
                [0.0, 0.0],
                [0.0, 1.0],
                [1.0, 0.0],
                [1.0, 1.0],
                [-1.0, 0.0],
                [-1.0, 1.0],
            ]
            .map(|[x, y]| [x, y, 0.0])
            .to_vec(),
            vec![[0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 1, 5]],
        )
        .unwrap();
        let place = |p: &[f64; 3]| [p[0].abs() as f32, p[1] as f32];
        let uvs = glued.positions().iter().map(place).collect();
        let uv = UvMap::new(uvs, glued.triangles().to_vec()).unwrap();
        let metrics = Metrics::measure(&glued, &uv).unwrap();
        assert_eq!((metrics.charts, metrics.flipped_triangles), (2, 0));
        assert_eq!((metrics.stacked_charts, metrics.mirrored_charts), (1, 1));
        assert_eq!(metrics.unintended_overlaps(), 0);
    }

    /// Chance places on a small lattice, where many triangles coincide: the same as one by one.
    #[test]
    fn overlaps_of_coinciding_triangles_are_those_of_all_pairs() {
        for seed in 0..30 {
            let mut random = Pcg64::seed_from_u64(seed);
            let count = random.random_range(2..40);
            let uvs: Vec<[[f32; 2]; 4]> = (0..count)
                .map(|_| std::array::from_fn(|_| [0; 2].map(|_| random.random_range(0..3) as f32)))
                .collect();
            let (mesh, uv) = squares(&uvs);
            let (mut all, mut stacked) = (0, 0);
            let canonical = |t: usize| {
                let mut corners = uv.corners(t).map(|q| q.map(|c| c as i32));
                corners.sort_unstable();
                corners
            };
            // A square is a chart of two triangles.
            let chart = |k: usize| {
                let mut own = [canonical(2 * k), canonical(2 * k + 1)].concat();
                own.sort_unstable();
                own.dedup();
                own
            };
            for_each_overlapping_pair(&uv, |[a, b]| {
                all += 1;
                let [a, b] = [a, b].map(|t| t as usize / 2);
                stacked += u64::from(a != b && chart(a) == chart(b));
            });
            let metrics = Metrics::measure(&mesh, &uv).unwrap();
            assert_eq!(
                (metrics.overlapping_pairs, metrics.stacked_pairs),
                (all, stacked)
            );
        }
    }
}
