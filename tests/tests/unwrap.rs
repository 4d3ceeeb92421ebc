//! `fam unwrap`: what it writes, and that it can be relied upon.

mod common;

use std::fs;
use std::path::Path;

use common::{brief, fam, refuses, succeeds};
use fam_surface::{Surface, shapes};
use serde_json::Value;

/// Two quads that share an edge, in two groups with a material, as an artist's file has them.
const QUADS: &str = "\
# two quads
mtllib scene.mtl
o panel
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0.3
v 2 1 0.3
g left
usemtl red
f 1 2 3 4
g right
f 2 5 6 3
";

fn write_torus(path: &Path) {
    let mesh = shapes::torus(1.0, 0.4, 24, 12);
    let document = fam_io::Document::of_surface(Surface::Mesh(mesh.clone()));
    let flat = mesh.positions().iter().map(|p| [p[0] as f32, p[1] as f32]);
    let uvs = fam_surface::UvMap::new(flat.collect(), mesh.triangles().to_vec()).unwrap();
    document
        .write_mesh_uvs(&uvs, path, &fam_io::WriteOptions::default())
        .unwrap();
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn without_an_input_the_sample_is_flattened_and_every_file_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let run = succeeds(folder.path(), &brief(&["--json"]));
    let out = folder.path().join("sample.fam");
    let mut names: Vec<_> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "config.toml",
        "metrics.json",
        "model.safetensors",
        "preview.png",
        "sample.obj",
        "seams.json",
        "seams.obj",
        "uv.png",
    ];
    assert_eq!(names, expected);

    let metrics = json(&out.join("metrics.json"));
    let summary: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(summary["mesh"], metrics["mesh"]);
    assert_eq!(summary["backend"], "flex");
    assert!(summary["training_seconds"].is_f64() && summary["finishing_seconds"].is_f64());
    assert!(metrics.get("training_seconds").is_none());
    assert_eq!(metrics["version"], 4);
    assert_eq!(metrics["method"], "neural");
    assert_eq!(metrics["components"][0]["iterations"], 3);
    assert!(metrics["mesh"]["conformality"].as_f64().unwrap() > 0.0);
    assert!(metrics["components"][0]["loss"]["wrap"].as_f64().unwrap() > 0.0);

    let measured = succeeds(
        folder.path(),
        &["metrics", "sample.fam/sample.obj", "--json"],
    );
    let mut measured: Value = serde_json::from_str(&measured.stdout).unwrap();
    let visibility = measured.as_object_mut().unwrap().remove("seam_visibility");
    assert!(visibility.is_some());
    assert_eq!(
        measured, metrics["mesh"],
        "the file holds what was measured"
    );

    let uv = image::open(out.join("uv.png")).unwrap();
    assert_eq!((uv.width(), uv.height()), (1024, 1024));
    let preview = image::open(out.join("preview.png")).unwrap();
    assert!(preview.width() > 3 * preview.height());
    let seams = json(&out.join("seams.json"));
    assert_eq!(
        seams["points"].as_array().unwrap().len() as u64,
        metrics["seam_points"]
    );
    assert_eq!(
        seams["edges"].as_array().unwrap().len() as u64,
        metrics["torn_edges"]
    );
    let config: toml::Table =
        toml::from_str(&fs::read_to_string(out.join("config.toml")).unwrap()).unwrap();
    assert_eq!(config["points"].as_integer(), Some(150));
    assert_eq!(config["finish"]["mode"].as_str(), Some("full"));
    let model = fs::read(out.join("model.safetensors")).unwrap();
    assert_eq!(
        safetensors::SafeTensors::deserialize(&model).unwrap().len(),
        50
    );
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    write_torus(&folder.path().join("torus.obj"));
    for out in ["a", "b"] {
        succeeds(
            folder.path(),
            &brief(&["torus.obj", "-q", "--seed", "5", "-o", out]),
        );
    }
    for entry in fs::read_dir(folder.path().join("a")).unwrap() {
        let name = entry.unwrap().file_name();
        let read = |out: &str| fs::read(folder.path().join(out).join(&name)).unwrap();
        assert!(read("a") == read("b"), "{name:?} differs");
    }
}

#[test]
fn an_obj_keeps_all_but_its_texture_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("panel.obj"), QUADS).unwrap();
    succeeds(folder.path(), &brief(&["panel.obj", "-q"]));
    let written = fs::read_to_string(folder.path().join("panel.fam/panel.obj")).unwrap();
    let kept: Vec<&str> = written
        .lines()
        .filter(|line| !line.starts_with("vt "))
        .collect();
    let stripped: Vec<String> = kept
        .iter()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => {
                let vertex = |corner: &str| corner.split('/').next().unwrap().to_string();
                let corners: Vec<String> = corners.split(' ').map(vertex).collect();
                format!("f {}", corners.join(" "))
            }
            None => line.to_string(),
        })
        .collect();
    assert_eq!(stripped, QUADS.lines().collect::<Vec<_>>());
    let document = fam_io::read_surface(folder.path().join("panel.fam/panel.obj")).unwrap();
    assert!(document.uv_map().is_some());
}

#[test]
fn a_mesh_named_like_the_seams_is_not_lost() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("seams.obj"), QUADS).unwrap();
    succeeds(folder.path(), &brief(&["seams.obj", "-q"]));
    let written = fam_io::read_surface(folder.path().join("seams.fam/seams-uv.obj")).unwrap();
    assert!(written.uv_map().is_some());
}

#[test]
fn point_clouds_keep_their_format_and_get_a_uv_each() {
    let folder = tempfile::tempdir().unwrap();
    let points: String = (0..300)
        .map(|i| {
            let (x, y) = (f64::from(i % 20) / 10.0, f64::from(i / 20) / 10.0);
            format!("{x} {y} {}\n", 0.3 * x * y)
        })
        .collect();
    fs::write(folder.path().join("sheet.xyz"), &points).unwrap();
    let header = "ply\nformat ascii 1.0\nelement vertex 300\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    fs::write(folder.path().join("cloud.ply"), format!("{header}{points}")).unwrap();
    for name in ["sheet.xyz", "cloud.ply"] {
        succeeds(folder.path(), &brief(&[name, "-q"]));
        let stem = name.split('.').next().unwrap();
        let out = folder.path().join(format!("{stem}.fam"));
        let document = fam_io::read_surface(out.join(name)).unwrap();
        assert_eq!(document.point_uvs().unwrap().len(), 300);
        assert!(matches!(document.surface(), Surface::PointCloud(_)));
        let metrics = json(&out.join("metrics.json"));
        assert_eq!(metrics["points"], 300);
        assert!(metrics.get("mesh").is_none() && metrics.get("raw").is_none());
        assert!(metrics["finish"]["unreached_points"].as_u64() <= Some(300));
    }
}

#[test]
fn a_configuration_file_overrides_the_preset_and_options_override_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = "points = 120\niterations = 2\n[networks]\nwidth = 24\n";
    fs::write(folder.path().join("mine.toml"), file).unwrap();
    let arguments = [
        "unwrap",
        "-q",
        "--backend",
        "ndarray",
        "--config",
        "mine.toml",
        "--seed",
        "9",
    ];
    succeeds(folder.path(), &arguments);
    let written = fs::read_to_string(folder.path().join("sample.fam/config.toml")).unwrap();
    let config: toml::Table = toml::from_str(&written).unwrap();
    assert_eq!(config["points"].as_integer(), Some(120));
    assert_eq!(config["seed"].as_integer(), Some(9));
    assert_eq!(config["networks"]["width"].as_integer(), Some(24));
    // What was written configures the same run again.
    let again = [
        "unwrap",
        "-q",
        "--backend",
        "ndarray",
        "--config",
        "sample.fam/config.toml",
        "-o",
        "again",
    ];
    succeeds(folder.path(), &again);
    let model = |out: &str| fs::read(folder.path().join(out).join("model.safetensors")).unwrap();
    assert!(model("sample.fam") == model("again"));
}

#[test]
fn every_option_of_the_method_runs() {
    let folder = tempfile::tempdir().unwrap();
    for options in [
        &["--without", "deform-branch"][..],
        &["--without", "unwrap-branch"],
        &["--without", "cut-net"],
        &["--jacobian", "double-backward"],
        &["--objective", "reference"],
        &["--sampling", "vertices"],
        &["--no-normals"],
        &["--seam-rule", "paper"],
    ] {
        let run = succeeds(folder.path(), &brief(&[options, &["--json"]].concat()));
        let summary: Value = serde_json::from_str(&run.stdout).unwrap();
        assert!(summary["mesh"]["conformality"].is_f64(), "{options:?}");
    }
}

#[test]
fn progress_is_plain_lines_where_there_is_no_terminal_and_none_if_quiet() {
    let folder = tempfile::tempdir().unwrap();
    let run = succeeds(folder.path(), &brief(&[]));
    assert!(run.stdout.is_empty());
    let first = run
        .stderr
        .lines()
        .find(|line| line.starts_with("1/9 "))
        .unwrap();
    for word in ["loss", "wrap", "cycle", "conf", "points/s", "left"] {
        assert!(first.contains(word), "{first}");
    }
    assert!(!run.stderr.contains('\r') && !run.stderr.contains('\u{1b}'));
    let run = succeeds(folder.path(), &brief(&["-q"]));
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("empty.obj", "# nothing\n", "no vertices"),
        (
            "nan.obj",
            "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n",
            "finite",
        ),
        ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "9"),
        (
            "equal.obj",
            "v 1 2 3\nv 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\nf 2 3 4\n",
            "all points are equal",
        ),
        (
            "line.obj",
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3\nf 2 3 4\n",
            "no area",
        ),
        (
            "sliver.off",
            "OFF\n4 2 0\n0 0 0\n1 0 0\n2 1e-40 0\n1 -1e-40 0\n3 0 1 2\n3 0 3 2\n",
            "no area",
        ),
        ("three.xyz", "0 0 0\n1 0 0\n0 1 0\n", "fewer than 4"),
        (
            "garbage.ply",
            "ply\nformat ascii 1.0\nelement vertex 4000000000\n",
            "",
        ),
        ("scene.fbx", "Kaydara", ".fbx"),
    ];
    for (name, content, reason) in cases {
        fs::write(folder.path().join(name), content).unwrap();
        refuses(folder.path(), &brief(&[name, "-q"]), &[name, reason]);
        let stem = name.split('.').next().unwrap();
        assert!(!folder.path().join(format!("{stem}.fam")).exists());
    }
    refuses(folder.path(), &brief(&["missing.obj"]), &["missing.obj"]);
    fs::write(folder.path().join("panel.obj"), QUADS).unwrap();
    refuses(
        folder.path(),
        &brief(&["panel.obj", "-o", "."]),
        &["panel.obj", "overwritten"],
    );
    assert_eq!(
        fs::read_to_string(folder.path().join("panel.obj")).unwrap(),
        QUADS
    );
    fs::write(folder.path().join("file"), "").unwrap();
    refuses(folder.path(), &brief(&["-o", "file/out"]), &["file/out"]);
}

#[test]
fn bad_configurations_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let write = |text: &str| fs::write(folder.path().join("c.toml"), text).unwrap();
    let config = brief(&["--config", "c.toml"]);
    write("iteration = 3\n");
    refuses(folder.path(), &config, &["c.toml", "unknown key iteration"]);
    write("learning-rate = \"fast\"\n");
    refuses(folder.path(), &config, &["c.toml"]);
    write("[[[\n");
    refuses(folder.path(), &config, &["c.toml"]);
    write("[weights]\nwrap = nan\n");
    refuses(folder.path(), &config, &["weights"]);
    write("[networks]\nwidth = 4611686018427387904\n");
    refuses(folder.path(), &config, &["networks.width"]);
    refuses(
        folder.path(),
        &["unwrap", "--points", "18446744073709551615"],
        &["points"],
    );
    write("learning-rate = 7.0\n");
    refuses(folder.path(), &config, &["learning rates"]);
    refuses(folder.path(), &["unwrap", "--points", "3"], &["points"]);
    refuses(
        folder.path(),
        &["unwrap", "--iterations", "0"],
        &["iterations"],
    );
}

#[test]
fn training_that_diverges_writes_the_last_good_weights_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let wild = "learning-rate = 1.0\nfinal-learning-rate = 1.0\n";
    fs::write(folder.path().join("c.toml"), wild).unwrap();
    let arguments = [
        "unwrap",
        "-q",
        "--backend",
        "ndarray",
        "--iterations",
        "100",
        "--points",
        "150",
        "--config",
        "c.toml",
    ];
    let run = fam(folder.path(), &arguments);
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert_eq!(run.stderr.lines().count(), 1);
    assert!(run.stderr.contains("at iteration") && run.stderr.contains("last good"));
    assert!(folder.path().join("sample.fam/sample.obj").exists());
}

#[cfg(unix)]
#[test]
fn an_interrupt_still_writes_what_was_trained() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "unwrap",
        "--backend",
        "ndarray",
        "--iterations",
        "100000",
        "--points",
        "100",
    ];
    let mut child = Command::new(common::FAM)
        .current_dir(folder.path())
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    lines.find(|line| line.as_ref().unwrap().starts_with("1/"));
    let pid = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &pid])
            .status()
            .unwrap()
            .success()
    );
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(rest.iter().any(|line| line.starts_with("stopping: ")));
    assert!(rest.iter().any(|line| line.contains("--resume")));
    let out = folder.path().join("sample.fam");
    let metrics = json(&out.join("metrics.json"));
    let iterations = metrics["components"][0]["iterations"].as_u64().unwrap();
    assert!((1..100_000).contains(&iterations));
    assert!(
        fam_io::read_surface(out.join("sample.obj"))
            .unwrap()
            .uv_map()
            .is_some()
    );
    // Beside the results there is what the training can go on with.
    assert!(out.join("checkpoint.safetensors").exists());
    assert_eq!(fs::read_dir(&out).unwrap().count(), 9);
}

/// The plan is in config.toml and gives the same map again; what it takes is not looked at.
#[test]
fn a_time_budget_is_planned_and_can_be_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let sized = ["--points", "64", "--finish", "none", "-q"];
    let planned = [
        &["unwrap", "--time-budget", "1s", "-o", "planned"],
        &sized[..],
    ]
    .concat();
    succeeds(folder.path(), &planned);
    let config = fs::read_to_string(folder.path().join("planned/config.toml")).unwrap();
    let iterations = config
        .lines()
        .find_map(|line| line.strip_prefix("iterations = "));
    let iterations: usize = iterations.unwrap().parse().unwrap();
    assert!((50..=10_000).contains(&iterations), "{iterations}");
    let again = [
        "unwrap",
        "--config",
        "planned/config.toml",
        "-o",
        "again",
        "-q",
    ];
    succeeds(folder.path(), &again);
    let model = |name: &str| fs::read(folder.path().join(name).join("model.safetensors")).unwrap();
    assert_eq!(model("planned"), model("again"));

    for wrong in ["0s", "soon", "5d"] {
        let run = fam(folder.path(), &["unwrap", "--time-budget", wrong]);
        assert_eq!(run.code, Some(2));
        assert!(run.stderr.contains("--time-budget") && run.stderr.contains("30s"));
    }
    let both = ["unwrap", "--time-budget", "1s", "--iterations", "9"];
    let run = fam(folder.path(), &both);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("--iterations"));
}

#[test]
fn a_start_is_chosen_among_several() {
    let folder = tempfile::tempdir().unwrap();
    let sized = ["unwrap", "--points", "64", "--iterations", "40"];
    // 40 iterations of the map that is kept, 4 of every other start, and 6 more of one of them.
    for (starts, steps) in [("1", "40/40 "), ("3", "54/54 ")] {
        let more = ["--finish", "none", "--starts", starts, "-o", starts];
        let run = succeeds(folder.path(), &[&sized[..], &more].concat());
        let last = run.stderr.lines().any(|line| line.starts_with(steps));
        assert!(last, "{}", run.stderr);
        let metrics = json(&folder.path().join(starts).join("metrics.json"));
        assert_eq!(metrics["components"][0]["iterations"], 40);
    }
    refuses(folder.path(), &["unwrap", "--starts", "0"], &["starts"]);
}
