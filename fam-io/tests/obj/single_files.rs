//! Single files whose answer is known.

use super::*;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn a_file_that_changed_is_not_written() {
    let folder = Folder::new();
    let out = folder.file("out.obj", "old");
    let uvs = UvMap::new(vec![[0.0, 0.0]], vec![[0; 3]]).unwrap();
    for changed in [
        String::new(),
        TRIANGLE.replace("0 1 0", "0 2 0"),
        TRIANGLE.replace("\n", "\r\n"),
        TRIANGLE.replace("f 1 2 3\n", ""),
        TRIANGLE.replace("f 1 2 3", "f 1 2 3 1"),
        TRIANGLE.replace("f 1 2 3", "f 1/////2 2 3"),
        format!("{TRIANGLE}f 1 2 3\n"),
        format!("{TRIANGLE} "),
    ] {
        let document = folder.read("a.obj", TRIANGLE);
        folder.file("a.obj", &changed);
        let error = document
            .write_mesh_uvs(&uvs, &out, &WriteOptions::default())
            .unwrap_err();
        let message = error.to_string();
        assert!(
            message.ends_with("out.obj: the file changed since it was read"),
            "{message}"
        );
        assert_eq!(fs::read(&out).unwrap(), b"old");
    }
    let document = folder.read("a.obj", TRIANGLE);
    fs::remove_file(folder.path("a.obj")).unwrap();
    assert!(
        document
            .write_mesh_uvs(&uvs, &out, &WriteOptions::default())
            .is_err()
    );
    assert_eq!(fs::read(&out).unwrap(), b"old");
}

#[test]
fn lines_may_be_longer_than_any_buffer() {
    let folder = Folder::new();
    let count = 100_000;
    let mut text: String = (0..count).map(|i| format!("v {i} 0 0\n")).collect();
    text += "f";
    text.extend((1..=count).map(|i| format!(" {i}")));
    let document = folder.read("a.obj", &text);
    let triangles: Vec<[u32; 3]> = (2..count).map(|k| [0, k - 1, k]).collect();
    assert_eq!(mesh(&document).triangles(), triangles);
    let uvs = (0..count).map(|i| [i as f32, 0.5]).collect();
    let uvs = UvMap::new(uvs, triangles).unwrap();
    let path = folder.path("b.obj");
    document
        .write_mesh_uvs(&uvs, &path, &WriteOptions::default())
        .unwrap();
    assert_eq!(read_surface(path).unwrap().uv_map(), Some(&uvs));
}

#[test]
fn uvs_of_points_start_a_line() {
    let folder = Folder::new();
    for (text, expected) in [
        ("v 1 2 3", "v 1 2 3\nvt 0.5 1\n"),
        ("\u{feff}v 1 2 3\r\n", "\u{feff}v 1 2 3\r\nvt 0.5 1\r\n"),
        ("v 1 2 3\nvt 9 9", "v 1 2 3\nvt 0.5 1\n"),
        ("v 1 2 3 \\", "v 1 2 3 \\\n\nvt 0.5 1\n"),
        ("v 1 2 3\r\\\r", "v 1 2 3\r\\\r\rvt 0.5 1\r"),
        ("v 1 2 3\nvt 1 \\\n", "v 1 2 3\nvt 0.5 1\n"),
        ("l 1/1\nvt 0 0 # \\\nv 1 2 3\n", "l 1\nv 1 2 3\nvt 0.5 1\n"),
    ] {
        let document = folder.read("a.obj", text);
        let path = folder.path("b.obj");
        document
            .write_point_uvs(&[[0.5, 1.0]], &path, &WriteOptions::default())
            .unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), expected);
        assert_eq!(
            read_surface(&path).unwrap().point_uvs(),
            Some(&[[0.5, 1.0]][..])
        );
    }
}

#[test]
fn the_first_face_with_a_missing_vertex_is_named() {
    let message = |faces: &str| {
        let text = TRIANGLE.replace("f 1 2 3\n", faces).into_bytes();
        Document::from_bytes(Format::Obj, text)
            .unwrap_err()
            .to_string()
    };
    let refers = |what: &str| format!("face {what}, but there are only 3");
    assert_eq!(
        message("f 1 2\nf 1 2 3\nf 1\nf 1 2 9\nf 1 2 -9\n"),
        refers("4 refers to vertex 9")
    );
    assert_eq!(
        message("f 1 2 3\nf 1 2 -9\nf 1\nf 1 2 9\n"),
        refers("2 refers to vertex -9")
    );
    assert_eq!(
        message("f 1 2 -9223372036854775808\n"),
        refers("1 refers to vertex -9223372036854775808")
    );
    assert_eq!(
        message("f 1 2 4294967296\n"),
        refers("1 refers to vertex 4294967296")
    );
    assert_eq!(
        message("f 1 2 4294967295\n"),
        refers("1 refers to vertex 4294967295")
    );
    assert_eq!(
        message("f 1 2 9223372036854775808\n"),
        "line 4: `9223372036854775808` is not the corner of a face"
    );
    assert_eq!(
        message("f 1 2 0\n"),
        refers("1 refers to vertex 0") + ", numbered from 1"
    );
    assert_eq!(
        message("\n\nf 1 2 \\\n1.5\n"),
        "line 6: `1.5` is not the corner of a face"
    );
}
