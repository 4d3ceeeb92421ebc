//! glTF documents that are written with UVs and read back: nothing else changes.

#[path = "common/gltf.rs"]
mod documents;
#[path = "gltf/outside.rs"]
mod outside;
#[path = "common/random.rs"]
mod random;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use documents::{Parts, has_triangles, random_document};
use fam_io::{Document, Format, Uvs, WriteOptions, read_surface};
use fam_surface::{Surface, UvMap};
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

fn mesh(document: &Document) -> &fam_surface::TriangleMesh {
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
fn seams_far_from_the_origin_are_added_once() {
    let obj = "v 600000 5000000.25 0\nv 600001 5000000.25 0\nv 600000 5000001.25 0\nf 1 2 3\n";
    let document = Document::from_bytes(Format::Obj, obj.into()).unwrap();
    let uvs = Uvs::Mesh(UvMap::new(vec![[0.5; 2]], vec![[0; 3]]).unwrap());
    let with_seams = |seam_lines: &[[u32; 2]]| WriteOptions {
        seam_lines: seam_lines.to_vec(),
        ..WriteOptions::default()
    };
    let first = write(&document, &uvs, &with_seams(&[[0, 1]]));
    let nodes = first.json["nodes"].as_array().unwrap();
    assert_eq!(nodes.len(), 2);
    assert_eq!(
        nodes[1]["translation"],
        json!([600_000.5, 5_000_000.0, 0.0])
    );
    let second = write(&read(&first), &uvs, &with_seams(&[[0, 1]]));
    assert_eq!(rest(&second), rest(&first));
    assert_eq!(sizes(&second), sizes(&first));

    let other = write(&read(&first), &uvs, &with_seams(&[[1, 2]]));
    assert_eq!(other.json["nodes"].as_array().unwrap().len(), 2);
    assert_eq!(other.json["scenes"], first.json["scenes"]);
    let lines = &other.json["meshes"][1]["primitives"][0]["attributes"]["POSITION"];
    let accessor = &other.json["accessors"][lines.as_u64().unwrap() as usize];
    let node = &other.json["nodes"][1]["translation"];
    let y = |bound: &str| node[1].as_f64().unwrap() + accessor[bound][1].as_f64().unwrap();
    assert_eq!((y("min"), y("max")), (5_000_000.25, 5_000_001.25));
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
