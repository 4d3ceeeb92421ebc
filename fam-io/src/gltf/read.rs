//! The surface of a document, in the coordinates of its scenes.

use fam_surface::{Surface, SurfaceError};
use serde_json::Value;

use super::geometry::{Geometry, Pool};
use super::package::Package;
use super::transforms::{transform_normal, transform_point};
use crate::labels::Labels;
use crate::parsed::surface_of_triangles;
use crate::scene::{IDENTITY, Node};
use crate::uvs::{Uvs, vertex_uvs};

/// The surface; its vertices are those of all pools.
pub(super) fn surface(
    package: &Package,
    geometry: &Geometry,
    nodes: &[Node],
) -> Result<Surface, SurfaceError> {
    let positions = positions(package, geometry, nodes);
    let normals = normals(package, geometry, nodes);
    let triangles: Vec<_> = geometry
        .primitives
        .iter()
        .flat_map(|primitive| {
            let start = geometry.pools[primitive.pool].vertices.start as u32;
            let triangles = primitive.triangles.iter();
            triangles.map(move |triangle| triangle.map(|v| v + start))
        })
        .collect();
    surface_of_triangles(positions, triangles, normals)
}

/// The positions of all vertices: those of a mesh where the first node that uses it puts them.
pub(super) fn positions(package: &Package, geometry: &Geometry, nodes: &[Node]) -> Vec<[f64; 3]> {
    let place = |pool: &Pool, transform: Transform| {
        let positions = vectors(package, pool, "POSITION").into_iter().flatten();
        positions.map(move |p| transform_point(&transform, p))
    };
    with_transforms(package, geometry, nodes)
        .flat_map(|(pool, transform)| place(pool, transform))
        .collect()
}

/// The normals of all vertices, if all pools have them.
fn normals(package: &Package, geometry: &Geometry, nodes: &[Node]) -> Option<Vec<[f64; 3]>> {
    let mut pools = geometry.pools.iter();
    let all = pools.all(|pool| pool.attribute("NORMAL").is_some());
    all.then(|| known_normals(package, geometry, nodes))
        .flatten()
}

/// The normals of all vertices; zero where there are none, or where they are not finite. `None` if
/// no pool has any.
pub(super) fn known_normals(
    package: &Package,
    geometry: &Geometry,
    nodes: &[Node],
) -> Option<Vec<[f64; 3]>> {
    let mut pools = geometry.pools.iter();
    pools.find(|pool| pool.attribute("NORMAL").is_some())?;
    let mut all = Vec::new();
    for (pool, transform) in with_transforms(package, geometry, nodes) {
        match vectors(package, pool, "NORMAL") {
            Some(normals) => {
                all.extend(normals.into_iter().map(|n| transform_normal(&transform, n)))
            }
            None => all.resize(all.len() + pool.vertices.len(), [0.0; 3]),
        }
    }
    Some(all)
}

type Transform = [[f64; 4]; 4];

/// The pools with the transforms of their meshes.
fn with_transforms<'a>(
    package: &Package,
    geometry: &'a Geometry,
    nodes: &[Node],
) -> impl Iterator<Item = (&'a Pool, Transform)> {
    let mut transforms = vec![None; package.count("meshes")];
    for node in nodes {
        transforms[node.mesh].get_or_insert(node.transform);
    }
    geometry
        .pools
        .iter()
        .map(move |pool| (pool, transforms[pool.mesh].unwrap_or(IDENTITY)))
}

/// An attribute of a pool; `None` if it has none of the name.
pub(super) fn vectors<const N: usize>(
    package: &Package,
    pool: &Pool,
    name: &str,
) -> Option<Vec<[f64; N]>> {
    Some(pool.attribute(name)?.elements.vectors(&package.bin))
}

/// The first set of UVs, if all pools have it and all are finite.
pub(super) fn uvs(package: &Package, geometry: &Geometry, surface: &Surface) -> Option<Uvs> {
    let mut all = Vec::new();
    for pool in &geometry.pools {
        let uvs = vectors(package, pool, "TEXCOORD_0")?.into_iter();
        all.extend(uvs.map(|[u, v]| [u as f32, 1.0 - v as f32]));
    }
    vertex_uvs(surface, all)
}

/// The meshes and materials of the triangles; only meshes that have any are counted.
pub(super) fn labels(package: &Package, geometry: &Geometry) -> Labels {
    let mut labels = Labels::default();
    let mut meshes = Vec::new();
    for primitive in &geometry.primitives {
        if meshes.last() != Some(&primitive.mesh) {
            meshes.push(primitive.mesh);
        }
        let count = primitive.triangles.len();
        let object = meshes.len() as u32 - 1;
        labels.objects.extend(std::iter::repeat_n(object, count));
        let material = primitive.material.map(|material| material as u32);
        labels
            .materials
            .extend(std::iter::repeat_n(material, count));
    }
    if meshes.len() < 2 {
        labels.objects.clear();
    }
    labels.named_objects = labels.objects.clone();
    let names: Vec<_> = package.entries("meshes").iter().map(name).collect();
    let of_mesh = |&mesh: &usize| names.get(mesh).cloned().unwrap_or_default();
    labels.object_names = meshes.iter().map(of_mesh).collect();
    if labels.materials.iter().all(Option::is_none) {
        labels.materials.clear();
    } else {
        labels.material_names = package.entries("materials").iter().map(name).collect();
    }
    labels
}

/// The name of a part of a document; empty if it has none.
pub(super) fn name(entry: &Value) -> String {
    entry["name"].as_str().unwrap_or_default().to_owned()
}
