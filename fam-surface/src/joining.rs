//! Which triangles of a mesh are neighbours.
//!
//! What the file joins stays joined: an edge of its own vertices with two triangles joins them.
//! At an edge of more, those pairs are joined that continue each other best. Only the sides that
//! are open then are joined by position, by the same rule, as in a mesh whose vertices were split
//! for hard edges or texture seams.
//!
//! The corners around a vertex that are joined across edges are a fan, and become one vertex. A pair
//! stays apart where an edge would have three sides between the same two fans then (`crowding`).

use rayon::prelude::*;

use super::crowding::Crowding;
use super::orientation::{NONE, ends};
use super::vector::{dot, normalize, scale, sub};

/// Sides of one edge that are paired at most. More are no surface, and there are about half the
/// square of their number of pairs to choose from.
const MOST_SIDES: usize = 32;

/// Pairs that are considered for each side of an edge, the best ones. An edge of four sides has no
/// more.
const MOST_PAIRS: usize = 3;

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
}

/// A half-edge, with the group and the ends by which it meets others.
type Side = (u32, [u32; 2], u32);

/// Two sides of one edge that may be joined. The best comes first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    /// Whether the edge has more sides than these.
    is_chosen: bool,
    /// Whether the two triangles are wound against each other.
    is_turned: bool,
    /// Of the angle between them, in millionths: -1,000,000 where they lie in one plane.
    cosine: i64,
    sides: [u32; 2],
}

impl Topology<'_> {
    pub fn group(&self, triangle: usize) -> u32 {
        self.groups.get(triangle).copied().unwrap_or(0)
    }

    /// Joins the triangles that are `kept` across the edges of the file's own vertices.
    pub fn join_by_file(&self, kept: impl Fn(usize) -> bool + Sync) -> Joined {
        let mut joined = Joined {
            across: vec![NONE; 3 * self.own.len()],
            non_manifold_edges: Vec::new(),
        };
        let sides = self.sides(self.own, |h| kept(h as usize / 3));
        let mut pairs = Vec::new();
        for edge in edges(&sides) {
            match *edge {
                [_] => {}
                [(.., a), (.., b)] => joined.join(a, b),
                _ => {
                    let (group, _, h) = edge[0];
                    let ends = ascending(ends(self.welded, h));
                    joined.non_manifold_edges.push((group, ends));
                    pairs.extend(self.pairs(edge));
                }
            }
        }
        self.join_best(&mut joined, pairs, &kept);
        joined
    }

    /// Joins the triangles that are `kept`, by position where the file leaves them open.
    pub fn join(&self, kept: impl Fn(usize) -> bool + Sync) -> Joined {
        let mut joined = self.join_by_file(&kept);
        let is_open = |h: u32| kept(h as usize / 3) && joined.across[h as usize] == NONE;
        let open = self.sides(self.welded, is_open);
        let mut pairs = Vec::new();
        for edge in edges(&open).filter(|edge| edge.len() > 1) {
            if edge.len() > 2 {
                joined.non_manifold_edges.push((edge[0].0, edge[0].1));
            }
            pairs.extend(self.pairs(edge));
        }
        self.join_best(&mut joined, pairs, &kept);
        joined.non_manifold_edges.sort_unstable();
        joined.non_manifold_edges.dedup();
        joined
    }

    /// Joins pairs, the best first, each side once, where the surface stays a manifold.
    fn join_best(
        &self,
        joined: &mut Joined,
        mut pairs: Vec<Pair>,
        kept: impl Fn(usize) -> bool + Sync,
    ) {
        pairs.par_sort_unstable();
        let mut crowding = match pairs.is_empty() {
            true => None,
            false => self.crowding(joined, kept),
        };
        for Pair { sides: [a, b], .. } in pairs {
            let is_free = [a, b].iter().all(|&h| joined.across[h as usize] == NONE);
            if is_free && crowding.as_mut().is_none_or(|crowding| crowding.join(a, b)) {
                joined.join(a, b);
            }
        }
    }

    /// What keeps watch over edges of three or more sides; none if there are none.
    fn crowding(
        &self,
        joined: &Joined,
        kept: impl Fn(usize) -> bool + Sync,
    ) -> Option<Crowding<'_>> {
        let sides = self.sides(self.welded, |h| kept(h as usize / 3));
        let branched: Vec<u32> = edges(&sides)
            .filter(|edge| edge.len() > 2)
            .flat_map(|edge| edge.iter().map(|side| side.2))
            .collect();
        (!branched.is_empty()).then(|| Crowding::of(self.welded, &branched, &joined.across))
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

    /// The pairs of sides of one edge that may be joined, the best of each side: none of triangles
    /// that lie on each other.
    fn pairs(&self, edge: &[Side]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        if edge.len() > MOST_SIDES {
            return pairs;
        }
        let sides: Vec<(bool, [f64; 3])> = edge.iter().map(|side| self.wing(side.2)).collect();
        for (j, (forward, wing)) in sides.iter().enumerate() {
            for (i, (other_forward, other)) in sides[..j].iter().enumerate() {
                let cosine = (1e6 * dot(*wing, *other)).round() as i64;
                if cosine <= FOLDED {
                    pairs.push(Pair {
                        is_chosen: edge.len() > 2,
                        is_turned: forward == other_forward,
                        cosine,
                        sides: [edge[i].2, edge[j].2],
                    });
                }
            }
        }
        pairs.sort_unstable();
        let mut counts = vec![0; edge.len()];
        let place = |h: u32| edge.partition_point(|side| side.2 < h);
        pairs.retain(|pair| {
            let places = pair.sides.map(place);
            let is_best = places.iter().any(|&i| counts[i] < MOST_PAIRS);
            places.iter().for_each(|&i| counts[i] += 1);
            is_best
        });
        pairs
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
}

/// The sides of each edge.
fn edges(sides: &[Side]) -> impl Iterator<Item = &[Side]> {
    sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
}

pub(super) fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
