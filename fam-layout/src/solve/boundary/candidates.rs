use std::ops::{ControlFlow, Range};

use super::plane::Point;

/// An upright rectangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    low: Point,
    high: Point,
}

impl Bounds {
    pub fn of(ends: [Point; 2]) -> Self {
        let [a, b] = ends;
        Self {
            low: [0, 1].map(|k| a[k].min(b[k])),
            high: [0, 1].map(|k| a[k].max(b[k])),
        }
    }

    /// That of points; none if there are none.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        let all = points.into_iter().map(|p| Self::of([p, p]));
        all.reduce(Self::union)
    }

    /// With so much more room on every side.
    pub fn widened(self, by: f64) -> Self {
        Self {
            low: self.low.map(|c| c - by),
            high: self.high.map(|c| c + by),
        }
    }

    /// Whether a point is in it.
    pub fn contains(&self, point: Point) -> bool {
        (0..2).all(|k| self.low[k] <= point[k] && point[k] <= self.high[k])
    }

    /// Whether both have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        (0..2).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    pub fn union(self, other: Self) -> Self {
        Self {
            low: [0, 1].map(|k| self.low[k].min(other.low[k])),
            high: [0, 1].map(|k| self.high[k].max(other.high[k])),
        }
    }

    /// The axis along which it is longer.
    pub fn longer_axis(&self) -> usize {
        usize::from(self.side(1) > self.side(0))
    }

    /// The length of its longer side.
    pub fn longest_side(&self) -> f64 {
        self.side(self.longer_axis())
    }

    fn side(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }

    fn double_center(&self, axis: usize) -> f64 {
        self.high[axis] + self.low[axis]
    }
}

/// A rectangle and how far off something may be that matters to what is in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Boxed {
    pub bounds: Bounds,
    pub reach: f64,
}

impl Boxed {
    fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            reach: self.reach.max(other.reach),
        }
    }

    /// Whether each may be in reach of the other; boxes that touch always are.
    fn is_close(&self, other: &Self) -> bool {
        let reach = self.reach.min(other.reach);
        let (a, b) = (&self.bounds, &other.bounds);
        (0..2).all(|k| a.low[k] <= b.high[k] + reach && b.low[k] <= a.high[k] + reach)
    }
}

/// A binary tree over the edges of the boundary, a few consecutive ones to a leaf, split at
/// the median of the leaves' centres.
pub(super) struct Tree {
    boxes: Vec<Boxed>,
    leaves: Vec<Leaf>,
    /// Children precede their parents.
    nodes: Vec<Node>,
}

struct Leaf {
    extent: Boxed,
    edges: Range<usize>,
}

struct Node {
    extent: Boxed,
    leaves: Range<usize>,
    children: Option<[usize; 2]>,
}

impl Tree {
    const LEAF: usize = 4;

    pub fn new(boxes: Vec<Boxed>, loops: &[Range<usize>]) -> Self {
        let mut leaves = Vec::with_capacity(boxes.len() / Self::LEAF + loops.len());
        for edges in loops {
            for start in edges.clone().step_by(Self::LEAF) {
                let edges = start..(start + Self::LEAF).min(edges.end);
                let extent = boxes[edges.clone()].iter().copied().reduce(Boxed::union);
                leaves.extend(extent.map(|extent| Leaf { extent, edges }));
            }
        }
        let all = 0..leaves.len();
        let mut tree = Self {
            boxes,
            nodes: Vec::with_capacity(2 * leaves.len()),
            leaves,
        };
        tree.build(all);
        tree
    }

    /// Calls `visit` once for each pair of different edges whose boxes are close, in no
    /// particular order, until it breaks.
    pub fn for_each_pair(
        &self,
        mut visit: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        match self.nodes.last() {
            Some(root) => self.pairs_within(root, &mut visit),
            None => ControlFlow::Continue(()),
        }
    }

    fn build(&mut self, range: Range<usize>) -> Option<usize> {
        let leaves = &mut self.leaves[range.clone()];
        let extent = leaves.iter().map(|leaf| leaf.extent).reduce(Boxed::union)?;
        let children = if leaves.len() > 1 {
            let axis = extent.bounds.longer_axis();
            let half = leaves.len() / 2;
            leaves.select_nth_unstable_by(half, |a, b| {
                let [a, b] = [a, b].map(|leaf| leaf.extent.bounds.double_center(axis));
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
            extent,
            leaves: range,
            children,
        });
        Some(self.nodes.len() - 1)
    }

    fn pairs_within(
        &self,
        node: &Node,
        visit: &mut impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if let Some(children) = node.children {
            let [left, right] = children.map(|child| &self.nodes[child]);
            self.pairs_within(left, visit)?;
            self.pairs_within(right, visit)?;
            return self.pairs_between(left, right, visit);
        }
        let edges = self.leaves[node.leaves.start].edges.clone();
        for i in edges.clone() {
            for j in i + 1..edges.end {
                self.visit_if_close(i, j, visit)?;
            }
        }
        ControlFlow::Continue(())
    }

    fn pairs_between(
        &self,
        a: &Node,
        b: &Node,
        visit: &mut impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if !a.extent.is_close(&b.extent) {
            return ControlFlow::Continue(());
        }
        let (fewer, more) = if a.leaves.len() < b.leaves.len() {
            (a, b)
        } else {
            (b, a)
        };
        if let Some(children) = more.children {
            for child in children {
                self.pairs_between(fewer, &self.nodes[child], visit)?;
            }
            return ControlFlow::Continue(());
        }
        for i in self.leaves[fewer.leaves.start].edges.clone() {
            for j in self.leaves[more.leaves.start].edges.clone() {
                self.visit_if_close(i, j, visit)?;
            }
        }
        ControlFlow::Continue(())
    }

    fn visit_if_close(
        &self,
        i: usize,
        j: usize,
        visit: &mut impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if self.boxes[i].is_close(&self.boxes[j]) {
            return visit(i, j);
        }
        ControlFlow::Continue(())
    }
}
