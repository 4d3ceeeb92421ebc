use std::ops::{ControlFlow, Range};

use robust::{Coord, orient2d};

use crate::UvMap;

use super::layout::signed_double_area;
use super::places::{Pairs, Places};

/// Calls `visit` once for each pair of triangles whose interiors intersect in UV space,
/// with their indices in ascending order.
///
/// Triangles that touch in a point or along an edge do not overlap, and a triangle without
/// UV area overlaps nothing; the predicates are exact. The order of the pairs is
/// unspecified but always the same. There may be a pair for every two triangles, so a
/// caller should not collect them without need.
pub fn for_each_overlapping_pair(uv: &UvMap, mut visit: impl FnMut([u32; 2])) {
    let every = |pair: [u32; 2]| {
        visit(pair);
        ControlFlow::Continue(())
    };
    // It never breaks off.
    let _ = overlapping_pairs_among(uv, 0..uv.triangles().len() as u32, every);
}

/// The same among some triangles, until `visit` breaks off.
pub(super) fn overlapping_pairs_among(
    uv: &UvMap,
    triangles: impl Iterator<Item = u32>,
    mut visit: impl FnMut([u32; 2]) -> ControlFlow<()>,
) -> ControlFlow<()> {
    match Tree::new(uv, triangles) {
        Some(tree) => tree.pairs_within(tree.root(), &mut visit),
        None => ControlFlow::Continue(()),
    }
}

/// The pairs of triangles whose interiors intersect in UV space. Those that are one triangle twice
/// do not count.
pub(super) fn overlapping_pairs(uv: &UvMap, places: &Places) -> Pairs {
    let mut pairs = places.within_each();
    let between = |[a, b]: [u32; 2]| {
        pairs.add(places.between(a, b));
        ControlFlow::Continue(())
    };
    let _ = overlapping_pairs_among(uv, places.firsts(), between);
    pairs
}

/// Overlapping pairs in percent of all pairs of triangles; 0 for a single triangle.
pub(super) fn overlap_percentage(overlapping_pairs: u64, triangles: usize) -> f64 {
    let all = 0.5 * triangles as f64 * (triangles as f64 - 1.0);
    if all > 0.0 {
        100.0 * overlapping_pairs as f64 / all
    } else {
        0.0
    }
}

#[derive(Clone, Copy)]
struct Bounds {
    low: [f32; 2],
    high: [f32; 2],
}

impl Bounds {
    fn of(corners: [[f32; 2]; 3]) -> Self {
        let [a, b, c] = corners.map(|q| Self { low: q, high: q });
        a.union(b).union(c)
    }

    fn union(self, other: Self) -> Self {
        Self {
            low: [0, 1].map(|k| self.low[k].min(other.low[k])),
            high: [0, 1].map(|k| self.high[k].max(other.high[k])),
        }
    }

    fn interiors_intersect(&self, other: &Self) -> bool {
        (0..2).all(|k| self.low[k] < other.high[k] && other.low[k] < self.high[k])
    }

    fn side(&self, axis: usize) -> f64 {
        f64::from(self.high[axis]) - f64::from(self.low[axis])
    }

    fn double_center(&self, axis: usize) -> f64 {
        f64::from(self.low[axis]) + f64::from(self.high[axis])
    }
}

/// A UV triangle with a non-empty interior.
struct Triangle {
    index: u32,
    /// Counter-clockwise.
    corners: [Coord<f64>; 3],
    bounds: Bounds,
}

impl Triangle {
    fn new(index: u32, mut corners: [[f32; 2]; 3]) -> Option<Self> {
        let area = signed_double_area(corners);
        if area < 0.0 {
            corners.swap(1, 2);
        }
        (area != 0.0).then(|| Self {
            index,
            corners: corners.map(|[x, y]| Coord {
                x: x.into(),
                y: y.into(),
            }),
            bounds: Bounds::of(corners),
        })
    }

    /// Two convex polygons have disjoint interiors exactly if the line through an edge of
    /// either separates them.
    fn overlaps(&self, other: &Self) -> bool {
        self.bounds.interiors_intersect(&other.bounds)
            && !self.has_separating_edge(other)
            && !other.has_separating_edge(self)
    }

    fn has_separating_edge(&self, other: &Self) -> bool {
        let [a, b, c] = self.corners;
        [[a, b], [b, c], [c, a]].into_iter().any(|[start, end]| {
            other
                .corners
                .iter()
                .all(|&corner| orient2d(start, end, corner) <= 0.0)
        })
    }
}

/// A binary tree of bounding boxes, split at the median of the box centres, so that its
/// depth is logarithmic whatever the triangles are.
struct Tree {
    triangles: Vec<Triangle>,
    /// Children precede their parents.
    nodes: Vec<Node>,
}

struct Node {
    bounds: Bounds,
    triangles: Range<usize>,
    children: Option<[usize; 2]>,
}

impl Tree {
    const LEAF: usize = 4;

    /// The tree of those of some triangles that have UV area, if there are any.
    fn new(uv: &UvMap, triangles: impl Iterator<Item = u32>) -> Option<Self> {
        let triangles: Vec<Triangle> = triangles
            .filter_map(|t| Triangle::new(t, uv.corners(t as usize)))
            .collect();
        let all = 0..triangles.len();
        let mut tree = Self {
            triangles,
            nodes: Vec::new(),
        };
        tree.build(all)?;
        Some(tree)
    }

    fn build(&mut self, range: Range<usize>) -> Option<usize> {
        let triangles = &mut self.triangles[range.clone()];
        let bounds = triangles
            .iter()
            .map(|triangle| triangle.bounds)
            .reduce(Bounds::union)?;
        let children = if triangles.len() > Self::LEAF {
            let axis = usize::from(bounds.side(1) > bounds.side(0));
            let half = triangles.len() / 2;
            triangles.select_nth_unstable_by(half, |a, b| {
                let [a, b] = [a, b].map(|triangle| triangle.bounds.double_center(axis));
                a.total_cmp(&b)
            });
            let middle = range.start + half;
            Some([
                self.build(range.start..middle)?,
                self.build(middle..range.end)?,
            ])
        } else {
            None
        };
        self.nodes.push(Node {
            bounds,
            triangles: range,
            children,
        });
        Some(self.nodes.len() - 1)
    }

    fn root(&self) -> &Node {
        &self.nodes[self.nodes.len() - 1]
    }

    fn pairs_within(&self, node: &Node, visit: &mut impl Visit) -> ControlFlow<()> {
        if let Some(children) = node.children {
            let [left, right] = children.map(|child| &self.nodes[child]);
            self.pairs_within(left, visit)?;
            self.pairs_within(right, visit)?;
            self.pairs_between(left, right, visit)
        } else {
            let triangles = &self.triangles[node.triangles.clone()];
            (0..)
                .zip(triangles)
                .try_for_each(|(i, a)| visit_overlaps(a, &triangles[i + 1..], visit))
        }
    }

    fn pairs_between(&self, a: &Node, b: &Node, visit: &mut impl Visit) -> ControlFlow<()> {
        if !a.bounds.interiors_intersect(&b.bounds) {
            return ControlFlow::Continue(());
        }
        let (fewer, more) = if a.triangles.len() < b.triangles.len() {
            (a, b)
        } else {
            (b, a)
        };
        if let Some(children) = more.children {
            children
                .into_iter()
                .try_for_each(|child| self.pairs_between(fewer, &self.nodes[child], visit))
        } else {
            self.triangles[fewer.triangles.clone()]
                .iter()
                .try_for_each(|triangle| {
                    visit_overlaps(triangle, &self.triangles[more.triangles.clone()], visit)
                })
        }
    }
}

/// What is done with an overlapping pair; it may break off.
trait Visit: FnMut([u32; 2]) -> ControlFlow<()> {}

impl<F: FnMut([u32; 2]) -> ControlFlow<()>> Visit for F {}

fn visit_overlaps(a: &Triangle, others: &[Triangle], visit: &mut impl Visit) -> ControlFlow<()> {
    let mut overlapping = others.iter().filter(|b| a.overlaps(b));
    overlapping.try_for_each(|b| visit([a.index.min(b.index), a.index.max(b.index)]))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    type Lattice = [[i64; 2]; 3];

    fn soup(triangles: &[Lattice], scale: f32) -> UvMap {
        let uvs = triangles
            .iter()
            .flatten()
            .map(|q| q.map(|c| c as f32 * scale))
            .collect();
        let indices = (0..triangles.len() as u32).map(|t| [0, 1, 2].map(|c| 3 * t + c));
        UvMap::new(uvs, indices.collect()).unwrap()
    }

    /// The pairs found, each of which must be found once.
    fn found(uv: &UvMap) -> BTreeSet<[u32; 2]> {
        let mut pairs = BTreeSet::new();
        for_each_overlapping_pair(uv, |pair| {
            assert!(pair[0] < pair[1]);
            assert!(pairs.insert(pair), "{pair:?} is reported twice");
        });
        pairs
    }

    fn expected(
        triangles: &[Lattice],
        overlap: impl Fn(Lattice, Lattice) -> bool,
    ) -> BTreeSet<[u32; 2]> {
        let mut pairs = BTreeSet::new();
        for (j, &b) in triangles.iter().enumerate() {
            for (i, &a) in triangles[..j].iter().enumerate() {
                if overlap(a, b) {
                    pairs.insert([i as u32, j as u32]);
                }
            }
        }
        pairs
    }

    /// Whether the intersection polygon has area: `a` clipped at the edges of `b`, in exact
    /// homogeneous coordinates.
    fn clipped_polygon_has_area(a: Lattice, b: Lattice) -> bool {
        let gcd = |mut x: i128, mut y: i128| {
            while y != 0 {
                (x, y) = (y, x % y);
            }
            x.abs()
        };
        let det = |p: [i128; 3], q: [i128; 3], r: [i128; 3]| {
            p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0])
                + p[2] * (q[0] * r[1] - q[1] * r[0])
        };
        let homogeneous = |q: [i64; 2]| [i128::from(q[0]), i128::from(q[1]), 1];
        let mut polygon: Vec<[i128; 3]> = a.iter().map(|&q| homogeneous(q)).collect();
        let mut clip = b.map(homogeneous);
        match det(clip[0], clip[1], clip[2]) {
            0 => return false,
            d if d < 0 => clip.swap(0, 1),
            _ => (),
        }
        for (start, end) in [(0, 1), (1, 2), (2, 0)] {
            let side = |p: [i128; 3]| det(clip[start], clip[end], p);
            let mut clipped = Vec::new();
            for (i, &p) in polygon.iter().enumerate() {
                let q = polygon[(i + 1) % polygon.len()];
                let (s, r) = (side(p), side(q));
                if s >= 0 {
                    clipped.push(p);
                }
                if s.signum() * r.signum() < 0 {
                    let cut = [0, 1, 2].map(|k| s.abs() * q[k] + r.abs() * p[k]);
                    let divisor = gcd(gcd(cut[0], cut[1]), cut[2]);
                    clipped.push(cut.map(|c| c / divisor));
                }
            }
            polygon = clipped;
        }
        (2..polygon.len()).any(|i| det(polygon[0], polygon[i - 1], polygon[i]) != 0)
    }

    /// Whether the shadows of the two on every edge normal intersect.
    fn projections_overlap(a: Lattice, b: Lattice) -> bool {
        let area = |t: Lattice| {
            let [[ax, ay], [bx, by], [cx, cy]] = t.map(|q| q.map(i128::from));
            (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        };
        let axes = [a, b]
            .into_iter()
            .flat_map(|t| [0, 1, 2].map(|i| [t[i], t[(i + 1) % 3]]))
            .map(|[p, q]| [i128::from(p[1] - q[1]), i128::from(q[0] - p[0])]);
        area(a) != 0
            && area(b) != 0
            && axes.into_iter().all(|axis| {
                let shadow = |t: Lattice| {
                    let on_axis =
                        t.map(|q| axis[0] * i128::from(q[0]) + axis[1] * i128::from(q[1]));
                    let (low, high) = (on_axis.iter().min(), on_axis.iter().max());
                    [*low.unwrap(), *high.unwrap()]
                };
                let ([a_low, a_high], [b_low, b_high]) = (shadow(a), shadow(b));
                a_low < b_high && b_low < a_high
            })
    }

    #[test]
    fn touching_lattice_triangles_agree_with_exact_clipping() {
        for (seed, size, count) in [(1, 3, 60), (2, 5, 120), (3, 9, 200), (4, 40, 200)] {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let triangles: Vec<Lattice> = (0..count)
                .map(|_| std::array::from_fn(|_| [0; 2].map(|_| rng.random_range(0..size))))
                .collect();
            let pairs = expected(&triangles, clipped_polygon_has_area);
            assert!(!pairs.is_empty());
            assert_eq!(found(&soup(&triangles, 1.0)), pairs, "seed {seed}");
            assert_eq!(pairs, expected(&triangles, projections_overlap));
        }
    }

    #[test]
    fn slivers_agree_with_integer_projections() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let far = 1 << 23;
        let triangles: Vec<Lattice> = (0..300)
            .map(|_| {
                let base = rng.random_range(0..8);
                std::array::from_fn(|_| {
                    let x = rng.random_range(0..far);
                    [x, (x + base).clamp(0, far) + rng.random_range(-1..=1)]
                })
            })
            .collect();
        let pairs = expected(&triangles, projections_overlap);
        assert!(pairs.len() > 100 && pairs.len() < 300 * 299 / 4);
        for scale in [1.0, (-40.0_f32).exp2(), 100.0_f32.exp2()] {
            assert_eq!(found(&soup(&triangles, scale)), pairs);
        }
    }

    #[test]
    fn sizes_may_differ_without_bound() {
        let mut rng = Pcg64Mcg::seed_from_u64(6);
        let mut triangles: Vec<Lattice> = (0..400)
            .map(|i| {
                let size = 1 << (i % 23);
                let corner = [0; 2].map(|_| rng.random_range(0..(1 << 23)));
                std::array::from_fn(|_| corner.map(|c| c + rng.random_range(0..=size)))
            })
            .collect();
        triangles.push([[-1, -1], [1 << 24, -1], [-1, 1 << 24]]);
        assert_eq!(
            found(&soup(&triangles, 1.0)),
            expected(&triangles, projections_overlap)
        );
    }

    #[test]
    fn a_triangle_overlaps_its_copy_and_its_mirror_image_but_nothing_collapsed() {
        let triangle = [[0, 0], [4, 0], [0, 4]];
        let mirrored = [[0, 0], [0, 4], [4, 0]];
        let point = [[1, 1], [1, 1], [1, 1]];
        let segment = [[1, 1], [2, 2], [0, 0]];
        let neighbour = [[4, 0], [4, 4], [0, 4]];
        let uv = soup(
            &[triangle, triangle, mirrored, point, segment, neighbour],
            0.1,
        );
        assert_eq!(found(&uv), BTreeSet::from([[0, 1], [0, 2], [1, 2]]));
        assert!(found(&soup(&[point, segment], 1.0)).is_empty());
    }

    #[test]
    fn percentage_is_of_all_pairs() {
        assert_eq!(overlap_percentage(3, 4), 50.0);
        assert_eq!(overlap_percentage(0, 1), 0.0);
    }
}
