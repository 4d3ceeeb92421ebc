//! Which UVs tangents belong to.

use serde_json::Value;

use super::Package;
use super::geometry::Primitive;

/// Whether the tangents of a primitive follow from one of some sets of UVs: the one that a
/// texture of tangent space uses, in any material that the primitive can have, or the first
/// set if there is no such texture.
pub(super) fn depend_on(sets: &[u32], package: &Package, primitive: &Primitive) -> bool {
    let entry = &package.json["meshes"][primitive.mesh]["primitives"][primitive.index];
    let variants = entry["extensions"]["KHR_materials_variants"]["mappings"].as_array();
    let variants = variants.into_iter().flatten();
    let materials = variants
        .filter_map(|variant| variant["material"].as_u64())
        .map(|material| material as usize)
        .chain(primitive.material);
    let mut used: Vec<u64> = materials
        .filter_map(|material| package.entries("materials").get(material))
        .flat_map(tangent_space_sets)
        .collect();
    if used.is_empty() {
        used.push(0);
    }
    sets.iter().any(|&set| used.contains(&set.into()))
}

/// The sets of UVs that the textures in tangent space of a material use.
fn tangent_space_sets(material: &Value) -> impl Iterator<Item = u64> {
    let extensions = &material["extensions"];
    let textures = [
        &material["normalTexture"],
        &extensions["KHR_materials_clearcoat"]["clearcoatNormalTexture"],
        &extensions["KHR_materials_anisotropy"]["anisotropyTexture"],
    ];
    let textures = textures.into_iter().filter(|texture| texture.is_object());
    textures.map(|texture| {
        let transform = &texture["extensions"]["KHR_texture_transform"];
        let set = transform["texCoord"]
            .as_u64()
            .or(texture["texCoord"].as_u64());
        set.unwrap_or(0)
    })
}
