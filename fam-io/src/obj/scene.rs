//! An OBJ file as a scene: one mesh with all faces, and with its objects.

use fam_surface::vector;

use crate::scene::{Material, Mesh, Scene};

use super::model::Model;
use super::statements::decode;

/// The scene of a file that was read, with the colours of its vertices and its materials.
pub(super) fn scene(
    model: Model,
    colors: Option<Vec<[f32; 4]>>,
    materials: Vec<Material>,
) -> Scene {
    let is_cloud = model.faces.vertices.is_empty();
    let normals = if is_cloud {
        model
            .point_normals()
            .map(|normals| normals.iter().copied().map(narrow).collect())
    } else {
        corner_normals(&model)
    };
    let name = match model.objects.used() {
        [only] => decode(only),
        _ => String::new(),
    };
    let mesh = Mesh {
        name,
        colors: colors.map(|colors| model.kept.only(colors)),
        normals,
        materials: model.materials.of_faces(&model.faces.vertices),
        objects: model.objects.starts(),
        positions: model.numbers.positions,
        polygons: model.faces.vertices,
    };
    Scene {
        materials,
        ..Scene::of_mesh(mesh)
    }
}

fn narrow(vector: [f64; 3]) -> [f32; 3] {
    vector.map(|c| c as f32)
}

/// The normals of all corners, if one has any; that of its face for a corner that has none.
fn corner_normals(model: &Model) -> Option<Vec<[f32; 3]>> {
    let (faces, numbers) = (&model.faces, &model.numbers);
    let given = |corner: usize| {
        let normal = faces.normals.get(corner, numbers.normals.len())?;
        let normal = narrow(numbers.normals[normal as usize]);
        let is_direction = normal.iter().all(|c| c.is_finite()) && normal != [0.0; 3];
        is_direction.then_some(normal)
    };
    let corners = faces.vertices.corners().len();
    (0..corners).any(|corner| given(corner).is_some()).then(|| {
        let mut normals = Vec::with_capacity(corners);
        for polygon in faces.vertices.iter() {
            let of_corners = normals.len()..normals.len() + polygon.len();
            let mut of_face = None;
            normals.extend(of_corners.map(|corner| {
                given(corner).unwrap_or_else(|| {
                    *of_face.get_or_insert_with(|| face_normal(polygon, &numbers.positions))
                })
            }));
        }
        normals
    })
}

/// The unit normal of a polygon's area vector; zero if it has no area.
fn face_normal(polygon: &[u32], positions: &[[f64; 3]]) -> [f32; 3] {
    let corner =
        |vertex: u32| vector::sub(positions[vertex as usize], positions[polygon[0] as usize]);
    let areas = polygon
        .windows(2)
        .map(|pair| vector::cross(corner(pair[0]), corner(pair[1])));
    narrow(vector::normalize(areas.fold([0.0; 3], vector::add)))
}
