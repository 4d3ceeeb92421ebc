//! Which UVs tangents belong to.

use serde_json::Value;

use super::geometry::Primitive;
use super::package::Package;

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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::json;

    use super::*;

    #[test]
    fn the_normal_texture_says_which_uvs_tangents_belong_to() {
        let sets = |material: Value| tangent_space_sets(&material).collect::<BTreeSet<_>>();
        assert_eq!(
            sets(json!({"occlusionTexture": {"index": 0, "texCoord": 3}})),
            [].into()
        );
        assert_eq!(sets(json!({"normalTexture": {"index": 0}})), [0].into());
        let transform = json!({"KHR_texture_transform": {"texCoord": 2}});
        let moved = json!({"index": 0, "texCoord": 1, "extensions": transform});
        let coat = json!({"clearcoatNormalTexture": {"index": 0, "texCoord": 1}});
        let extensions = json!({"KHR_materials_clearcoat": coat});
        assert_eq!(
            sets(json!({"normalTexture": moved, "extensions": extensions})),
            [1, 2].into()
        );
    }

    #[test]
    fn all_materials_of_a_primitive_count() {
        let variants = json!({"KHR_materials_variants": {"mappings": [{"material": 1}]}});
        let package = Package {
            json: json!({
                "materials": [{"name": "plain"}, {"normalTexture": {"index": 0, "texCoord": 1}}],
                "meshes": [{"primitives": [{}, {"extensions": variants}]}],
            }),
            bin: Vec::new(),
        };
        let depends = |set: u32, index: usize, material: Option<usize>| {
            let primitive = Primitive {
                mesh: 0,
                index,
                pool: 0,
                material,
                is_indexed: false,
                triangles: Vec::new(),
            };
            depend_on(&[set], &package, &primitive)
        };
        assert!(depends(0, 0, None) && !depends(1, 0, None));
        assert!(depends(0, 0, Some(0)) && !depends(1, 0, Some(0)));
        assert!(!depends(0, 0, Some(1)) && depends(1, 0, Some(1)));
        assert!(!depends(0, 1, Some(0)) && depends(1, 1, Some(0)));
    }
}
