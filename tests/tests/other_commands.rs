//! `fam map`, `fam metrics`, `fam backends`, and the real models where they are present.

mod common;

use std::fs;
use std::io::Write;
use std::path::Path;

use common::{brief, fam, refuses, succeeds};

#[test]
fn a_trained_model_maps_its_own_surface_as_unwrap_did_and_any_other_points_too() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &brief(&["-q", "--finish", "none"]));
    let model = "sample.fam/model.safetensors";
    let map = |input: &str, out: &str| {
        succeeds(
            folder.path(),
            &[
                "map",
                "--backend",
                "ndarray",
                "--model",
                model,
                input,
                "-o",
                out,
            ],
        )
    };
    map("sample.fam/sample.obj", "again.obj");
    let read = |name: &str| fam_io::read_surface(folder.path().join(name)).unwrap();
    assert_eq!(
        read("again.obj").uv_map().unwrap(),
        read("sample.fam/sample.obj").uv_map().unwrap()
    );
    fs::write(
        folder.path().join("points.xyz"),
        "1.4 0 0\n-1.4 0 0\n0 1 0.4\n",
    )
    .unwrap();
    map("points.xyz", "mapped.xyz");
    assert_eq!(read("mapped.xyz").point_uvs().unwrap().len(), 3);
}

#[test]
fn map_refuses_what_is_no_model() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("p.xyz"), "0 0 0\n1 0 0\n").unwrap();
    fs::write(folder.path().join("m.safetensors"), "nothing of the kind").unwrap();
    let map = ["map", "--model", "m.safetensors", "p.xyz", "-o", "o.xyz"];
    refuses(folder.path(), &map, &["m.safetensors"]);
    let missing = ["map", "--model", "none.safetensors", "p.xyz", "-o", "o.xyz"];
    refuses(folder.path(), &missing, &["none.safetensors"]);
    assert!(!folder.path().join("o.xyz").exists());
}

#[test]
fn metrics_of_a_known_layout() {
    let folder = tempfile::tempdir().unwrap();
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                  f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    fs::write(folder.path().join("square.obj"), square).unwrap();
    let run = succeeds(folder.path(), &["metrics", "square.obj", "--json"]);
    let metrics: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(metrics["conformality"], 0.0);
    assert!((metrics["symmetric_dirichlet"].as_f64().unwrap() - 4.0).abs() < 1e-12);
    assert_eq!(
        (&metrics["charts"], &metrics["uv_coverage"]),
        (&1.into(), &1.0.into())
    );
    assert!(metrics["seam_visibility"].is_null(), "no seams");
    let apart = square.replace("vt 0 1\n", "vt 0 1\nvt 2 0\nvt 2 1\n");
    let apart = apart.replace("f 1/1 3/3 4/4", "f 1/5 3/6 4/4");
    fs::write(folder.path().join("apart.obj"), apart).unwrap();
    let run = succeeds(folder.path(), &["metrics", "apart.obj", "--json"]);
    let metrics: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(metrics["seam_visibility"], 1.0, "nothing hides a sheet");
    let table = succeeds(folder.path(), &["metrics", "square.obj"]).stdout;
    assert!(table.contains("conformality") && table.contains("charts"));

    let bare = square
        .replace("/1", "")
        .replace("/2", "")
        .replace("/3", "")
        .replace("/4", "");
    fs::write(folder.path().join("bare.obj"), bare).unwrap();
    refuses(
        folder.path(),
        &["metrics", "bare.obj"],
        &["bare.obj", "texture coordinates"],
    );
    fs::write(folder.path().join("p.xyz"), "0 0 0\n1 0 0\n").unwrap();
    refuses(
        folder.path(),
        &["metrics", "p.xyz"],
        &["p.xyz", "point cloud"],
    );
}

#[test]
fn backends_names_the_cpu_and_auto_never_takes_a_software_adapter() {
    let run = succeeds(Path::new("."), &["backends"]);
    assert!(run.stdout.contains("flex") && run.stdout.contains("ndarray"));
    let real = run.stdout.lines().any(|line| line.contains("GPU"));
    let auto = run
        .stdout
        .lines()
        .find(|line| line.starts_with("auto"))
        .unwrap();
    assert_eq!(auto.contains("wgpu"), real, "{}", run.stdout);
}

#[test]
fn wgpu_trains_and_agrees_with_ndarray() {
    let folder = tempfile::tempdir().unwrap();
    let adapters = succeeds(folder.path(), &["backends"]).stdout;
    if adapters.contains("no adapter found") {
        assert!(
            std::env::var_os("FAM_REQUIRE_WGPU").is_none(),
            "no wgpu adapter, and FAM_REQUIRE_WGPU is set"
        );
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no wgpu adapter on this machine"
        );
        return;
    }
    let loss = |backend: &str| {
        let arguments = [
            "unwrap",
            "--json",
            "-q",
            "--backend",
            backend,
            "--iterations",
            "2",
            "--points",
            "100",
        ];
        let run = succeeds(folder.path(), &arguments);
        let summary: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(summary["backend"], backend);
        summary["components"][0]["loss"]["total"].as_f64().unwrap()
    };
    let (cpu, gpu) = (loss("ndarray"), loss("wgpu"));
    assert!((cpu - gpu).abs() < 1e-4 * cpu, "{cpu} against {gpu}");
}

#[test]
fn help_names_every_command_and_usage_errors_exit_with_2() {
    let help = succeeds(Path::new("."), &["--help"]).stdout;
    for command in ["unwrap", "map", "metrics", "evaluate", "bench", "backends"] {
        assert!(help.contains(command));
    }
    assert_eq!(
        fam(Path::new("."), &["unwrap", "--preset", "slow"]).code,
        Some(2)
    );
}

/// Every model of a folder beside the repository, where it is present: each is flattened, or
/// refused in one line that names it.
#[test]
fn real_models_work_or_are_refused_in_one_line() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/models");
    if !models.is_dir() {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: the real models are not present"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (mut flattened, mut refused) = (0, Vec::new());
    for group in [
        models.clone(),
        models.join("hostile"),
        models.join("formats"),
    ] {
        for entry in fs::read_dir(group).unwrap() {
            let path = entry.unwrap().path();
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            if !["obj", "off", "ply", "xyz"]
                .iter()
                .any(|known| extension == *known)
            {
                continue;
            }
            let name = path.to_str().unwrap();
            let arguments = [
                "unwrap",
                name,
                "-q",
                "-o",
                "out",
                "--backend",
                "ndarray",
                "--iterations",
                "1",
                "--points",
                "64",
                "--finish",
                "none",
            ];
            let run = fam(folder.path(), &arguments);
            match run.code {
                Some(0) => flattened += 1,
                Some(2) => {
                    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
                    assert!(run.stderr.contains(name), "{}", run.stderr);
                    refused.push(path.file_name().unwrap().to_str().unwrap().to_string());
                }
                code => panic!("{name}: exit code {code:?}: {}", run.stderr),
            }
        }
    }
    refused.sort();
    println!("{flattened} flattened, refused: {refused:?}");
    assert!(flattened > 30);
}

/// A cloud in the format that it has goes through in pieces, in another one as a whole.
#[test]
fn map_gives_a_cloud_the_same_uvs_in_any_format() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &brief(&["-q", "--finish", "none"]));
    let points: String = (0..200)
        .map(|i| format!("{} 0.1 {}\n", f64::from(i) / 100.0, 0.4))
        .collect();
    fs::write(folder.path().join("points.xyz"), points).unwrap();
    for out in ["same.xyz", "other.ply"] {
        let model = "sample.fam/model.safetensors";
        succeeds(
            folder.path(),
            &["map", "--model", model, "points.xyz", "-o", out],
        );
    }
    let uvs = |name: &str| {
        let document = fam_io::read_surface(folder.path().join(name)).unwrap();
        document.point_uvs().unwrap().to_vec()
    };
    assert_eq!(uvs("same.xyz").len(), 200);
    assert_eq!(uvs("same.xyz"), uvs("other.ply"));

    fs::write(folder.path().join("broken.xyz"), "0 0 0\n1 0\n").unwrap();
    let model = "sample.fam/model.safetensors";
    let broken = ["map", "--model", model, "broken.xyz", "-o", "broken-uv.xyz"];
    refuses(folder.path(), &broken, &["broken.xyz", "line 2"]);
    assert!(!folder.path().join("broken-uv.xyz").exists());
}
