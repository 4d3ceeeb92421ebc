//! A document as what all formats have in common.

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use ::gltf::json::accessor::Type;
use fam_surface::polygons::Polygons;
use serde_json::Value;

use super::geometry::{Geometry, Pool};
use super::images;
use super::package::Package;
use super::read::{name, vectors};
use crate::scene::{Image, Material, Mesh, Node, Scene};

/// The meshes in their own coordinates, the nodes that use them, and the materials.
pub(super) fn scene(
    package: &Package,
    folder: Option<&Path>,
    geometry: &Geometry,
    nodes: &[Node],
) -> Scene {
    let mut images = Images {
        package,
        folder,
        read: HashMap::new(),
    };
    let materials = package.entries("materials").iter();
    let meshes = package.entries("meshes").iter().enumerate();
    Scene {
        materials: materials
            .map(|entry| material(entry, &mut images))
            .collect(),
        meshes: meshes
            .map(|(index, entry)| Mesh {
                name: name(entry),
                ..mesh(package, geometry, index)
            })
            .collect(),
        nodes: nodes.to_vec(),
    }
}

fn mesh(package: &Package, geometry: &Geometry, index: usize) -> Mesh {
    let pools = geometry.pools_of(index);
    let first = pools.first().map_or(0, |pool| pool.vertices.start);
    let mut mesh = Mesh {
        colors: colors(package, pools),
        ..Mesh::default()
    };
    for pool in pools {
        mesh.positions
            .extend(vectors(package, pool, "POSITION").into_iter().flatten());
    }
    for primitive in geometry.primitives_of(index) {
        let start = (geometry.pools[primitive.pool].vertices.start - first) as u32;
        for triangle in &primitive.triangles {
            mesh.polygons.push(triangle.map(|v| v + start));
            mesh.materials
                .push(primitive.material.map(|material| material as u32));
        }
    }
    if mesh.materials.iter().all(Option::is_none) {
        mesh.materials.clear();
    }
    mesh.normals = normals(package, pools).map(|normals| per_corner(normals, &mesh.polygons));
    mesh
}

/// The normals of the vertices, if all have one.
fn normals(package: &Package, pools: &[Pool]) -> Option<Vec<[f32; 3]>> {
    let mut all = Vec::new();
    for pool in pools {
        let normals = vectors::<3>(package, pool, "NORMAL")?;
        all.extend(normals.iter().map(|n| n.map(|c| c as f32)));
    }
    Some(all).filter(|all| !all.is_empty())
}

fn per_corner(normals: Vec<[f32; 3]>, polygons: &Polygons) -> Vec<[f32; 3]> {
    let mut corners = polygons.iter().flatten().peekable();
    if corners.peek().is_none() {
        return normals;
    }
    corners.map(|&v| normals[v as usize]).collect()
}

/// The colors of the vertices, white where a pool has none; `None` if no pool has any.
fn colors(package: &Package, pools: &[Pool]) -> Option<Vec<[f32; 4]>> {
    if pools.iter().all(|pool| pool.attribute("COLOR_0").is_none()) {
        return None;
    }
    let of = |pool: &Pool| match pool.attribute("COLOR_0").map(|colors| colors.elements.kind) {
        Some(Type::Vec3) => vectors::<3>(package, pool, "COLOR_0")
            .into_iter()
            .flatten()
            .map(|[r, g, b]| [r, g, b, 1.0])
            .collect(),
        Some(_) => vectors(package, pool, "COLOR_0").unwrap_or_default(),
        None => vec![[1.0; 4]; pool.vertices.len()],
    };
    let colors = pools.iter().flat_map(of);
    Some(colors.map(|color| color.map(|c| c as f32)).collect())
}

fn material(entry: &Value, images: &mut Images) -> Material {
    let surface = &entry["pbrMetallicRoughness"];
    let factor = surface["baseColorFactor"].as_array();
    let component = |c: usize| factor.and_then(|factor| factor.get(c)?.as_f64());
    Material {
        name: name(entry),
        base_color: std::array::from_fn(|c| component(c).unwrap_or(1.0) as f32),
        texture: images.of_texture(&surface["baseColorTexture"]),
    }
}

/// Where an image is: its URI and its buffer view.
type ImagePlace<'a> = (Option<&'a str>, Option<u64>);

/// The images of a document; what several textures have is read once.
struct Images<'a> {
    package: &'a Package,
    folder: Option<&'a Path>,
    read: HashMap<ImagePlace<'a>, Option<Rc<[u8]>>>,
}

impl Images<'_> {
    /// The image of a texture, if it is there.
    fn of_texture(&mut self, info: &Value) -> Option<Image> {
        let entry = |list, index: u64| self.package.entries(list).get(index as usize);
        let texture = entry("textures", info["index"].as_u64()?)?;
        let extensions = texture["extensions"].as_object();
        let alternatives = extensions.into_iter().flat_map(|all| all.values());
        let mut sources = std::iter::once(texture).chain(alternatives);
        let source = sources.find_map(|owner| owner["source"].as_u64())?;
        let image = entry("images", source)?;
        let place = (image["uri"].as_str(), image["bufferView"].as_u64());
        let read = || images::bytes(self.package, self.folder, image).map(Rc::from);
        Some(Image {
            name: name(image),
            bytes: self.read.entry(place).or_insert_with(read).clone()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::scene::IDENTITY;

    #[test]
    fn a_document_is_a_scene() {
        let mut package = Package {
            json: json!({
                "materials": [
                    {"name": "plain"},
                    {"pbrMetallicRoughness": {
                        "baseColorFactor": [0.25, 0.5, 0.75, 1.0],
                        "baseColorTexture": {"index": 0},
                    }},
                ],
                "textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
            }),
            bin: Vec::new(),
        };
        let image = package.add_view(b"image", None, None);
        package.push("images", json!({"name": "picture", "bufferView": image}));
        let left = package.add_vectors(&[[0.0_f32; 3], [1.0; 3], [2.0; 3]], true);
        let right = package.add_vectors(&[[3.0_f32; 3], [4.0; 3], [5.0; 3]], true);
        let colors = package.add_vectors(&[[0.5_f32, 0.25, 1.0]; 3], false);
        let indices = package.add_indices(&[2, 1, 0], 3);
        let first = json!({
            "attributes": {"POSITION": left, "NORMAL": right, "COLOR_0": colors}, "indices": indices,
        });
        let second = json!({"attributes": {"POSITION": right, "NORMAL": left}, "material": 1});
        package.push("meshes", json!({"name": "none", "primitives": []}));
        package.push(
            "meshes",
            json!({"name": "both", "primitives": [first, second]}),
        );
        let geometry = Geometry::of(&package, 1).unwrap();
        let node = Node {
            mesh: 1,
            transform: IDENTITY,
        };
        let scene = scene(&package, None, &geometry, std::slice::from_ref(&node));

        assert_eq!(scene.nodes, [node]);
        let image = Image {
            name: "picture".to_owned(),
            bytes: (*b"image").into(),
        };
        let textured = Material {
            name: String::new(),
            base_color: [0.25, 0.5, 0.75, 1.0],
            texture: Some(image),
        };
        let plain = Material {
            name: "plain".to_owned(),
            base_color: [1.0; 4],
            texture: None,
        };
        assert_eq!(scene.materials, [plain, textured]);
        let [none, both] = &scene.meshes[..] else {
            panic!("there are two meshes");
        };
        assert!(none.name == "none" && none.positions.is_empty() && none.normals.is_none());
        assert_eq!(both.name, "both");
        assert_eq!(
            both.positions,
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(|c| [c; 3])
        );
        assert_eq!(both.polygons.triangles(), [[2, 1, 0], [3, 4, 5]]);
        assert_eq!(both.materials, [None, Some(1)]);
        let normals = [5.0, 4.0, 3.0, 0.0, 1.0, 2.0].map(|c| [c; 3]);
        assert_eq!(both.normals.as_deref(), Some(&normals[..]));
        let colors = [[[0.5, 0.25, 1.0, 1.0]; 3], [[1.0; 4]; 3]].concat();
        assert_eq!(both.colors.as_deref(), Some(&colors[..]));
    }
}
