//! The triangles that no component's mesh has, and those that stand in for them.

use std::collections::HashMap;

/// What a triangle is to its component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Kept,
    /// It has the vertices of this earlier triangle.
    DuplicateOf(u32),
    /// Two of its corners are one vertex.
    Collapsed,
}

/// The kinds of triangles over welded vertices.
pub(super) fn kinds(triangles: &[[u32; 3]], label: impl Fn(usize) -> u32) -> Vec<Kind> {
    let mut first: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    let kind = |(t, &[a, b, c]): (usize, &[u32; 3])| {
        if a == b || b == c || c == a {
            return Kind::Collapsed;
        }
        let mut vertices = [a, b, c];
        vertices.sort_unstable();
        match *first.entry((label(t), vertices)).or_insert(t as u32) {
            earlier if earlier as usize == t => Kind::Kept,
            earlier => Kind::DuplicateOf(earlier),
        }
    };
    triangles.iter().enumerate().map(kind).collect()
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

    fn of(triangles: &[[u32; 3]], labels: &[u32]) -> Vec<Option<[u32; 3]>> {
        let label = |t: usize| labels[t];
        stand_ins(triangles, &kinds(triangles, label), label)
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
