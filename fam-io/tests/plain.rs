//! Dialects of the formats that hold one plain mesh or cloud: PLY, OFF, STL and XYZ.

mod common;

use common::Folder;
use fam_core::surface::{Surface, TriangleMesh, UvMap};
use fam_io::{Document, Format, Uvs, WriteOptions};
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
    let stays = text
        .replace("0 1 2 6", "0 1 2 6")
        .replace(" .5 .25", " 0.5 0.25");
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
    let faces = "comment a\ncomment b\ncomment c\nelement face 4\nproperty list uchar uint vertex_indices\n";
    let uv = "property float s\nproperty float t\n";
    let body = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 0 1\n0 1 0 1 1\n3 0 1 2\n3 2 1 3\n3 1 2 0\n3 2 1 0\n";
    let output = written_text(&document, &uvs);
    assert_eq!(
        output.replace(
            "comment c\nelement face 4\nproperty list uchar uint vertex_indices\n",
            "element face 4\nproperty list uchar uint vertex_indices\ncomment c\n"
        ),
        ply(
            uv,
            &faces.replace(
                "comment c\nelement face 4\nproperty list uchar uint vertex_indices\n",
                "element face 4\nproperty list uchar uint vertex_indices\ncomment c\n"
            ),
            body
        )
    );
    let again = read(Format::Ply, output);
    assert_eq!(mesh(&again).triangles(), triangles);
    assert_eq!(again.uv_map(), Some(&uvs));
}
