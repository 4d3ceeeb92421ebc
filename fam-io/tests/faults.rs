//! Files that cannot be read or written: one line that says why, and never a panic.

mod common;

use std::fs;

use common::Folder;
use fam_io::{WriteOptions, read_surface};
use fam_surface::UvMap;

/// The message of a file that cannot be read, without the folder.
fn fault(folder: &Folder, name: &str, content: impl AsRef<[u8]>) -> String {
    let path = folder.file(name, content);
    let message = read_surface(path).unwrap_err().to_string();
    message.rsplit_once(name).unwrap().1.to_owned()
}

fn ply(vertices: &str, faces: &str, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\n\
         end_header\n{body}"
    )
}

#[test]
fn faults_are_one_line_with_the_reason() {
    let folder = Folder::new();
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases = [
        ("a.obj", String::new(), ": it has no vertices"),
        (
            "b.obj",
            "# only\ng a comment\n".into(),
            ": it has no vertices",
        ),
        (
            "c.obj",
            format!("{cube}f 1 2 3\nf 1 2\nf 1 2 900"),
            ": face 3 refers to vertex 900, but there are only 3",
        ),
        (
            "d.obj",
            format!("{cube}f 1 2 -4"),
            ": face 1 refers to vertex -4, but there are only 3",
        ),
        (
            "e.obj",
            format!("{cube}f 0 1 2"),
            ": face 1 refers to vertex 0, but there are only 3, numbered from 1",
        ),
        (
            "f.obj",
            format!("{cube}f 1 2 x/y"),
            ": line 4: `x/y` is not the corner of a face",
        ),
        (
            "g.obj",
            format!("{cube}f 1 2 /1"),
            ": line 4: `/1` is not the corner of a face",
        ),
        (
            "h.obj",
            "v 0 0 0\nv nan 0 0\nf 1 2 1\n".into(),
            ": line 2: the vertex has a coordinate that is not a finite number",
        ),
        ("i.obj", "v 0 0\n".into(), ": line 1: position parse error"),
        ("a.off", String::new(), ": line 1: the file is empty"),
        (
            "b.off",
            "PLY\n".into(),
            ": line 1: an OFF file starts with OFF, not `PLY`",
        ),
        (
            "c.off",
            "4OFF\n".into(),
            ": four-dimensional OFF is not supported",
        ),
        (
            "d.off",
            "OFF BINARY\n\0\0\0\x01".into(),
            ": the number of faces is missing",
        ),
        (
            "l.off",
            "OFF BINARY\n\x7f\x7f\x7f\x7f\0\0\0\0\0\0\0\0\0\0".into(),
            ": it announces 2139062143 entries of `vertices`, but holds only 0",
        ),
        (
            "m.off",
            "OFF BINARY\n\0\0\0\0\0\0\0\x01\0\0\0\0\x7f\0\0\0".into(),
            ": it announces 1 entries of `faces`, but holds only 0",
        ),
        (
            "n.off",
            "nOFF\n4\n".into(),
            ": n-dimensional OFF is not supported",
        ),
        (
            "o.off",
            "OFF 1 0 0\n0 nan 0\n".into(),
            ": none of its 1 points has finite coordinates",
        ),
        ("e.off", "OFF\n0 0 0\n".into(), ": it has no vertices"),
        (
            "f.off",
            "OFF 1000000000 7 0\n0 0 0\n".into(),
            ": it announces 1000000000 entries of `vertices`, but holds only 1",
        ),
        (
            "g.off",
            "OFF 1 18446744073709551615 0\n0 0 0\n".into(),
            ": it announces 18446744073709551615 entries of `faces`, but holds only 0",
        ),
        (
            "h.off",
            "OFF 1 1 0\n0 nan 0\n3 0 0 0\n".into(),
            ": line 2: `nan` is not a finite number",
        ),
        (
            "i.off",
            "OFF 1 1 0\n0 0 0\n3 0 0 1\n".into(),
            ": face 1 refers to vertex 1, but there are only 1, numbered from 0",
        ),
        (
            "j.off",
            "OFF 1 1 0\n0 0 0\n9 0 0 1\n".into(),
            ": line 3: a face of 9 corners has 3 columns for them",
        ),
        (
            "k.off",
            "STOFF 1 0 0\n0 0 0 1\n".into(),
            ": line 2: a vertex of 5 columns or more has only 4",
        ),
        ("a.ply", ply("0", "0", ""), ": it has no vertices"),
        (
            "b.ply",
            ply("1000000000", "0", "0 0 0\n"),
            ": it announces 1000000000 entries of `vertex`, but holds only 1",
        ),
        (
            "c.ply",
            ply("1", "1", "0 0 0\n3 0 0 -1\n"),
            ": face 1 refers to vertex -1, but there are only 1, numbered from 0",
        ),
        (
            "d.ply",
            ply("2", "0", "0 0 0\n"),
            ": it announces 2 entries of `vertex`, but holds only 1",
        ),
        (
            "e.ply",
            ply("1", "0", "0 0 0\n").replace("float x", "float a"),
            ": the vertices have no x, y and z",
        ),
        (
            "f.ply",
            "ply\nformat ascii 1.0\nend_header\n".into(),
            ": it has no vertices",
        ),
        (
            "g.ply",
            ply("1", "1", "0 0 0\n3 0 0\n"),
            ": line 11: an entry of `face` has only 0 of its 1 properties",
        ),
        (
            "h.ply",
            ply("1", "1", "0 0 0\n-3 0 0\n"),
            ": line 11: `-3` is not the length of a list",
        ),
        (
            "i.ply",
            ply("1", "1", "0 0 0\n3 0 0 .5\n"),
            ": entry 1 of `face` has a vertex index that is no integer",
        ),
        (
            "j.ply",
            ply("1", "0", "0 0 0\n").replace("float x", "int64 x"),
            ": line 4: `property int64 x` is not a property of a known type",
        ),
        (
            "k.ply",
            "plywood\n".into(),
            ": line 1: `plywood` is not the first line of a PLY file",
        ),
        (
            "l.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\n".into(),
            ": the header ends without end_header",
        ),
        ("a.xyz", "# nothing\n".into(), ": it has no vertices"),
        (
            "b.xyz",
            "1 2 3\n1 2\n".into(),
            ": line 2: a point has three columns or more, not 2",
        ),
        (
            "c.xyz",
            "1 2 3\n\n1 x 3\n".into(),
            ": line 3: `x` is not a number",
        ),
        (
            "d.xyz",
            "1 2 inf\nnan nan nan\n".into(),
            ": none of its 2 points has finite coordinates",
        ),
        ("a.fbx", String::new(), ": FBX is not supported"),
        (
            "none",
            String::new(),
            ": a file without an extension is not a known format; \
             the known ones are .glb, .gltf, .obj, .off, .ply, .stl and .xyz",
        ),
    ];
    for (name, content, expected) in cases {
        assert_eq!(fault(&folder, name, content), expected, "{name}");
    }
    let missing = folder.path("missing.obj");
    let message = read_surface(&missing).unwrap_err().to_string();
    let expected = format!("{}: ", missing.display());
    assert!(
        message.starts_with(&expected) && !message.contains('\n'),
        "{message}"
    );
}

#[test]
fn binary_ply_with_a_huge_count_is_refused_at_once() {
    let folder = Folder::new();
    let header = |properties: &str| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n\
             {properties}end_header\n1234567890123456"
        )
    };
    for (properties, found) in [
        ("property float x\nproperty double y\nproperty float z\n", 1),
        ("property list uint float x\n", 0),
        ("property list uchar uchar x\n", 0),
    ] {
        let expected = format!(
            ": it announces 18446744073709551615 entries of `vertex`, but holds only {found}"
        );
        assert_eq!(fault(&folder, "a.ply", header(properties)), expected);
    }
    let expected = ": the vertices have no x, y and z";
    assert_eq!(fault(&folder, "b.ply", header("")), expected);
}

#[test]
fn results_that_do_not_fit_are_refused_and_the_old_file_stays() {
    let folder = Folder::new();
    let document = folder.read("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let cloud = folder.read("a.xyz", "0 0 0\n1 1 1\n");
    let uvs = |count| UvMap::new(vec![[0.0, 0.0]], vec![[0; 3]; count]).unwrap();
    let out = folder.file("out.obj", "old");
    let other = folder.file("out.stl", "old");
    let options = WriteOptions::default();
    let errors = [
        (
            document.write_mesh_uvs(&uvs(2), &out, &options),
            "1 triangles need as many UVs, found 2",
        ),
        (
            document.write_point_uvs(&[[0.0; 2]; 3], &out, &options),
            "the surface is a mesh, but the UVs are for a point cloud",
        ),
        (
            document.write_mesh_uvs(&uvs(1), &other, &options),
            "STL has no place for UVs",
        ),
        (
            cloud.write_mesh_uvs(&uvs(1), folder.path("b.xyz"), &options),
            "the surface is a point cloud, but the UVs are for a mesh",
        ),
        (
            cloud.write_point_uvs(&[[0.0; 2]], folder.path("b.xyz"), &options),
            "2 points need as many UVs, found 1",
        ),
        (
            cloud.write_point_uvs(&[[0.0; 2], [f32::NAN, 0.0]], folder.path("b.xyz"), &options),
            "the UV of point 1 is not a finite number",
        ),
    ];
    for (result, expected) in errors {
        let message = result.unwrap_err().to_string();
        assert!(message.ends_with(&format!(": {expected}")), "{message}");
    }
    assert_eq!(fs::read(out).unwrap(), b"old");
    assert_eq!(fs::read(other).unwrap(), b"old");
    assert!(!folder.path("b.xyz").exists());
}
