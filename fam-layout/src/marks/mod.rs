//! What somebody marked: edges along which the mesh is to be cut or not, and where seams are welcome.

pub mod opening;

use std::collections::HashSet;

use crate::costs::creases::DISCOUNT;
use crate::part::Part;
use crate::patch::Patch;
use fam_surface::{Component, Edges};

/// Edges of a mesh at which a seam is wanted and at which none is.
///
/// The mesh is cut along all wanted edges; those in its interior that would stay closed, since
/// they lie alone, take a neighbour with them. Along forbidden edges it is cut only where
/// there is no other way to a valid layout, or where they are wanted as well. The diagonals of
/// polygons are no edges to somebody who knows the polygons, and are avoided in the same way.
///
/// Hard edges and paint say where seams are welcome: they change what a seam costs, no more.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Marks {
    wanted: Vec<[u32; 2]>,
    forbidden: Vec<[u32; 2]>,
    diagonals: Vec<[u32; 2]>,
    hard: Vec<[u32; 2]>,
    paint: Vec<f64>,
}

/// No marks.
pub(super) static NONE: Marks = Marks {
    wanted: Vec::new(),
    forbidden: Vec::new(),
    diagonals: Vec::new(),
    hard: Vec::new(),
    paint: Vec::new(),
};

impl Marks {
    /// Marks on the edges of a mesh, each by its vertices in any order. Pairs of vertices that
    /// are no edge are left out.
    pub fn new(edges: &Edges, wanted: &[[u32; 2]], forbidden: &[[u32; 2]]) -> Self {
        Self {
            wanted: known(edges, wanted),
            forbidden: known(edges, forbidden),
            ..Self::default()
        }
    }

    /// The same, and polygons are kept whole: of their triangles the common edges, each by its
    /// vertices in any order.
    pub fn with_diagonals(self, edges: &Edges, diagonals: &[[u32; 2]]) -> Self {
        Self {
            diagonals: known(edges, diagonals),
            ..self
        }
    }

    /// The same, and seams along hard edges cost less: those at which the shading or the material
    /// changes, each by its vertices in any order.
    pub fn with_hard_edges(self, edges: &Edges, hard: &[[u32; 2]]) -> Self {
        Self {
            hard: known(edges, hard),
            ..self
        }
    }

    /// The same with paint: for every vertex of the mesh a share from 0, where seams are welcome, to 1,
    /// where they are not. Vertices without any count as 0; a number that is no share counts as the
    /// nearest, NaN as 0.
    pub fn with_paint(self, paint: Vec<f64>) -> Self {
        let share = |p: f64| if p.is_nan() { 0.0 } else { p.clamp(0.0, 1.0) };
        Self {
            paint: paint.into_iter().map(share).collect(),
            ..self
        }
    }

    /// The paint of the vertices of the mesh; empty if there is none.
    pub fn paint(&self) -> &[f64] {
        &self.paint
    }

    /// The edges at which a seam is wanted, each once, by the first vertices at the positions of
    /// their ends, the smaller first, ascending.
    pub fn wanted(&self) -> &[[u32; 2]] {
        &self.wanted
    }

    /// The same of the edges at which none is.
    pub fn forbidden(&self) -> &[[u32; 2]] {
        &self.forbidden
    }

    /// How many forbidden edges are among `seams`, which are as those of
    /// [`Seams::of_components`](fam_surface::seams::Seams::of_components).
    pub fn forbidden_among(&self, seams: &[[u32; 2]]) -> usize {
        let is_forbidden = |edge: &&[u32; 2]| self.forbidden.binary_search(edge).is_ok();
        seams.iter().filter(is_forbidden).count()
    }

    /// Those on the mesh of a component.
    pub(super) fn of_component(&self, component: &Component) -> ComponentMarks {
        let on = |marked: &[[u32; 2]]| -> HashSet<[u32; 2]> {
            if marked.is_empty() {
                return HashSet::new();
            }
            let is_marked = |&[a, b]: &[u32; 2]| {
                let [a, b] = [a, b].map(|v| component.vertices[v as usize]);
                marked.binary_search(&[a.min(b), a.max(b)]).is_ok()
            };
            let triangles = component.mesh.triangles().iter();
            triangles
                .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
                .filter(is_marked)
                .map(|[a, b]| [a.min(b), a.max(b)])
                .collect()
        };
        ComponentMarks {
            wanted: on(&self.wanted),
            forbidden: &on(&self.forbidden) | &on(&self.diagonals),
            hard: on(&self.hard),
        }
    }
}

/// The edges among pairs of vertices, each once, ascending.
fn known(edges: &Edges, marked: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut found: Vec<[u32; 2]> = marked.iter().filter_map(|&e| edges.find(e)).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The marks on the mesh of a component, by its vertices, the smaller first. Diagonals count as
/// forbidden.
#[derive(Debug, Default)]
pub(super) struct ComponentMarks {
    pub(super) wanted: HashSet<[u32; 2]>,
    pub(super) forbidden: HashSet<[u32; 2]>,
    pub(super) hard: HashSet<[u32; 2]>,
}

impl ComponentMarks {
    /// Makes seams wanted along edges, by their vertices, the smaller first, except forbidden ones.
    pub(super) fn want(&mut self, edges: Vec<[u32; 2]>) {
        let allowed = edges.into_iter().filter(|e| !self.forbidden.contains(e));
        self.wanted.extend(allowed);
    }

    /// Whether they are those of another component, whose vertices are `vertices` for those of this
    /// one.
    pub(super) fn are_those_of(&self, other: &Self, vertices: &[u32]) -> bool {
        let are_same = |own: &HashSet<[u32; 2]>, of: &HashSet<[u32; 2]>| {
            let is_there = |edge: &[u32; 2]| {
                let [a, b] = edge.map(|v| vertices[v as usize]);
                of.contains(&[a.min(b), a.max(b)])
            };
            own.len() == of.len() && own.iter().all(is_there)
        };
        are_same(&self.wanted, &other.wanted)
            && are_same(&self.forbidden, &other.forbidden)
            && are_same(&self.hard, &other.hard)
    }

    /// A part of the component, ready to be cut where it is not forbidden. Seams cost `rates` at every
    /// vertex of the component for each unit of length, 1 if these are not given, and less along hard
    /// edges the more creases count.
    pub(super) fn patch(&self, part: &Part, rates: Option<&[f64]>, crease_weight: f64) -> Patch {
        let edge = |ends: [u32; 2]| {
            let [a, b] = ends.map(|v| part.vertices[v as usize]);
            [a.min(b), a.max(b)]
        };
        let is_forbidden = |a: u32, b: u32| self.forbidden.contains(&edge([a, b]));
        let mut patch = Patch::of(&part.mesh).forbidding(is_forbidden);
        patch.crease_weight = crease_weight;
        if let Some(rates) = rates {
            let rate = |v: u32| rates[part.vertices[v as usize] as usize];
            patch = patch.priced(|ends| 0.5 * (rate(ends[0]) + rate(ends[1])));
        }
        if !self.hard.is_empty() && crease_weight > 0.0 {
            let share = 1.0 - crease_weight * DISCOUNT;
            let is_hard = |ends: [u32; 2]| self.hard.contains(&edge(ends));
            patch = patch.priced(|ends| if is_hard(ends) { share } else { 1.0 });
        }
        patch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::{Components, TriangleMesh, shapes};

    /// A sheet in two halves that have vertices of their own along their common side.
    #[test]
    fn marks_are_found_whichever_of_equal_vertices_names_them() {
        let sheet = shapes::rectangle(2.0, 1.0, 2, 1);
        let corners = sheet.triangles().iter().flatten();
        let positions: Vec<_> = corners.map(|&v| sheet.positions()[v as usize]).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = TriangleMesh::new(positions.clone(), triangles).unwrap();
        let at = |x: f64, y: f64| {
            let last = positions.iter().rposition(|p| p[0] == x && p[1] == y);
            last.unwrap() as u32
        };
        let along = |x: f64| [at(x, 0.5), at(x, -0.5)];
        let across = [at(-1.0, -0.5), at(1.0, 0.5)];
        let marks = Marks::new(
            &Edges::of(&mesh),
            &[along(0.0), along(0.0), across, [77, 1]],
            &[along(-1.0)],
        );
        assert_eq!((marks.wanted().len(), marks.forbidden().len()), (1, 1));
        assert_eq!(marks.forbidden_among(marks.wanted()), 0);
        assert_eq!(marks.forbidden_among(marks.forbidden()), 1);
        let components = Components::of(&mesh, &[]).unwrap();
        let own = marks.of_component(&components.list[0]);
        let x = |edges: &HashSet<[u32; 2]>| {
            let ends: Vec<[u32; 2]> = edges.iter().copied().collect();
            assert_eq!(ends.len(), 1);
            ends[0].map(|v| components.list[0].mesh.positions()[v as usize][0])
        };
        assert_eq!(x(&own.wanted), [0.0; 2]);
        assert_eq!(x(&own.forbidden), [-1.0; 2]);
    }
}
