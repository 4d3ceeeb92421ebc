//! Which triangles of a mesh are neighbours.
//!
//! What the file joins stays joined: an edge of its own vertices with two triangles joins them.
//! At an edge of more, those pairs are joined that continue each other best. Only the sides that
//! are open then are joined by position, by the same rule, as in a mesh whose vertices were split
//! for hard edges or texture seams.

use rayon::prelude::*;

use super::orientation::{NONE, ends};
use super::vector::{dot, normalize, scale, sub};

/// Sides of one edge that are paired at most. More are no surface, and there are about half the
/// square of their number of pairs to choose from.
const MOST_SIDES: usize = 32;

/// The cosine of the angle between two triangles that lie on each other, in millionths: above it
/// the angle is less than about a tenth of a degree. They are two sheets, so that a choice of
/// neighbours does not join them.
const FOLDED: i64 = 999_998;

/// A mesh as its joining needs it.
pub(super) struct Topology<'a> {
    /// Triangles over the file's own vertices.
    pub own: &'a [[u32; 3]],
    /// The same over the first vertices at equal positions.
    pub welded: &'a [[u32; 3]],
    /// Triangles of different groups are never joined; empty if all are of one.
    pub groups: &'a [u32],
    /// By the file's own vertices; no product of three coordinates may overflow.
    pub positions: &'a [[f64; 3]],
}

/// The neighbours of triangles.
pub(super) struct Joined {
    /// For every half-edge the one that it is joined to, or [`NONE`].
    pub across: Vec<u32>,
    /// The edges of three or more triangles, by group and welded vertices, ascending.
    pub non_manifold_edges: Vec<(u32, [u32; 2])>,
    /// Whether the file's own vertices alone join the triangles, no three at one edge.
    pub by_file: bool,
}

/// A half-edge, with the group and the ends by which it meets others.
type Side = (u32, [u32; 2], u32);

impl Topology<'_> {
    pub fn group(&self, triangle: usize) -> u32 {
        self.groups.get(triangle).copied().unwrap_or(0)
    }

    /// Joins the triangles that are `kept` across the edges of the file's own vertices.
    pub fn join_by_file(&self, kept: impl Fn(usize) -> bool + Sync) -> Joined {
        let mut joined = Joined {
            across: vec![NONE; 3 * self.own.len()],
            non_manifold_edges: Vec::new(),
            by_file: true,
        };
        for edge in edges(&self.sides(self.own, |h| kept(h as usize / 3))) {
            match *edge {
                [_] => {}
                [(.., a), (.., b)] => joined.join(a, b),
                _ => {
                    joined.by_file = false;
                    let (group, _, h) = edge[0];
                    joined
                        .non_manifold_edges
                        .push((group, ascending(ends(self.welded, h))));
                    self.pairs(edge).for_each(|[a, b]| joined.join(a, b));
                }
            }
        }
        joined
    }

    /// Joins the triangles that are `kept`, by position where the file leaves them open.
    pub fn join(&self, kept: impl Fn(usize) -> bool + Sync) -> Joined {
        let mut joined = self.join_by_file(&kept);
        let is_open = |h: u32| kept(h as usize / 3) && joined.across[h as usize] == NONE;
        let open = self.sides(self.welded, is_open);
        for edge in edges(&open).filter(|edge| edge.len() > 1) {
            joined.by_file = false;
            if edge.len() > 2 {
                joined.non_manifold_edges.push((edge[0].0, edge[0].1));
            }
            self.pairs(edge).for_each(|[a, b]| joined.join(a, b));
        }
        joined.non_manifold_edges.sort_unstable();
        joined.non_manifold_edges.dedup();
        joined
    }

    /// The half-edges of `triangles` (own or welded) for which `which` holds, sorted by edge.
    fn sides(&self, triangles: &[[u32; 3]], which: impl Fn(u32) -> bool + Sync) -> Vec<Side> {
        let mut sides: Vec<Side> = (0..3 * triangles.len() as u32)
            .into_par_iter()
            .filter(|&h| which(h))
            .map(|h| {
                let group = self.group(h as usize / 3);
                (group, ascending(ends(triangles, h)), h)
            })
            .collect();
        sides.par_sort_unstable();
        sides
    }

    /// Disjoint pairs of the sides of one edge, the best first: those of one winding before
    /// others, the flattest before others, those of earlier triangles before others. Triangles
    /// that lie on each other make no pair.
    fn pairs(&self, edge: &[Side]) -> impl Iterator<Item = [u32; 2]> + use<> {
        let mut candidates = Vec::new();
        if edge.len() <= MOST_SIDES {
            let sides: Vec<(bool, [f64; 3])> = edge.iter().map(|side| self.wing(side.2)).collect();
            for (j, (forward, wing)) in sides.iter().enumerate() {
                for (i, (other_forward, other)) in sides[..j].iter().enumerate() {
                    let cosine = (1e6 * dot(*wing, *other)).round() as i64;
                    if cosine <= FOLDED {
                        candidates.push((forward == other_forward, cosine, i, j));
                    }
                }
            }
        }
        candidates.sort_unstable();
        let mut free: Vec<Option<u32>> = edge.iter().map(|side| Some(side.2)).collect();
        candidates.into_iter().filter_map(move |(.., i, j)| {
            let pair = [free[i]?, free[j]?];
            (free[i], free[j]) = (None, None);
            Some(pair)
        })
    }

    /// Whether a half-edge leads from the lower of its welded vertices to the higher, and the
    /// direction in which its triangle leaves the edge, at a right angle; zero if the triangle
    /// has no area.
    fn wing(&self, h: u32) -> (bool, [f64; 3]) {
        let [start, end] = ends(self.welded, h);
        let triangle = self.own[h as usize / 3];
        let at = |c: usize| self.positions[triangle[(h as usize % 3 + c) % 3] as usize];
        let along = normalize(sub(at(1), at(0)));
        let third = sub(at(2), at(0));
        let out = sub(third, scale(along, dot(third, along)));
        (start < end, normalize(out))
    }
}

impl Joined {
    fn join(&mut self, a: u32, b: u32) {
        self.across[a as usize] = b;
        self.across[b as usize] = a;
    }

    /// Takes a half-edge and its neighbour apart.
    pub fn part(&mut self, h: u32) {
        let other = std::mem::replace(&mut self.across[h as usize], NONE);
        if other != NONE {
            self.across[other as usize] = NONE;
        }
    }
}

/// The sides of each edge.
fn edges(sides: &[Side]) -> impl Iterator<Item = &[Side]> {
    sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
}

pub(super) fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
