//! What is read, what is written, and that reading it again gives the same.

mod common;
#[path = "common/random.rs"]
mod random;

use std::fs;

use common::Folder;
use fam_io::{Document, Format, WriteOptions, read_surface};
use fam_surface::{Surface, TriangleMesh, UvMap};
use random::Random;

fn mesh(document: &Document) -> &TriangleMesh {
    match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(_) => panic!("a mesh was expected"),
    }
}

/// Position and UV of every corner of every triangle.
fn corners(mesh: &TriangleMesh, uvs: &UvMap) -> Vec<([f64; 3], [f32; 2])> {
    assert_eq!(mesh.triangles().len(), uvs.triangles().len());
    (0..mesh.triangles().len())
        .flat_map(|t| std::iter::zip(mesh.corners(t), uvs.corners(t)))
        .collect()
}

fn random_uv(random: &mut Random) -> [f32; 2] {
    [0; 2].map(|_| random.below(1 << 24) as f32 / (1 << 24) as f32 * 1.3 - 0.1)
}

/// Writes a mesh with UVs and returns the content of the file.
fn written(folder: &Folder, document: &Document, name: &str, uvs: &UvMap) -> Vec<u8> {
    let path = folder.path(name);
    document
        .write_mesh_uvs(uvs, &path, &WriteOptions::default())
        .unwrap();
    fs::read(path).unwrap()
}

/// A house of one pentagon, quads and triangles, with a vertex in no face.
const VERTICES: [&str; 8] = [
    "0 0 0",
    "1 0 0",
    "1 1 0",
    "0.5 1.5 0",
    "0 1 0",
    "0 0 -1.25",
    "1e0 0 -1.25",
    "7 7 7",
];
const FACES: [&[usize]; 4] = [&[0, 1, 2, 3, 4], &[1, 0, 5, 6], &[0, 4, 5], &[2, 1, 6]];

fn obj(end: &str) -> String {
    let mut lines = vec![
        "# house".to_owned(),
        "mtllib none.mtl".to_owned(),
        "o a".to_owned(),
    ];
    lines.extend(VERTICES.map(|v| format!("v {v}")));
    lines.extend([
        "vt 0.5 0.5".to_owned(),
        "vn 0 0 1".to_owned(),
        "g walls".to_owned(),
    ]);
    for face in FACES {
        let corners: Vec<_> = face.iter().map(|v| format!("{}/1/-1", v + 1)).collect();
        lines.push(format!("f {} # wall", corners.join("  ")));
        lines.push("usemtl red".to_owned());
    }
    lines.join(end)
}

fn off(keyword: &str, tail: &str) -> String {
    let mut text = format!("{keyword}\n# a house\n8 4 0\n");
    for vertex in VERTICES {
        text += &format!("{vertex}{tail} # v\n");
    }
    for (face, color) in FACES.iter().zip(["", " 255 0 0", " 0.5 0.5 0.5 1", " 3"]) {
        let corners: Vec<_> = face.iter().map(ToString::to_string).collect();
        text += &format!("{} {}{color}\n", face.len(), corners.join(" "));
    }
    text
}

fn ply_ascii(uvs: [&str; 2]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment house\nelement camera 1\nproperty double fov\n\
         element vertex 8\nproperty float {}\nproperty double x\nproperty double y\n\
         property double z\nproperty float {}\nproperty uchar red\n\
         element face 4\nproperty uchar kind\nproperty list uchar uchar vertex_indices\n\
         element tail 1\nproperty list uchar short values\nend_header\n0.75\n",
        uvs[0], uvs[1]
    );
    for (i, vertex) in VERTICES.iter().enumerate() {
        text += &format!("0.{i} {vertex} 0.25 {i}\n");
    }
    for (i, face) in FACES.iter().enumerate() {
        let corners: Vec<_> = face.iter().map(ToString::to_string).collect();
        text += &format!("{i} {} {}\n", face.len(), corners.join(" "));
    }
    text + "3 -1 2 -3\n"
}

/// The same file as [`ply_ascii`] with `s`, `t`, in one of the binary encodings.
fn ply_binary(big: bool) -> Vec<u8> {
    let encoding = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let text = ply_ascii(["s", "t"]);
    let header = text
        .split_once("end_header\n")
        .unwrap()
        .0
        .replace("ascii", encoding);
    let mut bytes = format!("{header}end_header\n").into_bytes();
    let mut push = |native: &[u8]| {
        let native = native.iter().copied();
        if big {
            bytes.extend(native)
        } else {
            bytes.extend(native.rev())
        }
    };
    push(&0.75f64.to_be_bytes());
    for (i, vertex) in VERTICES.iter().enumerate() {
        push(&(i as f32 / 10.0).to_be_bytes());
        for c in vertex.split(' ') {
            push(&c.parse::<f64>().unwrap().to_be_bytes());
        }
        push(&0.25f32.to_be_bytes());
        push(&[i as u8]);
    }
    for (i, face) in FACES.iter().enumerate() {
        push(&[i as u8]);
        push(&[face.len() as u8]);
        face.iter().for_each(|&v| push(&[v as u8]));
    }
    push(&[3]);
    [-1i16, 2, -3].iter().for_each(|v| push(&v.to_be_bytes()));
    bytes
}

fn houses() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("lf.obj", obj("\n").into_bytes()),
        ("crlf.OBJ", obj("\r\n").into_bytes()),
        ("plain.off", off("OFF", "").into_bytes()),
        ("st.off", off("STOFF", " 0.5 0.5").into_bytes()),
        (
            "all.off",
            off("STCNOFF", " 0 0 1 255 0 0 1 0.5 0.5").into_bytes(),
        ),
        ("extra.off", off("OFF", " 0.25 0.5 0.75").into_bytes()),
        ("ascii.ply", ply_ascii(["s", "t"]).into_bytes()),
        ("little.ply", ply_binary(false)),
        ("big.ply", ply_binary(true)),
    ]
}

/// Random UVs: one per vertex, seams between faces, or seams within polygons too.
fn random_uvs(random: &mut Random, kind: usize) -> UvMap {
    let (mut uvs, mut triangles) = (Vec::new(), Vec::new());
    let shared: Vec<[f32; 2]> = VERTICES.iter().map(|_| random_uv(random)).collect();
    for face in FACES {
        let mut corners: Vec<[f32; 2]> = face.iter().map(|&v| shared[v]).collect();
        if kind > 0 {
            corners[random.below(face.len())] = random_uv(random);
        }
        for k in 1..face.len() - 1 {
            let first = uvs.len() as u32;
            uvs.extend([corners[0], corners[k], corners[k + 1]]);
            if kind > 1 {
                uvs[first as usize + random.below(3)] = random_uv(random);
            }
            triangles.push([first, first + 1, first + 2]);
        }
    }
    UvMap::new(uvs, triangles).unwrap()
}

#[test]
fn every_format_gives_back_positions_polygons_and_uvs() {
    let folder = Folder::new();
    let mut random = Random::new(1);
    for (name, content) in houses() {
        let document = folder.read(name, content);
        let before = mesh(&document);
        let positions = VERTICES.map(|v| {
            let c: Vec<f64> = v.split(' ').map(|c| c.parse().unwrap()).collect();
            [c[0], c[1], c[2]]
        });
        assert_eq!(before.positions(), positions, "{name}");
        assert_eq!(before.triangles().len(), 7, "{name}");
        assert_eq!(before.triangles()[..2], [[0, 1, 2], [0, 2, 3]], "{name}");
        for round in 0..6 {
            let uvs = random_uvs(&mut random, round % 3);
            let path = folder.path(&format!("out-{name}"));
            document
                .write_mesh_uvs(&uvs, &path, &WriteOptions::default())
                .unwrap();
            let again = read_surface(&path).unwrap();
            let after = mesh(&again);
            let read = again.uv_map().unwrap();
            assert_eq!(corners(after, read), corners(before, &uvs), "{name}");
            assert_eq!(after.positions()[..8], positions, "{name}");
            assert_eq!(after.normals().is_some(), before.normals().is_some());
            if round % 3 == 0 {
                assert_eq!(after, before, "{name}");
            }
            if again.format() == Format::Obj {
                assert_eq!(after, before, "{name}");
                assert_eq!(read.uvs(), uvs.uvs());
            }

            // Writing what was read is the same file.
            let first = fs::read(&path).unwrap();
            again
                .write_mesh_uvs(read, &path, &WriteOptions::default())
                .unwrap();
            assert_eq!(fs::read(&path).unwrap(), first, "{name}");
        }
    }
}

#[test]
fn obj_keeps_every_byte_but_those_of_uvs() {
    let folder = Folder::new();
    for end in ["\n", "\r\n"] {
        let document = folder.read("a.obj", obj(end));
        let uvs = random_uvs(&mut Random::new(5), 1);
        let text = String::from_utf8(written(&folder, &document, "b.obj", &uvs)).unwrap();
        let without: Vec<_> = text
            .split(end)
            .filter(|line| !line.starts_with("vt "))
            .collect();
        let mut number = 0;
        let expected: Vec<String> = obj(end)
            .split(end)
            .filter(|line| !line.starts_with("vt "))
            .map(|line| {
                let mut fan = Vec::new();
                if line.starts_with("f ") {
                    // The corners of a fan have the UVs 1 2 3, 6, 9, …
                    fan.extend([number + 1, number + 2]);
                    for _ in 2..line.split_whitespace().count() - 3 {
                        number += 3;
                        fan.push(number);
                    }
                }
                let mut parts = line.split("/1/").map(str::to_owned);
                let first = parts.next().unwrap();
                fan.into_iter()
                    .zip(parts)
                    .fold(first, |text, (uv, part)| format!("{text}/{uv}/{part}"))
            })
            .collect();
        assert_eq!(without, expected);
        let first_uv = text.find("vt ").unwrap();
        assert!(text[..first_uv].ends_with(&format!("g walls{end}")));
    }
}

#[test]
fn obj_reads_its_dialects() {
    let folder = Folder::new();
    // Faces before vertices, a comment in Latin-1, continuation, colours, a byte order mark.
    let text = b"\xef\xbb\xbfv 0 0 0 1 0 0\nf 1 2 3 4\ng f v \xe4\nv 1 0 0 1 0 nan\n\
                 v 1 1 0 .1 .2 .3\\\n .4\nv 0 1 0\nl 1 2\nf 1 2\nf -4// -3// \\\r\n-2// # f 9 9 9";
    let document = folder.read("a.obj", text);
    let read = mesh(&document);
    assert_eq!(read.positions()[2], [1.0, 1.0, 0.0]);
    assert_eq!(read.triangles(), [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert!(document.uv_map().is_none() && read.normals().is_none());

    let uvs = vec![[0.0, 1.0], [0.25, 0.5], [1e-7, 3.0], [0.125, 1.0]];
    let uvs = UvMap::new(uvs, vec![[0, 1, 2], [0, 2, 3], [3, 2, 1]]).unwrap();
    let expected = b"\xef\xbb\xbfv 0 0 0 1 0 0\nvt 0 1\nvt 0.25 0.5\nvt 0.0000001 3\nvt 0.125 1\n\
                 f 1/1 2/2 3/3 4/4\ng f v \xe4\nv 1 0 0 1 0 nan\n\
                 v 1 1 0 .1 .2 .3\\\n .4\nv 0 1 0\nl 1 2\nf 1 2\nf -4/4 -3/3 \\\r\n-2/2 # f 9 9 9";
    assert_eq!(written(&folder, &document, "b.obj", &uvs), expected);
}

#[test]
fn negative_indices_count_back_from_where_they_are() {
    let folder = Folder::new();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf -3/-1/-1 -2/-1/-1 -1/-1/-1\n";
    let document = folder.read("a.obj", triangle.repeat(2));
    assert_eq!(mesh(&document).triangles(), [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(document.uv_map().unwrap().triangles(), [[0; 3], [1; 3]]);
    let uvs = UvMap::new(vec![[0.5, 0.5]], vec![[0; 3]; 2]).unwrap();
    let output = String::from_utf8(written(&folder, &document, "b.obj", &uvs)).unwrap();
    assert!(
        output.ends_with("\nf -3/1/-1 -2/1/-1 -1/1/-1\n"),
        "{output}"
    );
    let again = read_surface(folder.path("b.obj")).unwrap();
    assert_eq!(again.surface(), document.surface());
}

#[test]
fn obj_normals_are_those_of_the_corners() {
    let folder = Folder::new();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\nvn 0 0 2\nvn 0 3 0\nvn 0 0 2\n\
                f 1//1 2//1 3//3\nf 1//2 3//1 4\n";
    let document = folder.read("a.obj", text);
    let half = 0.5f64.sqrt();
    let normals = mesh(&document).normals().unwrap();
    assert!((normals[0][1] - half).abs() < 1e-12 && (normals[0][2] - half).abs() < 1e-12);
    assert_eq!(normals[1..], [[0., 0., 2.], [0., 0., 2.], [0.; 3], [0.; 3]]);
}

#[test]
fn obj_uvs_must_be_on_all_corners() {
    let folder = Folder::new();
    let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
    let uvs = |faces: &str| {
        folder
            .read("a.obj", format!("{head}{faces}"))
            .uv_map()
            .cloned()
    };
    let map = uvs("f 1/1 2/2 3/3\nf 3/-1 2/2 1/1\n").unwrap();
    assert_eq!(map.triangles(), [[0, 1, 2], [2, 1, 0]]);
    assert_eq!(map.uvs(), [[0., 0.], [1., 0.], [0., 1.]]);
    assert_eq!(uvs("f 1/1 2/2 3/3\nf 3/3 2 1/1\n"), None);
    assert_eq!(uvs("f 1/1 2/2 3/4\n"), None);
    assert_eq!(uvs("vt nan 0\nf 1/1 2/2 3/3\n"), None);
}

#[test]
fn old_texture_references_do_not_dangle() {
    let folder = Folder::new();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 1 1\nf 1/1 2/1\nl 1/1 2/1 3\nf 1/1 2/1 3/1\nvt 2 2";
    let document = folder.read("a.obj", text);
    let uvs = UvMap::new(vec![[0.5, 0.5]], vec![[0, 0, 0]]).unwrap();
    let expected = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nl 1 2 3\nvt 0.5 0.5\nf 1/1 2/1 3/1\n";
    let output = written(&folder, &document, "b.obj", &uvs);
    assert_eq!(String::from_utf8(output).unwrap(), expected);
}

/// A dart whose fan would fold over.
#[test]
fn a_concave_polygon_is_written_as_it_came() {
    let folder = Folder::new();
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
         0 0 0\n2 1 0\n0 2 0\n1 1 0\n4 2 3 0 1\n";
    for (name, text, face) in [
        (
            "a.obj",
            "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nf 3 4 1 2\n",
            "f 3/3 4/4 1/1 2/2",
        ),
        (
            "a.off",
            "OFF\n4 1 0\n0 0 0\n2 1 0\n0 2 0\n1 1 0\n4 2 3 0 1\n",
            "4 2 3 0 1",
        ),
        ("a.ply", ply, "4 2 3 0 1"),
    ] {
        let document = folder.read(name, text);
        assert_eq!(
            mesh(&document).triangles(),
            [[1, 2, 3], [1, 3, 0]],
            "{name}"
        );
        assert_eq!(document.diagonals(), [[3, 1]], "{name}");
        let places = mesh(&document).positions().iter();
        let uvs = places.map(|p| [p[0] as f32, p[1] as f32]).collect();
        let uvs = UvMap::new(uvs, mesh(&document).triangles().to_vec()).unwrap();
        let bytes = written(&folder, &document, &format!("b{name}"), &uvs);
        let text = String::from_utf8(bytes.clone()).unwrap();
        assert!(text.lines().any(|line| line == face), "{text}");
        let again = folder.read(&format!("again-{name}"), bytes);
        let map = again.uv_map().unwrap();
        assert_eq!(map.triangles().len(), 2);
        for t in 0..2 {
            assert_eq!(map.corners(t), uvs.corners(t), "{name}");
        }
        // A seam along the diagonal.
        let torn = UvMap::new(vec![[0.0; 2], [1.0; 2]], vec![[0; 3], [1; 3]]).unwrap();
        let bytes = written(&folder, &document, &format!("c-{name}"), &torn);
        let again = folder.read(&format!("torn-{name}"), bytes);
        assert_eq!(mesh(&again).corners(0), mesh(&document).corners(0));
        assert_eq!(again.uv_map().unwrap().corners(1), torn.corners(1));
    }
}

#[test]
fn a_seam_through_a_polygon_makes_triangles() {
    let folder = Folder::new();
    let uvs = vec![[0., 0.], [1., 0.], [1., 1.], [0., 1.], [2., 2.]];
    let torn = UvMap::new(uvs, vec![[0, 1, 2], [0, 4, 3]]).unwrap();
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n";
    let obj = folder.read("a.obj", format!("{vertices}f 1//1 2//1 3//1 4//1 # x\n"));
    let output = String::from_utf8(written(&folder, &obj, "b.obj", &torn)).unwrap();
    assert!(
        output.ends_with("\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/5/1 4/4/1 # x\n"),
        "{output}"
    );

    let off = folder.read(
        "a.off",
        "OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 9 8 7 # x\n",
    );
    let output = String::from_utf8(written(&folder, &off, "b.off", &torn)).unwrap();
    let expected = "STOFF 5 2 0\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n1 1 0 2 2\n\
                    3 0 1 2 9 8 7\n3 0 4 3 9 8 7 # x\n";
    assert_eq!(output, expected);
}

#[test]
fn off_reads_its_dialects() {
    let folder = Folder::new();
    let triangle = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for header in [
        "OFF\n3 1 0\n",
        "OFF 3 1\n",
        "\t OFF3 1 3 # counts\r\n\r\n",
        "# first\n\nOFF # keyword\n#\n3 1 0\n",
        "3 1 0\n",
    ] {
        let document = folder.read("a.off", format!("{header}{triangle}"));
        assert_eq!(mesh(&document).triangles(), [[0, 1, 2]], "{header}");
        let uvs = UvMap::new(vec![[0., 0.], [1., 0.], [0., 1.]], vec![[0, 1, 2]]).unwrap();
        written(&folder, &document, "b.off", &uvs);
        let again = read_surface(folder.path("b.off")).unwrap();
        assert_eq!(again.uv_map(), Some(&uvs), "{header}");
    }
    for (columns, keyword) in [("", "STOFF"), (" 9 8 7", "STCOFF")] {
        let text = format!("OFF\n1 0 0\n0 0 0{columns}\n");
        let document = folder.read("a.off", text);
        let path = folder.path("b.off");
        document
            .write_point_uvs(&[[0.5, 1.0]], &path, &WriteOptions::default())
            .unwrap();
        let expected = format!("{keyword}\n1 0 0\n0 0 0{columns} 0.5 1\n");
        assert_eq!(fs::read_to_string(path).unwrap(), expected);
    }
    let normals = folder.read("n.off", "NOFF 1 0 0\n1 2 3 0 0 1 # n\n");
    let Surface::PointCloud(cloud) = normals.surface() else {
        panic!("a cloud was expected");
    };
    assert_eq!(cloud.normals(), Some(&[[0.0, 0.0, 1.0]][..]));
}

#[test]
fn ply_replaces_uvs_of_any_name_and_keeps_the_rest() {
    let folder = Folder::new();
    for names in [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]] {
        let document = folder.read("a.ply", ply_ascii(names));
        let map = document.uv_map().unwrap();
        assert_eq!(map.uvs()[3], [0.3, 0.25]);
        let uvs = random_uvs(&mut Random::new(3), 0);
        let output = String::from_utf8(written(&folder, &document, "b.ply", &uvs)).unwrap();
        let (header, body) = output.split_once("end_header\n").unwrap();
        let expected = "ply\nformat ascii 1.0\ncomment house\nelement camera 1\n\
            property double fov\nelement vertex 8\nproperty double x\nproperty double y\n\
            property double z\nproperty uchar red\nproperty float s\nproperty float t\n\
            element face 4\nproperty uchar kind\nproperty list uchar uchar vertex_indices\n\
            element tail 1\nproperty list uchar short values\n";
        assert_eq!(header, expected);
        assert!(body.starts_with("0.75\n0 0 0 0 "), "{body}");
        assert!(body.contains("\n0 5 0 1 2 3 4\n1 4 1 0 5 6\n"), "{body}");
        assert!(body.ends_with("\n3 -1 2 -3\n"), "{body}");
    }
}

#[test]
fn ply_widens_indices_that_splitting_outgrows() {
    let folder = Folder::new();
    let count = 90;
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {count}\nproperty list uchar char vertex_index\n\
         property list uchar float texcoord\nend_header\n",
        count + 2
    );
    (0..count + 2).for_each(|i| text += &format!("{i} {} 0\n", i % 2));
    (0..count).for_each(|i| text += &format!("3 {i} {} {} 2 0.5 0.5\n", i + 1, i + 2));
    let document = folder.read("a.ply", text);
    let uvs: Vec<_> = (0..3 * count).map(|i| [i as f32, 0.5]).collect();
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let uvs = UvMap::new(uvs, triangles).unwrap();
    let output = String::from_utf8(written(&folder, &document, "b.ply", &uvs)).unwrap();
    assert!(output.contains("element vertex 270\n"), "{output}");
    assert!(output.contains("property list uchar uint vertex_index\nend_header"));
    let again = read_surface(folder.path("b.ply")).unwrap();
    let before = corners(mesh(&document), &uvs);
    assert_eq!(corners(mesh(&again), again.uv_map().unwrap()), before);
}

fn points(document: &Document) -> (&[[f64; 3]], Option<&[[f64; 3]]>) {
    match document.surface() {
        Surface::PointCloud(cloud) => (cloud.points(), cloud.normals()),
        Surface::Mesh(_) => panic!("a cloud was expected"),
    }
}

#[test]
fn clouds_of_every_format_give_back_points_and_uvs() {
    let folder = Folder::new();
    let mut random = Random::new(9);
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 0\nproperty list uchar int vertex_indices\n\
               end_header\n1 2 3\n4 5 6\n7 8 9\n";
    for (name, content) in [
        (
            "a.obj",
            "v 1 2 3\nvn 0 0 1\nv 4 5 6\nvn 0 1 0\nvt 0 0\nv 7 8 9\nvn 1 0 0\np 1 2 3",
        ),
        ("b.obj", "v 1 2 3\r\nv 4 5 6\r\nv 7 8 9\r\n"),
        (
            "a.off",
            "COFF\n3 0 0\n1 2 3 255 0 0 0 # c\n4 5 6 0 0 0 0\n7 8 9 1 1 1 1",
        ),
        ("a.ply", ply),
        ("a.xyz", "1 2 3\n4 5 6\n7 8 9"),
        ("b.xyz", "3\n1,2, 3\n4,5, 6 # note\n\n7,8, 9\n"),
        (
            "c.xyz",
            "//X Y Z Nx Ny Nz\r\n3\r\n1;2;3;0;0;1\r\n4;5;6;0;1;0;\r\n7;8;9;1;0;0\r\n",
        ),
        ("d.xyz", "x y z r\n1 2 3 255\n4 5 6 0\n7 8 9 1\n// end\n"),
    ] {
        let document = folder.read(name, content);
        let expected = [[1., 2., 3.], [4., 5., 6.], [7., 8., 9.]];
        assert_eq!(points(&document).0, expected, "{name}");
        assert_eq!(
            points(&document).1.is_some(),
            ["a.obj", "c.xyz"].contains(&name),
            "{name}"
        );
        assert!(document.point_uvs().is_none(), "{name}");
        let mut path = folder.path(&format!("out-{name}"));
        let mut source = document;
        for round in 0..4 {
            let uvs = [(); 3].map(|()| random_uv(&mut random));
            source
                .write_point_uvs(&uvs, &path, &WriteOptions::default())
                .unwrap();
            let again = read_surface(&path).unwrap();
            assert_eq!(again.surface(), source.surface(), "{name}");
            assert_eq!(again.point_uvs(), Some(&uvs[..]), "{name}");
            path = folder.path(&format!("out-{round}-{name}"));
            source = again;
        }
    }
}

#[test]
fn xyz_names_its_columns_on_the_first_line() {
    let folder = Folder::new();
    let uvs = [[0.5, 1.0], [0.25, 0.0]];
    for (content, expected) in [
        ("1 2 3\n4 5 6", "# x y z u v\n1 2 3 0.5 1\n4 5 6 0.25 0"),
        (
            "2\r\n1, 2, 3, 255\r\n4, 5, 6, 0\r\n",
            "# x y z column4 u v\r\n2\r\n1, 2, 3, 255, 0.5, 1\r\n4, 5, 6, 0, 0.25, 0\r\n",
        ),
        (
            "1\t2\t3\t0\t0\t1.001\tq # a\n4\t5\t6\t0\t1\t0\tq",
            "# x y z nx ny nz column7 u v\n1\t2\t3\t0\t0\t1.001\tq\t0.5\t1 # a\n\
             4\t5\t6\t0\t1\t0\tq\t0.25\t0",
        ),
        (
            "// a cloud\nX Y Z I\n1 2 3 4\n5 6 7 8\n",
            "# X Y Z I u v\n// a cloud\nX Y Z I\n1 2 3 4 0.5 1\n5 6 7 8 0.25 0\n",
        ),
        (
            "# x y z u v\n1 2 3 9 9\n4 5 6 8 8\n",
            "# x y z u v\n1 2 3 0.5 1\n4 5 6 0.25 0\n",
        ),
    ] {
        let document = folder.read("a.xyz", content);
        document
            .write_point_uvs(&uvs, folder.path("b.xyz"), &WriteOptions::default())
            .unwrap();
        assert_eq!(fs::read_to_string(folder.path("b.xyz")).unwrap(), expected);
    }
}

#[test]
fn xyz_colours_are_no_normals() {
    let folder = Folder::new();
    let normals = |text: &str| points(&folder.read("a.xyz", text)).1.map(<[_]>::to_vec);
    assert_eq!(
        normals("1 2 3 0 0 1\n4 5 6 0 0.6 0.8\n").unwrap()[1],
        [0.0, 0.6, 0.8]
    );
    assert_eq!(normals("1 2 3 0 0 1\n4 5 6 117 73 49\n"), None);
    assert_eq!(normals("1 2 3 0 0 1\n4 5 6\n"), None);
    assert_eq!(normals("1 2 3 0 0 1.02\n"), None);
}
