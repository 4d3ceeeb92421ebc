//! The triangles that no component's mesh has, and those that stand in for them.

use std::collections::HashMap;

use rayon::prelude::*;

use super::joining::Topology;
use super::orientation::NONE;
use super::sets::Sets;

/// What a triangle is to its component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Kept,
    /// It repeats this kept triangle.
    DuplicateOf(u32),
    /// Two of its corners are one vertex.
    Collapsed,
}

/// The kinds of triangles.
///
/// A triangle repeats an earlier one if it has the same three of the file's own vertices. One
/// that has the same three positions only is repeated with its whole sheet: with all that the
/// file joins to it elsewhere, or not at all. So where two boxes touch, both keep their sides.
pub(super) fn kinds(topology: &Topology) -> Vec<Kind> {
    let welded = topology.welded;
    let is_collapsed = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
    let mut kinds = vec![Kind::Kept; welded.len()];
    let mut places = Vec::with_capacity(welded.len());
    for (t, triangle) in welded.iter().enumerate() {
        if is_collapsed(triangle) {
            kinds[t] = Kind::Collapsed;
        } else {
            places.push((topology.group(t), sorted(*triangle), t as u32));
        }
    }
    places.par_sort_unstable();
    // Those at the positions of an earlier triangle, with the first there.
    let mut repeated: Vec<[u32; 2]> = Vec::new();
    for place in places.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let Some((first, others)) = place.split_first().filter(|(_, others)| !others.is_empty())
        else {
            continue;
        };
        let mut own: Vec<([u32; 3], u32)> = place
            .iter()
            .map(|&(.., t)| (sorted(topology.own[t as usize]), t))
            .collect();
        own.sort_unstable();
        for same in own.chunk_by(|a, b| a.0 == b.0) {
            for (_, t) in &same[1..] {
                kinds[*t as usize] = Kind::DuplicateOf(same[0].1);
            }
        }
        repeated.extend(others.iter().map(|&(.., t)| [t, first.2]));
    }
    repeated.retain(|[t, _]| kinds[*t as usize] == Kind::Kept);
    repeated.sort_unstable();
    if !repeated.is_empty() {
        leave_out_sheets(topology, &repeated, &mut kinds);
    }
    // What a triangle of a repeated sheet is repeated by, is repeated with it.
    for t in 0..kinds.len() {
        if let Kind::DuplicateOf(of) = kinds[t]
            && let Kind::DuplicateOf(first) = kinds[of as usize]
        {
            kinds[t] = Kind::DuplicateOf(first);
        }
    }
    kinds
}

/// Leaves out the sheets that consist of nothing but `repeated` triangles, ascending, each with
/// the first at its position.
fn leave_out_sheets(topology: &Topology, repeated: &[[u32; 2]], kinds: &mut [Kind]) {
    let joined = topology.join_by_file(|t| kinds[t] == Kind::Kept);
    let mut sheets = Sets::new(kinds.len());
    for (h, &other) in (0..).zip(&joined.across) {
        let place = |h: u32| sorted(topology.welded[h as usize / 3]);
        if other != NONE && place(h) != place(other) {
            sheets.join(h / 3, other / 3);
        }
    }
    sheets.settle();
    let mut left = repeated.iter().map(|[t, _]| *t as usize).peekable();
    let mut has_its_own = vec![false; kinds.len()];
    for t in 0..kinds.len() {
        if left.next_if_eq(&t).is_none() && kinds[t] == Kind::Kept {
            has_its_own[sheets.find(t as u32) as usize] = true;
        }
    }
    for &[t, first] in repeated {
        if !has_its_own[sheets.find(t) as usize] {
            kinds[t as usize] = Kind::DuplicateOf(first);
        }
    }
}

/// How often the triangle at the positions of each has been there before, for groups in which no
/// triangle repeats another; all are kept then but collapsed ones.
pub(super) fn layers(kinds: &mut [Kind]) -> Vec<u32> {
    let mut repeats = vec![0; kinds.len()];
    let mut layers = vec![0; kinds.len()];
    for t in 0..kinds.len() {
        if let Kind::DuplicateOf(first) = kinds[t] {
            repeats[first as usize] += 1;
            layers[t] = repeats[first as usize];
            kinds[t] = Kind::Kept;
        }
    }
    layers
}

fn sorted(mut vertices: [u32; 3]) -> [u32; 3] {
    vertices.sort_unstable();
    vertices
}

/// For every triangle the corners, all of one kept triangle, that its own corners stand for;
/// corner `c` of triangle `t` has the number 3 t + c.
///
/// Of a kept triangle these are its own, of a duplicate those at its vertices. A collapsed
/// triangle takes those of the first triangle of its label over the same edge; if there is
/// none, one corner at one of its vertices for all three; else it has none.
pub(super) fn stand_ins(
    triangles: &[[u32; 3]],
    kinds: &[Kind],
    label: impl Fn(usize) -> u32,
) -> Vec<Option<[u32; 3]>> {
    let neighbours = Neighbours::of_collapsed(triangles, kinds, &label);
    let at = |t: u32, vertices: [u32; 3]| {
        let corner = |v| triangles[t as usize].iter().position(|&w| w == v);
        let [a, b, c] = vertices.map(|v| corner(v).map(|c| 3 * t + c as u32));
        Some([a?, b?, c?])
    };
    let stand_in = |(t, kind): (usize, &Kind)| match kind {
        Kind::Kept => at(t as u32, triangles[t]),
        Kind::DuplicateOf(first) => at(*first, triangles[t]),
        Kind::Collapsed => match neighbours.beside(label(t), triangles[t]) {
            Some(beside) => at(beside, triangles[t]),
            None => {
                let touched = |&v: &u32| neighbours.touching(label(t), v);
                let corner = triangles[t].iter().find_map(touched);
                corner.map(|corner| [corner; 3])
            }
        },
    };
    kinds.iter().enumerate().map(stand_in).collect()
}

/// Kept triangles at the edges and vertices of collapsed ones, by label.
#[derive(Default)]
struct Neighbours {
    /// The first triangle at an edge, by its ends in ascending order.
    of_edge: HashMap<(u32, [u32; 2]), Option<u32>>,
    /// The first corner at a vertex.
    of_vertex: HashMap<(u32, u32), Option<u32>>,
}

impl Neighbours {
    fn of_collapsed(triangles: &[[u32; 3]], kinds: &[Kind], label: impl Fn(usize) -> u32) -> Self {
        let mut found = Self::default();
        for (t, triangle) in triangles.iter().enumerate() {
            if kinds[t] == Kind::Collapsed {
                found.of_edge.insert((label(t), edge_of(*triangle)), None);
                for &v in triangle {
                    found.of_vertex.insert((label(t), v), None);
                }
            }
        }
        if found.of_vertex.is_empty() {
            return found;
        }
        for (t, &[a, b, c]) in triangles.iter().enumerate() {
            if kinds[t] != Kind::Kept {
                continue;
            }
            for (corner, [v, w]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                if let Some(first) = found.of_edge.get_mut(&(label(t), [v.min(w), v.max(w)])) {
                    first.get_or_insert(t as u32);
                }
                if let Some(first) = found.of_vertex.get_mut(&(label(t), v)) {
                    first.get_or_insert((3 * t + corner) as u32);
                }
            }
        }
        found
    }

    fn beside(&self, label: u32, collapsed: [u32; 3]) -> Option<u32> {
        let first = self.of_edge.get(&(label, edge_of(collapsed)));
        first.copied().flatten()
    }

    fn touching(&self, label: u32, vertex: u32) -> Option<u32> {
        self.of_vertex.get(&(label, vertex)).copied().flatten()
    }
}

/// The least and the greatest vertex of a collapsed triangle, which has no others.
fn edge_of(mut collapsed: [u32; 3]) -> [u32; 2] {
    collapsed.sort_unstable();
    [collapsed[0], collapsed[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds_of(own: &[[u32; 3]], welded: &[[u32; 3]], groups: &[u32]) -> Vec<Kind> {
        kinds(&Topology {
            own,
            welded,
            groups,
            positions: &[[0.0; 3]; 20],
        })
    }

    fn of(triangles: &[[u32; 3]], labels: &[u32]) -> Vec<Option<[u32; 3]>> {
        let kinds = kinds_of(triangles, triangles, labels);
        stand_ins(triangles, &kinds, |t| labels[t])
    }

    /// A strip of two, and the same over vertices of its own: alone, or with a third triangle.
    #[test]
    fn a_sheet_is_repeated_as_a_whole_or_not_at_all() {
        let own = [[0, 1, 2], [1, 3, 2], [10, 12, 11], [11, 12, 13]];
        let welded = own.map(|t| t.map(|v| v % 10));
        let expected = [
            Kind::Kept,
            Kind::Kept,
            Kind::DuplicateOf(0),
            Kind::DuplicateOf(1),
        ];
        assert_eq!(kinds_of(&own, &welded, &[]), expected);
        assert_eq!(layers(&mut expected.clone()), [0, 0, 1, 1]);
        let larger = [&own[..], &[[13, 12, 14]]].concat();
        let welded: Vec<_> = larger.iter().map(|t| t.map(|v| v % 10)).collect();
        assert_eq!(kinds_of(&larger, &welded, &[]), [Kind::Kept; 5]);
        // A triangle that the second sheet repeats within itself.
        let again = [&own[..], &[[12, 13, 11]]].concat();
        let welded: Vec<_> = again.iter().map(|t| t.map(|v| v % 10)).collect();
        assert_eq!(
            kinds_of(&again, &welded, &[])[3..],
            [Kind::DuplicateOf(1); 2]
        );
    }

    #[test]
    fn duplicates_stand_for_the_corners_at_their_vertices() {
        let found = of(&[[4, 5, 6], [6, 5, 4], [5, 6, 4]], &[0; 3]);
        assert_eq!(found, [Some([0, 1, 2]), Some([2, 1, 0]), Some([1, 2, 0])]);
        let apart = of(&[[4, 5, 6], [6, 5, 4]], &[0, 1]);
        assert_eq!(apart, [Some([0, 1, 2]), Some([3, 4, 5])]);
    }

    #[test]
    fn collapsed_triangles_follow_an_edge_before_a_vertex() {
        let triangles = [
            [0, 1, 2],
            [2, 1, 3],
            [3, 2, 3],
            [0, 0, 3],
            [1, 1, 1],
            [7, 8, 8],
        ];
        let found = of(&triangles, &[0; 6]);
        assert_eq!(
            found[2],
            Some([5, 3, 5]),
            "the second has the edge of 2 and 3"
        );
        assert_eq!(
            found[3],
            Some([0; 3]),
            "no triangle has the edge of 0 and 3"
        );
        assert_eq!(found[4], Some([1; 3]));
        assert_eq!(found[5], None);
        let apart = of(&triangles, &[0, 0, 1, 1, 0, 0]);
        assert_eq!(apart[2..4], [None, None]);
    }
}
