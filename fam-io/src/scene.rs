//! What the formats have in common, for writing a file of one as another.

use std::rc::Rc;

use fam_core::surface::Surface;

use crate::polygons::Polygons;

/// Meshes or points, and where they are.
///
/// The polygons of all meshes, in order, as fans, are the triangles of the document's surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scene {
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    /// Where the meshes are; one mesh may be in several places, or in none.
    pub nodes: Vec<Node>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Material {
    pub name: String,
    /// Red, green, blue and opacity, linear.
    pub base_color: [f32; 4],
    pub texture: Option<Image>,
}

/// An encoded image (PNG, JPEG, …). Materials that have the same one share its bytes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Image {
    pub name: String,
    pub bytes: Rc<[u8]>,
}

/// Faces over shared vertices; points, if there are no faces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    pub name: String,
    pub positions: Vec<[f64; 3]>,
    /// Of each vertex: red, green, blue and opacity, linear.
    pub colors: Option<Vec<[f32; 4]>>,
    pub polygons: Polygons,
    /// Of each corner of the polygons in order; of each vertex where there are no polygons.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Of each polygon; empty where none has a material.
    pub materials: Vec<Option<u32>>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    pub mesh: usize,
    /// From the mesh's coordinates to those of the scene, column by column.
    pub transform: [[f64; 4]; 4],
}

pub(crate) const IDENTITY: [[f64; 4]; 4] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
];

impl Scene {
    /// One mesh, where it is.
    pub fn of_mesh(mesh: Mesh) -> Self {
        let node = Node {
            mesh: 0,
            transform: IDENTITY,
        };
        Self {
            materials: Vec::new(),
            meshes: vec![mesh],
            nodes: vec![node],
        }
    }

    /// The positions, triangles and normals of a surface.
    pub fn of_surface(surface: &Surface) -> Self {
        let mut polygons = Polygons::default();
        let normals = match surface {
            Surface::Mesh(mesh) => {
                mesh.triangles().iter().for_each(|&t| polygons.push(t));
                mesh.normals()
            }
            Surface::PointCloud(cloud) => cloud.normals(),
        };
        Self::of_mesh(Mesh {
            positions: surface.positions().to_vec(),
            normals: normals.map(|normals| corner_normals(&polygons, normals)),
            polygons,
            ..Mesh::default()
        })
    }
}

/// Normals given per vertex, as those of a mesh of these polygons; zero for one that is not
/// finite.
pub(crate) fn corner_normals(polygons: &Polygons, normals: &[[f64; 3]]) -> Vec<[f32; 3]> {
    let known = |c: &f64| c.is_finite();
    let narrow = |n: &[f64; 3]| {
        if n.iter().all(known) {
            n.map(|c| c as f32)
        } else {
            [0.0; 3]
        }
    };
    let mut corners = polygons.iter().flatten().peekable();
    if corners.peek().is_none() {
        return normals.iter().map(narrow).collect();
    }
    corners.map(|&v| narrow(&normals[v as usize])).collect()
}
