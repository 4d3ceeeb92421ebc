//! Dialects of the formats that hold one plain mesh or cloud: PLY, OFF, STL and XYZ.

mod common;
#[path = "common/ply.rs"]
mod foreign_ply;
#[path = "plain/round_trips.rs"]
mod round_trips;

use std::io::Cursor;

use common::Folder;
use fam_io::{Document, Format, Uvs, Warning, WriteOptions};
use fam_surface::{Surface, TriangleMesh, UvMap};
use proptest::prelude::*;

fn read(format: Format, bytes: impl AsRef<[u8]>) -> Document {
    Document::from_bytes(format, bytes.as_ref().to_vec()).unwrap()
}

fn mesh(document: &Document) -> &TriangleMesh {
    match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(_) => panic!("a mesh was expected"),
    }
}

fn written(document: &Document, uvs: &Uvs) -> Vec<u8> {
    let mut out = Vec::new();
    let options = WriteOptions::default();
    document
        .write_to(uvs, document.format(), &options, &mut out)
        .unwrap();
    out
}

fn written_text(document: &Document, uvs: &UvMap) -> String {
    String::from_utf8(written(document, &Uvs::Mesh(uvs.clone()))).unwrap()
}

const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

fn ply(properties: &str, faces: &str, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\n{properties}{faces}end_header\n{body}"
    )
}

#[test]
fn ply_headers_come_in_many_spellings() {
    let plain = ply(
        "",
        "element face 1\nproperty list uchar int vertex_indices\n",
        &format!("{SQUARE}4 0 1 2 3\n"),
    );
    let numbers = plain.replace("1 1 0", " +1\t1. .0e0 99");
    let types = plain
        .replace("float", "float32")
        .replace("uchar int", "uint8 int32");
    let texts = plain.replace(
        "\nelement",
        "\ncomment \n\nobj_info num_cols 5\ncomment caf\u{e9} \\\nelement",
    );
    let mut latin = texts.clone().into_bytes();
    let at = texts.find('\u{e9}').unwrap();
    latin.splice(at..at + 2, [0xe9]);
    for bytes in [
        plain.clone().into_bytes(),
        plain.replace('\n', "\r\n").into_bytes(),
        plain.replace('\n', "\r").into_bytes(),
        plain.replace("\n1 1 0", "\n\n \n1 1 0").into_bytes(),
        plain.replace("vertex_indices", "vertex_index").into_bytes(),
        plain.replace("vertex_indices", "vertexIndex").into_bytes(),
        plain.replace("uchar int", "ushort double").into_bytes(),
        plain.trim_end().as_bytes().to_vec(),
        numbers.into_bytes(),
        types.into_bytes(),
        texts.into_bytes(),
        latin,
    ] {
        let document = read(Format::Ply, &bytes);
        let shown = String::from_utf8_lossy(&bytes);
        assert_eq!(
            mesh(&document).triangles(),
            [[0, 1, 2], [0, 2, 3]],
            "{shown}"
        );
        assert_eq!(mesh(&document).positions()[2], [1.0, 1.0, 0.0], "{shown}");
    }
}

#[test]
fn ply_headers_stay_in_place() {
    let text = "ply\r\nformat  ascii 1.0\r\ncomment a\r\n\r\nelement  vertex 3 \r\n\
                property float x\r\ncomment b\r\nproperty float y\r\nproperty double u\r\n\
                comment c\r\nproperty float z\r\nproperty uchar v\r\nproperty float scalar [<1.5]\r\n\
                property uchar x\r\ncomment d\r\nobj_info e\r\nelement face 1\r\n\
                property list uchar int vertex_index\r\ncomment f\r\nend_header \r\n\
                0 0 .5 0 7 nan 1\r\n1 0 .50 0 7 1e9 2\r\n0 1  0 -0.0 7 -inf 3\r\n 3 0  1 2 \r\n";
    let document = read(Format::Ply, text);
    let uvs = UvMap::new(vec![[0., 0.], [1., 0.], [0., 1.]], vec![[0, 1, 2]]).unwrap();
    let expected = "ply\r\nformat  ascii 1.0\r\ncomment a\r\n\r\nelement  vertex 3 \r\n\
                property float x\r\ncomment b\r\nproperty float y\r\n\
                comment c\r\nproperty float z\r\nproperty float scalar [<1.5]\r\n\
                property uchar x\r\nproperty float s\r\nproperty float t\r\n\
                comment d\r\nobj_info e\r\nelement face 1\r\n\
                property list uchar int vertex_index\r\ncomment f\r\nend_header \r\n\
                0 0 0 nan 1 0 0\r\n1 0 0 1e9 2 1 0\r\n0 1 -0.0 -inf 3 0 1\r\n3 0 1 2\r\n";
    assert_eq!(written_text(&document, &uvs), expected);
}

#[test]
fn ply_corner_uvs_are_replaced_in_place() {
    let faces = "element face 3\nproperty list uchar int vertex_indices\n\
                 property list uchar float texcoord\nproperty int texnumber\n";
    let body =
        format!("{SQUARE}3 0 1 2 6 0 0 1 0 1 1 4\n2 0 1 0 5\n4 3 2 1 0 8 0 .5 .25 0 0 0 1 1 6\n");
    let text = ply("", faces, &body);
    let document = read(Format::Ply, &text);
    let corners = [
        [0., 0.],
        [1., 0.],
        [1., 1.],
        [0., 0.5],
        [0.25, 0.],
        [0., 0.],
        [1., 1.],
    ];
    let map = document.uv_map().unwrap();
    assert_eq!(map.uvs(), corners);
    assert_eq!(map.triangles(), [[0, 1, 2], [3, 4, 5], [3, 5, 6]]);
    let stays = text.replace(" .5 .25", " 0.5 0.25");
    assert_eq!(written_text(&document, map), stays);

    let mut uvs = corners.to_vec();
    uvs.push([9.0, 9.0]);
    let torn = UvMap::new(uvs, vec![[0, 1, 2], [3, 4, 5], [3, 7, 6]]).unwrap();
    let output = written_text(&document, &torn);
    assert!(output.contains("element face 4\n"), "{output}");
    let tail = "2 0 1 0 5\n3 3 2 1 6 0 0.5 0.25 0 0 0 6\n3 3 1 0 6 0 0.5 9 9 1 1 6\n";
    assert!(output.ends_with(tail), "{output}");
    let again = read(Format::Ply, output);
    assert_eq!(again.uv_map().unwrap().corners(2), torn.corners(2));

    // UVs of the vertices come first, and those of the corners must be complete.
    let vertex_uvs = ply(
        "property float s\nproperty float t\n",
        faces,
        &body.replace(" 0\n", " 0 5 5\n"),
    );
    assert_eq!(
        read(Format::Ply, vertex_uvs).uv_map().unwrap().uvs(),
        [[5.0; 2]; 4]
    );
    for (old, new) in [
        (" 8 0", " 7 "),
        ("0 6\n", "0 6\n"),
        (".25", "nan"),
        ("float texcoord", "int texcoord"),
    ] {
        let document = read(Format::Ply, text.replace(old, new));
        assert_eq!(document.uv_map().is_some(), old == "0 6\n", "{new}");
    }
}

#[test]
fn ply_strips_become_faces() {
    let strips = "comment a\nelement face 0\nproperty list uchar int vertex_indices\n\
                  element tristrips 2\ncomment b\nproperty list int int vertex_indices\n\
                  property uchar kind\ncomment c\n";
    let body = format!("{SQUARE}9 0 1 2 3 -1 -1 1 2 0 7\n5 3 2 2 1 0 8\n");
    let document = read(Format::Ply, ply("", strips, &body));
    let triangles = [[0, 1, 2], [2, 1, 3], [1, 2, 0], [2, 1, 0]];
    assert_eq!(mesh(&document).triangles(), triangles);
    assert_eq!(document.uv_map(), None);

    let uvs = vec![[0., 0.], [1., 0.], [0., 1.], [1., 1.]];
    let uvs = UvMap::new(uvs, triangles.to_vec()).unwrap();
    let faces = "comment a\ncomment b\nelement face 4\n\
                 property list uchar uint vertex_indices\ncomment c\n";
    let uv = "property float s\nproperty float t\n";
    let body = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 0 1\n0 1 0 1 1\n3 0 1 2\n3 2 1 3\n3 1 2 0\n3 2 1 0\n";
    let output = written_text(&document, &uvs);
    assert_eq!(output, ply(uv, faces, body));
    let again = read(Format::Ply, output);
    assert_eq!(mesh(&again).triangles(), triangles);
    assert_eq!(again.uv_map(), Some(&uvs));
}

#[test]
fn files_are_read_by_their_content() {
    let folder = Folder::new();
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
               vertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let mut binary_off = b"CNOFF BINARY\r\n".to_vec();
    binary_off.extend([1, 0, 0].map(u32::to_be_bytes).concat());
    binary_off.extend((1..=10).map(|c| c as f32 / 10.0).flat_map(f32::to_be_bytes));
    for (name, content, format) in [
        ("a.obj", stl.as_bytes(), Format::Stl),
        ("a.xyz", b"OFF 1 0 0\n1 2 3\n", Format::Off),
        ("b.stl", &binary_off, Format::Off),
        ("noname", b"v 1 2 3\n", Format::Obj),
        ("a.csv", b"x,y,z\n1,2,3\n", Format::Xyz),
    ] {
        assert_eq!(folder.read(name, content).format(), format, "{name}");
    }
    let missing = fam_io::read_surface(folder.path("missing")).unwrap_err();
    assert!(
        matches!(missing.fault, fam_io::ReadFault::Io(_)),
        "{missing}"
    );
    assert!(fam_io::read_surface(folder.path("")).is_err());
}

#[test]
fn binary_off_is_written_as_text() {
    let mut bytes = b"# a\nSTCOFF BINARY\n".to_vec();
    bytes.extend([3, 2, 0].map(u32::to_be_bytes).concat());
    for corner in [[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1e20]] {
        let [x, y, z]: [f32; 3] = corner;
        let columns = [x, y, z, 1.0, 0.5, 0.0, 1.0, 0.25, x];
        bytes.extend(columns.map(f32::to_be_bytes).concat());
    }
    bytes.extend([3, 0, 1, 2, 0, 2, 0, 1, 1].map(u32::to_be_bytes).concat());
    bytes.extend(1f32.to_be_bytes());
    let document = read(Format::Off, bytes);
    let positions = mesh(&document).positions();
    assert_eq!(positions[0][0], f64::from(0.1f32));
    assert_eq!(positions[2][2], f64::from(1e20f32));
    assert_eq!(document.uv_map().unwrap().uvs()[0], [0.25, 0.1]);
    let uvs = UvMap::new(vec![[0., 0.], [1., 0.], [0., 1.]], vec![[0, 1, 2]]).unwrap();
    let output = written_text(&document, &uvs);
    assert!(
        output.starts_with("STCOFF\n3 2 0\n0.10000000149011612 0 0 1.0 0.5 0.0 1.0 0 0\n"),
        "{output}"
    );
    assert!(output.ends_with("\n3 0 1 2\n2 0 1 1.0\n"), "{output}");
}

/// Numbers that are written and read without loss.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![(-999i32..999).prop_map(|n| n as f32 / 8.0), -1e9f32..1e9]
}

fn point() -> impl Strategy<Value = [f32; 3]> {
    [coordinate(), coordinate(), coordinate()]
}

/// Vertices, and polygons over them of two corners or more.
fn polygons() -> impl Strategy<Value = (Vec<[f32; 3]>, Vec<Vec<u32>>)> {
    prop::collection::vec(point(), 3..12).prop_flat_map(|points| {
        let vertex = 0..points.len() as u32;
        let face = prop::collection::vec(vertex, 2..6);
        (Just(points), prop::collection::vec(face, 0..8))
    })
}

/// UVs of the triangles of a document or of its points: torn everywhere, or few different ones.
fn uvs_for(document: &Document, seed: u64, values: u64) -> Uvs {
    let mut state = seed;
    let mut uv = || {
        let mut part = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) % values
        };
        [part() as f32 / 8.0, part() as f32 / -4.0]
    };
    match document.surface() {
        Surface::PointCloud(cloud) => Uvs::Points(cloud.points().iter().map(|_| uv()).collect()),
        Surface::Mesh(mesh) => {
            let count = mesh.triangles().len() as u32;
            let uvs = (0..3 * count).map(|_| uv()).collect();
            let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
            Uvs::Mesh(UvMap::new(uvs, triangles.collect()).unwrap())
        }
    }
}

/// Writes a document with UVs and checks that all of the surface and the UVs come back.
fn check_round_trip(document: &Document, seed: u64, values: u64) -> (Document, Vec<u8>) {
    let uvs = uvs_for(document, seed, values);
    let bytes = written(document, &uvs);
    let again = read(document.format(), &bytes);
    let old = document.surface().positions();
    assert_eq!(&again.surface().positions()[..old.len()], old);
    match (document.surface(), &uvs) {
        (Surface::Mesh(before), Uvs::Mesh(uvs)) => {
            let (after, map) = (mesh(&again), again.uv_map().unwrap());
            assert_eq!(after.triangles().len(), before.triangles().len());
            for t in 0..before.triangles().len() {
                assert_eq!(after.corners(t), before.corners(t));
                assert_eq!(map.corners(t), uvs.corners(t));
            }
            assert_eq!(after.normals().is_some(), before.normals().is_some());
        }
        (_, Uvs::Points(uvs)) => {
            assert_eq!(again.surface(), document.surface());
            assert_eq!(again.point_uvs(), Some(&uvs[..]));
        }
        _ => panic!("UVs of another kind"),
    }
    // What was read is written as the same file.
    let read = match again.uv_map() {
        Some(map) => Uvs::Mesh(map.clone()),
        None => Uvs::Points(again.point_uvs().unwrap().to_vec()),
    };
    assert_eq!(written(&again, &read), bytes);
    (again, bytes)
}

/// A PLY file as a table, for checks by code that is not the reader's.
#[derive(Debug, Clone, PartialEq)]
struct Element {
    name: String,
    properties: Vec<Property>,
    /// The numbers of every property of every entry.
    rows: Vec<Vec<Vec<f64>>>,
}

#[derive(Debug, Clone, PartialEq)]
struct Property {
    name: String,
    /// The type of the length of a list.
    length: Option<&'static str>,
    kind: &'static str,
}

const KINDS: [(&str, &str); 8] = [
    ("char", "int8"),
    ("uchar", "uint8"),
    ("short", "int16"),
    ("ushort", "uint16"),
    ("int", "int32"),
    ("uint", "uint32"),
    ("float", "float32"),
    ("double", "float64"),
];

fn size(kind: &str) -> usize {
    let at = KINDS.iter().position(|k| k.0 == kind).unwrap();
    [1, 1, 2, 2, 4, 4, 4, 8][at]
}

/// The big-endian bytes of a number.
fn to_bytes(kind: &str, value: f64) -> Vec<u8> {
    match kind {
        "float" => (value as f32).to_be_bytes().to_vec(),
        "double" => value.to_be_bytes().to_vec(),
        _ => (value as i64).to_be_bytes()[8 - size(kind)..].to_vec(),
    }
}

fn of_bytes(kind: &str, bytes: &[u8]) -> f64 {
    let mut eight = [if !kind.starts_with('u') && bytes[0] > 127 {
        255
    } else {
        0
    }; 8];
    eight[8 - bytes.len()..].copy_from_slice(bytes);
    match kind {
        "float" => f32::from_be_bytes(bytes.try_into().unwrap()).into(),
        "double" => f64::from_be_bytes(eight),
        _ => i64::from_be_bytes(eight) as f64,
    }
}

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// The file, with the second spelling of the types if `sized`.
fn encode(elements: &[Element], encoding: usize, line_end: &str, sized: bool) -> Vec<u8> {
    let spelled = |kind: &'static str| {
        let pair = KINDS.iter().find(|k| k.0 == kind).unwrap();
        if sized { pair.1 } else { pair.0 }
    };
    let mut header = format!("ply\nformat {} 1.0\ncomment c\n", ENCODINGS[encoding]);
    let mut body = Vec::new();
    for element in elements {
        header += &format!("element {} {}\n", element.name, element.rows.len());
        for property in &element.properties {
            let list = property
                .length
                .map(|length| format!("list {} ", spelled(length)));
            let (list, kind) = (list.unwrap_or_default(), spelled(property.kind));
            header += &format!("property {list}{kind} {}\n", property.name);
        }
        for row in &element.rows {
            let mut words = Vec::new();
            for (property, values) in element.properties.iter().zip(row) {
                let length = property.length.map(|kind| (kind, values.len() as f64));
                let values = values.iter().map(|&value| (property.kind, value));
                words.extend(length.into_iter().chain(values));
            }
            if encoding == 0 {
                let words: Vec<String> = words.iter().map(|word| word.1.to_string()).collect();
                body.extend((words.join(" ") + line_end).into_bytes());
                continue;
            }
            for (kind, value) in words {
                let mut bytes = to_bytes(kind, value);
                if encoding == 1 {
                    bytes.reverse();
                }
                body.extend(bytes);
            }
        }
    }
    let header = header + "end_header\n";
    [header.replace('\n', line_end).into_bytes(), body].concat()
}

fn decode(bytes: &[u8], line_end: &str) -> Vec<Element> {
    let end = format!("end_header{line_end}");
    let at = bytes
        .windows(end.len())
        .position(|w| w == end.as_bytes())
        .unwrap();
    let header = std::str::from_utf8(&bytes[..at]).unwrap();
    let mut body = &bytes[at + end.len()..];
    let kind = |name: &str| KINDS.iter().find(|k| k.0 == name || k.1 == name).unwrap().0;
    let (mut encoding, mut elements, mut counts) = (0, Vec::<Element>::new(), Vec::new());
    for line in header.split(line_end) {
        match line.split(' ').collect::<Vec<_>>().as_slice() {
            ["format", name, _] => encoding = ENCODINGS.iter().position(|e| e == name).unwrap(),
            ["element", name, count] => {
                counts.push(count.parse::<usize>().unwrap());
                let name = name.to_string();
                elements.push(Element {
                    name,
                    properties: vec![],
                    rows: vec![],
                });
            }
            ["property", types @ .., name] => {
                let length = (types.len() == 3).then(|| kind(types[1]));
                let (kind, name) = (kind(types[types.len() - 1]), name.to_string());
                let property = Property { name, length, kind };
                elements.last_mut().unwrap().properties.push(property);
            }
            _ => {}
        }
    }
    let text = if encoding == 0 {
        String::from_utf8(body.to_vec()).unwrap()
    } else {
        String::new()
    };
    let mut words = text.split_whitespace();
    let mut next = |kind: &str| -> f64 {
        if encoding == 0 {
            return words.next().unwrap().parse().unwrap();
        }
        let (mut number, rest) = (body[..size(kind)].to_vec(), &body[size(kind)..]);
        body = rest;
        if encoding == 1 {
            number.reverse();
        }
        of_bytes(kind, &number)
    };
    for (element, count) in elements.iter_mut().zip(counts) {
        for _ in 0..count {
            let row = element.properties.iter().map(|property| {
                let length = property.length.map_or(1, |kind| next(kind) as usize);
                (0..length).map(|_| next(property.kind)).collect()
            });
            let row = row.collect();
            element.rows.push(row);
        }
    }
    elements
}

/// Any value of a type: the same for the same seed.
fn any_value(kind: &str, seed: u64) -> f64 {
    let value = (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64;
    match kind {
        "float" | "double" => value / 64.0 - 9999.0,
        _ => value % 128.0,
    }
}

/// Properties that mean nothing to the reader, and their values in an entry.
fn add_extras(element: &mut Element, extras: &[(usize, bool, u64)]) {
    for (number, &(kind, is_list, seed)) in extras.iter().enumerate() {
        let at = seed as usize % (element.properties.len() + 1);
        let kind = KINDS[kind].0;
        let length = is_list.then_some(KINDS[seed as usize % 6].0);
        let name = format!("extra_{number}");
        element
            .properties
            .insert(at, Property { name, length, kind });
        for (row, values) in element.rows.iter_mut().enumerate() {
            let count = if is_list { (seed + row as u64) % 4 } else { 1 };
            let values_of = |i| any_value(kind, seed ^ (97 * row as u64 + i));
            values.insert(at, (0..count).map(values_of).collect());
        }
    }
}

fn extras() -> impl Strategy<Value = Vec<(usize, bool, u64)>> {
    prop::collection::vec((0..8usize, any::<bool>(), any::<u64>()), 0..4)
}

fn element(name: &str, properties: &[(&str, Option<&'static str>, &'static str)]) -> Element {
    let property = |&(name, length, kind): &(&str, _, _)| Property {
        name: String::from(name),
        length,
        kind,
    };
    Element {
        name: name.to_owned(),
        properties: properties.iter().map(property).collect(),
        rows: Vec::new(),
    }
}

/// The entries without some properties.
fn without(element: &Element, names: &[&str]) -> Element {
    let kept: Vec<usize> = (0..element.properties.len())
        .filter(|&at| !names.contains(&element.properties[at].name.as_str()))
        .collect();
    let keep = |row: &Vec<Vec<f64>>| kept.iter().map(|&at| row[at].clone()).collect();
    Element {
        name: element.name.clone(),
        properties: kept
            .iter()
            .map(|&at| element.properties[at].clone())
            .collect(),
        rows: element.rows.iter().map(keep).collect(),
    }
}

#[test]
fn points_that_are_not_finite_are_left_out_with_a_warning() {
    let options = WriteOptions::default();
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                  property float z\nproperty uchar red\nproperty uchar green\n\
                  property uchar blue\n";
    let rows = "nan -nan(ind) 1.#QNAN 1 2 3\n1 2 3 255 0 0\n4 5 inf 1 2 3\n6 7 8 0 255 0\n";
    let with_uvs = "nan -nan(ind) 1.#QNAN 1 2 3 NaN NaN\n1 2 3 255 0 0 0.25 1\n\
                    4 5 inf 1 2 3 NaN NaN\n6 7 8 0 255 0 0.5 0\n";
    let uv = "property float s\nproperty float t\n";
    for (format, text, expected) in [
        (
            Format::Ply,
            format!("{header}end_header\n{rows}"),
            format!("{header}{uv}end_header\n{with_uvs}"),
        ),
        (
            Format::Xyz,
            format!("4\nX Y Z R G B\n{rows}"),
            format!("# X Y Z R G B u v\n4\nX Y Z R G B\n{with_uvs}"),
        ),
        (
            Format::Off,
            format!("COFF\n4 0 0\n{rows}"),
            format!("STCOFF\n4 0 0\n{with_uvs}"),
        ),
    ] {
        let document = Document::from_bytes(format, text.into_bytes()).unwrap();
        let points = document.surface().positions();
        assert_eq!(points, [[1.0, 2.0, 3.0], [6.0, 7.0, 8.0]]);
        let warning = Warning::PointsLeftOut {
            left_out: 2,
            total: 4,
        };
        assert_eq!(document.warnings(), [warning]);
        let uvs = Uvs::Points(vec![[0.25, 1.0], [0.5, 0.0]]);
        let write = |format| {
            let mut out = Vec::new();
            document.write_to(&uvs, format, &options, &mut out).unwrap();
            String::from_utf8(out).unwrap()
        };
        assert_eq!(write(format), expected);
        // Converted, only the others are there.
        let colored = "v 1 2 3 1 0 0\nv 6 7 8 0 1 0\nvt 0.25 1\nvt 0.5 0\n";
        assert!(write(Format::Obj).ends_with(colored));
        // The UVs are there when it is read again.
        let again = Document::from_bytes(format, expected.into_bytes()).unwrap();
        assert_eq!(again.point_uvs(), Some(&[[0.25, 1.0], [0.5, 0.0]][..]));
        let mut out = Vec::new();
        again.write_to(&uvs, format, &options, &mut out).unwrap();
        assert_eq!(String::from_utf8(out).unwrap(), write(format));
    }
    // OBJ has its UVs apart from the points; faces of fewer than three corners make no mesh.
    let points =
        "v nan 0 1.#INF\nvn 0 0 1\nv 1 2 3 1 0 0\nvn 0 1 0\nv 6 7 8\nvn 1 0 0\np 1\nf 1 2\n";
    let parse = |text: String| Document::from_bytes(Format::Obj, text.into_bytes()).unwrap();
    let document = parse(points.to_owned());
    let warning = Warning::PointsLeftOut {
        left_out: 1,
        total: 3,
    };
    assert_eq!(document.warnings(), [warning]);
    let normals = |document: &Document| match document.surface() {
        Surface::PointCloud(cloud) => cloud.normals().unwrap().to_vec(),
        Surface::Mesh(_) => panic!("a cloud was expected"),
    };
    assert_eq!(normals(&document), [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    let uvs = Uvs::Points(vec![[0.25, 1.0], [0.5, 0.0]]);
    let write = |format| {
        let mut out = Vec::new();
        document.write_to(&uvs, format, &options, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    };
    let expected = format!("{points}vt NaN NaN\nvt 0.25 1\nvt 0.5 0\n");
    assert_eq!(write(Format::Obj), expected);
    let again = parse(expected);
    assert_eq!(again.point_uvs(), Some(&[[0.25, 1.0], [0.5, 0.0]][..]));
    assert!(write(Format::Off).contains("\n2 0 0\n1 2 3"));
    // A binary OFF: two points, of which one has a coordinate that is NaN and one a normal.
    let mut binary = b"NOFF BINARY\n".to_vec();
    binary.extend([2_u32, 0, 0].map(u32::to_be_bytes).as_flattened());
    let numbers = [f32::NAN, 0., 0., 0., 0., 1., 1., 2., 3., f32::NAN, 0., 1.];
    binary.extend(numbers.map(f32::to_be_bytes).as_flattened());
    let document = Document::from_bytes(Format::Off, binary).unwrap();
    assert_eq!(document.surface().positions(), [[1.0, 2.0, 3.0]]);
    assert_eq!(normals(&document), [[0.0; 3]]);
    assert_eq!(document.warnings().len(), 1);
    // With a face it is a mesh, whose vertices must be finite.
    let mut binary = b"OFF BINARY\n".to_vec();
    binary.extend([1_u32, 1, 0].map(u32::to_be_bytes).as_flattened());
    binary.extend([f32::NAN, 0., 0.].map(f32::to_be_bytes).as_flattened());
    binary.extend([3_u32, 0, 0, 0, 0].map(u32::to_be_bytes).as_flattened());
    let fault = Document::from_bytes(Format::Off, binary).unwrap_err();
    let expected = "vertex 0 has a coordinate that is not a finite number";
    assert!(fault.to_string().ends_with(expected), "{fault}");
    // A word that is no number is a fault, and so is a corner that is nowhere.
    for (text, fault) in [
        (
            format!("{header}end_header\n{}", rows.replace("inf", "x")),
            "vertex 2 has a coordinate that is not a finite number",
        ),
        (
            format!(
                "{header}element face 1\nproperty list uchar int vertex_index\nend_header\n\
                 {rows}3 0 1 2\n"
            ),
            "vertex 0 has a coordinate that is not a finite number",
        ),
    ] {
        let read = Document::from_bytes(Format::Ply, text.into_bytes());
        assert_eq!(read.unwrap_err().to_string(), fault);
    }
    for text in ["4\nX Y Z\n5\n1 2 3", "X Y Z\nX Y Z\n1 2 3", "1 2 3\n4\n"] {
        assert!(Document::from_bytes(Format::Xyz, text.into()).is_err());
    }
    let counted = Document::from_bytes(Format::Xyz, "X Y Z\n1\n1 2 3".into());
    assert_eq!(counted.unwrap().surface().positions().len(), 1);
}
