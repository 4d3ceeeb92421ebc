//! What the formats have in common, for writing a file of one as another.

use std::iter::once;
use std::rc::Rc;

use fam_surface::Surface;
use fam_surface::polygons::Polygons;

/// Meshes or points, and where they are.
///
/// The triangles of the polygons of all meshes, in order, are the triangles of the document's surface.
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
    /// The first polygon of every run that is an object, and the name of the object; empty
    /// where the mesh is one.
    pub objects: Vec<(usize, String)>,
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

    /// The same with every object of a mesh as a mesh of its own.
    pub fn with_objects_as_meshes(self) -> Self {
        let mut meshes = Vec::new();
        let mut numbers = Vec::new();
        for mesh in self.meshes {
            let first = meshes.len();
            meshes.extend(mesh.into_objects());
            numbers.push(first..meshes.len());
        }
        let of_objects = |node: Node| {
            let numbers = numbers.get(node.mesh).cloned().unwrap_or_default();
            numbers.map(move |mesh| Node {
                mesh,
                transform: node.transform,
            })
        };
        Self {
            materials: self.materials,
            meshes,
            nodes: self.nodes.into_iter().flat_map(of_objects).collect(),
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

impl Mesh {
    /// Every object with the vertices of its faces, in their order; vertices in no face are
    /// left out. The mesh itself if it is one object.
    fn into_objects(self) -> Vec<Self> {
        if self.objects.is_empty() {
            return vec![self];
        }
        let ends = self.objects.iter().skip(1).map(|(first, _)| *first);
        let ends = ends.chain(once(self.polygons.len()));
        let mut faces = self.polygons.iter();
        let mut corners = 0..0;
        // Of every vertex of the mesh, its number in the last object that has it.
        let mut numbers = vec![0; self.positions.len()];
        let mut object = |(first, name): &(usize, String), end: usize| {
            let faces: Vec<_> = faces.by_ref().take(end - first).collect();
            let mut used = faces.concat();
            corners = corners.end..corners.end + used.len();
            used.sort_unstable();
            used.dedup();
            for (number, &vertex) in (0..).zip(&used) {
                numbers[vertex as usize] = number;
            }
            let mut polygons = Polygons::default();
            for face in faces {
                polygons.push(face.iter().map(|&vertex| numbers[vertex as usize]));
            }
            let of_used = |colors: &Vec<_>| used.iter().map(|&v| colors[v as usize]).collect();
            let positions: Vec<_> = used.iter().map(|&v| self.positions[v as usize]).collect();
            polygons.divide(&positions);
            Self {
                name: name.clone(),
                positions,
                colors: self.colors.as_ref().map(of_used),
                polygons,
                normals: self.normals.as_ref().map(|n| n[corners.clone()].to_vec()),
                materials: self.materials.get(*first..end).unwrap_or_default().to_vec(),
                objects: Vec::new(),
            }
        };
        let objects = self.objects.iter().zip(ends);
        objects.map(|(start, end)| object(start, end)).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_become_meshes_with_their_own_vertices() {
        let mut polygons = Polygons::default();
        polygons.push([5, 1, 2]);
        polygons.push([2, 1, 5, 0]);
        polygons.push([4, 0, 5]);
        let mesh = Mesh {
            positions: (0..6).map(|x| [f64::from(x), 0.0, 0.0]).collect(),
            colors: Some((0..6).map(|r| [r as f32, 0.0, 0.0, 1.0]).collect()),
            normals: Some((0..10).map(|x| [x as f32, 0.0, 0.0]).collect()),
            polygons,
            materials: vec![None, Some(1), Some(0)],
            objects: vec![(0, "a".to_owned()), (2, "b".to_owned())],
            ..Mesh::default()
        };
        let place = |mesh: usize, x: f64| {
            let mut transform = IDENTITY;
            transform[3][0] = x;
            Node { mesh, transform }
        };
        let scene = Scene {
            materials: vec![Material::default(); 2],
            meshes: vec![Mesh::default(), mesh],
            nodes: vec![place(1, 0.0), place(0, 1.0), place(1, 2.0)],
        };
        let scene = scene.with_objects_as_meshes();
        let nodes = [(1, 0.0), (2, 0.0), (0, 1.0), (1, 2.0), (2, 2.0)];
        assert_eq!(scene.nodes, nodes.map(|(mesh, x)| place(mesh, x)));
        assert_eq!(scene.materials.len(), 2);
        let [_, a, b] = scene.meshes.as_slice() else {
            panic!("{} meshes", scene.meshes.len());
        };
        assert_eq!((&*a.name, &*b.name), ("a", "b"));
        let xs = |mesh: &Mesh| mesh.positions.iter().map(|p| p[0]).collect::<Vec<_>>();
        assert_eq!(
            (xs(a), xs(b)),
            (vec![0.0, 1.0, 2.0, 5.0], vec![0.0, 4.0, 5.0])
        );
        assert_eq!(b.colors.as_ref().unwrap()[1], [4.0, 0.0, 0.0, 1.0]);
        let faces = |mesh: &Mesh| mesh.polygons.iter().map(<[_]>::to_vec).collect::<Vec<_>>();
        assert_eq!(faces(a), [vec![3, 1, 2], vec![2, 1, 3, 0]]);
        assert_eq!(faces(b), [[1, 0, 2]]);
        assert_eq!(
            (a.normals.as_ref().unwrap().len(), &b.normals),
            (7, &Some((7..10).map(|x| [x as f32, 0.0, 0.0]).collect()))
        );
        assert_eq!(
            (&*a.materials, &*b.materials),
            (&[None, Some(1)][..], &[Some(0)][..])
        );
    }
}
