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

use candidates::{Bounds, Boxed, Tree};
use plane::Point;

/// The boundary edges of a connected chart, loop by loop.
///
/// Its edge `i` starts from its vertex `i`; every boundary vertex has one edge that leaves
/// it and one that arrives.
#[derive(Debug, Clone)]
pub(crate) struct Boundary {
    half_edges: Vec<u32>,
    vertices: Vec<u32>,
    next: Vec<u32>,
    loops: Vec<Range<usize>>,
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
            next: Vec::new(),
            loops: Vec::new(),
            lengths: Vec::new(),
            scales: Vec::new(),
        };
        for edges in topology.boundary_loops() {
            let start = boundary.half_edges.len();
            let end = start + edges.len();
            for (i, &h) in edges.iter().enumerate() {
                let before = edges[(i + edges.len() - 1) % edges.len()];
                boundary.vertices.push(topology.origin(h));
                boundary.lengths.push(length(h));
                boundary.scales.push(length(h).min(length(before)));
                let next = start + i + 1;
                boundary
                    .next
                    .push(if next < end { next } else { start } as u32);
            }
            boundary.half_edges.extend(edges);
            boundary.loops.push(start..end);
        }
        boundary
    }

    fn next(&self, i: usize) -> usize {
        self.next[i] as usize
    }

    fn point(&self, uv: &[Point], i: usize) -> Point {
        uv[self.vertices[i] as usize]
    }

    /// The ends of edge `i`.
    fn ends(&self, uv: &[Point], i: usize) -> [Point; 2] {
        [self.point(uv, i), self.point(uv, self.next(i))]
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
