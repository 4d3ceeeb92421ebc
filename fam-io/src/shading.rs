//! The edges that a file shades hard: where its normals, or its smoothing groups, break.
//!
//! An edge is what lies between two positions. Its sides are those of all triangles there, whether
//! they share vertices or not. Two sides shade differently if they do so at both ends of the
//! edge; at one end alone it is a crease that runs out. An edge is hard if it has a side that
//! shades differently from all other triangles there. So a sheet of two layers is not hard
//! where each layer goes on smoothly.

use fam_surface::TriangleMesh;
use fam_surface::vector::{length, normalize, sub};
use fam_surface::weld::weld;

/// How far apart the tips of two unit normals may be that mean the same: those of normals at one
/// degree to each other. Normals of one byte for each coordinate are rounded by less.
const TOLERANCE: f64 = 0.017_453;

/// Sides of one edge that are compared at most, each with each. More are no surface, so such an
/// edge is not hard.
const MOST_SIDES: usize = 32;

/// What a file says of the shading at a corner of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shade {
    /// Nothing: it goes on into whatever is beside it.
    Unknown,
    /// A normal of any length; one without a direction says nothing.
    Normal([f64; 3]),
    /// A smoothing group; without a number the triangle is smooth with no other.
    Group(Option<u32>),
}

/// A side of an edge.
struct Side {
    /// The ends of the edge, as the first vertices at their positions, in ascending order.
    ends: [u32; 2],
    /// The corners of the triangle at these ends: 3 t + c for corner c of triangle t.
    corners: [u32; 2],
}

impl Shade {
    fn direction(self) -> Option<[f64; 3]> {
        let Self::Normal(normal) = self else {
            return None;
        };
        let largest = normal.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let is_known = largest > 0.0 && normal.iter().all(|c| c.is_finite());
        is_known.then(|| normalize(normal.map(|c| c / largest)))
    }

    /// Whether two corners shade differently.
    fn differs(self, other: Self) -> bool {
        match (self, other) {
            (Self::Group(own), Self::Group(other)) => own.is_none() || own != other,
            _ => match (self.direction(), other.direction()) {
                (Some(own), Some(other)) => length(sub(own, other)) > TOLERANCE,
                _ => false,
            },
        }
    }

    /// Whether all corners that are alike to this one are sure not to differ from each other.
    fn is_alike(self, other: Self) -> bool {
        match (self, other) {
            (Self::Group(None), _) => false,
            (Self::Normal(_), Self::Normal(_)) if self != other => {
                match (self.direction(), other.direction()) {
                    (Some(own), Some(other)) => length(sub(own, other)) < TOLERANCE / 2.0,
                    _ => false,
                }
            }
            _ => self == other,
        }
    }
}

/// The edges that vertices with one normal each make hard.
pub(crate) fn hard_edges_of_normals(
    mesh: &TriangleMesh,
    diagonals: &[[u32; 2]],
    normals: &[[f64; 3]],
) -> Vec<[u32; 2]> {
    let vertices = mesh.triangles().as_flattened();
    hard_edges(mesh, diagonals, |corner| {
        Shade::Normal(normals[vertices[corner] as usize])
    })
}

/// The hard edges of a mesh, each by the first vertices at the positions of its ends, the smaller
/// before the larger, ascending.
///
/// `diagonals` are edges that never are hard, by their own vertices. `shade` is that of corner c of
/// triangle t, asked for 3 t + c.
pub(crate) fn hard_edges(
    mesh: &TriangleMesh,
    diagonals: &[[u32; 2]],
    shade: impl Fn(usize) -> Shade,
) -> Vec<[u32; 2]> {
    let vertices = mesh.triangles().as_flattened();
    let first = weld(mesh.positions());
    let breaks = breaks(vertices, &first, &shade);
    if !breaks.contains(&true) {
        return Vec::new();
    }
    let mut diagonals: Vec<_> = diagonals.iter().copied().map(ascending).collect();
    diagonals.sort_unstable();

    let mut sides = sides(vertices, &first, |own, welded| {
        welded.iter().all(|&v| breaks[v as usize])
            && diagonals.binary_search(&ascending(own)).is_err()
    });
    sides.sort_unstable_by_key(|side| (side.ends, side.corners));
    let differ = |a: &Side, b: &Side| {
        (0..2).all(|end| {
            let [a, b] = [a, b].map(|side| shade(side.corners[end] as usize));
            a.differs(b)
        })
    };
    let opposite = |side: &Side| {
        let [a, b] = side.corners;
        let third = a - a % 3 + (3 - a % 3 - b % 3);
        first[vertices[third as usize] as usize]
    };
    let is_hard = |edge: &&[Side]| {
        edge.len() <= MOST_SIDES
            && edge.iter().any(|side| {
                let own = opposite(side);
                let mut others = edge
                    .iter()
                    .filter(|other| opposite(other) != own)
                    .peekable();
                others.peek().is_some() && others.all(|other| differ(side, other))
            })
    };
    sides
        .chunk_by(|a, b| a.ends == b.ends)
        .filter(is_hard)
        .map(|edge| edge[0].ends)
        .collect()
}

/// For every first vertex at a position, whether corners there may differ. No other vertex is
/// at an end of a hard edge, and most meshes have few of them.
fn breaks(vertices: &[u32], first: &[u32], shade: impl Fn(usize) -> Shade) -> Vec<bool> {
    /// No corner yet.
    const NONE: u32 = u32::MAX;
    let mut breaks = vec![false; first.len()];
    let mut known = vec![NONE; first.len()];
    for (corner, &vertex) in vertices.iter().enumerate() {
        let place = first[vertex as usize] as usize;
        match known[place] {
            NONE => known[place] = corner as u32,
            _ if breaks[place] => {}
            other => breaks[place] = !shade(other as usize).is_alike(shade(corner)),
        }
    }
    breaks
}

/// The sides that are `wanted`, by their own vertices and by the first ones at their positions;
/// none of triangles with two corners at one position.
fn sides(
    vertices: &[u32],
    first: &[u32],
    wanted: impl Fn([u32; 2], [u32; 2]) -> bool,
) -> Vec<Side> {
    let (triangles, _) = vertices.as_chunks::<3>();
    let mut sides = Vec::new();
    for (corners, own) in (0..).step_by(3).zip(triangles) {
        let welded = own.map(|v| first[v as usize]);
        let [a, b, c] = welded;
        if a == b || b == c || c == a {
            continue;
        }
        for [from, to] in [[0, 1], [1, 2], [2, 0]] {
            if !wanted([own[from], own[to]], [welded[from], welded[to]]) {
                continue;
            }
            let [from, to] = match welded[from] < welded[to] {
                true => [from, to],
                false => [to, from],
            };
            sides.push(Side {
                ends: [welded[from], welded[to]],
                corners: [corners + from as u32, corners + to as u32],
            });
        }
    }
    sides
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
