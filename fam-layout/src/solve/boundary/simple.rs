use std::cmp::Ordering;
use std::ops::{ControlFlow, Range};

use super::Boundary;
use super::candidates::Bounds;
use super::plane::{Point, orientation};

impl Boundary {
    /// Whether the loops are simple and disjoint and exactly one runs counter-clockwise;
    /// exact.
    ///
    /// Touching is not simple, nor is an edge without length or one that folds back onto the
    /// edge before it. A loop of two edges, which is a cut along a single inner edge, is one
    /// segment whatever the UVs, and holds for simple. `uv` has the position of every vertex
    /// of the chart; if one on the boundary is not finite, the answer is no.
    pub fn is_simple(&self, uv: &[Point]) -> bool {
        self.edges_have_length(uv)
            && (!self.is_whole || self.has_one_outer_loop(uv))
            && self
                .for_each_touching_pair(uv, |_, _| ControlFlow::Break(()))
                .is_continue()
    }

    /// Calls `visit` for each pair of edges that meet where they must not, until it breaks.
    pub(super) fn for_each_touching_pair(
        &self,
        uv: &[Point],
        mut visit: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let tree = self.tree(0.0, |i| Bounds::of(self.ends(uv, i)));
        tree.for_each_pair(|i, j| match self.meet(uv, i, j) {
            true => visit(i, j),
            false => ControlFlow::Continue(()),
        })
    }

    fn meet(&self, uv: &[Point], i: usize, j: usize) -> bool {
        match (self.follows(j, i), self.follows(i, j)) {
            (true, true) => false,
            (true, false) => folds_back(self.ends(uv, i), self.ends(uv, j)),
            (false, true) => folds_back(self.ends(uv, j), self.ends(uv, i)),
            (false, false) => touch(self.ends(uv, i), self.ends(uv, j)),
        }
    }

    fn edges_have_length(&self, uv: &[Point]) -> bool {
        (0..self.vertices.len()).all(|i| {
            let [a, b] = self.ends(uv, i);
            a[0].is_finite() && a[1].is_finite() && a != b
        })
    }

    /// The turn of a simple loop is that at its lowest vertex.
    fn has_one_outer_loop(&self, uv: &[Point]) -> bool {
        let is_outer = |edges: &Range<usize>| {
            let lowest = edges.clone().min_by(|&i, &j| {
                let [a, b] = [i, j].map(|i| self.ends(uv, i)[1]);
                a.partial_cmp(&b).unwrap_or(Ordering::Equal)
            });
            lowest.is_some_and(|i| {
                let ([a, b], [_, c]) = (self.ends(uv, i), self.ends(uv, self.next(i)));
                orientation(a, b, c) > 0.0
            })
        };
        self.loops.iter().filter(|edges| is_outer(edges)).count() == 1
    }
}

/// Whether two segments have a point in common.
fn touch(one: [Point; 2], other: [Point; 2]) -> bool {
    let signs = |[a, b]: [Point; 2], ends: [Point; 2]| {
        ends.map(|c| {
            let side = orientation(a, b, c);
            i8::from(side > 0.0) - i8::from(side < 0.0)
        })
    };
    let of_other = signs(one, other);
    if of_other[0] * of_other[1] > 0 {
        return false;
    }
    if of_other == [0, 0] {
        let (p, q) = (one, other);
        return (0..2).all(|k| {
            p[0][k].min(p[1][k]) <= q[0][k].max(q[1][k])
                && q[0][k].min(q[1][k]) <= p[0][k].max(p[1][k])
        });
    }
    let of_one = signs(other, one);
    of_one[0] * of_one[1] <= 0
}

/// Whether an edge runs back along the one before it.
fn folds_back([before, middle]: [Point; 2], [_, after]: [Point; 2]) -> bool {
    let sign = |p: Point, k: usize| p[k].partial_cmp(&middle[k]);
    orientation(before, middle, after) == 0.0 && (0..2).all(|k| sign(before, k) == sign(after, k))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::patch::topology::{Opened, Topology};
    use fam_surface::{TriangleMesh, shapes};

    /// A chart whose only loop runs through its vertices in their order.
    fn polygon(corners: usize) -> Boundary {
        let triangles = (1..corners as u32 - 1).map(|i| [0, i, i + 1]).collect();
        let positions = (0..corners).map(|i| [i as f64, (i * i) as f64, 0.0]);
        let mesh = TriangleMesh::new(positions.collect(), triangles).unwrap();
        Boundary::new(&Topology::oriented(&mesh).topology, |_| 1.0)
    }

    /// Counter-clockwise, no vertex on an edge that is not its own, no two edges crossing: from
    /// integers, for all pairs.
    fn brute_force(points: &[[i64; 2]]) -> bool {
        let n = points.len();
        let det = |a: [i64; 2], b: [i64; 2], c: [i64; 2]| {
            ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).signum()
        };
        let within = |c: [i64; 2], a: [i64; 2], b: [i64; 2]| {
            let to_ends = (a[0] - c[0]) * (b[0] - c[0]) + (a[1] - c[1]) * (b[1] - c[1]);
            det(a, b, c) == 0 && to_ends <= 0
        };
        let edge = |i: usize| (points[i], points[(i + 1) % n]);
        let double_area: i64 = (0..n)
            .map(edge)
            .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
            .sum();
        double_area > 0
            && (0..n).all(|i| {
                let (a, b) = edge(i);
                let vertices_off = (0..n)
                    .filter(|&k| k != i && k != (i + 1) % n)
                    .all(|k| !within(points[k], a, b));
                let no_crossing = (0..n).all(|j| {
                    let (c, d) = edge(j);
                    det(a, b, c) * det(a, b, d) >= 0 || det(c, d, a) * det(c, d, b) >= 0
                });
                a != b && vertices_off && no_crossing
            })
    }

    #[test]
    fn lattice_polygons_agree_with_brute_force() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut simple = 0;
        for round in 0..20_000 {
            let corners = 3 + round % 6;
            let size = 2 + round as i64 % 7;
            let points: Vec<[i64; 2]> = (0..corners)
                .map(|_| [0; 2].map(|_| rng.random_range(0..=size)))
                .collect();
            let expected = brute_force(&points);
            simple += u32::from(expected);
            let uv: Vec<Point> = points.iter().map(|q| q.map(|x| x as f64)).collect();
            assert_eq!(polygon(corners).is_simple(&uv), expected, "{points:?}");
        }
        assert!(simple > 1000, "{simple}");
    }

    /// Polygons of many edges of very different lengths, simple by construction.
    fn large_polygons() -> Vec<Vec<[i64; 2]>> {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let star: Vec<[i64; 2]> = (0..400)
            .map(|i| {
                let radius = 1e6 * rng.random_range(0.1..1.0);
                let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 400.0).sin_cos();
                [(radius * cos) as i64, (radius * sin) as i64]
            })
            .collect();
        let comb: Vec<[i64; 2]> = (0..100)
            .flat_map(|i| [[2 * i, 1], [2 * i, 1000], [2 * i + 1, 1000], [2 * i + 1, 1]])
            .chain([[199, 0], [0, 0]])
            .rev()
            .collect();
        let arm = |i: i64, off: i64| {
            let (side, radius) = (i % 4, 10 * (i / 4) + 20 + off);
            match side {
                0 => [radius, -radius],
                1 => [radius, radius],
                2 => [-radius, radius],
                _ => [-radius, -radius - 10],
            }
        };
        let spiral: Vec<[i64; 2]> = (0..60)
            .map(|i| arm(i, 4))
            .chain((0..60).rev().map(|i| arm(i, 0)))
            .collect();
        vec![star, comb, spiral]
    }

    #[test]
    fn stars_combs_and_spirals_are_simple_until_a_vertex_is_moved_onto_an_edge() {
        for (kind, points) in large_polygons().into_iter().enumerate() {
            assert!(brute_force(&points), "{kind}");
            let uv: Vec<Point> = points.iter().map(|q| q.map(|x| x as f64)).collect();
            let boundary = polygon(points.len());
            assert!(boundary.is_simple(&uv), "{kind}");
            let clockwise: Vec<Point> = uv.iter().rev().copied().collect();
            assert!(!boundary.is_simple(&clockwise), "{kind}");
            let mut rng = Pcg64Mcg::seed_from_u64(3);
            for _ in 0..40 {
                let mut moved = points.clone();
                let [i, j] = [0; 2].map(|_| rng.random_range(0..points.len()));
                moved[i] = [0, 1].map(|k| points[j][k] + rng.random_range(-1..=1));
                let uv: Vec<Point> = moved.iter().map(|q| q.map(|x| x as f64)).collect();
                assert_eq!(boundary.is_simple(&uv), brute_force(&moved), "{kind}");
            }
        }
    }

    #[test]
    fn the_two_zeros_are_one() {
        let sides = [[1.0, 0.0], [1.0, 2.0], [0.0, 2.0], [-0.0, 1.0], [0.0, 0.0]];
        assert!(polygon(5).is_simple(&sides));
    }

    #[test]
    fn what_is_not_finite_is_not_simple() {
        let boundary = polygon(4);
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!(boundary.is_simple(&square));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for k in 0..8 {
                let mut uv = square;
                uv[k / 2][k % 2] = bad;
                assert!(!boundary.is_simple(&uv));
                boundary.close_pairs(&uv, 2.0);
            }
        }
    }

    /// Concentric circles run one each way; apart from each other, both could be counter-clockwise.
    #[test]
    fn loops_are_disjoint_and_exactly_one_is_outer() {
        let mesh = shapes::open_cylinder(1.0, 1.0, 16, 1);
        let Opened { topology, source } = Topology::oriented(&mesh);
        let boundary = Boundary::new(&topology, |_| 1.0);
        let is_simple = |radii: [f64; 2], mirror: f64, off: f64| {
            let uv: Vec<Point> = source
                .iter()
                .map(|&v| {
                    let [x, y, z] = mesh.positions()[v as usize];
                    match z > 0.0 {
                        true => [off + radii[1] * x, mirror * radii[1] * y],
                        false => [radii[0] * x, radii[0] * y],
                    }
                })
                .collect();
            boundary.is_simple(&uv)
        };
        assert!(is_simple([1.0, 2.0], 1.0, 0.0));
        assert!(is_simple([2.0, 1.0], 1.0, 0.9));
        assert!(!is_simple([2.0, 1.0], 1.0, 1.0), "touch");
        assert!(!is_simple([2.0, 1.0], 1.0, 2.0), "cross");
        assert!(!is_simple([1.0, 1.0], 1.0, 0.0), "coincide");
        assert!(is_simple([2.0, 1.0], 1.0, 4.0), "beside each other");
        assert!(!is_simple([2.0, 1.0], -1.0, 4.0), "both the same way round");
    }
}
