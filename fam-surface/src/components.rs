use std::collections::{BTreeMap, HashMap, HashSet};

use serde::Serialize;

use super::degenerate::{double_area, rescaled};
use super::left_out::{Kind, kinds, stand_ins};
use super::sets::Sets;
use super::vector::{add, normalize};
use super::weld::weld;
use super::{SurfaceError, TriangleMesh, UvMap};

/// A mesh taken apart into connected, manifold components.
///
/// Vertices at equal positions are one, so that a mesh whose vertices were split (for hard
/// edges or texture seams) hangs together again. Triangles are joined across an edge that
/// exactly two of them share; where three or more meet, and where parts touch in a vertex
/// only, they are not. Triangles with different labels are never joined.
///
/// Triangles that repeat the three vertices of an earlier one, and those with two corners at
/// one position, are in no component's mesh. The first belong to the component of the
/// triangle they repeat, the second to one they share an edge with or else touch, if there is
/// any.
#[derive(Debug, Clone, PartialEq)]
pub struct Components {
    /// The components, in the order of their first triangles.
    pub list: Vec<Component>,
    /// The component of every triangle of the mesh.
    pub of_triangle: Vec<Option<u32>>,
    /// What was found on the way.
    pub conditioning: Conditioning,
    /// For every triangle of the mesh the corners, 3 t + c for corner c of the mesh's triangle
    /// t, of a triangle in its component's mesh whose UVs it takes.
    stand_ins: Vec<Option<[u32; 3]>>,
}

/// A connected mesh without non-manifold edges and vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Its vertices and triangles.
    pub mesh: TriangleMesh,
    /// For every vertex of it one of the whole mesh, at the same position.
    pub vertices: Vec<u32>,
    /// The label of its triangles.
    pub label: u32,
}

/// What a mesh had that a manifold has not, and how it was dealt with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Conditioning {
    /// Vertices at the position of an earlier one, taken for the same.
    pub welded_vertices: usize,
    /// Vertices in no triangle, ignored.
    pub unreferenced_vertices: usize,
    /// Triangles over the vertices of an earlier one; they share its UVs.
    pub duplicate_triangles: usize,
    /// Triangles without area to the precision of their coordinates, kept.
    pub zero_area_triangles: usize,
    /// Edges of three or more triangles, split.
    pub non_manifold_edges: usize,
    /// Vertices (not on such an edge) where parts touch in nothing but the vertex, split.
    pub non_manifold_vertices: usize,
}

impl Components {
    /// Takes a mesh apart. `labels` has one entry per triangle, or none if all are alike.
    ///
    /// # Errors
    /// `labels` is neither empty nor as long as there are triangles, or every triangle has
    /// two corners at one position.
    pub fn of(mesh: &TriangleMesh, labels: &[u32]) -> Result<Self, SurfaceError> {
        let count = mesh.triangles().len();
        if !labels.is_empty() && labels.len() != count {
            return Err(SurfaceError::LengthMismatch {
                attribute: "labels",
                expected: count,
                found: labels.len(),
            });
        }
        let label = |t: usize| labels.get(t).copied().unwrap_or(0);
        let welded = weld(mesh.positions());
        let triangles: Vec<[u32; 3]> = mesh
            .triangles()
            .iter()
            .map(|t| t.map(|v| welded[v as usize]))
            .collect();
        let kinds = kinds(&triangles, label);
        let fans = Fans::join(&triangles, &kinds, label);

        let mut list: Vec<Builder> = Vec::new();
        let mut component_of_root: HashMap<u32, u32> = HashMap::new();
        let mut of_triangle: Vec<Option<u32>> = vec![None; count];
        for t in (0..count).filter(|&t| kinds[t] == Kind::Kept) {
            let root = fans.triangles.find(t as u32);
            let component = *component_of_root.entry(root).or_insert_with(|| {
                list.push(Builder::new(label(t)));
                list.len() as u32 - 1
            });
            of_triangle[t] = Some(component);
            let corners = [0, 1, 2].map(|c| {
                let fan = fans.corners.find(3 * t as u32 + c);
                (fan, triangles[t][c as usize], 3 * t + c as usize)
            });
            list[component as usize].push(corners);
        }
        if list.is_empty() {
            return Err(SurfaceError::TooSmall("its triangles have no area"));
        }
        let stand_ins = stand_ins(&triangles, &kinds, label);
        for t in (0..count).filter(|&t| kinds[t] != Kind::Kept) {
            of_triangle[t] = stand_ins[t].and_then(|[corner, ..]| of_triangle[corner as usize / 3]);
        }

        let used = mesh.used_vertices();
        let positions = rescaled(mesh.positions());
        let area = |t: &[u32; 3]| double_area(t.map(|v| positions[v as usize]));
        let conditioning = Conditioning {
            welded_vertices: used.len()
                - used
                    .iter()
                    .map(|&v| welded[v as usize])
                    .collect::<HashSet<_>>()
                    .len(),
            unreferenced_vertices: mesh.positions().len() - used.len(),
            duplicate_triangles: kinds
                .iter()
                .filter(|kind| matches!(kind, Kind::DuplicateOf(_)))
                .count(),
            zero_area_triangles: mesh.triangles().iter().filter(|t| area(t) == 0.0).count(),
            non_manifold_edges: fans.non_manifold_edges.len(),
            non_manifold_vertices: fans.non_manifold_vertices(&triangles, &kinds, label),
        };
        let list = list
            .into_iter()
            .map(|builder| builder.build(mesh))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            list,
            of_triangle,
            conditioning,
            stand_ins,
        })
    }

    /// The edges along which the mesh was taken apart, by the first vertices at the positions
    /// of their ends, the smaller first, ascending: triangles of several components share them.
    /// Between triangles of different labels they count if `across_labels`.
    ///
    /// # Panics
    /// If `mesh` is not the one that was taken apart.
    pub fn cuts(&self, mesh: &TriangleMesh, across_labels: bool) -> Vec<[u32; 2]> {
        let welded = weld(mesh.positions());
        let mut sides: Vec<(u32, [u32; 2], u32)> = Vec::new();
        for (triangle, &component) in mesh.triangles().iter().zip(&self.of_triangle) {
            let Some(component) = component else { continue };
            let label = match across_labels {
                true => 0,
                false => self.list[component as usize].label,
            };
            let [a, b, c] = triangle.map(|v| welded[v as usize]);
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if a != b {
                    sides.push((label, [a.min(b), a.max(b)], component));
                }
            }
        }
        sides.sort_unstable();
        sides.dedup();
        let mut cuts: Vec<[u32; 2]> = sides
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .filter(|components| components.len() > 1)
            .map(|components| components[0].1)
            .collect();
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    }

    /// The maps of the components' meshes that have one UV for each vertex.
    ///
    /// # Errors
    /// There are fewer UVs than vertices, or one is not finite.
    pub fn vertex_maps(&self, uvs: &[Vec<[f32; 2]>]) -> Result<Vec<UvMap>, SurfaceError> {
        let maps = self.list.iter().zip(uvs);
        maps.map(|(component, uvs)| UvMap::new(uvs.clone(), component.mesh.triangles().to_vec()))
            .collect()
    }

    /// The UVs of the whole mesh from one map for each of its components' meshes.
    ///
    /// A triangle that repeats another takes its UVs corner by corner; one with two corners at
    /// one position takes those of the edge that it has become, or one UV where no other
    /// triangle has that edge. Triangles of no component lie at (0, 0).
    ///
    /// # Errors
    /// There are not as many maps as components, or not as many triangles in a map as in the
    /// mesh of its component.
    pub fn uv_map(&self, maps: &[UvMap]) -> Result<UvMap, SurfaceError> {
        let mismatch = |attribute, expected, found| {
            Err(SurfaceError::LengthMismatch {
                attribute,
                expected,
                found,
            })
        };
        if maps.len() != self.list.len() {
            return mismatch("UV maps of components", self.list.len(), maps.len());
        }
        let mut all = vec![[0.0; 2]];
        let mut own = Vec::with_capacity(maps.len());
        for (component, map) in self.list.iter().zip(maps) {
            let (expected, found) = (component.mesh.triangles().len(), map.triangles().len());
            if expected != found {
                return mismatch("texture coordinate triangles", expected, found);
            }
            let first = all.len() as u32;
            all.extend(map.uvs());
            own.push(map.triangles().iter().map(move |t| t.map(|i| first + i)));
        }
        let is_kept = |t: usize| self.stand_ins[t].is_some_and(|[a, ..]| a as usize / 3 == t);
        let mut triangles = vec![[0; 3]; self.of_triangle.len()];
        for (t, component) in self.of_triangle.iter().enumerate() {
            if let (Some(component), true) = (component, is_kept(t)) {
                triangles[t] = own[*component as usize].next().unwrap_or_default();
            }
        }
        for t in (0..triangles.len()).filter(|&t| !is_kept(t)) {
            if let Some(corners) = self.stand_ins[t] {
                triangles[t] = corners.map(|corner| {
                    let corner = corner as usize;
                    triangles[corner / 3][corner % 3]
                });
            }
        }
        UvMap::new(all, triangles)
    }
}

/// Which triangles, and which of their corners, hang together.
struct Fans {
    triangles: Sets,
    corners: Sets,
    /// With their label, by welded vertices.
    non_manifold_edges: Vec<(u32, [u32; 2])>,
}

impl Fans {
    fn join(triangles: &[[u32; 3]], kinds: &[Kind], label: impl Fn(usize) -> u32) -> Self {
        // Per edge: label, lower and higher vertex, corner at the lower, corner at the higher.
        let mut sides: Vec<(u32, [u32; 2], [u32; 2])> = Vec::new();
        for (t, triangle) in triangles.iter().enumerate() {
            if kinds[t] != Kind::Kept {
                continue;
            }
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                let (i, j) = if triangle[i] < triangle[j] {
                    (i, j)
                } else {
                    (j, i)
                };
                let corner = |c: usize| (3 * t + c) as u32;
                sides.push((label(t), [triangle[i], triangle[j]], [corner(i), corner(j)]));
            }
        }
        sides.sort_unstable();
        let mut joined = Self {
            triangles: Sets::new(triangles.len()),
            corners: Sets::new(3 * triangles.len()),
            non_manifold_edges: Vec::new(),
        };
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match edge {
                [_] => {}
                [(_, _, a), (_, _, b)] => {
                    joined.triangles.join(a[0] / 3, b[0] / 3);
                    joined.corners.join(a[0], b[0]);
                    joined.corners.join(a[1], b[1]);
                }
                _ => joined.non_manifold_edges.push((edge[0].0, edge[0].1)),
            }
        }
        joined.triangles.settle();
        joined.corners.settle();
        joined
    }

    /// How many vertices off the non-manifold edges have several fans of triangles.
    fn non_manifold_vertices(
        &self,
        triangles: &[[u32; 3]],
        kinds: &[Kind],
        label: impl Fn(usize) -> u32,
    ) -> usize {
        let on_edge: HashSet<(u32, u32)> = self
            .non_manifold_edges
            .iter()
            .flat_map(|&(label, ends)| ends.map(|v| (label, v)))
            .collect();
        let mut fans: Vec<(u32, u32, u32)> = Vec::new();
        for (t, triangle) in triangles.iter().enumerate() {
            for (c, &v) in triangle.iter().enumerate() {
                if kinds[t] == Kind::Kept && !on_edge.contains(&(label(t), v)) {
                    let fan = self.corners.find((3 * t + c) as u32);
                    fans.push((label(t), v, fan));
                }
            }
        }
        fans.sort_unstable();
        fans.dedup();
        fans.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .filter(|fans| fans.len() > 1)
            .count()
    }
}

struct Builder {
    label: u32,
    triangles: Vec<[u32; 3]>,
    /// The new vertex of a fan of corners.
    of_fan: BTreeMap<u32, u32>,
    vertices: Vec<u32>,
    /// Corners of the whole mesh, three per triangle.
    corners: Vec<usize>,
}

impl Builder {
    fn new(label: u32) -> Self {
        Self {
            label,
            triangles: Vec::new(),
            of_fan: BTreeMap::new(),
            vertices: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Adds a triangle of three corners: fan, welded vertex, corner of the whole mesh.
    fn push(&mut self, corners: [(u32, u32, usize); 3]) {
        self.triangles.push(corners.map(|(fan, vertex, _)| {
            *self.of_fan.entry(fan).or_insert_with(|| {
                self.vertices.push(vertex);
                self.vertices.len() as u32 - 1
            })
        }));
        self.corners.extend(corners.map(|(_, _, corner)| corner));
    }

    fn build(self, whole: &TriangleMesh) -> Result<Component, SurfaceError> {
        let position = |&v: &u32| whole.positions()[v as usize];
        let positions = self.vertices.iter().map(position).collect();
        let corners: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        let mut mesh = TriangleMesh::new(positions, self.triangles)?;
        if let Some(normals) = whole.normals() {
            let mut sums = vec![[0.0; 3]; self.vertices.len()];
            for (&vertex, &corner) in corners.iter().zip(&self.corners) {
                let original = whole.triangles()[corner / 3][corner % 3];
                let sum = &mut sums[vertex as usize];
                *sum = add(*sum, normalize(normals[original as usize]));
            }
            mesh = mesh.with_normals(sums.into_iter().map(normalize).collect())?;
        }
        Ok(Component {
            mesh,
            vertices: self.vertices,
            label: self.label,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn components(mesh: &TriangleMesh) -> Components {
        Components::of(mesh, &[]).unwrap()
    }

    fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriangleMesh {
        TriangleMesh::new(positions.to_vec(), triangles.to_vec()).unwrap()
    }

    const FIVE: [[f64; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, -1.0, 0.0],
    ];

    #[test]
    fn a_manifold_mesh_is_its_only_component() {
        let torus = shapes::torus(1.0, 0.4, 12, 8);
        let found = components(&torus);
        assert_eq!(found.conditioning, Conditioning::default());
        assert_eq!(found.list.len(), 1);
        let component = &found.list[0];
        let back = |t: &[u32; 3]| t.map(|v| component.vertices[v as usize]);
        let triangles: Vec<_> = component.mesh.triangles().iter().map(back).collect();
        assert_eq!(triangles, torus.triangles());
        assert_eq!(component.mesh.positions().len(), torus.positions().len());
    }

    #[test]
    fn a_mesh_split_at_every_corner_hangs_together_again() {
        let torus = shapes::torus(1.0, 0.4, 12, 8);
        let soup = (0..torus.triangles().len()).flat_map(|t| torus.corners(t));
        let triangles = (0..torus.triangles().len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        let soup = mesh(&soup.collect::<Vec<_>>(), &triangles.collect::<Vec<_>>());
        let found = components(&soup);
        assert_eq!(found.list.len(), 1);
        assert_eq!(
            found.list[0].mesh.positions().len(),
            torus.positions().len()
        );
        let welded = soup.positions().len() - torus.positions().len();
        assert_eq!(found.conditioning.welded_vertices, welded);
    }

    #[test]
    fn three_triangles_at_an_edge_are_apart_and_four_sheets_stay_whole() {
        let fins = mesh(&FIVE, &[[0, 1, 2], [0, 1, 3], [1, 0, 4]]);
        let found = components(&fins);
        assert_eq!(found.list.len(), 3);
        assert_eq!(found.conditioning.non_manifold_edges, 1);
        assert_eq!(found.conditioning.non_manifold_vertices, 0);
        assert_eq!(found.cuts(&fins, false), [[0, 1]]);
        for component in &found.list {
            assert_eq!(component.mesh.positions().len(), 3);
        }
    }

    #[test]
    fn triangles_that_touch_in_a_vertex_are_apart() {
        let bow = mesh(&FIVE, &[[0, 1, 2], [0, 3, 4]]);
        let found = components(&bow);
        assert_eq!(found.list.len(), 2);
        assert_eq!(found.conditioning.non_manifold_vertices, 1);
        assert_eq!(found.conditioning.non_manifold_edges, 0);
        assert_eq!(found.of_triangle, [Some(0), Some(1)]);
    }

    #[test]
    fn a_pinched_vertex_inside_one_component_is_split() {
        // A strip of triangles that comes back to its first vertex.
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [2.0, 0.5, 1.0],
            [1.0, 2.0, 1.0],
            [-1.0, 1.0, 1.0],
        ];
        let strip = mesh(
            &positions,
            &[[0, 1, 2], [1, 3, 2], [2, 3, 4], [2, 4, 5], [4, 0, 5]],
        );
        let found = components(&strip);
        assert_eq!(found.list.len(), 1);
        assert_eq!(found.conditioning.non_manifold_vertices, 1);
        assert_eq!(found.list[0].mesh.positions().len(), 7);
        assert_eq!(
            found.list[0].vertices.iter().filter(|&&v| v == 0).count(),
            2
        );
    }

    #[test]
    fn repeated_and_collapsed_triangles_are_counted_and_follow_their_neighbours() {
        let mut positions = FIVE.to_vec();
        positions.push(FIVE[1]);
        positions.push([9.0; 3]);
        let messy = mesh(
            &positions,
            &[
                [0, 1, 2],
                [2, 5, 0],
                [1, 5, 3],
                [0, 3, 4],
                [6, 6, 6],
                [0, 2, 2],
            ],
        );
        let found = components(&messy);
        let expected = Conditioning {
            welded_vertices: 1,
            unreferenced_vertices: 0,
            duplicate_triangles: 1,
            zero_area_triangles: 3,
            non_manifold_edges: 0,
            non_manifold_vertices: 1,
        };
        assert_eq!(found.conditioning, expected);
        let of_triangle = [Some(0), Some(0), Some(0), Some(1), None, Some(0)];
        assert_eq!(found.of_triangle, of_triangle);
        assert_eq!(found.list[0].mesh.triangles().len(), 1);
    }

    /// The map of a component with three UVs of its own for each triangle.
    fn exploded(component: &Component, tag: f32) -> UvMap {
        let count = component.mesh.triangles().len() as u32;
        let uvs = (0..3 * count).map(|i| [tag, i as f32]).collect();
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        UvMap::new(uvs, triangles.collect()).unwrap()
    }

    #[test]
    fn maps_with_seams_reach_every_triangle() {
        let mut positions = FIVE.to_vec();
        positions.push(FIVE[1]);
        positions.push([9.0; 3]);
        let messy = mesh(
            &positions,
            &[
                [0, 1, 2],
                [2, 5, 0],
                [1, 5, 3],
                [0, 3, 4],
                [6, 6, 6],
                [0, 2, 2],
                [3, 2, 3],
            ],
        );
        let found = components(&messy);
        assert_eq!(found.list.len(), 2);
        let maps = [exploded(&found.list[0], 0.0), exploded(&found.list[1], 1.0)];
        let map = found.uv_map(&maps).unwrap();
        let corners: Vec<_> = (0..7).map(|t| map.corners(t)).collect();
        let expected = [
            [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]],
            [[0.0, 2.0], [0.0, 1.0], [0.0, 0.0]],
            // Both ends of the edge are vertex 1, which the first triangle has.
            [[0.0, 1.0]; 3],
            [[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]],
            [[0.0, 0.0]; 3],
            [[0.0, 0.0], [0.0, 2.0], [0.0, 2.0]],
            [[1.0, 1.0]; 3],
        ];
        assert_eq!(corners, expected);
        assert!(found.uv_map(&maps[..1]).is_err());
        assert!(found.uv_map(&[maps[0].clone(), maps[0].clone()]).is_ok());
        let torus = components(&shapes::torus(1.0, 0.4, 12, 8));
        assert!(torus.uv_map(&maps[..1]).is_err());
    }

    /// The two vertices that a pinched one was split into may have different UVs.
    #[test]
    fn the_sides_of_a_pinched_vertex_keep_their_uvs() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [2.0, 0.5, 1.0],
            [1.0, 2.0, 1.0],
            [-1.0, 1.0, 1.0],
        ];
        let strip = mesh(
            &positions,
            &[[0, 1, 2], [1, 3, 2], [2, 3, 4], [2, 4, 5], [4, 0, 5]],
        );
        let found = components(&strip);
        let component = &found.list[0];
        let uvs: Vec<[f32; 2]> = (0..7).map(|i| [i as f32, 1.0]).collect();
        let maps = found.vertex_maps(std::slice::from_ref(&uvs)).unwrap();
        let map = found.uv_map(&maps).unwrap();
        for (t, triangle) in component.mesh.triangles().iter().enumerate() {
            assert_eq!(map.corners(t), triangle.map(|v| uvs[v as usize]));
        }
        assert_ne!(map.corners(0)[0], map.corners(4)[1]);
    }

    #[test]
    fn labels_keep_triangles_apart() {
        let square = shapes::rectangle(1.0, 1.0, 2, 1);
        let found = Components::of(&square, &[7, 7, 3, 3]).unwrap();
        let labels: Vec<u32> = found.list.iter().map(|c| c.label).collect();
        assert_eq!(labels, [7, 3]);
        assert_eq!(found.cuts(&square, false), [] as [[u32; 2]; 0]);
        // The triangles of the first square and of the second share one edge.
        assert_eq!(found.cuts(&square, true).len(), 1);
        assert_eq!(found.conditioning, Conditioning::default());
        assert!(Components::of(&square, &[1]).is_err());
    }

    #[test]
    fn only_collapsed_triangles_are_an_error() {
        let points = mesh(&[[0.0; 3], [1.0; 3]], &[[0, 1, 1], [0, 0, 0]]);
        assert!(Components::of(&points, &[]).is_err());
    }
}
