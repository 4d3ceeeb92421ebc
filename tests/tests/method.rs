//! `fam unwrap --method`: which method is taken, and what each of them writes.

mod common;

use std::fs;
use std::path::Path;

use common::{FAM, brief, refuses, succeeds};
use fam_io::Document;
use fam_surface::{Components, Surface, TriangleMesh, shapes};
use serde_json::Value;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn write(folder: &Path, name: &str, mesh: &TriangleMesh) {
    let document = Document::of_surface(Surface::Mesh(mesh.clone()));
    let nowhere = vec![[0.0; 2]; mesh.positions().len()];
    let uvs = fam_surface::UvMap::new(nowhere, mesh.triangles().to_vec()).unwrap();
    let path = folder.join(name);
    let options = fam_io::WriteOptions::default();
    document.write_mesh_uvs(&uvs, path, &options).unwrap();
}

/// The method that results in a folder were made by.
fn method(folder: &Path, out: &str) -> String {
    let report = json(&folder.join(out).join("metrics.json"));
    let by_model = folder.join(out).join("model.safetensors").exists();
    let method = report["method"].as_str().unwrap();
    assert_eq!(by_model, method == "neural");
    assert_eq!(
        report["components"][0].get("iterations").is_some(),
        by_model
    );
    assert_eq!(report.get("raw").is_some(), by_model);
    method.to_string()
}

#[test]
fn a_mesh_is_laid_out_without_networks() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "torus.obj", &shapes::torus(1.0, 0.4, 24, 12));
    let run = succeeds(folder, &["unwrap", "torus.obj", "--json"]);
    let summary: Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(summary.get("training_seconds").is_none() && summary.get("backend").is_none());
    assert_eq!(method(folder, "torus.fam"), "direct");
    let report = json(&folder.join("torus.fam/metrics.json"));
    assert_eq!(report["mesh"]["flipped_triangles"], 0);
    assert_eq!(report["mesh"]["overlapping_pairs"], 0);
    assert!(report["mesh"]["symmetric_dirichlet"].as_f64().unwrap() <= 4.1);

    // The user is told how to get a map.
    let run = succeeds(folder, &["unwrap", "torus.obj"]);
    let hints = run.stderr.lines().filter(|l| l.contains("--method neural"));
    assert_eq!(hints.count(), 1, "{}", run.stderr);

    // What was written lays it out the same way.
    let config = ["--config", "torus.fam/config.toml", "-o", "again", "-q"];
    succeeds(folder, &[&["unwrap", "torus.obj"], &config[..]].concat());
    assert_eq!(method(folder, "again"), "direct");
    let bytes = |out: &str| fs::read(folder.join(out).join("torus.obj")).unwrap();
    assert!(bytes("torus.fam") == bytes("again"));
}

#[test]
fn networks_are_trained_where_something_asks_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "sheet.obj", &shapes::bust(0.4));
    fs::write(folder.join("training.toml"), "points = 120\n").unwrap();
    fs::write(folder.join("layout.toml"), "[finish]\nmargin = 2\n").unwrap();
    for (options, expected) in [
        (&["--seed", "3"][..], "direct"),
        (&["--config", "layout.toml"], "direct"),
        (&["--method", "direct", "--iterations", "3"], "direct"),
        (&["--iterations", "3", "--points", "64"], "neural"),
        (
            &["--config", "training.toml", "--iterations", "3"],
            "neural",
        ),
        // An earlier run's model does not stay beside UVs that are not its own.
        (&["--method", "auto"], "direct"),
    ] {
        let call = [&["unwrap", "sheet.obj", "-q", "-o", "out"], options].concat();
        succeeds(folder, &call);
        assert_eq!(method(folder, "out"), expected, "{options:?}");
    }
    let raw = [
        &["unwrap", "sheet.obj", "--method", "direct"][..],
        &["--finish", "none"],
    ];
    refuses(folder, &raw.concat(), &["sheet.obj", "raw map"]);
}

#[test]
fn point_clouds_need_networks() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let points = shapes::bust(0.4);
    let rows = points.positions().iter();
    let text: String = rows.map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    fs::write(folder.join("cloud.xyz"), text).unwrap();
    let direct = ["unwrap", "cloud.xyz", "--method", "direct"];
    refuses(folder, &direct, &["cloud.xyz", "neural"]);
    assert!(!folder.join("cloud.fam").exists());
    // --iterations would ask for them by itself.
    fs::write(
        folder.join("c.toml"),
        "method = \"auto\"\niterations = 3\npoints = 64\n",
    )
    .unwrap();
    succeeds(folder, &["unwrap", "cloud.xyz", "-q", "--config", "c.toml"]);
    let report = json(&folder.join("cloud.fam/metrics.json"));
    assert_eq!(report["method"], "neural");
}

#[test]
fn a_single_triangle_is_laid_out_by_either_method() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("triangle.obj"), TRIANGLE).unwrap();
    let neural = brief(&["triangle.obj", "-q", "-o", "neural"]);
    for call in [&["unwrap", "triangle.obj", "-o", "direct"][..], &neural] {
        let run = succeeds(folder, call);
        assert!(!run.stderr.contains("warning"), "{}", run.stderr);
    }
    for out in ["direct", "neural"] {
        let metrics = &json(&folder.join(out).join("metrics.json"))["mesh"];
        assert_eq!(metrics["charts"], 1);
        assert!((metrics["symmetric_dirichlet"].as_f64().unwrap() - 4.0).abs() < 1e-4);
        assert!(metrics["uv_coverage"].as_f64().unwrap() > 0.3, "{metrics}");
    }
}

/// A sheet given twice, front and back.
#[test]
fn the_sides_of_a_sheet_share_their_uvs_or_have_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let sheet = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 4 3 2\n";
    fs::write(folder.join("sheet.obj"), sheet).unwrap();
    for (option, charts) in [(&[][..], 1), (&["--separate-duplicates"], 2)] {
        let run = succeeds(folder, &[&["unwrap", "sheet.obj"], option].concat());
        assert!(!run.stderr.contains("warning"), "{}", run.stderr);
        let report = json(&folder.join("sheet.fam/metrics.json"));
        assert_eq!(report["finish"]["charts"], charts);
        assert_eq!(report["mesh"]["overlapping_pairs"], 0);
    }
}

#[test]
fn rows_without_a_point_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut text = String::from("nan nan nan\n");
    for p in shapes::bust(0.4).positions() {
        text.push_str(&format!("{} {} {}\n", p[0], p[1], p[2]));
    }
    fs::write(folder.join("scan.xyz"), text).unwrap();
    let run = succeeds(folder, &brief(&["scan.xyz", "-q"]));
    let warnings: Vec<&str> = run
        .stderr
        .lines()
        .filter(|l| l.contains("left out 1 "))
        .collect();
    assert_eq!(warnings.len(), 1, "{}", run.stderr);
    assert!(warnings[0].starts_with("warning: scan.xyz: "));
}

/// The parts of a mesh are laid out side by side on all cores.
#[test]
fn the_number_of_threads_changes_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..6 {
        let part = match k % 2 {
            0 => shapes::torus(1.0, 0.4, 20, 10),
            _ => shapes::bust(0.3),
        };
        let first = positions.len() as u32;
        let apart = 10.0 * f64::from(k);
        positions.extend(part.positions().iter().map(|p| [p[0] + apart, p[1], p[2]]));
        triangles.extend(part.triangles().iter().map(|t| t.map(|v| first + v)));
    }
    let mesh = TriangleMesh::new(positions, triangles).unwrap();
    assert_eq!(Components::of(&mesh, &[]).unwrap().list.len(), 6);
    write(folder, "parts.obj", &mesh);
    for threads in ["1", "2", "8"] {
        let run = std::process::Command::new(FAM)
            .current_dir(folder)
            .env("RAYON_NUM_THREADS", threads)
            .args(["unwrap", "parts.obj", "-q", "-o", threads])
            .status();
        assert!(run.unwrap().success());
    }
    for entry in fs::read_dir(folder.join("1")).unwrap() {
        let name = entry.unwrap().file_name();
        let read = |out: &str| fs::read(folder.join(out).join(&name)).unwrap();
        assert!(
            read("1") == read("2") && read("1") == read("8"),
            "{name:?} differs"
        );
    }
}
