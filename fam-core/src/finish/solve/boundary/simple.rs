use std::ops::ControlFlow;

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
        self.has_lengths(uv)
            && self.has_one_outer_loop(uv)
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
        match (self.next(i) == j, self.next(j) == i) {
            (true, true) => false,
            (true, false) => folds_back(self.ends(uv, i), self.ends(uv, j)),
            (false, true) => folds_back(self.ends(uv, j), self.ends(uv, i)),
            (false, false) => touch(self.ends(uv, i), self.ends(uv, j)),
        }
    }

    fn has_lengths(&self, uv: &[Point]) -> bool {
        (0..self.vertices.len()).all(|i| {
            let [a, b] = self.ends(uv, i);
            a[0].is_finite() && a[1].is_finite() && a != b
        })
    }

    /// The turn of a simple loop is that at its lowest vertex.
    fn has_one_outer_loop(&self, uv: &[Point]) -> bool {
        let is_outer = |edges: &std::ops::Range<usize>| {
            let lowest = edges.clone().min_by(|&i, &j| {
                let [a, b] = [i, j].map(|i| self.point(uv, self.next(i)));
                a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
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
