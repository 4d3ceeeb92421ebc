//! A document as what all formats have in common.

use std::path::Path;

use ::gltf::json::accessor::Type;
use serde_json::Value;

use super::Package;
use super::geometry::{Geometry, Pool};
use super::images;
use super::read::{name, vectors};
use crate::polygons::Polygons;
use crate::scene::{Image, Material, Mesh, Node, Scene};

/// The meshes in their own coordinates, the nodes that use them, and the materials.
pub(super) fn scene(
    package: &Package,
    folder: Option<&Path>,
    geometry: &Geometry,
    nodes: &[Node],
) -> Scene {
    let materials = package.entries("materials").iter();
    let meshes = package.entries("meshes").iter().enumerate();
    Scene {
        materials: materials
            .map(|entry| material(package, folder, entry))
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

fn material(package: &Package, folder: Option<&Path>, entry: &Value) -> Material {
    let surface = &entry["pbrMetallicRoughness"];
    let factor = surface["baseColorFactor"].as_array();
    let component = |c: usize| factor.and_then(|factor| factor.get(c)?.as_f64());
    Material {
        name: name(entry),
        base_color: std::array::from_fn(|c| component(c).unwrap_or(1.0) as f32),
        texture: texture(package, folder, &surface["baseColorTexture"]),
    }
}

/// The image of a texture, if it is there.
fn texture(package: &Package, folder: Option<&Path>, info: &Value) -> Option<Image> {
    let texture = package
        .entries("textures")
        .get(info["index"].as_u64()? as usize)?;
    let extensions = texture["extensions"].as_object();
    let alternatives = extensions.into_iter().flat_map(|all| all.values());
    let mut sources = std::iter::once(texture).chain(alternatives);
    let source = sources.find_map(|owner| owner["source"].as_u64())?;
    let image = package.entries("images").get(source as usize)?;
    Some(Image {
        name: name(image),
        bytes: images::bytes(package, folder, image)?,
    })
}
