//! glTF documents that are written with UVs and read back: nothing else changes.

#[path = "common/gltf.rs"]
mod documents;
#[path = "common/random.rs"]
mod random;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use documents::{Parts, has_triangles, random_document};
use fam_core::surface::{Surface, UvMap};
use fam_io::{Document, Format, Uvs, WriteOptions, read_surface};
use proptest::prelude::*;
use random::Random;
use serde_json::{Value, json};

fn read(parts: &Parts) -> Document {
    Document::from_bytes(Format::Glb, parts.glb()).unwrap()
}

fn write(document: &Document, uvs: &Uvs, options: &WriteOptions) -> Parts {
    Parts::of_glb(&write_as(document, uvs, Format::Glb, options))
}

fn write_as(document: &Document, uvs: &Uvs, format: Format, options: &WriteOptions) -> Vec<u8> {
    let mut bytes = Vec::new();
    document.write_to(uvs, format, options, &mut bytes).unwrap();
    bytes
}

fn options(uv_set: u32) -> WriteOptions {
    WriteOptions {
        uv_set,
        ..WriteOptions::default()
    }
}

/// Random UVs, exact in either direction of V; with `seams`, those of most corners differ.
fn random_uvs(random: &mut Random, document: &Document, seams: bool) -> Uvs {
    let mut number = || random.below(16) as f32 / 16.0;
    match document.surface() {
        Surface::Mesh(mesh) if seams => {
            let count = mesh.triangles().len() as u32;
            let uvs = (0..3 * count).map(|_| [number(), number()]).collect();
            let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            Uvs::Mesh(UvMap::new(uvs, triangles).unwrap())
        }
        Surface::Mesh(mesh) => {
            let uvs = mesh
                .positions()
                .iter()
                .map(|_| [number(), number()])
                .collect();
            Uvs::Mesh(UvMap::new(uvs, mesh.triangles().to_vec()).unwrap())
        }
        Surface::PointCloud(cloud) => Uvs::Points(
            cloud
                .points()
                .iter()
                .map(|_| [number(), number()])
                .collect(),
        ),
    }
}

fn primitives(parts: &Parts) -> impl Iterator<Item = &Value> {
    let meshes = parts.json["meshes"].as_array().unwrap().iter();
    meshes.flat_map(|mesh| mesh["primitives"].as_array().unwrap())
}

/// Everything but where and what vertices and indices are.
fn rest(parts: &Parts) -> String {
    let mut json = parts.json.clone();
    for key in ["accessors", "bufferViews", "buffers"] {
        json.as_object_mut().unwrap().shift_remove(key);
    }
    for mesh in json["meshes"].as_array_mut().unwrap() {
        for primitive in mesh["primitives"].as_array_mut().unwrap() {
            let primitive = primitive.as_object_mut().unwrap();
            for key in ["attributes", "targets", "indices", "mode"] {
                primitive.shift_remove(key);
            }
        }
    }
    json.to_string()
}

/// The set of UVs that the tangents of a primitive follow.
fn tangent_set(primitive: &Value) -> u32 {
    u32::from(primitive["material"] == 2)
}

/// Asserts that `after` is `before` with UVs in a set, and nothing else.
fn check_same_but_uvs(before: &Parts, after: &Parts, uvs: &UvMap, uv_set: u32) {
    assert_eq!(rest(before), rest(after));
    let name = format!("TEXCOORD_{uv_set}");
    let mut triangle = 0;
    for (old, new) in primitives(before).zip(primitives(after)) {
        let (old_corners, new_corners) = (before.corners(old), after.corners(new));
        assert_eq!(old_corners.len(), new_corners.len());
        if !has_triangles(old) || old_corners.is_empty() {
            assert_eq!(old_corners, new_corners);
            assert_eq!(old["attributes"], new["attributes"]);
            continue;
        }
        let names: BTreeSet<_> = new["attributes"].as_object().unwrap().keys().collect();
        assert!((0..=uv_set).all(|set| names.contains(&format!("TEXCOORD_{set}"))));
        let loses_tangents = !names.contains(&"TANGENT".to_owned());
        for (k, (mut old_corner, mut new_corner)) in
            old_corners.into_iter().zip(new_corners).enumerate()
        {
            let [u, v] = uvs.corners(triangle + k / 3)[k % 3];
            let expected = [u, 1.0 - v].map(f32::to_le_bytes).concat();
            for set in 0..=uv_set {
                let is_new = !old_corner.contains_key(&format!("TEXCOORD_{set}"));
                let written = new_corner[&format!("TEXCOORD_{set}")] == expected;
                assert!(written || set < uv_set && !is_new);
                if is_new {
                    new_corner.remove(&format!("TEXCOORD_{set}"));
                }
            }
            old_corner.remove(&name);
            new_corner.remove(&name);
            if loses_tangents {
                old_corner.retain(|name, _| !name.ends_with("TANGENT"));
            }
            assert_eq!(old_corner, new_corner);
        }
        let indices = after.indices(new);
        let count = after.elements(&new["attributes"]["POSITION"]).len();
        assert!(indices.iter().all(|&index| index < count));
        triangle += before.corners(old).len() / 3;
    }
    assert_eq!(triangle, uvs.triangles().len());
    for list in ["skins", "animations"] {
        let accessors = |parts: &Parts| {
            let list = parts.json[list].as_array().cloned().unwrap_or_default();
            let users = list.iter().flat_map(|entry| match &entry["samplers"] {
                Value::Null => vec![entry["inverseBindMatrices"].clone()],
                samplers => vec![samplers[0]["input"].clone(), samplers[0]["output"].clone()],
            });
            users
                .map(|accessor| parts.elements(&accessor))
                .collect::<Vec<_>>()
        };
        assert_eq!(accessors(before), accessors(after));
    }
}

fn sizes(parts: &Parts) -> [usize; 3] {
    let count = |list: &str| parts.json[list].as_array().unwrap().len();
    [count("accessors"), count("bufferViews"), parts.bin.len()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn documents_keep_everything_but_their_uvs(
        seed in any::<u64>(), uv_set in 0_u32..3, seams in any::<bool>(),
    ) {
        let mut random = Random::new(seed);
        let parts = random_document(&mut random);
        let Ok(document) = Document::from_bytes(Format::Glb, parts.glb()) else {
            // All primitives can be of lines.
            prop_assert!(primitives(&parts).all(|p| !has_triangles(p)));
            return Ok(());
        };
        let uvs = random_uvs(&mut random, &document, seams);
        let Uvs::Mesh(map) = &uvs else { unreachable!() };
        let first = write(&document, &uvs, &options(uv_set));
        check_same_but_uvs(&parts, &first, map, uv_set);
        if !seams {
            for (old, new) in primitives(&parts).zip(primitives(&first)) {
                prop_assert_eq!(parts.indices(old), first.indices(new));
                prop_assert_eq!(&old["mode"], &new["mode"]);
            }
        }

        // Written again, it is the same.
        let again = read(&first);
        let second = write(&again, &uvs, &options(uv_set));
        check_same_but_uvs(&first, &second, map, uv_set);
        // The number in the vendor's extension may look like a reference to what was added.
        if !parts.json["meshes"].to_string().contains("EXT_vendor_thing") {
            for (new, old) in sizes(&second).into_iter().zip(sizes(&first)) {
                prop_assert!(new <= old, "{:?} after {:?}", sizes(&second), sizes(&first));
            }
        }

        // JSON says the same as GLB.
        let text = write_as(&document, &uvs, Format::Gltf, &options(uv_set));
        let from_text = Document::from_bytes(Format::Gltf, text).unwrap();
        prop_assert_eq!(from_text.surface(), again.surface());
        prop_assert_eq!(from_text.uv_map(), again.uv_map());
        prop_assert_eq!(from_text.labels(), document.labels());
        let third = write(&from_text, &uvs, &options(uv_set));
        prop_assert_eq!(&third.json, &second.json);
        prop_assert_eq!(&third.bin, &second.bin);
    }
}
