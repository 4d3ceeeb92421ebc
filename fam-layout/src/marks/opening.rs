//! A component opened along the seams that are wanted, before it is looked for others.

use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};

use crate::marks::ComponentMarks;
use crate::part::Part;
use fam_surface::TriangleMesh;
use fam_surface::sets::Sets;
use fam_surface::vector::{length, sub};

/// The parts that a component's mesh falls into when it is opened along the wanted edges: the
/// whole if none are. The smallest come last.
pub fn opened(mesh: &TriangleMesh, marks: &ComponentMarks) -> Vec<Part> {
    if marks.wanted.is_empty() {
        return vec![Part::whole(mesh)];
    }
    let sides = Sides::of(mesh);
    let mut wanted = marks.wanted.clone();
    loop {
        let joined = sides.joined(&wanted);
        let closed = sides.closed(&joined, &wanted);
        let neighbors = sides.neighbors(mesh, &closed, &wanted, &marks.forbidden);
        if neighbors.is_empty() {
            return joined.parts(mesh);
        }
        wanted.extend(neighbors);
    }
}

/// The edges between triangles.
struct Sides {
    /// Each edge by its vertices, the smaller first, as a triangle sees it: with its corners
    /// there. Sorted, so that the sides of one edge follow one another.
    all: Vec<([u32; 2], [u32; 2])>,
}

impl Sides {
    fn of(mesh: &TriangleMesh) -> Self {
        let mut all: Vec<_> = (0_u32..)
            .zip(mesh.triangles())
            .flat_map(|(t, corners)| {
                [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
                    let (i, j) = match corners[i] < corners[j] {
                        true => (i, j),
                        false => (j, i),
                    };
                    let at = [i, j].map(|c| 3 * t + c as u32);
                    ([corners[i], corners[j]], at)
                })
            })
            .collect();
        all.sort_unstable();
        Self { all }
    }

    /// The edges inside of the mesh: of each its vertices, and the corners of its sides there.
    fn inner(&self) -> impl Iterator<Item = &[([u32; 2], [u32; 2])]> {
        let by_edge = self.all.chunk_by(|a, b| a.0 == b.0);
        by_edge.filter(|sides| sides.len() > 1)
    }

    /// What hangs together across edges that are not wanted.
    fn joined(&self, wanted: &HashSet<[u32; 2]>) -> Joined {
        let count = self.all.len();
        let mut joined = Joined {
            corners: Sets::new(count),
            triangles: Sets::new(count / 3),
        };
        for sides in self.inner().filter(|sides| !wanted.contains(&sides[0].0)) {
            for pair in sides.windows(2) {
                let (one, other) = (pair[0].1, pair[1].1);
                joined.corners.join(one[0], other[0]);
                joined.corners.join(one[1], other[1]);
                joined.triangles.join(one[0] / 3, other[0] / 3);
            }
        }
        joined.corners.settle();
        joined.triangles.settle();
        joined
    }

    /// The wanted edges at which nothing opens: both of their sides end in the same vertices.
    fn closed(&self, joined: &Joined, wanted: &HashSet<[u32; 2]>) -> Vec<[u32; 2]> {
        let vertices = |side: &([u32; 2], [u32; 2])| side.1.map(|c| joined.corners.find(c));
        self.inner()
            .filter(|sides| wanted.contains(&sides[0].0))
            .filter(|sides| vertices(&sides[0]) == vertices(&sides[1]))
            .map(|sides| sides[0].0)
            .collect()
    }

    /// For every one of some edges the shortest that meets it in a vertex and is not wanted yet;
    /// a forbidden one only if there is no other.
    fn neighbors(
        &self,
        mesh: &TriangleMesh,
        closed: &[[u32; 2]],
        wanted: &HashSet<[u32; 2]>,
        forbidden: &HashSet<[u32; 2]>,
    ) -> Vec<[u32; 2]> {
        let length = |[a, b]: [u32; 2]| {
            let at = |v: u32| mesh.positions()[v as usize];
            length(sub(at(b), at(a)))
        };
        let rank = |edge: [u32; 2]| (forbidden.contains(&edge), length(edge));
        let is_less = |one: (bool, f64), other: (bool, f64)| {
            one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)).is_lt()
        };
        let mut best: HashMap<u32, Option<[u32; 2]>> =
            closed.iter().flatten().map(|&v| (v, None)).collect();
        for edge in self.inner().map(|sides| sides[0].0) {
            for v in edge.into_iter().filter(|_| !wanted.contains(&edge)) {
                if let Some(best) = best.get_mut(&v)
                    && best.is_none_or(|best| is_less(rank(edge), rank(best)))
                {
                    *best = Some(edge);
                }
            }
        }
        let better = |ends: &[u32; 2]| {
            let [one, other] = ends.map(|v| best[&v]);
            match (one, other) {
                (Some(one), Some(other)) if is_less(rank(other), rank(one)) => Some(other),
                (one, other) => one.or(other),
            }
        };
        closed.iter().filter_map(better).collect()
    }
}

/// Which corners are one vertex, and which triangles one part.
struct Joined {
    corners: Sets,
    triangles: Sets,
}

impl Joined {
    fn parts(&self, mesh: &TriangleMesh) -> Vec<Part> {
        let mut order: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
        order.sort_by_key(|&t| (self.triangles.find(t), t));
        let mut members: Vec<&[u32]> = order
            .chunk_by(|&a, &b| self.triangles.find(a) == self.triangles.find(b))
            .collect();
        // Those that come last are cut first; what the small ones leave of the effort is more.
        members.sort_by_key(|triangles| Reverse(triangles.len()));
        let parts = members.into_iter();
        parts
            .filter_map(|triangles| self.part(mesh, triangles))
            .collect()
    }

    fn part(&self, mesh: &TriangleMesh, members: &[u32]) -> Option<Part> {
        let mut number = HashMap::new();
        let mut vertices = Vec::new();
        let mut vertex = |corner: u32| {
            *number.entry(self.corners.find(corner)).or_insert_with(|| {
                vertices.push(mesh.triangles()[corner as usize / 3][corner as usize % 3]);
                vertices.len() as u32 - 1
            })
        };
        let triangles = members
            .iter()
            .map(|t| [0, 1, 2].map(|c| vertex(3 * t + c)))
            .collect();
        let position = |&v: &u32| mesh.positions()[v as usize];
        let positions = vertices.iter().map(position).collect();
        Some(Part {
            mesh: TriangleMesh::new(positions, triangles).ok()?,
            vertices,
            triangles: members.to_vec(),
            placed: None,
        })
    }
}
