//! The edges of a mesh, as their triangles see them.

use rayon::prelude::*;

use super::joining::ascending;
use super::orientation::ends;

/// In the place of an edge of the file's own vertices: the file joins nothing here.
const OPEN: [u32; 2] = [u32::MAX; 2];

/// A side of an edge. An edge is what the file's own vertices join; sides that they leave open
/// belong to one edge if they are at the same positions.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side<P> {
    /// Sides of different groups belong to different edges.
    group: u32,
    /// The ends of the edge, as welded vertices in ascending order.
    pub ends: [u32; 2],
    /// The same as the file's own vertices, or [`OPEN`].
    own: [u32; 2],
    /// Where the two ends lie; sides at one place go on into each other.
    pub place: P,
    /// The third corner of the triangle, as a welded vertex.
    opposite: u32,
    /// 3 t + c: triangle t, from its corner c to the next.
    pub half_edge: u32,
    /// Whether it leads from the second end to the first.
    pub reversed: bool,
}

/// The sides for which there is a `place` of the half-edge and whether it leads from the higher
/// end to the lower, sorted by edge and then by place. A side between two vertices at one
/// position is none.
pub(super) fn sides<P: Ord + Send>(
    own: &[[u32; 3]],
    welded: &[[u32; 3]],
    group: impl Fn(u32) -> u32 + Sync,
    place: impl Fn(u32, bool) -> Option<P> + Sync,
) -> Vec<Side<P>> {
    let side = |h: u32| {
        let [start, end] = ends(welded, h);
        if start == end {
            return None;
        }
        Some(Side {
            group: group(h),
            ends: [start.min(end), start.max(end)],
            own: ascending(ends(own, h)),
            place: place(h, start > end)?,
            opposite: welded[h as usize / 3][(h as usize + 2) % 3],
            half_edge: h,
            reversed: start > end,
        })
    };
    let all = 0..3 * own.len() as u32;
    let mut sides: Vec<Side<P>> = all.into_par_iter().filter_map(side).collect();
    sides.par_sort_unstable_by_key(|side| (side.group, side.ends, side.own, side.half_edge));
    for edge in sides.chunk_by_mut(|a, b| (a.group, a.own) == (b.group, b.own)) {
        if !differ(edge) {
            edge.iter_mut().for_each(|side| side.own = OPEN);
        }
    }
    sides.par_sort_unstable();
    sides
}

/// Whether sides are those of different triangles, not of one that is drawn several times.
fn differ<P>(sides: &[Side<P>]) -> bool {
    sides
        .windows(2)
        .any(|pair| pair[0].opposite != pair[1].opposite)
}

/// The sides of each edge.
pub(super) fn edges<P>(sides: &[Side<P>]) -> impl Iterator<Item = &[Side<P>]> {
    sides.chunk_by(|a, b| (a.group, a.ends, a.own) == (b.group, b.ends, b.own))
}

/// The sides of one edge that lie at one place.
pub(super) fn places<P: PartialEq>(edge: &[Side<P>]) -> impl Iterator<Item = &[Side<P>]> {
    edge.chunk_by(|a, b| a.place == b.place)
}

/// Whether an edge has different triangles, one of which does not go on into another there.
pub(super) fn is_torn<P: PartialEq>(edge: &[Side<P>]) -> bool {
    differ(edge) && places(edge).any(|sides| !differ(sides))
}
