//! Numbers of the vertices by the names that files give them.

mod common;
#[path = "common/gltf.rs"]
#[allow(dead_code, reason = "only documents made by hand are needed")]
mod gltf;
#[path = "common/random.rs"]
#[allow(dead_code, reason = "the documents made by hand are not random")]
mod random;

use std::fs;

use common::Folder;
use fam_io::{AttributeError, Document, Format};
use fam_surface::{Surface, shapes};
use gltf::Parts;
use serde_json::{Value, json};

fn read(format: Format, bytes: impl AsRef<[u8]>) -> Document {
    Document::from_bytes(format, bytes.as_ref().to_vec()).unwrap()
}

fn numbers(document: &Document, name: &str) -> Vec<f64> {
    document.vertex_attribute(name).unwrap()
}

fn fault(document: &Document, name: &str) -> String {
    document.vertex_attribute(name).unwrap_err().to_string()
}

fn known(document: &Document) -> Vec<String> {
    match document.vertex_attribute("no such name") {
        Err(AttributeError::Missing { name, known }) if name == "no such name" => known,
        other => panic!("{other:?}"),
    }
}

fn ply(properties: &[&str], rows: [&str; 3], face: &str) -> Document {
    let properties: String = properties
        .iter()
        .map(|property| format!("property {property}\n"))
        .collect();
    let rows = rows.join("\n");
    let faces = match face {
        "" => String::new(),
        _ => "element face 1\nproperty list uchar int vertex_indices\n".to_owned(),
    };
    read(
        Format::Ply,
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{properties}{faces}end_header\n{rows}\n{face}\n"
        ),
    )
}

const RGB: [&str; 3] = ["uchar red", "ushort green", "float blue"];

#[test]
fn scalars_of_ply_are_numbers_of_the_vertices() {
    let properties = [&RGB[..], &["uchar quality", "list uchar int near"]].concat();
    let document = ply(
        &properties,
        [
            "0 0 0.25 255 0 .5 200 0",
            "1 0 0 51 65535 0.25 0 1 7",
            "0 1 0 0 0 -1 255 0",
        ],
        "3 0 1 2",
    );
    assert_eq!(numbers(&document, "quality"), [200.0, 0.0, 255.0]);
    assert_eq!(numbers(&document, "z"), [0.25, 0.0, 0.0]);
    assert_eq!(numbers(&document, "red"), [1.0, 0.2, 0.0]);
    assert_eq!(numbers(&document, "green"), [0.0, 1.0, 0.0]);
    assert_eq!(numbers(&document, "blue"), [0.5, 0.25, -1.0]);
    let mean = |r: f64, g: f64, b: f64| (r + g + b) / 3.0;
    let means = [mean(1., 0., 0.5), mean(0.2, 1., 0.25), mean(0., 0., -1.)];
    assert_eq!(numbers(&document, "color"), means);
    let names = ["x", "y", "z", "red", "green", "blue", "quality", "color"];
    assert_eq!(known(&document), names);
    assert_eq!(
        fault(&document, "near"),
        "the vertices have no attribute `near`; they have x, y, z, red, green, blue, quality, color"
    );
    // A scalar of that name, where there is no colour.
    let document = ply(
        &["int16 color", "uchar red"],
        ["0 0 0 7 1", "1 0 0 -8 1", "0 1 0 9 1"],
        "3 0 1 2",
    );
    assert_eq!(numbers(&document, "color"), [7.0, -8.0, 9.0]);
}

#[test]
fn numbers_of_clouds_are_those_of_the_points_that_are_left() {
    let rows = ["0 0 0 255 0 0 9", "nan 0 0 0 0 0 inf", "0 1 0 0 65535 1 5"];
    let properties = [&RGB[..], &["double w"]].concat();
    let document = ply(&properties, rows, "");
    assert_eq!(numbers(&document, "w"), [9.0, 5.0]);
    assert_eq!(numbers(&document, "color"), [1.0 / 3.0, 2.0 / 3.0]);

    let document = read(
        Format::Xyz,
        "0 0 0 255 0 0\nnan 0 0 0 0 0\n0 1 0 51 51 51\n",
    );
    assert_eq!(numbers(&document, "color"), [1.0 / 3.0, 0.2]);
    assert_eq!(known(&document), ["color"]);
    let document = read(
        Format::Obj,
        "v 0 0 0 1 0 0\nv 0 inf 0 1 1 1\nv 1 0 0 0 0 0\n",
    );
    assert_eq!(numbers(&document, "color"), [1.0 / 3.0, 0.0]);
}

#[test]
fn a_number_that_is_none_is_named_by_its_vertex() {
    for word in ["nan", "-inf", "1e999", "x"] {
        let rows = ["0 0 0 1", "1 0 0 2", &format!("0 1 0 {word}")];
        let document = ply(&["float w"], rows, "3 0 1 2");
        let expected = "the attribute `w` of vertex 2 is not a finite number";
        assert_eq!(fault(&document, "w"), expected);
        assert_eq!(numbers(&document, "x"), [0.0, 1.0, 0.0]);
        let text = format!("v 0 0 0 0 0 0\nv 1 0 0 0 {word} 0\nv 0 1 0\nf 1 2 3\n");
        let expected = "the attribute `color` of vertex 1 is not a finite number";
        assert_eq!(fault(&read(Format::Obj, text), "color"), expected);
    }
}

#[test]
fn colours_of_obj_are_as_they_are_written() {
    let faces = "f 1 2 3\n";
    let text = format!("v 0 0 0 0.5 0.25 0\nv 1 0 0\nv 0 1 0 1 1 1\n{faces}");
    let document = read(Format::Obj, &text);
    assert_eq!(numbers(&document, "color"), [0.25, 1.0, 1.0]);
    assert_eq!(known(&document), ["color"]);
    // After a weight.
    let text = "v 0 0 0 1 0.5 0.25 0\nv 1 0 0 1 0 0 0\nv 0 1 0 1 1 1 1\nf 1 2 3\n";
    assert_eq!(numbers(&read(Format::Obj, text), "color"), [0.25, 0.0, 1.0]);

    let plain = read(Format::Obj, format!("v 0 0 0\nv 1 0 0 1\nv 0 1 0\n{faces}"));
    let expected = "the vertices have no attribute `color`; they have none";
    assert_eq!(fault(&plain, "color"), expected);
    let folder = Folder::new();
    let document = folder.read("a.obj", text);
    fs::write(folder.path("a.obj"), "v 0 0 0\n").unwrap();
    let expected = "the file changed since it was read";
    assert_eq!(fault(&document, "color"), expected);
}

/// A document of two primitives, each of one triangle; the first has more attributes.
fn document(add: impl FnOnce(&mut Parts) -> Value) -> Document {
    let mut parts = Parts {
        json: json!({"asset": {"version": "2.0"}}),
        bin: Vec::new(),
    };
    let corners = [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.];
    let positions = accessor(&mut parts, &bytes(&corners), 5126, "VEC3", false);
    let mut first = add(&mut parts);
    first["POSITION"] = positions.into();
    let second = json!({"attributes": {"POSITION": positions}});
    let primitives = json!({"primitives": [{"attributes": first}, second]});
    parts.push("meshes", primitives);
    read(Format::Glb, parts.glb())
}

fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// An accessor of three elements.
fn accessor(parts: &mut Parts, bytes: &[u8], component: u32, kind: &str, unit: bool) -> usize {
    let view = parts.view(bytes, json!({}));
    let json = json!({
        "bufferView": view, "componentType": component, "count": 3, "type": kind,
        "normalized": unit,
    });
    parts.push("accessors", json)
}

#[test]
fn attributes_of_gltf_are_numbers_of_the_vertices() {
    let pairs = bytes(&[0.; 6]);
    let document = document(|parts| {
        let mut add =
            |bytes: &[u8], component, kind, unit| accessor(parts, bytes, component, kind, unit);
        let floats = bytes(&[0.5, -2.0, 1e9]);
        let colors = [255, 0, 0, 9, 51, 51, 51, 9, 0, 0, 0, 255];
        let shorts: Vec<u8> = [65535_u16, 0, 13107]
            .into_iter()
            .flat_map(u16::to_le_bytes)
            .collect();
        json!({
            "_SEAMS": add(&floats, 5126, "SCALAR", false),
            "_PAINTED": add(&shorts, 5123, "SCALAR", true),
            "_COUNT": add(&shorts, 5123, "SCALAR", false),
            "COLOR_0": add(&colors, 5121, "VEC4", true),
            "_LAYER": add(&bytes(&[0.25; 9]), 5126, "VEC3", false),
            "NORMAL": add(&bytes(&[0., 0., 1., 0., 0., 1., 0., 0., 1.]), 5126, "VEC3", false),
            "_PAIR": add(&pairs, 5126, "VEC2", false),
            "TEXCOORD_0": add(&pairs, 5126, "VEC2", false),
        })
    });
    assert_eq!(numbers(&document, "_SEAMS"), [0.5, -2.0, 1e9, 0., 0., 0.]);
    assert_eq!(numbers(&document, "_PAINTED"), [1.0, 0.0, 0.2, 0., 0., 0.]);
    assert_eq!(
        numbers(&document, "_COUNT"),
        [65535.0, 0.0, 13107.0, 0., 0., 0.]
    );
    let third = 1.0 / 3.0;
    let colors = numbers(&document, "COLOR_0");
    assert_eq!(colors[..1], [third]);
    assert!((colors[1] - 0.2).abs() < 1e-15);
    assert_eq!(colors[2..], [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(numbers(&document, "_LAYER"), [0.25, 0.25, 0.25, 0., 0., 0.]);
    let names = ["COLOR_0", "_COUNT", "_LAYER", "_PAINTED", "_SEAMS"];
    assert_eq!(known(&document), names);
    for name in ["NORMAL", "POSITION", "_PAIR", "TEXCOORD_0", "_seams", ""] {
        assert!(document.vertex_attribute(name).is_err(), "{name}");
    }
}

#[test]
fn a_number_of_gltf_that_is_none_is_named_by_its_vertex() {
    let document = document(|parts| {
        let floats = bytes(&[0.5, f32::NAN, 1.0]);
        json!({"_SEAMS": accessor(parts, &floats, 5126, "SCALAR", false)})
    });
    let expected = "the attribute `_SEAMS` of vertex 1 is not a finite number";
    assert_eq!(fault(&document, "_SEAMS"), expected);
}

#[test]
fn other_files_have_no_attributes() {
    let expected = "the vertices have no attribute `color`; they have none";
    let off = "COFF 3 1 0\n0 0 0 255 0 0\n1 0 0 0 0 0\n0 1 0 0 0 0\n3 0 1 2\n";
    let sheet = Surface::Mesh(shapes::rectangle(1.0, 1.0, 1, 1));
    for document in [
        read(Format::Off, off),
        read(Format::Xyz, "0 0 0\n1 0 0\n"),
        Document::of_surface(sheet),
    ] {
        assert_eq!(fault(&document, "color"), expected);
    }
}

/// Names are cut short where they are shown.
#[test]
fn long_names_make_no_long_message() {
    let long = "\u{1b}".repeat(1000);
    let names: Vec<String> = (0..1000).map(|n| format!("float {n}{long}")).collect();
    let properties: Vec<&str> = names.iter().map(String::as_str).collect();
    let row = format!("0 0 0{}", " 1".repeat(1000));
    let document = ply(&properties, [&row, &row, &row], "");
    let message = fault(&document, &long);
    assert!(message.len() < 2000 && !message.contains(char::is_control));
    assert_eq!(known(&document).len(), 1003);
}
