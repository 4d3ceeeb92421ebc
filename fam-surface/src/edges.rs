//! The edges of a mesh, by name.

use std::collections::{HashMap, HashSet};

use super::TriangleMesh;
use super::weld::weld;

/// The edges of a mesh, vertices at equal positions being one.
#[derive(Debug, Clone)]
pub struct Edges {
    /// For every vertex the first at its position.
    first: Vec<u32>,
    /// By the first vertices at their ends, the smaller before the larger.
    known: HashSet<[u32; 2]>,
}

impl Edges {
    /// Those of a mesh.
    pub fn of(mesh: &TriangleMesh) -> Self {
        let first = weld(mesh.positions());
        let known = mesh
            .triangles()
            .iter()
            .map(|t| t.map(|v| first[v as usize]))
            .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
            .filter(|[a, b]| a != b)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        Self { first, known }
    }

    /// All of them, ascending.
    pub fn all(&self) -> Vec<[u32; 2]> {
        let mut all: Vec<[u32; 2]> = self.known.iter().copied().collect();
        all.sort_unstable();
        all
    }

    /// The edges at which triangles of different labels meet, ascending. `labels` has one for each triangle
    /// of the mesh that these are the edges of.
    pub fn between<L: PartialEq>(&self, mesh: &TriangleMesh, labels: &[L]) -> Vec<[u32; 2]> {
        let mut first: HashMap<[u32; 2], &L> = HashMap::new();
        let mut between = Vec::new();
        for (&[a, b, c], label) in mesh.triangles().iter().zip(labels) {
            for edge in [[a, b], [b, c], [c, a]]
                .into_iter()
                .filter_map(|edge| self.find(edge))
            {
                if *first.entry(edge).or_insert(label) != label {
                    between.push(edge);
                }
            }
        }
        between.sort_unstable();
        between.dedup();
        between
    }

    /// The edge between two vertices, if there is one, by the first vertices at its ends, the
    /// smaller before the larger: one name for all of its sides.
    pub fn find(&self, [a, b]: [u32; 2]) -> Option<[u32; 2]> {
        let first = |v: u32| self.first.get(v as usize).copied();
        let (a, b) = (first(a)?, first(b)?);
        Some([a.min(b), a.max(b)]).filter(|edge| self.known.contains(edge))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a square, the second over vertices of its own.
    #[test]
    fn an_edge_has_one_name_for_all_vertices_at_its_ends() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let [a, b, c, d] = corners;
        let zero = a.map(|x: f64| -x);
        let mesh = TriangleMesh::new(
            vec![a, b, c, zero, c, d],
            vec![[0, 1, 2], [3, 4, 5], [0, 3, 5]],
        )
        .unwrap();
        let edges = Edges::of(&mesh);
        for same in [[0, 2], [2, 3], [4, 0], [3, 4]] {
            assert_eq!(edges.find(same), Some([0, 2]));
        }
        assert_eq!(edges.find([5, 3]), Some([0, 5]));
        assert_eq!(edges.all(), [[0, 1], [0, 2], [0, 5], [1, 2], [2, 5]]);
        assert_eq!(edges.between(&mesh, &[7, 8, 8]), [[0, 2]]);
        assert_eq!(edges.between(&mesh, &[7, 7, 7]), [[0; 2]; 0]);
        for none in [[1, 5], [0, 3], [0, 0], [0, 6], [u32::MAX, 1]] {
            assert_eq!(edges.find(none), None, "{none:?}");
        }
    }
}
