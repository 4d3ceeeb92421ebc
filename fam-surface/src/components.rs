use serde::Serialize;

use super::degenerate::{double_area, rescaled};
use super::fans::Fans;
use super::joining::Topology;
use super::left_out::{Kind, kinds, layers, stand_ins};
use super::orientation::NONE;
use super::sides::{edges, is_torn, sides};
use super::vector::{add, normalize};
use super::weld::weld;
use super::{SurfaceError, TriangleMesh, UvMap};

/// A mesh taken apart into connected, manifold components.
///
/// What the file joins stays joined: triangles are neighbours across the edges of the file's own
/// vertices. Sides that these leave open are joined by position, so that a mesh whose vertices
/// were split (for hard edges or texture seams) hangs together again, while parts that merely
/// touch stay apart. Where three or more triangles meet at an edge, those pairs are joined that
/// continue each other best: of one winding before others, then the flattest. A pair stays apart
/// where the surface would otherwise come back to one of its own edges. Triangles with different labels
/// are never joined.
///
/// Triangles that repeat an earlier one ([`Duplicates`]), and those with two corners at one
/// position, are in no component's mesh. The first belong to the component of the
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

/// What becomes of triangles that repeat an earlier one: over the same three vertices, or as
/// part of a sheet each of whose triangles lies at the positions of another.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Duplicates {
    /// They share its UVs.
    #[default]
    Share,
    /// They have UVs of their own, in components of their own, as lightmaps need.
    Separate,
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
    /// Triangles that repeat an earlier one and share its UVs.
    pub duplicate_triangles: usize,
    /// Triangles without area to the precision of their coordinates, kept.
    pub zero_area_triangles: usize,
    /// Edges of three or more triangles; pairs that continue each other stay joined.
    pub non_manifold_edges: usize,
    /// Vertices (not on such an edge) where parts touch in nothing but the vertex, split.
    pub non_manifold_vertices: usize,
}

impl Components {
    /// Takes a mesh apart. `labels` has one entry per triangle, or none if all are alike.
    /// Triangles that repeat others share their UVs.
    ///
    /// # Errors
    /// `labels` is neither empty nor as long as there are triangles, or every triangle has
    /// two corners at one position.
    pub fn of(mesh: &TriangleMesh, labels: &[u32]) -> Result<Self, SurfaceError> {
        Self::with(mesh, labels, Duplicates::Share)
    }

    /// As [`of`](Self::of), with a choice for triangles that repeat others.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn with(
        mesh: &TriangleMesh,
        labels: &[u32],
        duplicates: Duplicates,
    ) -> Result<Self, SurfaceError> {
        let count = mesh.triangles().len();
        if !labels.is_empty() && labels.len() != count {
            return Err(SurfaceError::LengthMismatch {
                attribute: "labels",
                expected: count,
                found: labels.len(),
            });
        }
        let welded = weld(mesh.positions());
        let triangles: Vec<[u32; 3]> = mesh
            .triangles()
            .iter()
            .map(|t| t.map(|v| welded[v as usize]))
            .collect();
        let positions = rescaled(mesh.positions());
        let topology = Topology {
            own: mesh.triangles(),
            welded: &triangles,
            groups: labels,
            positions: &positions,
        };
        let label = |t: usize| labels.get(t).copied().unwrap_or(0);
        let mut kinds = kinds(&topology);
        let layered = match duplicates {
            Duplicates::Share => Vec::new(),
            Duplicates::Separate => in_layers(labels, &layers(&mut kinds)),
        };
        let topology = match duplicates {
            Duplicates::Share => topology,
            Duplicates::Separate => Topology {
                groups: &layered,
                ..topology
            },
        };
        let kept = |t: usize| kinds[t] == Kind::Kept;
        let joined = topology.join(kept);
        let fans = Fans::of(&topology, &joined);

        let mut list: Vec<Builder> = Vec::new();
        let mut component_of_root = vec![NONE; count];
        let mut vertex_of_fan = vec![NONE; 3 * count];
        let mut of_triangle: Vec<Option<u32>> = vec![None; count];
        for t in (0..count).filter(|&t| kept(t)) {
            let component = &mut component_of_root[fans.triangles.find(t as u32) as usize];
            if *component == NONE {
                *component = list.len() as u32;
                list.push(Builder::new(label(t)));
            }
            of_triangle[t] = Some(*component);
            let corners = [0, 1, 2].map(|c| {
                let fan = fans.corners.find(3 * t as u32 + c);
                (fan, triangles[t][c as usize], 3 * t + c as usize)
            });
            list[*component as usize].push(corners, &mut vertex_of_fan);
        }
        if list.is_empty() {
            return Err(SurfaceError::TooSmall("its triangles have no area"));
        }
        let stand_ins = stand_ins(&triangles, &kinds, label);
        for t in (0..count).filter(|&t| !kept(t)) {
            of_triangle[t] = stand_ins[t].and_then(|[corner, ..]| of_triangle[corner as usize / 3]);
        }

        let used = mesh.used_vertices();
        let area = |t: &[u32; 3]| double_area(t.map(|v| positions[v as usize]));
        let is_duplicate = |kind: &&Kind| matches!(kind, Kind::DuplicateOf(_));
        let non_manifold = &joined.non_manifold_edges;
        let conditioning = Conditioning {
            welded_vertices: fans.welded_vertices(&topology, &used, &welded, kept),
            unreferenced_vertices: mesh.positions().len() - used.len(),
            duplicate_triangles: kinds.iter().filter(is_duplicate).count(),
            zero_area_triangles: mesh.triangles().iter().filter(|t| area(t) == 0.0).count(),
            non_manifold_edges: non_manifold.len(),
            non_manifold_vertices: fans.non_manifold_vertices(&topology, non_manifold, kept),
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
    /// of their ends, the smaller first, ascending: two or more triangles share them, and one of
    /// these is joined to no other there. Between triangles of different labels they count if
    /// `across_labels`.
    ///
    /// An edge is what the file's own vertices join, or what lies at one position where they
    /// leave triangles open. Where parts merely touch, nothing was cut.
    ///
    /// # Panics
    /// If `mesh` is not the one that was taken apart.
    pub fn cuts(&self, mesh: &TriangleMesh, across_labels: bool) -> Vec<[u32; 2]> {
        let welded = weld(mesh.positions());
        let triangles = mesh.triangles().iter();
        let triangles: Vec<[u32; 3]> = triangles.map(|t| t.map(|v| welded[v as usize])).collect();
        let mut own: Vec<_> = self
            .list
            .iter()
            .map(|c| c.mesh.triangles().iter())
            .collect();
        let corners: Vec<Option<(u32, [u32; 3])>> = (0..triangles.len())
            .map(|t| {
                let component = self.of_triangle[t].filter(|_| self.is_kept(t))?;
                Some((component, *own[component as usize].next()?))
            })
            .collect();
        let group = |h: u32| match (across_labels, corners[h as usize / 3]) {
            (false, Some((component, _))) => self.list[component as usize].label,
            _ => 0,
        };
        let place = |h: u32, reversed: bool| {
            let (component, corners) = corners[h as usize / 3]?;
            let [a, b] = [0, 1].map(|end| corners[(h as usize % 3 + end) % 3]);
            Some((component, if reversed { [b, a] } else { [a, b] }))
        };
        let sides = sides(mesh.triangles(), &triangles, group, place);
        let torn = edges(&sides).filter(|edge| is_torn(edge));
        let mut cuts: Vec<[u32; 2]> = torn.map(|edge| edge[0].ends).collect();
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    }

    /// Whether a triangle is in the mesh of its component.
    fn is_kept(&self, t: usize) -> bool {
        self.stand_ins[t].is_some_and(|[corner, ..]| corner as usize / 3 == t)
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
        let mut triangles = vec![[0; 3]; self.of_triangle.len()];
        for (t, component) in self.of_triangle.iter().enumerate() {
            if let (Some(component), true) = (component, self.is_kept(t)) {
                triangles[t] = own[*component as usize].next().unwrap_or_default();
            }
        }
        for t in (0..triangles.len()).filter(|&t| !self.is_kept(t)) {
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

/// Labels and layers in one: no two that differ in either are equal.
fn in_layers(labels: &[u32], layers: &[u32]) -> Vec<u32> {
    let both = |t: usize| (labels.get(t).copied().unwrap_or(0), layers[t]);
    let mut all: Vec<(u32, u32)> = (0..layers.len()).map(both).collect();
    all.sort_unstable();
    all.dedup();
    (0..layers.len())
        .map(|t| all.partition_point(|&one| one < both(t)) as u32)
        .collect()
}

struct Builder {
    label: u32,
    triangles: Vec<[u32; 3]>,
    vertices: Vec<u32>,
    /// Corners of the whole mesh, three per triangle.
    corners: Vec<usize>,
}

impl Builder {
    fn new(label: u32) -> Self {
        Self {
            label,
            triangles: Vec::new(),
            vertices: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Adds a triangle of three corners: fan, welded vertex, corner of the whole mesh. The vertex
    /// of a fan is [`NONE`] until it has one.
    fn push(&mut self, corners: [(u32, u32, usize); 3], vertex_of_fan: &mut [u32]) {
        self.triangles.push(corners.map(|(fan, welded, _)| {
            let vertex = &mut vertex_of_fan[fan as usize];
            if *vertex == NONE {
                *vertex = self.vertices.len() as u32;
                self.vertices.push(welded);
            }
            *vertex
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
mod tests;
