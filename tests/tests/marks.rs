//! Seams that the user marks.

mod common;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use common::{brief, refuses, succeeds};
use fam_surface::{TriangleMesh, shapes};
use serde_json::{Value, json};

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The OBJ file of a mesh, with lines instead of faces where edges are given.
fn obj(mesh: &TriangleMesh, lines: &[[u32; 2]]) -> String {
    let mut text = String::new();
    for [x, y, z] in mesh.positions() {
        writeln!(text, "v {x:.6} {y:.6} {z:.6}").unwrap();
    }
    for [a, b] in lines {
        writeln!(text, "l {} {}", a + 1, b + 1).unwrap();
    }
    for t in mesh.triangles().iter().filter(|_| lines.is_empty()) {
        writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap();
    }
    text
}

/// The edges of the cube between two of its sides, ascending.
fn creases(cube: &TriangleMesh) -> Vec<[u32; 2]> {
    let is_crease = |[a, b]: &[u32; 2]| {
        let [p, q] = [a, b].map(|v| cube.positions()[*v as usize]);
        let along = |k: &usize| p[*k] == q[*k] && [0.0, 1.0].contains(&p[*k]);
        (0..3).filter(along).count() == 2
    };
    let mut edges: Vec<[u32; 2]> = cube
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .filter(is_crease)
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

#[test]
fn a_cube_is_cut_where_it_is_wanted_and_not_where_it_is_forbidden() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let cube = shapes::cube(3);
    let creases = creases(&cube);
    assert_eq!(creases.len(), 36);
    fs::write(at("cube.obj"), obj(&cube, &[])).unwrap();
    fs::write(at("lines.obj"), obj(&cube, &creases)).unwrap();

    let options = [
        "cube.obj",
        "-o",
        "six",
        "--seams",
        "lines.obj",
        "--max-charts",
        "1",
    ];
    let run = succeeds(folder.path(), &brief(&options));
    assert!(
        run.stderr.contains("wanted along 36 edges"),
        "{}",
        run.stderr
    );
    let finish = read(&at("six/metrics.json"))["finish"].clone();
    assert_eq!(finish["charts"], 6);
    assert!(finish["energy"].as_f64().unwrap() < 4.001);
    let marks = json!({"wanted": 36, "forbidden": 0, "forbidden_cut": 0});
    assert_eq!(finish["marks"], marks);
    assert_eq!(finish["warnings"], json!([]));
    let seams = read(&at("six/seams.json"));
    assert_eq!(seams["edges"], json!(creases));

    // Its own seams, and those of the file of lines, are as good.
    for file in ["six/seams.json", "six/seams.obj"] {
        let options = ["cube.obj", "-q", "-o", "again", "--seams", file];
        succeeds(folder.path(), &brief(&options));
        assert_eq!(read(&at("again/seams.json"))["edges"], seams["edges"]);
    }

    let options = ["cube.obj", "-o", "none", "--no-seams", "six/seams.json"];
    succeeds(folder.path(), &brief(&options));
    let finish = read(&at("none/metrics.json"))["finish"].clone();
    let marks = json!({"wanted": 0, "forbidden": 36, "forbidden_cut": 0});
    assert_eq!(finish["marks"], marks);
    let cut = read(&at("none/seams.json"))["edges"].clone();
    let is_crease = |edge: &Value| seams["edges"].as_array().unwrap().contains(edge);
    assert!(!cut.as_array().unwrap().is_empty());
    assert!(!cut.as_array().unwrap().iter().any(is_crease));

    // Some that do not fit are left out, and those that are both are cut.
    let mut some = obj(&cube, &creases[..5]);
    some.push_str("v 9 9 9\nl 1 -1\n");
    fs::write(at("some.obj"), some).unwrap();
    let both = ["--seams", "some.obj", "--no-seams", "six/seams.json"];
    let options = [&["cube.obj", "-o", "both"], &both[..]].concat();
    let run = succeeds(folder.path(), &brief(&options));
    let finish = read(&at("both/metrics.json"))["finish"].clone();
    assert_eq!(finish["marks"]["wanted"], 5);
    let warnings: Vec<&str> = finish["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    assert!(
        warnings[0].contains("1 of 6 marked edges") && warnings[0].contains("line "),
        "{warnings:?}"
    );
    assert!(
        warnings[1].contains("that are cut: 5 of 36"),
        "{warnings:?}"
    );
    for warning in warnings {
        assert!(run.stderr.contains(warning), "{}", run.stderr);
    }
}

/// A torus of squares, as its triangles come two by two.
#[test]
fn polygons_are_not_cut_across() {
    let folder = tempfile::tempdir().unwrap();
    let torus = shapes::torus(1.0, 0.4, 24, 12);
    let squares: Vec<[u32; 4]> = torus
        .triangles()
        .chunks(2)
        .map(|pair| {
            let [a, b, c] = pair[0];
            let d = pair[1].into_iter().find(|v| !pair[0].contains(v)).unwrap();
            let lies_between = |p: &u32, q: &u32| pair[1].contains(p) && pair[1].contains(q);
            match (lies_between(&a, &b), lies_between(&b, &c)) {
                (true, _) => [a, d, b, c],
                (_, true) => [a, b, d, c],
                _ => [a, b, c, d],
            }
        })
        .collect();
    let mut text = String::new();
    for [x, y, z] in torus.positions() {
        writeln!(text, "v {x:.6} {y:.6} {z:.6}").unwrap();
    }
    for square in &squares {
        let [a, b, c, d] = square.map(|v| v + 1);
        writeln!(text, "f {a} {b} {c} {d}").unwrap();
    }
    fs::write(folder.path().join("torus.obj"), text).unwrap();
    let run = succeeds(folder.path(), &brief(&["torus.obj"]));
    assert!(!run.stderr.contains("forbidden"), "{}", run.stderr);
    let seams = read(&folder.path().join("torus.fam/seams.json"));
    let seams: Vec<[u32; 2]> = serde_json::from_value(seams["edges"].clone()).unwrap();
    assert!(seams.len() > 30);
    let sides = |&[a, b, c, d]: &[u32; 4]| [[a, b], [b, c], [c, d], [d, a]];
    let is_side = |seam: &[u32; 2]| {
        let of = |square| {
            sides(square)
                .iter()
                .any(|&[a, b]| [a.min(b), a.max(b)] == *seam)
        };
        squares.iter().any(of)
    };
    assert!(seams.iter().all(is_side), "{seams:?}");
    let written = fs::read_to_string(folder.path().join("torus.fam/torus.obj")).unwrap();
    let faces = written.lines().filter(|line| line.starts_with("f "));
    assert!(faces.clone().count() == squares.len());
    assert!(faces.into_iter().all(|face| face.split(' ').count() == 5));
}

#[test]
fn marks_without_use_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("cloud.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    write("far.obj", "v 7 0 0\nv 8 0 0\nl 1 2\n");
    write("bad.obj", "v 7 0 0\nl 1 2\n");
    write("empty.json", "{\"edges\": []}");
    write("seams.json", "{\"edges\": [[0, 1]]}");
    for (arguments, words) in [
        (
            &["a.obj", "b.obj", "--seams", "seams.json"][..],
            &["--seams", "several inputs"][..],
        ),
        (
            &["a.obj", "b.obj", "--no-seams", "seams.json"],
            &["--no-seams", "several inputs"],
        ),
        (
            &["a.obj", "--seams", "seams.json", "--finish", "none"],
            &["--seams", "--finish none"],
        ),
        (
            &["cloud.xyz", "--no-seams", "seams.json"],
            &["cloud.xyz", "point cloud", "--no-seams"],
        ),
        (&["a.obj", "--seams", "missing.json"], &["missing.json"]),
        (
            &["a.obj", "--seams", "far.obj"],
            &["far.obj", "is in the mesh"],
        ),
        (
            &["a.obj", "--seams", "bad.obj"],
            &["bad.obj", "line 2", "vertex 2"],
        ),
        (
            &["a.obj", "--seams", "empty.json"],
            &["empty.json", "marks nothing"],
        ),
        (
            &["a.obj", "--seams", "cloud.xyz"],
            &["cloud.xyz", "marks nothing"],
        ),
    ] {
        refuses(folder.path(), &brief(arguments), words);
        assert!(!folder.path().join("a.fam").exists());
    }
}

#[test]
fn what_is_marked_distinguishes_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let sheets = folder.path().join("sheets");
    fs::create_dir(&sheets).unwrap();
    fs::write(
        sheets.join("a.obj"),
        obj(&shapes::rectangle(1.0, 1.0, 2, 2), &[]),
    )
    .unwrap();
    let marks = |text: &str| fs::write(folder.path().join("marks.json"), text).unwrap();
    let state = |options: &[&str]| {
        let arguments = [&["sheets", "-o", "out"], options].concat();
        let run = succeeds(folder.path(), &brief(&arguments));
        run.stdout.split_whitespace().nth(1).unwrap().to_string()
    };
    let wanted = ["--seams", "marks.json"];
    assert_eq!(state(&[]), "done");
    marks("{\"edges\": [[3, 4]]}");
    assert_eq!(state(&wanted), "done");
    assert_eq!(state(&wanted), "skipped");
    marks("{\"edges\": [[4, 5]]}");
    assert_eq!(state(&wanted), "done");
    assert_eq!(state(&["--no-seams", "marks.json"]), "done");
}
