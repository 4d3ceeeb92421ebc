//! What comes from outside: files beside the document, faults, damage, real files.

use super::*;

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
