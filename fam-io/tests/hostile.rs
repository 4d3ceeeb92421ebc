//! Files made to exhaust memory or time: each is refused, or read, without memory out of
//! proportion to its size. What took quadratic time would be noticed by its seconds or minutes.

use std::fs;
use std::sync::{Mutex, MutexGuard, PoisonError};

use fam_io::{Document, Format, Uvs, WriteOptions};
use fam_surface::{Surface, UvMap};

const MIB: usize = 1 << 20;

/// The memory of this process is what is measured, so the tests run one after the other.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A number of bytes from the kernel's account of this process; 0 where there is none.
fn memory(key: &str) -> usize {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let kibibytes = line.and_then(|line| line.trim().strip_suffix(" kB"));
    kibibytes.map_or(0, |number| number.parse::<usize>().unwrap() << 10)
}

/// Does something; `name` is for the message if that takes too much.
fn measured<T>(name: &str, limit: usize, run: impl FnOnce() -> T) -> T {
    // The peak is what it is now. Where it cannot be set, the check is only weaker.
    let _ = fs::write("/proc/self/clear_refs", "5");
    let before = memory("VmHWM:");
    let result = run();
    let grown = memory("VmHWM:").saturating_sub(before);
    assert!(grown < limit, "{name}: {} MiB", grown / MIB);
    result
}

fn read(name: &str, format: Format, bytes: &[u8], limit: usize) -> Result<Document, String> {
    let document = measured(name, limit, || Document::from_bytes(format, bytes.to_vec()));
    document.map_err(|fault| {
        let message = fault.to_string();
        assert!(!message.contains(char::is_control), "{name}: {message:?}");
        message
    })
}

fn ply(encoding: &str, vertices: &str, list: &str, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {encoding} 1.0\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty float z\nelement face 1\nproperty list {list} vertex_indices\n\
         end_header\n"
    );
    [header.as_bytes(), body].concat()
}

fn gltf(content: &str) -> Vec<u8> {
    format!(r#"{{"asset":{{"version":"2.0"}},{content}}}"#).into_bytes()
}

/// A glTF document of one primitive, whose attribute is accessor 0.
fn gltf_with(accessors: &str, content: &str) -> Vec<u8> {
    gltf(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
           "accessors":[{accessors}]{content}"#
    ))
}

fn binary_stl(announced: u32, length: usize) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(announced.to_le_bytes());
    bytes.resize(84 + length, 0);
    bytes
}

fn binary_off(numbers: &[u32]) -> Vec<u8> {
    let numbers = numbers.iter().flat_map(|number| number.to_be_bytes());
    b"OFF BINARY\n".iter().copied().chain(numbers).collect()
}

fn glb(length: u32, chunk: u32, content: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(chunk.to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(content);
    bytes
}

#[test]
fn small_files_do_not_become_large() {
    let _alone = alone();
    let ply_triangle = b"0 0 0\n1 0 0\n0 1 0\n";
    let triangle = [0.0_f32, 0., 0., 1., 0., 0., 0., 1., 0.].map(f32::to_le_bytes);
    let with_list = |length: &[u8]| [triangle.as_flattened(), length].concat();
    let asset = br#"{"asset":{"version":"2.0"}}"#;
    let huge = "18446744073709551615";
    let floats = r#""componentType":5126,"type":"VEC3""#;
    let cases = [
        (
            "PLY vertices",
            Format::Ply,
            ply("ascii", huge, "uchar int", b"0 0 0\n"),
        ),
        (
            "binary PLY vertices",
            Format::Ply,
            ply("binary_little_endian", "4000000000", "uchar int", &[0; 36]),
        ),
        (
            "PLY list",
            Format::Ply,
            ply(
                "ascii",
                "3",
                "uint int",
                &[ply_triangle, &b"4294967295 0 1 2\n"[..]].concat(),
            ),
        ),
        (
            "binary PLY list",
            Format::Ply,
            ply(
                "binary_little_endian",
                "3",
                "uint double",
                &with_list(&[0xff; 28]),
            ),
        ),
        (
            "binary PLY list of negative length",
            Format::Ply,
            ply(
                "binary_big_endian",
                "3",
                "int uchar",
                &with_list(&[0xff; 28]),
            ),
        ),
        (
            "PLY elements without properties",
            Format::Ply,
            format!("ply\nformat ascii 1.0\nelement vertex {huge}\nend_header\n").into_bytes(),
        ),
        (
            "OFF counts",
            Format::Off,
            b"OFF 4000000000 4000000000 0\n0 0 0\n".to_vec(),
        ),
        (
            "OFF counts of 64 bits",
            Format::Off,
            format!("OFF {huge} {huge}\n0 0 0").into_bytes(),
        ),
        (
            "OFF face",
            Format::Off,
            b"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n1000000000 0 1 2\n".to_vec(),
        ),
        (
            "binary OFF counts",
            Format::Off,
            binary_off(&[u32::MAX, u32::MAX, 0, 0, 0]),
        ),
        (
            "binary OFF face",
            Format::Off,
            binary_off(&[1, 1, 0, 0, 0, 0, 1_000_000_000, 0]),
        ),
        (
            "binary OFF colour",
            Format::Off,
            binary_off(&[1, 1, 0, 0, 0, 0, 1, 0, u32::MAX, 0]),
        ),
        ("STL facets", Format::Stl, binary_stl(u32::MAX, 50)),
        ("STL without facets", Format::Stl, binary_stl(u32::MAX, 0)),
        ("STL solid", Format::Stl, b"solid ".repeat(20)),
        ("GLB of 4 GiB", Format::Glb, glb(u32::MAX, 28, asset)),
        ("GLB chunk of 4 GiB", Format::Glb, glb(47, u32::MAX, asset)),
        (
            "glTF elements without data",
            Format::Gltf,
            gltf_with(&format!(r#"{{"count":4000000000,{floats}}}"#), ""),
        ),
        (
            "glTF elements of no end",
            Format::Gltf,
            gltf_with(&format!(r#"{{"count":{huge},{floats}}}"#), ""),
        ),
        (
            "sparse glTF elements",
            Format::Gltf,
            gltf_with(
                &format!(
                    r#"{{"count":4000000000,{floats},"sparse":{{"count":1,
                    "indices":{{"bufferView":0,"componentType":5125}},"values":{{"bufferView":0}}}}}}"#
                ),
                r#","bufferViews":[{"buffer":0,"byteLength":12}],
                   "buffers":[{"byteLength":12,"uri":"data:;base64,AAAAAAAAAAAAAAAA"}]"#,
            ),
        ),
        (
            "glTF elements that overlap",
            Format::Gltf,
            gltf_with(
                &format!(r#"{{"count":4000000000,"bufferView":0,{floats}}}"#),
                r#","bufferViews":[{"buffer":0,"byteLength":12,"byteStride":0}],
                   "buffers":[{"byteLength":12,"uri":"data:;base64,AAAAAAAAAAAAAAAA"}]"#,
            ),
        ),
        (
            "glTF buffer",
            Format::Gltf,
            gltf_with(
                &format!(r#"{{"count":1,"bufferView":0,{floats}}}"#),
                &format!(
                    r#","bufferViews":[{{"buffer":0,"byteLength":{huge}}}],
                       "buffers":[{{"byteLength":{huge},"uri":"data:,abc"}}]"#
                ),
            ),
        ),
        ("deep JSON", Format::Gltf, b"[".repeat(100_000)),
        (
            "deep JSON of extras",
            Format::Gltf,
            gltf(&format!(
                r#""extras":{}1{}"#,
                "[".repeat(100_000),
                "]".repeat(100_000)
            )),
        ),
        (
            "many accessors",
            Format::Gltf,
            gltf_with(&"{},".repeat(1000), ""),
        ),
    ];
    for (name, format, bytes) in cases {
        assert!(
            read(name, format, &bytes, 100 * MIB).is_err(),
            "{name} is read"
        );
    }
    // As many elements without data as a small file can have.
    for (name, count, attributes, mode) in [
        ("points", 1_000_000, r#""POSITION":0,"NORMAL":0"#, 0),
        ("fan", 500_000, r#""POSITION":0,"NORMAL":0,"COLOR_0":0"#, 6),
    ] {
        let bytes = gltf(&format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{{attributes}}},"mode":{mode}}}]}}],
               "accessors":[{{"count":{count},{floats}}}]"#
        ));
        let read = read(name, Format::Gltf, &bytes, 100 * MIB).unwrap();
        assert_eq!(read.surface().positions().len(), count);
    }
    // Many primitives of the same elements, which are there once in the file.
    let primitive = r#"{"attributes":{"POSITION":0}}"#;
    let primitives = [primitive; 1000].join(",");
    let shared = gltf(&format!(
        r#""meshes":[{{"primitives":[{primitives}]}}],"accessors":[{{"count":30000,{floats}}}]"#
    ));
    let fault = read("shared elements", Format::Gltf, &shared, 100 * MIB).unwrap_err();
    assert!(fault.ends_with("its elements are out of proportion to the file"));

    for format in Format::ALL {
        for (name, bytes) in [
            ("nothing", Vec::new()),
            ("a zero byte", vec![0]),
            ("zero bytes", vec![0; 100_000]),
            (
                "UTF-16",
                "\u{feff}v 1 2 3\n"
                    .encode_utf16()
                    .flat_map(u16::to_le_bytes)
                    .collect(),
            ),
            ("lines", b"\n".repeat(100_000)),
            ("blanks", b" ".repeat(100_000)),
        ] {
            let read = read(name, format, &bytes, 100 * MIB);
            assert!(read.is_err(), "{name} as {format}");
        }
    }
}

#[test]
fn large_files_are_read() {
    let _alone = alone();
    const MANY: u32 = 1_000_000;
    let mesh = |document: Document| match document.surface() {
        Surface::Mesh(mesh) => mesh.triangles().len(),
        Surface::PointCloud(cloud) => panic!("a cloud of {}", cloud.points().len()),
    };
    let limit = 400 * MIB;
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    let corners: String = (0..MANY)
        .map(|corner| format!(" {}", corner % 3 + 1))
        .collect();
    let polygon = format!("{triangle}f{corners}\n");
    let read_polygon = read("a polygon", Format::Obj, polygon.as_bytes(), limit).unwrap();
    assert_eq!(mesh(read_polygon), MANY as usize - 2);

    let joined = format!("{triangle}f{}\n", corners.replace(' ', " \\\n"));
    let read_joined = read("joined lines", Format::Obj, joined.as_bytes(), limit).unwrap();
    assert_eq!(mesh(read_joined), MANY as usize - 2);

    // Objects that hang together by a chain from the last to the first.
    let count = 100_000;
    let vertices = "v 0 0 0\n".repeat(count + 1);
    let apart: String = (1..=count)
        .map(|n| format!("o {n}\nf {n} {n} {n}\n"))
        .collect();
    let chain: String = (1..count)
        .rev()
        .map(|n| format!("o {n}\nf {n} {n} {}\n", n + 1))
        .collect();
    let objects = format!("{vertices}{apart}{chain}");
    let objects = read("objects", Format::Obj, objects.as_bytes(), limit).unwrap();
    assert!(objects.labels().objects.is_empty());

    let columns = "1 ".repeat(MANY as usize);
    let cloud = read("columns", Format::Xyz, columns.as_bytes(), limit).unwrap();
    assert_eq!(cloud.surface().positions(), [[1.0; 3]]);

    let words = "0 ".repeat(MANY as usize);
    let long = format!("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n{MANY} {words}\n");
    assert_eq!(
        mesh(read("an OFF face", Format::Off, long.as_bytes(), limit).unwrap()),
        MANY as usize - 2
    );
    let body = format!("0 0 0\n1 0 0\n0 1 0\n{MANY} {words}\n");
    let long = ply("ascii", "3", "uint int", body.as_bytes());
    let long = read("a PLY face", Format::Ply, &long, limit).unwrap();
    assert_eq!(mesh(long), MANY as usize - 2);
}

#[test]
fn chains_and_cycles_of_nodes_come_to_an_end() {
    let _alone = alone();
    let document = |nodes: &str| {
        gltf(&format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
               "accessors":[{{"componentType":5126,"count":3,"type":"VEC3"}}],"nodes":[{nodes}]"#
        ))
    };
    let count = 100_000;
    let chain: String = (1..count)
        .map(|n| format!(r#"{{"children":[{n}]}},"#))
        .collect();
    let cycle = r#"{"mesh":0,"children":[1]},{"mesh":0,"children":[0,1,0]}"#;
    for (name, nodes) in [
        ("chain", chain + r#"{"mesh":0}"#),
        ("cycle", cycle.to_owned()),
    ] {
        let read = read(name, Format::Gltf, &document(&nodes), 400 * MIB).unwrap();
        assert_eq!(read.surface().positions().len(), 3);
    }
}

#[test]
fn an_image_is_in_memory_once_for_all_materials() {
    let _alone = alone();
    let material = r#"{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}"#;
    let materials = [material; 1000].join(",");
    let image = "a".repeat(MIB);
    let bytes = gltf_with(
        r#"{"componentType":5126,"count":3,"type":"VEC3"}"#,
        &format!(
            r#","materials":[{materials}],"textures":[{{"source":0}}],
               "images":[{{"uri":"data:,{image}"}}]"#
        ),
    );
    let document = read("materials", Format::Gltf, &bytes, 100 * MIB).unwrap();
    let uvs = Uvs::Mesh(UvMap::new(vec![[0.0; 2]], vec![[0; 3]]).unwrap());
    measured("materials", 100 * MIB, || {
        let options = WriteOptions::default();
        document.write_to(&uvs, Format::Obj, &options, &mut Vec::new())
    })
    .unwrap();
}

#[test]
fn edges_of_many_sides_take_little_time() {
    let _alone = alone();
    let count = 200_000;
    let ends = "v 0 0 0\nv 0 0 1\n";
    let vertices: String = (0..count).map(|n| format!("v 1 {n} 0\n")).collect();
    let normals: String = (0..count).map(|n| format!("vn 1 {n} 0\n")).collect();
    let faces = |corner: &dyn Fn(usize, usize) -> String| -> String {
        let face = |n: usize| [1, 2, n + 3].map(|v| corner(v, n + 1)).join(" ");
        (0..count).map(|n| format!("f {}\n", face(n))).collect()
    };
    let shaded = faces(&|v, n| format!("{v}//{n}"));
    let plain = faces(&|v, _| v.to_string());
    let limit = 400 * MIB;
    for (name, text) in [
        (
            "sides with normals",
            format!("{ends}{vertices}{normals}{shaded}"),
        ),
        (
            "sides without groups",
            format!("s off\n{ends}{vertices}{plain}"),
        ),
        (
            "groups",
            format!("{ends}{vertices}{}", plain.replace("f ", "s 1\nf ")),
        ),
    ] {
        let document = read(name, Format::Obj, text.as_bytes(), limit).unwrap();
        let edges = measured(name, limit, || document.hard_edges()).unwrap();
        assert!(edges.is_empty(), "{name}: {}", edges.len());
    }
    // All at one place.
    let vertices = "v 1e300 -1e-320 0\n".repeat(count + 2);
    let text = format!("s 0\n{vertices}{plain}");
    let document = read("one place", Format::Obj, text.as_bytes(), limit).unwrap();
    assert!(document.hard_edges().unwrap().is_empty());
}

#[test]
fn files_without_shading_are_not_looked_at() {
    let _alone = alone();
    let vertices: String = (0..300_000).map(|n| format!("v {n} 0 0\n")).collect();
    let faces: String = (1..299_999)
        .map(|n| format!("f {n} {} {}\n", n + 1, n + 2))
        .collect();
    let text = format!("{vertices}{faces}");
    let document = read("plain", Format::Obj, text.as_bytes(), 400 * MIB).unwrap();
    assert!(
        measured("plain", 2 * MIB, || document.hard_edges())
            .unwrap()
            .is_empty()
    );
}
