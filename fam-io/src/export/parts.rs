//! The meshes of a scene with their shares of the UVs.

use fam_surface::polygons::Pieces;

use crate::error::WriteFault;
use crate::scene::{Mesh, Scene};
use crate::uvs::{Uvs, check_count};

use super::place::Place;

/// A mesh, its faces and UVs, and where it is.
pub(super) struct Part<'a> {
    pub mesh: &'a Mesh,
    pub faces: Faces,
    /// What the corners of the faces refer to.
    pub uvs: &'a [[f32; 2]],
    /// One for each point of a cloud, otherwise none.
    pub point_uvs: &'a [[f32; 2]],
    /// At least one.
    pub places: Vec<Place>,
}

impl Part<'_> {
    /// The normal of a corner; zero if it is unknown.
    pub fn corner_normal(&self, corner: &Corner) -> [f32; 3] {
        normal(self.mesh, corner.number)
    }

    /// The normal of a vertex of a mesh without faces; zero if it is unknown.
    pub fn point_normal(&self, vertex: usize) -> [f32; 3] {
        normal(self.mesh, vertex)
    }

    /// The colour of a vertex, if the mesh has colours.
    pub fn color(&self, vertex: usize) -> Option<[f32; 4]> {
        self.mesh.colors.as_ref()?.get(vertex).copied()
    }

    /// Whether the transforms leave all coordinates finite.
    pub fn is_finite(&self) -> bool {
        let mut moved = self.places.iter().filter(|place| place.axes().is_some());
        moved.all(|place| {
            let mut positions = self.mesh.positions.iter();
            positions.all(|&p| place.position(p).iter().all(|c| c.is_finite()))
        })
    }

    /// The material of a polygon.
    pub fn material(&self, polygon: usize) -> Option<u32> {
        self.mesh.materials.get(polygon).copied().flatten()
    }
}

fn normal(mesh: &Mesh, at: usize) -> [f32; 3] {
    let normal = mesh.normals.as_ref().and_then(|normals| normals.get(at));
    match normal {
        Some(normal) if normal.iter().all(|c| c.is_finite()) => *normal,
        _ => [0.0; 3],
    }
}

/// The polygons of a mesh, as triangles where a seam crosses them.
#[derive(Debug, Default)]
pub(super) struct Faces {
    corners: Vec<Corner>,
    /// Of each face: where its corners end, and the polygon it is of.
    ends: Vec<(usize, usize)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corner {
    pub vertex: u32,
    pub uv: u32,
    /// Which corner of all polygons of the mesh it is.
    pub number: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face<'a> {
    pub polygon: usize,
    pub corners: &'a [Corner],
}

impl Faces {
    fn next(mesh: &Mesh, pieces: &mut Pieces) -> Self {
        let mut faces = Self::default();
        let mut first = 0;
        for (number, (polygon, division)) in mesh.polygons.divided().enumerate() {
            for piece in pieces.next(division) {
                faces.corners.extend(piece.iter().map(|&(at, uv)| Corner {
                    vertex: polygon[at],
                    uv,
                    number: first + at,
                }));
                faces.ends.push((faces.corners.len(), number));
            }
            first += polygon.len();
        }
        faces
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn iter(&self) -> impl Iterator<Item = Face<'_>> {
        let starts = std::iter::once(0).chain(self.ends.iter().map(|&(end, _)| end));
        starts.zip(&self.ends).map(|(start, &(end, polygon))| Face {
            polygon,
            corners: &self.corners[start..end],
        })
    }

    /// The corners of all faces in order.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
    }
}

/// The meshes in order.
///
/// # Errors
/// There are more UVs than the scene needs, or fewer: a file that was read before may have
/// changed.
pub(super) fn parts<'a>(scene: &'a Scene, uvs: &'a Uvs) -> Result<Vec<Part<'a>>, WriteFault> {
    check(scene, uvs)?;
    let mut places = vec![Vec::new(); scene.meshes.len()];
    for node in &scene.nodes {
        if let Some(places) = places.get_mut(node.mesh) {
            places.push(Place::of(&node.transform));
        }
    }
    for places in places.iter_mut().filter(|places| places.is_empty()) {
        places.push(Place::OWN);
    }
    let with_places = scene.meshes.iter().zip(places);
    Ok(match uvs {
        Uvs::Mesh(map) => {
            let mut pieces = Pieces::of(map);
            with_places
                .map(|(mesh, places)| Part {
                    mesh,
                    faces: Faces::next(mesh, &mut pieces),
                    uvs: map.uvs(),
                    point_uvs: &[],
                    places,
                })
                .collect()
        }
        Uvs::Points(points) => {
            let mut rest = points.as_slice();
            with_places
                .map(|(mesh, places)| {
                    let (point_uvs, others) = rest.split_at(mesh.positions.len());
                    rest = others;
                    Part {
                        mesh,
                        faces: Faces::default(),
                        uvs: &[],
                        point_uvs,
                        places,
                    }
                })
                .collect()
        }
    })
}

fn check(scene: &Scene, uvs: &Uvs) -> Result<(), WriteFault> {
    match uvs {
        Uvs::Mesh(map) => check_count("triangles", triangles(scene), map.triangles().len()),
        Uvs::Points(uvs) => {
            let points = scene.meshes.iter().map(|mesh| mesh.positions.len());
            check_count("points", points.sum(), uvs.len())
        }
    }
}

fn triangles(scene: &Scene) -> usize {
    let polygons = scene.meshes.iter().flat_map(|mesh| mesh.polygons.iter());
    polygons.map(|polygon| polygon.len() - 2).sum()
}
