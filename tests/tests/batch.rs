//! `fam unwrap` of many files, and of every format.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::{brief, fam, refuses, succeeds, write_mesh};
use fam_io::{Format, read_surface};
use fam_surface::{Surface, shapes};
use serde_json::Value;

fn json(path: PathBuf) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn triangles(path: &Path) -> usize {
    match read_surface(path).unwrap().surface() {
        Surface::Mesh(mesh) => mesh.triangles().len(),
        Surface::PointCloud(_) => 0,
    }
}

#[test]
fn a_folder_is_done_file_by_file_and_not_again() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    let torus = shapes::torus(1.0, 0.4, 12, 8);
    write_mesh(&scans.join("a.obj"), &torus);
    write_mesh(&scans.join("a.glb"), &torus);
    write_mesh(&scans.join("deep/b.ply"), &torus);
    fs::write(scans.join("broken.obj"), "v 0 0\n").unwrap();
    fs::write(scans.join("scene.fbx"), "Kaydara FBX Binary  \0").unwrap();
    fs::write(scans.join("notes.txt"), "Nothing to flatten here.\n").unwrap();
    fs::write(scans.join("package.json"), "{}").unwrap();
    let earlier = scans.join("earlier results");
    let arguments = ["scans/a.obj", "-q", "-o", earlier.to_str().unwrap()];
    succeeds(folder.path(), &brief(&arguments));
    let run = fam(folder.path(), &brief(&["scans", "-o", "out"]));
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let states = |table: &str| -> Vec<(String, String)> {
        let mut rows: Vec<_> = table
            .lines()
            .map(|line| {
                let mut words = line.split_whitespace();
                let mut word = || words.next().unwrap().replace('\\', "/");
                (word(), word())
            })
            .collect();
        rows.sort();
        rows
    };
    let expected = |done: &str| {
        [
            ("scans/a.glb", done),
            ("scans/a.obj", done),
            ("scans/broken.obj", "failed"),
            ("scans/deep/b.ply", done),
            ("scans/scene.fbx", "failed"),
        ]
        .map(|(name, state)| (name.to_string(), state.to_string()))
    };
    assert_eq!(states(&run.stdout), expected("done"));
    assert!(run.stdout.contains("line 1: "), "{}", run.stdout);
    assert!(
        run.stdout.contains("FBX is not supported"),
        "{}",
        run.stdout
    );
    assert_eq!(run.stderr.lines().last(), Some("fam: 2 of 5 files failed"));
    let out = folder.path().join("out");
    for written in ["a.obj.fam/a.obj", "a.glb.fam/a.glb", "deep/b.fam/b.ply"] {
        assert_eq!(triangles(&out.join(written)), 192, "{written}");
    }
    assert!(!out.join("broken.fam").exists());

    let again = fam(folder.path(), &brief(&["scans", "-o", "out"]));
    assert_eq!(states(&again.stdout), expected("skipped"));
    // What an interruption leaves has no report, and a file that changed has another content.
    fs::remove_file(out.join("a.obj.fam/metrics.json")).unwrap();
    write_mesh(&scans.join("deep/b.ply"), &shapes::torus(1.0, 0.3, 12, 8));
    let third = fam(folder.path(), &brief(&["scans", "-o", "out"]));
    let done: Vec<_> = states(&third.stdout)
        .into_iter()
        .filter(|(_, state)| state == "done")
        .map(|(name, _)| name)
        .collect();
    assert_eq!(done, ["scans/a.obj", "scans/deep/b.ply"]);
    fs::remove_file(out.join("a.glb.fam/uv.png")).unwrap();
    let missing = fam(folder.path(), &brief(&["scans", "-o", "out"]));
    let done = states(&missing.stdout);
    let done: Vec<_> = done.iter().filter(|(_, state)| state == "done").collect();
    assert_eq!(done, [&("scans/a.glb".to_string(), "done".to_string())]);
    let other = ["scans", "-o", "out", "--format", "obj"];
    let fourth = fam(folder.path(), &brief(&other));
    assert_eq!(states(&fourth.stdout), expected("done"));
    let forced = [&other[..], &["--force"]].concat();
    assert_eq!(
        states(&fam(folder.path(), &brief(&forced)).stdout),
        expected("done")
    );
}

#[test]
fn a_pattern_is_a_batch_and_one_without_matches_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let torus = shapes::torus(1.0, 0.4, 12, 8);
    write_mesh(&folder.path().join("a.obj"), &torus);
    write_mesh(&folder.path().join("b.obj"), &torus);
    write_mesh(&folder.path().join("c.ply"), &torus);
    let run = succeeds(folder.path(), &brief(&["*.obj", "--json", "-q"]));
    let summaries = serde_json::Deserializer::from_str(&run.stdout).into_iter::<Value>();
    let inputs: Vec<String> = summaries
        .map(|summary| summary.unwrap()["input"].as_str().unwrap().to_string())
        .collect();
    assert_eq!(inputs, ["a.obj", "b.obj"]);
    assert!(folder.path().join("b.fam/b.obj").exists());
    assert!(!folder.path().join("c.fam").exists());
    refuses(
        folder.path(),
        &["unwrap", "*.stl"],
        &["*.stl", "nothing matches"],
    );
    // A pattern without matches does not keep the others from being tried.
    let run = fam(
        folder.path(),
        &brief(&["*.stl", "a.obj", "missing.ply", "-q", "--json"]),
    );
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let summaries = serde_json::Deserializer::from_str(&run.stdout).into_iter::<Value>();
    let states: Vec<(String, String)> = summaries
        .map(|summary| {
            let summary = summary.unwrap();
            let text = |key: &str| summary[key].as_str().unwrap().to_string();
            (text("input"), text("state"))
        })
        .collect();
    let expected = [
        ("*.stl", "failed"),
        ("a.obj", "skipped"),
        ("missing.ply", "failed"),
    ];
    assert_eq!(
        states,
        expected.map(|(a, b)| (a.to_string(), b.to_string()))
    );
    assert!(run.stderr.contains("fam: missing.ply: "), "{}", run.stderr);
    fs::create_dir(folder.path().join("empty")).unwrap();
    refuses(folder.path(), &["unwrap", "empty"], &["empty", "no mesh"]);
}

#[test]
fn the_result_comes_in_the_format_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    write_mesh(
        &folder.path().join("a.ply"),
        &shapes::torus(1.0, 0.4, 12, 8),
    );
    for (name, format) in [
        ("glb", Format::Glb),
        ("gltf", Format::Gltf),
        ("obj", Format::Obj),
        ("off", Format::Off),
        ("ply", Format::Ply),
    ] {
        succeeds(
            folder.path(),
            &brief(&["a.ply", "-q", "-o", "out", "--format", name]),
        );
        let written = read_surface(folder.path().join(format!("out/a.{name}"))).unwrap();
        assert_eq!(written.format(), format);
        assert_eq!(written.uv_map().unwrap().triangles().len(), 192, "{name}");
    }
    refuses(
        folder.path(),
        &brief(&["a.ply", "-q", "--format", "xyz"]),
        &["a.ply", "XYZ has no place for a mesh"],
    );
    let flags = [
        "--format",
        "glb",
        "--uv-set",
        "1",
        "--checker",
        "--seam-lines",
    ];
    succeeds(
        folder.path(),
        &brief(&[&["a.ply", "-q", "-o", "lines"], &flags[..]].concat()),
    );
    let bytes = fs::read(folder.path().join("lines/a.glb")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let primitives: Vec<&Value> = document["meshes"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|mesh| mesh["primitives"].as_array().unwrap())
        .collect();
    assert_eq!(primitives.len(), 2);
    assert!(primitives[0]["attributes"].get("TEXCOORD_1").is_some());
    assert_eq!(primitives[1]["mode"], 1);
    assert_eq!(document["images"].as_array().unwrap().len(), 1);
}

#[test]
fn stl_is_welded_and_becomes_obj() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = shapes::torus(1.0, 0.4, 12, 8);
    let mut text = "solid torus\n".to_string();
    for t in 0..mesh.triangles().len() {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in mesh.corners(t) {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    fs::write(folder.path().join("torus.stl"), text + "endsolid torus\n").unwrap();
    succeeds(folder.path(), &brief(&["torus.stl", "-q"]));
    let written = read_surface(folder.path().join("torus.fam/torus.obj")).unwrap();
    assert_eq!(written.surface().positions().len(), 96);
    assert!(written.uv_map().is_some());
}

#[test]
fn materials_get_a_square_each_if_asked() {
    let folder = tempfile::tempdir().unwrap();
    let (torus, sheet) = (
        shapes::torus(1.0, 0.4, 12, 8),
        shapes::rectangle(3.0, 1.0, 2, 1),
    );
    let mut text = "mtllib scene.mtl\n".to_string();
    for [x, y, z] in torus.positions().iter().chain(sheet.positions()) {
        text += &format!("v {x} {y} {z}\n");
    }
    for (material, mesh, first) in [("red", &torus, 1), ("blue", &sheet, 97)] {
        text += &format!("usemtl {material}\n");
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|v| v + first);
            text += &format!("f {a} {b} {c}\n");
        }
    }
    fs::write(folder.path().join("scene.obj"), text).unwrap();
    fs::write(
        folder.path().join("scene.mtl"),
        "newmtl red\nmap_Kd maps/r.png\n",
    )
    .unwrap();
    fs::create_dir(folder.path().join("maps")).unwrap();
    fs::write(folder.path().join("maps/r.png"), "pixels").unwrap();
    let extent = |out: &str| {
        let written = read_surface(folder.path().join(out).join("scene.obj")).unwrap();
        let map = written.uv_map().unwrap();
        let sheet = (192..196).flat_map(|t| map.corners(t));
        let (low, high) = sheet
            .map(|uv| uv[0])
            .fold((1.0f32, 0.0f32), |(low, high), u| (low.min(u), high.max(u)));
        high - low
    };
    let raw = ["scene.obj", "-q", "--finish", "none"];
    succeeds(folder.path(), &brief(&[&raw[..], &["-o", "one"]].concat()));
    let metrics = json(folder.path().join("one/metrics.json"));
    assert_eq!(metrics["uv_squares"], 1);
    succeeds(
        folder.path(),
        &brief(&[&raw[..], &["-o", "two", "--per-material"]].concat()),
    );
    let metrics = json(folder.path().join("two/metrics.json"));
    assert_eq!(metrics["uv_squares"], 2);
    assert_eq!(metrics["components"].as_array().unwrap().len(), 2);
    assert_eq!(extent("two"), 1.0);
    assert!(extent("one") < 0.99);
    // The file is of use in its new place: what it refers to went with it.
    let copied = fs::read(folder.path().join("two/maps/r.png")).unwrap();
    assert_eq!(copied, b"pixels");
    assert!(folder.path().join("two/scene.mtl").exists());

    let model = "two/model.safetensors";
    let map = [
        "map",
        "--backend",
        "ndarray",
        "--model",
        model,
        "--per-material",
    ];
    succeeds(
        folder.path(),
        &[&map[..], &["scene.obj", "-o", "again.obj"]].concat(),
    );
    let read = |name: &str| read_surface(folder.path().join(name)).unwrap();
    let (again, first) = (read("again.obj"), read("two/scene.obj"));
    assert_eq!(again.uv_map(), first.uv_map());
}

#[test]
fn what_is_wrong_with_a_mesh_is_said_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    // Five sheets at one edge, one of them without area; one triangle twice, a vertex too many.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 1\nv 9 9 9\nv 2 0 0\nv 0 1 0\n\
                v 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 3 1 2\nf 1 2 7\nf 2 8 4\nf 1 2 9\n";
    fs::write(folder.path().join("messy.obj"), text).unwrap();
    let run = succeeds(folder.path(), &brief(&["messy.obj"]));
    let expected = "1 coinciding vertices taken for one, 1 non-manifold edges, \
                    1 repeated triangles, 1 triangles without area, 1 vertices in no face";
    assert!(
        run.stderr.lines().any(|line| line == expected),
        "{}",
        run.stderr
    );
    let found = &json(folder.path().join("messy.fam/metrics.json"))["conditioning"];
    assert_eq!(found["non_manifold_edges"], 1);
    assert_eq!(found["duplicate_triangles"], 1);
    assert_eq!(found["zero_area_triangles"], 1);
    // Two pairs go on across the edge; the fifth sheet was taken apart there.
    let seams = json(folder.path().join("messy.fam/seams.json"));
    let edges = seams["edges"].as_array().unwrap();
    assert!(edges.contains(&serde_json::json!([0, 1])));
    let written = read_surface(folder.path().join("messy.fam/messy.obj")).unwrap();
    assert_eq!(written.uv_map().unwrap().triangles().len(), 7);
}

/// The models and what comes of them, where they are present.
#[test]
fn every_model_works_or_fails_with_a_reason() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/models");
    if !models.exists() {
        eprintln!("SKIPPED: no models beside the repository");
        return;
    }
    let failing = [
        ("formats/empty.obj", "it has no vertices"),
        ("formats/empty_nodes.glb", "it has no vertices"),
        ("formats/face_in_group_name.obj", "all points are equal"),
        ("formats/ply_empty_bin.ply", "it has no vertices"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let inputs = ["*.obj", "*.off", "formats", "hostile"].map(|name| models.join(name));
    let [objs, offs, formats, hostile] = inputs.each_ref().map(|path| path.to_str().unwrap());
    let run = fam(
        folder.path(),
        &[
            "unwrap",
            objs,
            offs,
            formats,
            hostile,
            "-o",
            "out",
            "--backend",
            "ndarray",
            "--iterations",
            "2",
            "--points",
            "64",
            "--finish",
            "none",
        ],
    );
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let mut works = 0;
    for line in run.stdout.lines() {
        let (name, row) = line.split_once("  ").unwrap();
        let name = Path::new(name)
            .strip_prefix(&models)
            .unwrap()
            .to_str()
            .unwrap();
        match failing.iter().find(|(failing, _)| *failing == name) {
            Some((_, reason)) => {
                assert!(
                    row.trim().starts_with("failed") && row.ends_with(reason),
                    "{line}"
                );
            }
            None => {
                assert!(row.trim().starts_with("done"), "{line}");
                works += 1;
            }
        }
    }
    let listed = |folder: &str| {
        let entries = fs::read_dir(models.join(folder))
            .unwrap()
            .map(Result::unwrap);
        let file = |entry: &fs::DirEntry| {
            entry.path().is_file() && entry.path().extension() != Some("md".as_ref())
        };
        entries.filter(file).count()
    };
    let all = listed("") + listed("formats") + listed("hostile");
    assert_eq!(works + failing.len(), all, "{}", run.stdout);
    for (name, reason) in failing {
        let path = models.join(name);
        refuses(
            folder.path(),
            &brief(&[path.to_str().unwrap(), "-q"]),
            &[name, reason],
        );
    }
}

/// Kills the program while it writes, again and again: what was there is there, whole.
#[cfg(unix)]
#[test]
fn a_kill_while_writing_damages_nothing() {
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    let mesh = shapes::torus(1.0, 0.4, 300, 150);
    write_mesh(&folder.path().join("torus.ply"), &mesh);
    succeeds(
        folder.path(),
        &brief(&[
            "torus.ply",
            "-q",
            "--finish",
            "none",
            "--format",
            "glb",
            "-o",
            "out",
        ]),
    );
    let map = |out: &str| {
        let mut command = Command::new(common::FAM);
        command.current_dir(folder.path()).args([
            "map",
            "--backend",
            "ndarray",
            "--model",
            "out/model.safetensors",
            "out/torus.glb",
            "-o",
            out,
        ]);
        command.stderr(Stdio::null());
        command
    };
    let started = std::time::Instant::now();
    assert!(map("out/torus.glb").status().unwrap().success());
    let whole = started.elapsed();
    let (mut killed, mut finished) = (0, 0);
    for round in 0..30_u32 {
        let mut child = map("out/torus.glb").spawn().unwrap();
        // Most of the time in the second half, where the file is written.
        std::thread::sleep(whole.mul_f64(0.3 + 0.7 * f64::from(round % 15) / 15.0));
        child.kill().unwrap();
        match child.wait().unwrap().success() {
            true => finished += 1,
            false => killed += 1,
        }
        let document = read_surface(folder.path().join("out/torus.glb")).unwrap();
        assert_eq!(document.uv_map().unwrap().triangles().len(), 90_000);
    }
    println!("{killed} killed, {finished} finished");
    assert!(killed > 5, "{killed} killed, {finished} finished");
}

/// Kills `unwrap` while it replaces earlier results: every file is an old or a new one, whole.
#[cfg(unix)]
#[test]
fn a_kill_leaves_a_whole_folder_of_results() {
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    write_mesh(
        &folder.path().join("torus.obj"),
        &shapes::torus(1.0, 0.4, 200, 100),
    );
    let unwrap = |seed: &str| {
        let mut command = Command::new(common::FAM);
        let arguments = [
            "torus.obj",
            "-q",
            "--finish",
            "none",
            "--format",
            "glb",
            "--seed",
            seed,
        ];
        command.current_dir(folder.path()).args(brief(&arguments));
        command.stderr(Stdio::null());
        command
    };
    let started = std::time::Instant::now();
    assert!(unwrap("0").status().unwrap().success());
    let whole = started.elapsed();
    let out = folder.path().join("torus.fam");
    let names: Vec<_> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(names.len(), 8);
    let mut killed = 0;
    for round in 1..=12_u32 {
        let mut child = unwrap(&round.to_string()).spawn().unwrap();
        std::thread::sleep(whole.mul_f64(0.4 + 0.6 * f64::from(round) / 12.0));
        child.kill().unwrap();
        killed += u32::from(!child.wait().unwrap().success());
        for name in &names {
            let path = out.join(name);
            match path.extension().unwrap().to_str().unwrap() {
                "glb" | "obj" => drop(read_surface(&path).unwrap()),
                "json" => drop(json(path)),
                "png" => drop(image::open(path).unwrap()),
                "toml" => {
                    let text = fs::read_to_string(path).unwrap();
                    text.parse::<toml::Table>().unwrap();
                }
                "safetensors" => {
                    let bytes = fs::read(path).unwrap();
                    safetensors::SafeTensors::deserialize(&bytes).unwrap();
                }
                other => panic!("{other}"),
            }
        }
    }
    assert!(killed > 2, "{killed} killed");
}
