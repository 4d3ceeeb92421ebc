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
        for (name, accessor) in old["attributes"].as_object().unwrap() {
            if let Some(written) = new["attributes"].get(name) {
                let uvs = written == &new["attributes"][format!("TEXCOORD_{uv_set}")];
                assert_eq!(
                    described(before, accessor, uvs),
                    described(after, written, uvs)
                );
            }
        }
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

/// What an accessor says beside where and how many its elements are, and, of UVs that are
/// written, of what type.
fn described(parts: &Parts, accessor: &Value, uvs: bool) -> Value {
    let mut accessor = parts.json["accessors"][accessor.as_u64().unwrap() as usize].clone();
    let entry = accessor.as_object_mut().unwrap();
    for key in ["bufferView", "byteOffset", "count", "sparse"] {
        entry.shift_remove(key);
    }
    if uvs {
        entry.shift_remove("componentType");
        entry.shift_remove("normalized");
    }
    accessor
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
            // All primitives can be of lines, or of what joins the parts of a strip.
            prop_assert!(primitives(&parts).all(|p| !has_triangles(p) || parts.corners(p).is_empty()));
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

/// A document without anything.
fn empty() -> Parts {
    Parts {
        json: json!({"asset": {"version": "2.0"}, "meshes": [], "accessors": [], "bufferViews": []}),
        bin: Vec::new(),
    }
}

fn add_floats<const N: usize>(parts: &mut Parts, values: &[[f32; N]]) -> usize {
    let bytes: Vec<u8> = values
        .iter()
        .flatten()
        .flat_map(|c| c.to_le_bytes())
        .collect();
    let view = parts.view(&bytes, json!({}));
    let accessor = json!({
        "bufferView": view, "componentType": 5126, "count": values.len(), "type": format!("VEC{N}"),
    });
    parts.push("accessors", accessor)
}

fn add_indices(parts: &mut Parts, indices: &[u32], component_type: u32) -> usize {
    let size = [1, 0, 2, 0, 4][component_type as usize - 5121];
    let bytes: Vec<u8> = indices
        .iter()
        .flat_map(|i| i.to_le_bytes()[..size].to_vec())
        .collect();
    let view = parts.view(&bytes, json!({}));
    let accessor = json!({
        "bufferView": view, "componentType": component_type, "count": indices.len(), "type": "SCALAR",
    });
    parts.push("accessors", accessor)
}

/// So many vertices along a zigzag line.
fn zigzag(count: usize) -> Vec<[f32; 3]> {
    (0..count)
        .map(|k| [k as f32, (k % 2) as f32, 0.0])
        .collect()
}

/// A mesh of one primitive with indices of a component type.
fn indexed(vertices: usize, mode: u32, indices: &[u32], component_type: u32) -> Parts {
    let mut parts = empty();
    let positions = add_floats(&mut parts, &zigzag(vertices));
    let indices = add_indices(&mut parts, indices, component_type);
    let primitive =
        json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": mode});
    parts.push("meshes", json!({"primitives": [primitive]}));
    parts
}

fn mesh(document: &Document) -> &fam_core::surface::TriangleMesh {
    match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(_) => panic!("it is a mesh"),
    }
}

/// UVs that differ at every corner of every triangle.
fn torn(document: &Document) -> Uvs {
    let count = mesh(document).triangles().len() as u32;
    let uvs = (0..3 * count).map(|k| [k as f32, 0.5]).collect();
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Uvs::Mesh(UvMap::new(uvs, triangles).unwrap())
}

/// UVs that are the same wherever a vertex is used.
fn whole(document: &Document) -> Uvs {
    let uvs = mesh(document)
        .positions()
        .iter()
        .map(|p| [p[0] as f32, p[1] as f32])
        .collect();
    Uvs::Mesh(UvMap::new(uvs, mesh(document).triangles().to_vec()).unwrap())
}

#[test]
fn strips_and_fans_are_triangles() {
    let strip = read(&indexed(6, 5, &[0, 1, 2, 3, 3, 4, 5], 5121));
    assert_eq!(mesh(&strip).triangles(), [[0, 1, 2], [1, 3, 2], [3, 4, 5]]);
    let fan = read(&indexed(6, 6, &[2, 0, 1, 1, 5], 5123));
    assert_eq!(mesh(&fan).triangles(), [[0, 1, 2], [1, 5, 2]]);
    let list = read(&indexed(6, 4, &[0, 1, 2, 3, 3, 4, 5], 5125));
    assert_eq!(mesh(&list).triangles(), [[0, 1, 2], [3, 3, 4]]);
}

#[test]
fn indices_are_as_wide_as_they_must_be() {
    let cases = [
        // Of 255 vertices, the last has the index 254; 255 would restart the primitive.
        (252, 5121, 3, 5121),
        (252, 5121, 4, 5123),
        (252, 5125, 3, 5123),
        (65532, 5123, 3, 5123),
        (65532, 5123, 4, 5125),
    ];
    for (vertices, component_type, added, expected) in cases {
        let indices = [0, 1, 2, 2, 1, 3, 4, 5, 6, 6, 5, 7];
        let parts = indexed(vertices, 4, &indices, component_type);
        let document = read(&parts);
        // The corners at the vertices 1 and 2, 5 and 6 have two UVs, as far as wanted.
        let uvs = indices.iter().enumerate().map(|(k, &v)| {
            let torn = [(3, 1), (4, 2), (9, 3), (10, 4)]
                .iter()
                .any(|&(at, n)| at == k && n <= added);
            [v as f32 + if torn { 0.5 } else { 0.0 }, 0.0]
        });
        let triangles = (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let uvs = Uvs::Mesh(UvMap::new(uvs.collect(), triangles).unwrap());
        let after = write(&document, &uvs, &options(0));
        let primitive = primitives(&after).next().unwrap();
        let accessor = primitive["indices"].as_u64().unwrap() as usize;
        assert_eq!(after.json["accessors"][accessor]["componentType"], expected);
        let positions = after.elements(&primitive["attributes"]["POSITION"]);
        assert_eq!(positions.len(), vertices + added);
        let Uvs::Mesh(map) = &uvs else { unreachable!() };
        check_same_but_uvs(&parts, &after, map, 0);
    }
}

#[test]
fn without_seams_one_accessor_is_added() {
    for mode in [4, 5, 6] {
        let parts = indexed(6, mode, &[0, 1, 2, 3, 4, 5], 5121);
        let document = read(&parts);
        let after = write(&document, &whole(&document), &options(0));
        assert_eq!(
            after.json["accessors"].as_array().unwrap()[..2],
            parts.json["accessors"].as_array().unwrap()[..]
        );
        assert_eq!(after.bin[..parts.bin.len()], parts.bin);
        let expected = json!({
            "attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "mode": mode,
        });
        assert_eq!(*primitives(&after).next().unwrap(), expected);
        let again = read(&after);
        for t in 0..mesh(&again).triangles().len() {
            let expected = mesh(&again)
                .corners(t)
                .map(|[x, y, _]| [x as f32, y as f32]);
            assert_eq!(again.uv_map().unwrap().corners(t), expected);
        }
    }
}

#[test]
fn unindexed_triangles_stay_so_if_they_can() {
    let mut parts = empty();
    let positions = add_floats(&mut parts, &zigzag(6));
    for mode in [4, 5] {
        let primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
        parts.push("meshes", json!({"primitives": [primitive]}));
    }
    let document = read(&parts);
    let after = write(&document, &torn(&document), &options(0));
    let [list, strip]: [&Value; 2] = primitives(&after).collect::<Vec<_>>().try_into().unwrap();
    assert!(list.get("indices").is_none() && strip.get("indices").is_some());
    assert_eq!((&list["mode"], &strip["mode"]), (&json!(4), &json!(4)));
    let Uvs::Mesh(map) = torn(&document) else {
        unreachable!()
    };
    check_same_but_uvs(&parts, &after, &map, 0);
}

#[test]
fn meshes_are_in_the_coordinates_of_the_scene() {
    let mut parts = empty();
    let positions = add_floats(&mut parts, &zigzag(3));
    let other = add_floats(&mut parts, &zigzag(3));
    let primitive =
        |positions: usize| json!({"attributes": {"POSITION": positions}, "material": 1});
    let plain = json!({"attributes": {"POSITION": positions}});
    parts.push(
        "meshes",
        json!({"primitives": [primitive(positions), plain, primitive(other)]}),
    );
    parts.push(
        "meshes",
        json!({"primitives": [{"attributes": {"POSITION": other}, "mode": 1}]}),
    );
    parts.push("meshes", json!({"primitives": [primitive(positions)]}));
    parts.json["materials"] = json!([{"name": "a"}, {"name": "b"}]);
    parts.json["nodes"] = json!([
        {"mesh": 2, "translation": [7, 0, 0]},
        {"mesh": 2, "translation": [0, 9, 0]},
        {"mesh": 0, "scale": [2, 2, 2]},
    ]);
    parts.json["scenes"] = json!([{"nodes": [1, 2]}]);
    let document = read(&parts);
    let triangles = [[0, 1, 2], [0, 1, 2], [3, 4, 5], [6, 7, 8]];
    assert_eq!(mesh(&document).triangles(), triangles);
    let along = |start: [f64; 3], scale: f64| {
        [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]
            .map(|[x, y]| [start[0] + scale * x, start[1] + scale * y, 0.0])
    };
    let expected = [
        along([0.0; 3], 2.0),
        along([0.0; 3], 2.0),
        along([0.0, 9.0, 0.0], 1.0),
    ]
    .concat();
    assert_eq!(mesh(&document).positions(), expected);
    assert_eq!(document.labels().objects, [0, 0, 0, 1]);
    assert_eq!(
        document.labels().materials,
        [Some(1), None, Some(1), Some(1)]
    );
    assert_eq!(document.labels().material_names, ["a", "b"]);
}

#[test]
fn existing_uvs_and_normals_are_read() {
    let mut parts = indexed(3, 4, &[0, 1, 2], 5121);
    let uvs = parts.view(
        &[0, 255, 51, 0, 255, 0, 102, 0, 0, 0, 0, 0],
        json!({"byteStride": 4}),
    );
    let uvs = parts.push("accessors", json!({
        "bufferView": uvs, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2",
    }));
    let normals = add_floats(&mut parts, &[[0.0, 0.6, 0.8]; 3]);
    let attributes = &mut parts.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_0"] = uvs.into();
    attributes["NORMAL"] = normals.into();
    parts.json["nodes"] = json!([{"mesh": 0, "rotation": [1, 0, 0, 0]}]);
    let document = read(&parts);
    assert_eq!(
        document.uv_map().unwrap().corners(0),
        [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    );
    let normals = mesh(&document).normals().unwrap();
    assert!((normals[0][1] + 0.6).abs() < 1e-6 && (normals[0][2] + 0.8).abs() < 1e-6);
}

#[test]
fn what_others_use_stays_as_it_is() {
    let mut parts = indexed(4, 4, &[0, 1, 2, 2, 1, 3], 5121);
    let lines = json!({"attributes": {"POSITION": 0}, "mode": 1});
    parts.json["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap()
        .push(lines.clone());
    // The accessor of the indices is all that an extension may refer to.
    parts.json["extensions"] = json!({"EXT_unknown": {"deep": [{"number": 1}]}});
    let document = read(&parts);
    let after = write(&document, &torn(&document), &options(0));
    assert_eq!(
        after.json["accessors"].as_array().unwrap()[..2],
        parts.json["accessors"].as_array().unwrap()[..]
    );
    assert_eq!(after.bin[..parts.bin.len()], parts.bin);
    assert_eq!(*primitives(&after).nth(1).unwrap(), lines);
    let expected = json!({"POSITION": 2, "TEXCOORD_0": 3});
    assert_eq!(primitives(&after).next().unwrap()["attributes"], expected);
    assert_eq!(primitives(&after).next().unwrap()["indices"], 4);
}

#[test]
fn tangents_are_left_out_with_their_uvs() {
    let mut parts = indexed(3, 4, &[0, 1, 2], 5121);
    let tangents = add_floats(&mut parts, &[[1.0, 0.0, 0.0, 1.0]; 3]);
    let uvs = add_floats(&mut parts, &[[0.0, 0.0]; 3]);
    let bent = add_floats(&mut parts, &[[0.0; 3]; 3]);
    let attributes =
        json!({"POSITION": 0, "TANGENT": tangents, "TEXCOORD_0": uvs, "TEXCOORD_1": uvs});
    let primitive = &mut parts.json["meshes"][0]["primitives"][0];
    primitive["attributes"] = attributes;
    primitive["targets"] = json!([{"TANGENT": bent}, {"POSITION": bent, "TANGENT": bent}]);
    primitive["material"] = 0.into();
    let has_tangents = |material: Value, uv_set: u32| {
        let mut parts = parts.clone();
        parts.json["materials"] = json!([material]);
        let document = read(&parts);
        let after = write(&document, &torn(&document), &options(uv_set));
        let primitive = primitives(&after).next().unwrap();
        let kept = primitive["attributes"].get("TANGENT").is_some();
        let targets = primitive["targets"].as_array().unwrap();
        assert!(
            targets
                .iter()
                .all(|target| target.get("TANGENT").is_some() == kept)
        );
        // A morph target has to have something.
        assert_eq!(targets[0].get("POSITION").is_some(), !kept);
        if !kept {
            assert_eq!(after.elements(&targets[0]["POSITION"]), vec![[0; 12]; 3]);
        }
        kept
    };
    let relief = |set: u32| json!({"normalTexture": {"index": 0, "texCoord": set}});
    assert_eq!(
        [0, 1].map(|set| has_tangents(json!({}), set)),
        [false, true]
    );
    assert_eq!(
        [0, 1].map(|set| has_tangents(relief(0), set)),
        [false, true]
    );
    assert_eq!(
        [0, 1].map(|set| has_tangents(relief(1), set)),
        [true, false]
    );
}

#[test]
fn points_get_uvs_too() {
    let mut parts = empty();
    let positions = add_floats(&mut parts, &zigzag(4));
    let lines = json!({"attributes": {"POSITION": positions}, "mode": 1});
    let points = json!({"attributes": {"POSITION": positions}, "mode": 0});
    parts.push("meshes", json!({"primitives": [lines, points, points]}));
    let document = read(&parts);
    let Surface::PointCloud(cloud) = document.surface() else {
        panic!("it is a cloud");
    };
    assert_eq!(cloud.points().len(), 4);
    assert!(document.point_uvs().is_none());
    let uvs = vec![[0.0, 0.25], [0.5, 0.5], [0.75, 1.0], [1.0, 0.0]];
    let after = write(&document, &Uvs::Points(uvs.clone()), &options(0));
    assert_eq!(read(&after).point_uvs().unwrap(), uvs);
    let second = write(&read(&after), &Uvs::Points(uvs), &options(0));
    assert_eq!(second, after);
    let names = |k: usize| {
        primitives(&after).nth(k).unwrap()["attributes"]
            .as_object()
            .unwrap()
            .len()
    };
    assert_eq!([0, 1, 2].map(names), [1, 2, 2]);
}

#[test]
fn checker_and_seams_are_added_once() {
    let mut parts = indexed(4, 4, &[0, 1, 2, 2, 1, 3], 5121);
    parts.json["materials"] = json!([{"name": "kept"}]);
    parts.json["nodes"] = json!([{"mesh": 0, "translation": [1, 2, 3]}]);
    parts.json["scenes"] = json!([{"name": "other"}, {"nodes": [0]}]);
    parts.json["scene"] = 1.into();
    let primitive = &mut parts.json["meshes"][0]["primitives"][0];
    primitive["material"] = 0.into();
    primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": []}});
    let document = read(&parts);
    let options = WriteOptions {
        uv_set: 1,
        checker: true,
        seam_lines: vec![[1, 2], [2, 3]],
    };
    let after = write(&document, &torn(&document), &options);
    let primitive = primitives(&after).next().unwrap();
    let material = &after.json["materials"][primitive["material"].as_u64().unwrap() as usize];
    assert_eq!(material["name"], "checker");
    assert_eq!(
        material["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"],
        1
    );
    assert!(primitive.get("extensions").is_none());
    assert_eq!(after.json["materials"][0], json!({"name": "kept"}));

    let node = after.json["nodes"].as_array().unwrap().last().unwrap();
    assert_eq!(*node, json!({"mesh": 1, "name": "seams"}));
    assert_eq!(
        after.json["scenes"],
        json!([{"name": "other"}, {"nodes": [0, 1]}])
    );
    let lines = primitives(&after).nth(1).unwrap();
    assert_eq!(lines["mode"], 1);
    let floats = |bytes: &Vec<u8>| {
        [0, 4, 8].map(|at| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()))
    };
    let ends: Vec<_> = after
        .elements(&lines["attributes"]["POSITION"])
        .iter()
        .map(floats)
        .collect();
    assert_eq!(
        ends,
        [
            [2.0, 3.0, 3.0],
            [3.0, 2.0, 3.0],
            [3.0, 2.0, 3.0],
            [4.0, 3.0, 3.0]
        ]
    );
    let accessor =
        &after.json["accessors"][lines["attributes"]["POSITION"].as_u64().unwrap() as usize];
    assert_eq!(
        (&accessor["min"], &accessor["max"]),
        (&json!([2.0, 2.0, 3.0]), &json!([4.0, 3.0, 3.0]))
    );

    let again = read(&after);
    assert_eq!(mesh(&again).triangles().len(), 2);
    let second = write(&again, &torn(&again), &options);
    assert_eq!(rest(&second), rest(&after));
    assert_eq!(sizes(&second), sizes(&after));
    let third = write(
        &read(&second),
        &torn(&again),
        &WriteOptions {
            seam_lines: vec![[0, 1]],
            ..options.clone()
        },
    );
    let lines = primitives(&third).nth(1).unwrap();
    assert_eq!(third.elements(&lines["attributes"]["POSITION"]).len(), 2);
    assert_eq!(third.json["nodes"], after.json["nodes"]);

    let beyond = WriteOptions {
        seam_lines: vec![[0, 4]],
        ..options
    };
    let fault = document.write_to(&torn(&document), Format::Glb, &beyond, &mut Vec::new());
    assert_eq!(
        fault.unwrap_err().to_string(),
        "a seam refers to vertex 4, but there are only 4"
    );
    assert!(
        document
            .write_to(
                &torn(&document),
                Format::Glb,
                &self::options(16),
                &mut Vec::new()
            )
            .is_err()
    );
}

#[test]
fn files_beside_the_document_are_taken_in() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub folder")).unwrap();
    let parts = indexed(4, 4, &[0, 1, 2, 2, 1, 3], 5121);
    let (first, second) = parts.bin.split_at(48);
    fs::write(at("first.bin"), first).unwrap();
    let png = b"\x89PNG\r\n\x1a\nimage";
    fs::write(at("sub folder/a.png"), png).unwrap();
    fs::write(at("secret.txt"), "no image").unwrap();
    let mut json = parts.json.clone();
    let data = "data:application/gltf-buffer;base64,AAECAgED";
    assert_eq!(second, [0, 1, 2, 2, 1, 3]);
    json["buffers"] = json!([
        {"byteLength": 48, "uri": "../first.bin", "name": "kept", "extras": 5},
        {"byteLength": 6, "uri": data},
    ]);
    json["bufferViews"][1]["buffer"] = 1.into();
    json["bufferViews"][1]["byteOffset"] = 0.into();
    json["images"] = json!([
        {"uri": "a.png", "name": "picture"},
        {"uri": "missing.png"},
        {"uri": "../secret.txt"},
        {"uri": "https://example.com/a.png"},
        {"uri": "data:image/png;base64,AAAA"},
        {"uri": "../sub%20folder/a.png"},
    ]);
    let path = at("sub folder/a.gltf");
    fs::write(&path, format!("\u{feff}{json}")).unwrap();
    let document = read_surface(&path).unwrap();
    assert_eq!(document.surface(), read(&parts).surface());

    let after = write(&document, &whole(&document), &options(0));
    let images = after.json["images"].as_array().unwrap();
    for (index, name) in [(0, Some("picture")), (5, None)] {
        let view = images[index]["bufferView"].as_u64().unwrap() as usize;
        let view = &after.json["bufferViews"][view];
        let start = view["byteOffset"].as_u64().unwrap() as usize;
        let bytes = &after.bin[start..][..view["byteLength"].as_u64().unwrap() as usize];
        assert_eq!((bytes, images[index]["name"].as_str()), (&png[..], name));
        assert_eq!(images[index]["mimeType"], "image/png");
        assert!(images[index].get("uri").is_none());
    }
    assert_eq!(images[1..5], json["images"].as_array().unwrap()[1..5]);
    let buffer = json!({"byteLength": after.bin.len(), "name": "kept", "extras": 5});
    assert_eq!(after.json["buffers"], json!([buffer]));

    let text = write_as(&document, &whole(&document), Format::Gltf, &options(0));
    let text: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(
        text["images"][0]["uri"],
        "data:image/png;base64,iVBORw0KGgppbWFnZQ=="
    );
    assert_eq!(text["images"][0]["name"], "picture");

    let from_bytes = Document::from_bytes(Format::Gltf, json.to_string().into_bytes());
    let message = from_bytes.unwrap_err().to_string();
    assert_eq!(
        message,
        "its buffer `../first.bin` is another file, and there is no folder to look in"
    );
    fs::write(at("first.bin"), &first[1..]).unwrap();
    let message = read_surface(&path).unwrap_err().fault.to_string();
    assert_eq!(
        message,
        "buffer 0 announces 48 bytes, but there are only 47"
    );
    fs::remove_file(at("first.bin")).unwrap();
    assert!(
        read_surface(&path)
            .unwrap_err()
            .to_string()
            .contains("its buffer `../first.bin`: ")
    );
}

#[test]
fn faults_are_one_line_with_the_reason() {
    let parts = indexed(4, 4, &[0, 1, 2, 2, 1, 3], 5121);
    let with = |pointer: &str, value: Value| {
        let mut parts = parts.clone();
        let (owner, key) = pointer.rsplit_once('/').unwrap();
        match parts.json.pointer_mut(owner).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            object => object[key] = value,
        }
        let fault = Document::from_bytes(Format::Glb, parts.glb()).unwrap_err();
        fault.to_string()
    };
    let primitive = "/meshes/0/primitives/0";
    let of = |key: &str| format!("{primitive}/{key}");
    let compressed = |name: &str| json!({name: {}});
    let cases = [
        (
            with("/asset", json!({"version": "1.0"})),
            "glTF 1.0 is not supported",
        ),
        (
            with("/asset", json!({"version": "2.1", "minVersion": "2.1"})),
            "glTF 2.1 is not supported",
        ),
        (
            with("/asset", json!({})),
            "it does not say which version of glTF it is",
        ),
        (
            with("/nodes", json!({})),
            "`nodes` is not a list of objects",
        ),
        (
            with("/nodes", json!([1])),
            "`nodes` is not a list of objects",
        ),
        (with("/meshes", json!([])), "it has no vertices"),
        (with(&of("mode"), json!(1)), "it has no vertices"),
        (
            with(&of("extensions"), compressed("KHR_draco_mesh_compression")),
            "the compression KHR_draco_mesh_compression is not supported",
        ),
        (
            with(
                "/bufferViews/0",
                json!({"extensions": compressed("EXT_meshopt_compression")}),
            ),
            "the compression EXT_meshopt_compression is not supported",
        ),
        (
            with(
                "/bufferViews/0",
                json!({"extensions": compressed("KHR_meshopt_compression")}),
            ),
            "the compression KHR_meshopt_compression is not supported",
        ),
        (
            with(&of("attributes"), json!({"POSITION": 9})),
            "mesh 0, primitive 0: `POSITION` refers to entry 9, but there are only 2",
        ),
        (
            with(&of("attributes"), json!(3)),
            "mesh 0, primitive 0: its attributes are no object",
        ),
        (
            with(&of("attributes"), json!({"POSITION": 0, "NORMAL": 1})),
            "mesh 0, primitive 0: NORMAL is of a type that it cannot have",
        ),
        (
            with(&of("attributes"), json!({"POSITION": 0, "_X": 1})),
            "mesh 0, primitive 0: _X has 6 elements, but POSITION has 4",
        ),
        (
            with(&of("indices"), json!(0)),
            "mesh 0, primitive 0: its indices are not unsigned integers",
        ),
        (
            with(&of("indices"), json!(-1)),
            "mesh 0, primitive 0: `indices` is not an index",
        ),
        (
            with("/accessors/0/count", json!(3)),
            "mesh 0, primitive 0: it has the index 3, but there are only 3 vertices",
        ),
        (
            with("/accessors/0/count", json!(5)),
            "mesh 0, primitive 0: accessor 0 reaches beyond its buffer view",
        ),
        (
            with("/bufferViews/1/byteLength", json!(1_u64 << 60)),
            "buffer view 1 reaches beyond its buffer",
        ),
        (
            with("/bufferViews/1/buffer", json!(1)),
            "buffer view 1 refers to buffer 1, which is missing",
        ),
        (
            with("/buffers/0/byteLength", json!(57)),
            "buffer 0 announces 57 bytes, but there are only 56",
        ),
        (
            with("/buffers/0/uri", json!("file:///etc/hosts")),
            "its buffer `file:///etc/hosts` is not a file beside it",
        ),
        (
            with("/buffers/0/uri", json!("data:;base64,???")),
            "the data URI of a buffer is broken",
        ),
        (
            with(
                "/accessors/0",
                json!({"componentType": 5126, "type": "VEC3", "count": 1_u64 << 40}),
            ),
            "mesh 0, primitive 0: its elements are out of proportion to the file",
        ),
    ];
    for (message, expected) in cases {
        assert_eq!(message, expected);
    }
    let restart = indexed(300, 5, &[0, 1, 2, 255, 3, 4, 5], 5121);
    let message = Document::from_bytes(Format::Glb, restart.glb())
        .unwrap_err()
        .to_string();
    assert!(message.ends_with("it has the index 255, which would restart the primitive"));
    let without_chunk = &parts.glb()[..parts.glb().len() - 56 - 8];
    let mut without_chunk = without_chunk.to_vec();
    let length = without_chunk.len() as u32;
    without_chunk[8..12].copy_from_slice(&length.to_le_bytes());
    let message = Document::from_bytes(Format::Glb, without_chunk)
        .unwrap_err()
        .to_string();
    assert_eq!(message, "its binary chunk is missing");
    for text in ["", "{", "[]", "null", "{\"asset\": 1e999}"] {
        let fault = Document::from_bytes(Format::Gltf, text.into())
            .unwrap_err()
            .to_string();
        assert!(!fault.contains(char::is_control), "{fault}");
    }
}

#[test]
fn small_files_cannot_ask_for_much_memory() {
    let mut parts = empty();
    let void = json!({"componentType": 5121, "type": "VEC3", "count": 60_000});
    let positions = parts.push("accessors", void);
    let mesh = json!({"primitives": [{"attributes": {"POSITION": positions}}]});
    parts.push("meshes", mesh.clone());
    assert_eq!(self::mesh(&read(&parts)).positions().len(), 60_000);
    for _ in 0..1000 {
        parts.push("meshes", mesh.clone());
    }
    let message = Document::from_bytes(Format::Glb, parts.glb())
        .unwrap_err()
        .to_string();
    assert!(
        message.ends_with("its elements are out of proportion to the file"),
        "{message}"
    );
}

/// Damages a document's JSON: one value becomes another one, or is lost.
fn damage(random: &mut Random, value: &mut Value) {
    let replacements = [
        json!(-1),
        json!(0),
        json!(1),
        json!(3),
        json!(255),
        json!(65535),
        json!(u32::MAX),
        json!(u64::MAX),
        json!(1.5),
        json!(1e300),
        json!("x"),
        json!(null),
        json!(true),
        json!([]),
        json!({}),
        json!([0]),
        json!({"a": 0}),
        json!(5121),
        json!(5126),
        json!("MAT3"),
    ];
    let children = match value {
        Value::Array(list) => list.len(),
        Value::Object(object) => object.len(),
        _ => 0,
    };
    if children == 0 || random.below(12) == 0 {
        *value = replacements[random.below(replacements.len())].clone();
        return;
    }
    let child = random.below(children);
    match value {
        Value::Array(list) if random.below(12) == 0 => drop(list.remove(child)),
        Value::Array(list) => damage(random, &mut list[child]),
        Value::Object(object) => {
            let key = object.keys().nth(child).unwrap().clone();
            if random.below(12) == 0 {
                object.shift_remove(&key);
            } else {
                damage(random, &mut object[&key]);
            }
        }
        _ => {}
    }
}

#[test]
fn damaged_documents_never_panic() {
    let mut random = Random::new(7);
    let mut read = 0;
    for round in 0..3000 {
        let mut parts = random_document(&mut random);
        for _ in 0..=random.below(2) {
            damage(&mut random, &mut parts.json);
        }
        let mut bytes = parts.glb();
        if round % 4 == 0 {
            let at = random.below(bytes.len());
            bytes[at] = random.below(256) as u8;
            bytes.truncate(bytes.len() - random.below(3));
        }
        let document = match Document::from_bytes(Format::Glb, bytes) {
            Ok(document) => document,
            Err(fault) => {
                let message = fault.to_string();
                assert!(!message.contains(char::is_control), "{message}");
                continue;
            }
        };
        read += 1;
        let seams = random.below(2) == 0;
        let uvs = random_uvs(&mut random, &document, seams);
        let options = WriteOptions {
            uv_set: random.below(2) as u32,
            checker: round % 64 == 0,
            seam_lines: vec![[0, 0]],
        };
        let bytes = write_as(&document, &uvs, Format::Glb, &options);
        let again = Document::from_bytes(Format::Glb, bytes).unwrap();
        if let (Surface::Mesh(old), Surface::Mesh(new)) = (document.surface(), again.surface()) {
            assert_eq!(old.triangles().len(), new.triangles().len());
        }
    }
    assert!(
        read > 1000,
        "only {read} damaged documents were still readable"
    );
}

/// Files of other programs, where they are at hand.
#[test]
fn real_files_keep_everything_but_their_uvs() {
    let folder = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/models/formats"
    ));
    let Ok(files) = fs::read_dir(folder) else {
        println!("skipped: there are no files to try");
        return;
    };
    let mut random = Random::new(1);
    for path in files.map(|file| file.unwrap().path()) {
        let Some(Format::Glb | Format::Gltf) = Format::of_path(&path) else {
            continue;
        };
        let document = match read_surface(&path) {
            Ok(document) => document,
            Err(error) => {
                assert!(path.ends_with("empty_nodes.glb"), "{error}");
                assert!(error.to_string().ends_with(": it has no vertices"));
                continue;
            }
        };
        for (uv_set, seams) in [(0, false), (0, true), (1, true)] {
            let uvs = random_uvs(&mut random, &document, seams);
            let Uvs::Mesh(map) = &uvs else { unreachable!() };
            let first = write(&document, &uvs, &options(uv_set));
            let again = read(&first);
            assert_eq!(mesh(&again).triangles().len(), map.triangles().len());
            for t in 0..map.triangles().len() {
                assert_eq!(mesh(&again).corners(t), mesh(&document).corners(t));
            }
            assert_eq!(again.labels(), document.labels());
            let second = write(&again, &uvs, &options(uv_set));
            check_same_but_uvs(&first, &second, map, uv_set);
            assert!(
                sizes(&second)
                    .into_iter()
                    .zip(sizes(&first))
                    .all(|(new, old)| new <= old)
            );
        }
    }
}
