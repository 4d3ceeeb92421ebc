//! The edges that files shade hard: by normals and by smoothing groups.

mod common;
#[path = "common/gltf.rs"]
#[allow(dead_code, reason = "only documents made by hand are needed")]
mod gltf;
#[path = "common/random.rs"]
#[allow(dead_code, reason = "the documents made by hand are not random")]
mod random;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use common::Folder;
use fam_io::{Document, Format, Uvs, WriteOptions};
use fam_surface::{Edges, Surface, TriangleMesh, UvMap, shapes};
use gltf::Parts;
use proptest::prelude::*;
use serde_json::{Value, json};

fn read(format: Format, bytes: impl AsRef<[u8]>) -> Document {
    Document::from_bytes(format, bytes.as_ref().to_vec()).unwrap()
}

fn hard(format: Format, bytes: impl AsRef<[u8]>) -> Vec<[u32; 2]> {
    read(format, bytes).hard_edges().unwrap()
}

fn mesh(document: &Document) -> &TriangleMesh {
    match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(_) => panic!("a mesh was expected"),
    }
}

/// A strip of three squares: vertices 1 to 4 along y = 0, and 5 to 8 above them.
const STRIP: &str = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 3 1 0\n";
/// The edge between the first two squares, and that between the last two.
const BETWEEN: [[u32; 2]; 2] = [[1, 5], [2, 6]];

/// The strip with a face after each of three lines.
fn grouped(lines: [&str; 3]) -> Vec<[u32; 2]> {
    let faces = ["f 1 2 6 5\n", "f 2 3 7 6\n", "f 3 4 8 7\n"];
    let faces: String = std::iter::zip(lines, faces)
        .flat_map(|(line, face)| [line, face])
        .collect();
    hard(Format::Obj, format!("{STRIP}{faces}"))
}

/// The first two squares of the strip, with normals at the two ends of the edge between them, of
/// the first square and of the second.
fn hinge(ends: [[&str; 2]; 2]) -> Vec<[u32; 2]> {
    let [[a, b], [c, d]] = ends;
    let text = format!(
        "{STRIP}vn 0 0 1\nvn {a}\nvn {b}\nvn {c}\nvn {d}\n\
         f 1//1 2//2 6//3 5//1\nf 2//4 3//1 7//1 6//5\n"
    );
    hard(Format::Obj, text)
}

const CUBE: [[f64; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
];
const SIDES: [[usize; 4]; 6] = [
    [0, 3, 2, 1],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];
const CUBE_EDGES: [[u32; 2]; 12] = [
    [0, 1],
    [0, 3],
    [0, 4],
    [1, 2],
    [1, 5],
    [2, 3],
    [2, 6],
    [3, 7],
    [4, 5],
    [4, 7],
    [5, 6],
    [6, 7],
];

/// A cube with the normals of its sides.
fn cube(split: bool) -> String {
    let mut text: String = CUBE
        .iter()
        .map(|[x, y, z]| format!("v {x} {y} {z}\n"))
        .collect();
    text += "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 1 0 0\nvn 0 1 0\nvn -1 0 0\n";
    for (n, side) in (1..).zip(SIDES) {
        let [a, b, c, d] = side.map(|v| format!("{}//{n}", v + 1));
        text += &match split {
            true => format!("f {a} {b} {c}\nf {a} {c} {d}\n"),
            false => format!("f {a} {b} {c} {d}\n"),
        };
    }
    text
}

#[test]
fn a_cube_is_hard_along_its_edges() {
    for split in [false, true] {
        let document = read(Format::Obj, cube(split));
        let found = document.hard_edges().unwrap();
        assert_eq!(found, CUBE_EDGES);
        let edges = Edges::of(mesh(&document));
        assert!(found.iter().all(|&edge| edges.find(edge) == Some(edge)));
    }
    // From a file, which is read again.
    let folder = Folder::new();
    let document = folder.read("cube.obj", cube(false));
    assert_eq!(document.hard_edges().unwrap(), CUBE_EDGES);
    fs::write(folder.path("cube.obj"), cube(true)).unwrap();
    let error = document.hard_edges().unwrap_err();
    assert_eq!(error.to_string(), "the file changed since it was read");
    fs::remove_file(folder.path("cube.obj")).unwrap();
    assert!(document.hard_edges().is_err());
    // One without normals is not needed any more.
    let plain = folder.read("plain.obj", format!("{STRIP}f 1 2 6 5\nf 2 3 7 6\n"));
    fs::remove_file(folder.path("plain.obj")).unwrap();
    assert!(plain.hard_edges().unwrap().is_empty());
}

#[test]
fn normals_of_obj_differ_by_more_than_a_degree_at_both_ends() {
    let up = "0 0 1";
    // Tangents of 0.9 and 1.1 degrees.
    let (near, far) = ("0.0157 0 1", "0 0.0192 1");
    let one = vec![BETWEEN[0]];
    assert_eq!(hinge([[up, up], ["1 0 0", "0 1 0"]]), one);
    assert_eq!(hinge([[up, up], [far, far]]), one);
    for smooth in [
        [[up, up], [up, up]],
        [[up, up], [near, near]],
        // A crease that runs out.
        [[up, up], [up, "1 0 0"]],
        [["1 0 0", up], [up, up]],
        // Of other lengths.
        [[up, "3 0 1"], ["0 0 1e300", "3e-310 0 1e-310"]],
        // Nothing is known of one side.
        [[up, up], ["0 0 0", "nan 0 1"]],
        [["0 inf 0", "0 0 0"], ["1 0 0", "0 1 0"]],
    ] {
        assert_eq!(hinge(smooth), [] as [[u32; 2]; 0], "{smooth:?}");
    }
    // The second face has no normals, or such that do not exist.
    for face in ["f 2 3 7 6", "f 2//9 3//9 7//9 6//9"] {
        let text = format!("{STRIP}vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 6//2 5//2\n{face}\n");
        assert_eq!(hard(Format::Obj, text), [] as [[u32; 2]; 0]);
    }
}

#[test]
fn smoothing_groups_meet_at_hard_edges() {
    let [left, right] = BETWEEN;
    for (lines, expected) in [
        (["", "", ""], vec![]),
        (["s 1\n", "", "s 2\n"], vec![right]),
        (["s 1\n", "s 2\n", "s 01\n"], vec![left, right]),
        (["s 1\n", "s 1\n", "s 1\n"], vec![]),
        (["s off\n", "", ""], vec![left, right]),
        (["s 0\n", "s 3\n", ""], vec![left]),
        (["s 3\n", "", "s\n"], vec![right]),
        // Before the first there is no group.
        (["", "", "s 7\n"], vec![left, right]),
        (["s OFF\n", "s on\n", "s on # 2\n"], vec![left]),
    ] {
        assert_eq!(grouped(lines), expected, "{lines:?}");
    }
    // A group that comes again, on faces of other vertices at the same places.
    let text = format!("{STRIP}{STRIP}s 1\nf 1 2 6 5\ns 2\nf 10 11 15 14\ns 1\nf 3 4 8 7\n");
    assert_eq!(hard(Format::Obj, text), BETWEEN);
    // The whole cube without a group: its edges, and not the diagonals of its sides.
    let corners = cube(false);
    let plain: String = (0..=9)
        .rev()
        .fold(corners, |text, n| text.replace(&format!("//{n}"), ""));
    assert_eq!(hard(Format::Obj, format!("s off\n{plain}")), CUBE_EDGES);
}

#[test]
fn normals_count_for_more_than_groups() {
    let first = "s 1\nf 1//1 2//1 6//1 5//1\n";
    for (second, expected) in [
        ("s 2\nf 2//1 3//1 7//1 6//1\n", vec![]),
        ("f 2//2 3//2 7//2 6//2\n", vec![BETWEEN[0]]),
        ("s 2\nf 2 3 7 6\n", vec![]),
        ("s 2\nf 2 3 7 6\ns 3\nf 3 4 8 7\n", vec![BETWEEN[1]]),
    ] {
        let text = format!("{STRIP}vn 0 0 1\nvn 1 0 0\n{first}{second}");
        assert_eq!(hard(Format::Obj, text), expected, "{second}");
    }
}

/// The positions of a primitive, and perhaps its normals.
type Primitive<'a> = (&'a [[f32; 3]], Option<&'a [[f32; 3]]>);

/// A mesh of triangles in glTF.
fn document(primitives: &[Primitive], node: Value) -> Vec<u8> {
    let mut parts = Parts {
        json: json!({"asset": {"version": "2.0"}, "nodes": [node]}),
        bin: Vec::new(),
    };
    let mut list = Vec::new();
    for (positions, normals) in primitives {
        let mut vectors = |values: &[[f32; 3]]| {
            let bytes: Vec<u8> = values
                .as_flattened()
                .iter()
                .flat_map(|c| c.to_le_bytes())
                .collect();
            let view = parts.view(&bytes, json!({}));
            let count = values.len();
            parts.push(
                "accessors",
                json!({"bufferView": view, "componentType": 5126, "count": count, "type": "VEC3"}),
            )
        };
        let mut attributes = json!({"POSITION": vectors(positions)});
        if let Some(normals) = normals {
            attributes["NORMAL"] = vectors(normals).into();
        }
        list.push(json!({"attributes": attributes}));
    }
    parts.push("meshes", json!({"primitives": list}));
    parts.glb()
}

const CORNERS: [[f32; 3]; 4] = [[0., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.]];
const UP: [f32; 3] = [0., 0., 1.];
const EAST: [f32; 3] = [1., 0., 0.];

#[test]
fn vertices_of_gltf_with_several_normals_are_hard() {
    let [a, b, c, d] = CORNERS;
    let square = [a, b, c, a, c, d];
    let node = || json!({"mesh": 0});
    let of = |normals: [[f32; 3]; 6], node| {
        hard(Format::Glb, document(&[(&square, Some(&normals))], node))
    };
    let bent = [UP, UP, UP, EAST, EAST, EAST];
    assert_eq!(of(bent, node()), [[0, 2]]);
    // Somewhere else, turned over and of another size in each direction.
    let place = json!({"mesh": 0, "translation": [5, 6, 7], "scale": [1, 2, -3]});
    assert_eq!(of(bent, place), [[0, 2]]);
    assert!(of([UP; 6], node()).is_empty());
    assert!(of([UP, UP, UP, UP, EAST, EAST], node()).is_empty());
    assert!(of([UP, UP, UP, [0.; 3], [f32::NAN; 3], UP], node()).is_empty());

    // Primitives of which one has no normals, and two that have some.
    let (lower, upper) = (&square[..3], &square[3..]);
    let (ups, easts) = (&[UP; 3][..], &[EAST; 3][..]);
    let beyond = [c, d, [1., 5., 0.]];
    let all = [
        (lower, Some(ups)),
        (upper, Some(easts)),
        (&beyond[..], None),
    ];
    assert_eq!(hard(Format::Glb, document(&all, node())), [[0, 2]]);
    let none = [(lower, None), (upper, None)];
    assert!(hard(Format::Glb, document(&none, node())).is_empty());
}

fn ply(normals: [&str; 6]) -> String {
    let rows = ["0 0 0", "2 0 0", "2 2 0", "-0 0 0", "2 2 0", "0 2 0"];
    let rows: String = std::iter::zip(rows, normals)
        .map(|(row, normal)| format!("{row} {normal}\n"))
        .collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
         property float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n\
         {rows}3 0 1 2\n3 3 4 5\n"
    )
}

#[test]
fn vertices_of_ply_with_several_normals_are_hard() {
    let (up, east) = ("0 0 1", "1 0 0");
    let bent = ply([up, up, up, east, east, east]);
    assert_eq!(hard(Format::Ply, &bent), [[0, 2]]);
    assert!(hard(Format::Ply, ply([up; 6])).is_empty());
    assert!(hard(Format::Ply, ply([up, up, up, east, up, up])).is_empty());
    assert!(hard(Format::Ply, ply([up, up, up, "nan 0 0", east, east])).is_empty());
    // The same vertices, so the normals are the same.
    assert!(hard(Format::Ply, bent.replace("3 3 4 5", "3 0 2 5")).is_empty());
    // The normals mean something else.
    assert!(hard(Format::Ply, bent.replace("nx", "n")).is_empty());
}

#[test]
fn other_files_have_no_hard_edges() {
    let off = "NOFF 6 2 0\n0 0 0 0 0 1\n2 0 0 0 0 1\n2 2 0 0 0 1\n\
               0 0 0 1 0 0\n2 2 0 1 0 0\n0 2 0 1 0 0\n3 0 1 2\n3 3 4 5\n";
    assert!(hard(Format::Off, off).is_empty());
    let facet = |normal: &str, rows: [&str; 3]| {
        let rows = rows.map(|row| format!("vertex {row}\n")).concat();
        format!("facet normal {normal}\nouter loop\n{rows}endloop\nendfacet\n")
    };
    let stl =
        facet("0 0 1", ["0 0 0", "2 0 0", "2 2 0"]) + &facet("1 0 0", ["0 0 0", "2 2 0", "0 2 9"]);
    assert!(hard(Format::Stl, format!("solid\n{stl}endsolid\n")).is_empty());
    assert!(hard(Format::Xyz, "0 0 0 0 0 1\n0 0 0 1 0 0\n").is_empty());
    assert!(hard(Format::Obj, "v 0 0 0\nvn 0 0 1\nv 0 0 0\nvn 1 0 0\ns 1\n").is_empty());
    let cube = Surface::Mesh(shapes::rectangle(1.0, 1.0, 1, 1));
    assert!(Document::of_surface(cube).hard_edges().unwrap().is_empty());
}

#[test]
fn an_edge_is_hard_if_a_side_goes_on_nowhere() {
    let normals = "vn 0 0 1\nvn 0 0 -1\nvn 1 0 0\n";
    let faces = |faces: &str| hard(Format::Obj, format!("{STRIP}{STRIP}{normals}{faces}"));
    let front = "f 1//1 2//1 6//1 5//1\nf 2//1 3//1 7//1 6//1\n";
    // A sheet with a back: on its own vertices, and on the same. The borders of both meet.
    for back in [
        "f 13//2 14//2 10//2 9//2\nf 14//2 15//2 11//2 10//2\n",
        "f 5//2 6//2 2//2 1//2\nf 6//2 7//2 3//2 2//2\n",
    ] {
        let found = faces(&format!("{front}{back}"));
        assert!(found.contains(&[0, 1]) && !found.contains(&BETWEEN[0]));
    }
    // A fin stands on the edge.
    let fin = "f 2//3 6//3 8//3\n";
    assert_eq!(faces(&format!("{front}{fin}")), [BETWEEN[0]]);
    // One triangle that is there twice is a border.
    assert!(faces("f 1//1 2//1 6//1\nf 6//2 2//2 1//2\n").is_empty());
    // Triangles without an area are no side.
    let slivers = "f 2//3 6//3 10//3\nf 2//3 2//3 6//3\n";
    assert!(faces(&format!("{front}{slivers}")).is_empty());
}

/// A polygon around a hole has a bridge, an edge on both of whose sides it is.
#[test]
fn bridges_are_not_hard() {
    let text = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nv 3 3 0\nv 3 6 0\nv 6 6 0\nv 6 3 0\n\
                vn 0 0 1\nvn 1 0 0\n\
                f 1//1 2//1 3//1 4//1 1//2 5//2 6//1 7//1 8//1 5//1\n";
    let document = read(Format::Obj, text);
    assert!(document.diagonals().contains(&[0, 4]));
    assert!(document.hard_edges().unwrap().is_empty());
}

/// A sheet of squares or pairs of triangles in the plane. All positions are there twice.
#[derive(Debug, Clone)]
struct Sheet {
    width: usize,
    /// Corner by corner in counter-clockwise order: the copy of the vertex and its normal. There
    /// are six if the square is two triangles.
    squares: Vec<Vec<(bool, usize)>>,
}

/// Directions that differ by more than a degree, but for the first two.
const NORMALS: [[f64; 3]; 4] = [[0., 0., 1.], [0., 0., 5.], [0., 0.02, 1.], [1., 0., 0.]];

impl Sheet {
    /// The faces by the columns and rows of their corners.
    fn faces(&self) -> Vec<Vec<([usize; 2], bool, usize)>> {
        let face = |n: usize, steps: &[[usize; 2]], corners: &[(bool, usize)]| {
            let at = |[i, j]: [usize; 2]| [n % self.width + i, n / self.width + j];
            let corners = std::iter::zip(steps, corners);
            corners
                .map(|(step, (copy, n))| (at(*step), *copy, *n))
                .collect()
        };
        let round = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let squares = self.squares.iter().enumerate();
        squares
            .flat_map(|(n, corners)| match corners.len() {
                4 => vec![face(n, &round, corners)],
                _ => vec![
                    face(n, &round[..3], &corners[..3]),
                    face(n, &[round[0], round[2], round[3]], &corners[3..]),
                ],
            })
            .collect()
    }

    fn obj(&self) -> String {
        let columns = self.width + 1;
        let rows = self.squares.len() / self.width + 1;
        let mut text = String::new();
        for _ in 0..2 {
            for at in 0..columns * rows {
                text += &format!("v {} {} 0\n", at % columns, at / columns);
            }
        }
        for [x, y, z] in NORMALS {
            text += &format!("vn {x} {y} {z}\n");
        }
        for face in self.faces() {
            let corners = face.iter().map(|&([i, j], copy, normal)| {
                let vertex = j * columns + i + usize::from(copy) * columns * rows;
                format!(" {}//{}", vertex + 1, normal + 1)
            });
            text += &format!("f{}\n", corners.collect::<String>());
        }
        text
    }

    /// The hard edges by their definition.
    fn hard(&self) -> BTreeSet<[[usize; 2]; 2]> {
        let mut sides: BTreeMap<_, Vec<[usize; 2]>> = BTreeMap::new();
        for face in self.faces() {
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                let [a, b] = if a.0 < b.0 { [a, b] } else { [b, a] };
                // The first two normals are one.
                let normals = [a.2.max(1), b.2.max(1)];
                sides.entry([a.0, b.0]).or_default().push(normals);
            }
        }
        let is_hard = |sides: &[[usize; 2]]| match sides {
            [[a, b], [c, d]] => a != c && b != d,
            _ => false,
        };
        let hard = sides.into_iter().filter(|(_, sides)| is_hard(sides));
        hard.map(|(edge, _)| edge).collect()
    }
}

/// The hard edges of a document by where their ends are.
fn places(document: &Document) -> BTreeSet<[[usize; 2]; 2]> {
    let positions = mesh(document).positions();
    let place = |v: u32| [0, 1].map(|c| positions[v as usize][c] as usize);
    let edges = document.hard_edges().unwrap();
    assert!(edges.is_sorted() && edges.iter().all(|[a, b]| a < b));
    edges
        .iter()
        .map(|edge| {
            let mut ends = edge.map(place);
            ends.sort_unstable();
            ends
        })
        .collect()
}

fn sheets() -> impl Strategy<Value = Sheet> {
    let corner = || (any::<bool>(), 0..NORMALS.len());
    let square = prop_oneof![
        proptest::collection::vec(corner(), 4),
        proptest::collection::vec(corner(), 6),
    ];
    (1_usize..4, 1_usize..4).prop_flat_map(move |(width, height)| {
        let squares = proptest::collection::vec(square.clone(), width * height);
        squares.prop_map(move |squares| Sheet { width, squares })
    })
}

proptest! {
    #[test]
    fn hard_edges_survive_conversion(sheet in sheets(), torn in any::<bool>()) {
        let document = read(Format::Obj, sheet.obj());
        let expected = sheet.hard();
        prop_assert_eq!(&places(&document), &expected);
        let triangles = mesh(&document).triangles().len() as u32;
        let of_triangle = |t: u32| [if torn { t % 3 } else { 0 }; 3];
        let uvs = UvMap::new(
            vec![[0.0; 2], [0.5; 2], [1.0; 2]],
            (0..triangles).map(of_triangle).collect(),
        );
        let uvs = Uvs::Mesh(uvs.unwrap());
        for format in [Format::Glb, Format::Ply, Format::Obj] {
            let mut out = Vec::new();
            document.write_to(&uvs, format, &WriteOptions::default(), &mut out).unwrap();
            prop_assert_eq!(&places(&read(format, out)), &expected, "{}", format);
        }
    }
}
