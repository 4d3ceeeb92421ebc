//! The boundary of a chart, that must not touch itself.
//!
//! A map of a connected chart into the plane under which every triangle is positive is
//! injective if the boundary loops are simple, disjoint and only one of them (the outer one)
//! runs counter-clockwise: every point then is covered once or not at all.

mod barrier;
mod candidates;
mod plane;
mod simple;
mod slits;

pub(crate) use barrier::Pair;
pub(crate) use slits::{open_contacts, open_slits};

use std::ops::Range;

use crate::patch::topology::Topology;

pub(crate) use candidates::Bounds;
use candidates::{Boxed, Tree};
use plane::Point;

/// The boundary edges of a connected chart, loop by loop, or those in a part of the plane.
///
/// Its edge `i` starts from its vertex `i`; every vertex of a whole boundary has one edge that
/// leaves it and one that arrives.
#[derive(Debug, Clone)]
pub(crate) struct Boundary {
    half_edges: Vec<u32>,
    vertices: Vec<u32>,
    /// The vertex in which every edge ends.
    ends: Vec<u32>,
    /// The edges of every loop, or of every part of one; consecutive ones follow each other.
    loops: Vec<Range<usize>>,
    /// Whether all edges of the chart are there.
    is_whole: bool,
    /// Rest lengths of the edges.
    lengths: Vec<f64>,
    /// Of the two edges at a vertex the lesser length.
    scales: Vec<f64>,
}

impl Boundary {
    /// `length` is the rest length of a half-edge, in units of the UVs.
    pub fn new(topology: &Topology, length: impl Fn(u32) -> f64) -> Self {
        let mut boundary = Self {
            half_edges: Vec::new(),
            vertices: Vec::new(),
            ends: Vec::new(),
            loops: Vec::new(),
            is_whole: true,
            lengths: Vec::new(),
            scales: Vec::new(),
        };
        for edges in topology.boundary_loops() {
            let start = boundary.half_edges.len();
            for (i, &h) in edges.iter().enumerate() {
                let before = edges[(i + edges.len() - 1) % edges.len()];
                boundary.vertices.push(topology.origin(h));
                boundary.lengths.push(length(h));
                boundary.scales.push(length(h).min(length(before)));
                boundary.ends.push(topology.target(h));
            }
            boundary.half_edges.extend(edges);
            boundary.loops.push(start..boundary.half_edges.len());
        }
        boundary
    }

    /// The edges that come into an upright rectangle, with their vertices numbered anew.
    ///
    /// Such a part can tell whether its own edges meet. Whether only one loop is an outer one it
    /// leaves open: as long as no edges meet and no triangle flips, that does not change.
    pub fn within(
        &self,
        uv: &[Point],
        region: Bounds,
        mut number: impl FnMut(u32) -> u32,
    ) -> Boundary {
        let mut part = Self {
            half_edges: Vec::new(),
            vertices: Vec::new(),
            ends: Vec::new(),
            loops: Vec::new(),
            is_whole: false,
            lengths: Vec::new(),
            scales: Vec::new(),
        };
        for edges in &self.loops {
            let mut start = part.vertices.len();
            for i in edges.clone() {
                if Bounds::of(self.ends(uv, i)).meets(&region) {
                    part.half_edges.push(self.half_edges[i]);
                    part.vertices.push(number(self.vertices[i]));
                    part.ends.push(number(self.ends[i]));
                    part.lengths.push(self.lengths[i]);
                    part.scales.push(self.scales[i]);
                } else if start < part.vertices.len() {
                    part.loops.push(start..part.vertices.len());
                    start = part.vertices.len();
                }
            }
            if start < part.vertices.len() {
                part.loops.push(start..part.vertices.len());
            }
        }
        part
    }

    /// The edge that follows edge `i` of a whole boundary.
    fn next(&self, i: usize) -> usize {
        let after = self.loops.partition_point(|edges| edges.end <= i);
        let edges = &self.loops[after];
        if i + 1 < edges.end {
            i + 1
        } else {
            edges.start
        }
    }

    /// Whether edge `j` starts where edge `i` ends.
    fn follows(&self, j: usize, i: usize) -> bool {
        self.ends[i] == self.vertices[j]
    }

    fn point(&self, uv: &[Point], i: usize) -> Point {
        uv[self.vertices[i] as usize]
    }

    /// The ends of edge `i`.
    fn ends(&self, uv: &[Point], i: usize) -> [Point; 2] {
        [self.vertices[i], self.ends[i]].map(|v| uv[v as usize])
    }

    /// The edges in boxes, for pairs of them that are no further apart than `reach` times the
    /// lesser rest length.
    fn tree(&self, reach: f64, bounds: impl Fn(usize) -> Bounds) -> Tree {
        let boxes = (0..self.vertices.len()).map(|i| Boxed {
            bounds: bounds(i),
            reach: reach * self.lengths[i],
        });
        Tree::new(boxes.collect(), &self.loops)
    }
}
