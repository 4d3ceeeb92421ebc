//! What `fam unwrap` makes of the map that training ends with.

mod common;

use std::fs;
use std::path::Path;

use common::{brief, refuses, succeeds};
use fam_surface::Surface;
use fam_surface::metrics::seam_edges;
use serde_json::Value;

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_finished_layout_is_valid_and_cut_along_edges() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &brief(&["-q"]));
    let out = folder.path().join("sample.fam");
    let metrics = json(&out.join("metrics.json"));
    let (mesh, finish) = (&metrics["mesh"], &metrics["finish"]);
    assert_eq!(mesh["flipped_triangles"], 0);
    assert_eq!(mesh["overlapping_pairs"], 0);
    assert!(mesh["symmetric_dirichlet"].as_f64().unwrap() <= 4.101);
    assert_eq!(finish["charts"], mesh["charts"]);
    assert_eq!(
        finish["charts"],
        metrics["components"][0]["finish"]["charts"]
    );
    let close = |a: &Value, b: &Value| (a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-3;
    assert!(close(&finish["energy"], &mesh["symmetric_dirichlet"]));
    assert!(close(&finish["seam_length"], &mesh["seam_length"]));
    assert_eq!(finish["warnings"], serde_json::json!([]));

    let document = fam_io::read_surface(out.join("sample.obj")).unwrap();
    let Surface::Mesh(torus) = document.surface() else {
        panic!("a mesh");
    };
    let edges = seam_edges(torus, document.uv_map().unwrap()).unwrap();
    assert!(edges.len() > 80, "a closed torus is cut");
    let seams = json(&out.join("seams.json"));
    assert_eq!(seams["edges"], serde_json::json!(edges));
    assert_eq!(seams["thresholds"], serde_json::json!([null]));
    assert_eq!(metrics["torn_edges"], edges.len());
}

/// Assets that are laid out in seconds.
const ASSETS: [&str; 8] = [
    "bridged-holes.obj",
    "cable.obj",
    "double-sided.obj",
    "end-solid.stl",
    "octopus.obj",
    "ribbon.obj",
    "single-triangle.obj",
    "voxel-quads.obj",
];

/// The small models beside the repository, where they are present, awkward ones among them.
#[test]
fn small_models_get_valid_layouts() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/models");
    if !models.exists() {
        eprintln!("SKIPPED: no models beside the repository");
        return;
    }
    let hostile = ["cube", "double_triangles", "plane", "torus_with_holes"];
    let mut inputs: Vec<String> = hostile
        .iter()
        .map(|name| models.join(format!("hostile/{name}.obj")))
        .chain(ASSETS.iter().map(|name| models.join("assets").join(name)))
        .chain([models.join("suzanne.obj"), models.join("formats")])
        .map(|path| path.to_str().unwrap().to_string())
        .collect();
    inputs.push("-q".to_string());
    let folder = tempfile::tempdir().unwrap();
    let arguments: Vec<&str> = inputs.iter().map(String::as_str).collect();
    // Some files of the folder are refused.
    let run = common::fam(folder.path(), &brief(&arguments));
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let mut meshes = 0;
    let mut folders = vec![folder.path().to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.ends_with("metrics.json") {
                let metrics = json(&path);
                let mesh = &metrics["mesh"];
                if mesh.is_object() {
                    assert_eq!(mesh["flipped_triangles"], 0, "{}", path.display());
                    assert_eq!(mesh["overlapping_pairs"], 0, "{}", path.display());
                    assert_eq!(mesh["collapsed_triangles"], 0, "{}", path.display());
                    let energy = mesh["symmetric_dirichlet"].as_f64().unwrap();
                    assert!(energy <= 4.1, "{}: {energy}", path.display());
                    meshes += 1;
                }
            }
        }
    }
    assert!(meshes > 35, "{meshes}");
}

#[test]
fn what_is_not_finished_is_the_raw_map() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &brief(&["-q", "-o", "full"]));
    let none = ["-q", "-o", "none", "--finish", "none"];
    succeeds(folder.path(), &brief(&none));
    let report = |out: &str| json(&folder.path().join(out).join("metrics.json"));
    let (full, none) = (report("full"), report("none"));
    assert_eq!(full["raw"], none["mesh"]);
    assert!(none.get("raw").is_none() && none.get("finish").is_none());
    assert!(none["components"][0].get("finish").is_none());
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("full/model.safetensors") == read("none/model.safetensors"));
    let document = fam_io::read_surface(folder.path().join("none/sample.obj")).unwrap();
    let map = document.uv_map().unwrap();
    assert!(map.uvs().len() <= document.surface().positions().len() + 1);

    // A configuration that was written says so too, and one without the table finishes.
    let again = ["-q", "-o", "again", "--config", "none/config.toml"];
    succeeds(folder.path(), &brief(&again));
    assert!(read("again/sample.obj") == read("none/sample.obj"));
    let config = String::from_utf8(read("none/config.toml")).unwrap();
    let (old, _) = config.split_once("[finish]").unwrap();
    fs::write(folder.path().join("old.toml"), old).unwrap();
    let again = ["-q", "-o", "old", "--config", "old.toml"];
    succeeds(folder.path(), &brief(&again));
    assert!(read("old/sample.obj") == read("full/sample.obj"));
}

/// Where nothing else is printed: on standard error and in the report.
#[test]
fn a_bound_that_is_missed_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    // No cut is worth that much, and there may be only one chart.
    let run = succeeds(
        folder.path(),
        &brief(&["-q", "--seam-weight", "1000000", "--max-charts", "1"]),
    );
    let report = json(&folder.path().join("sample.fam/metrics.json"));
    let warnings = report["finish"]["warnings"].as_array().unwrap();
    let printed: Vec<String> = warnings
        .iter()
        .map(|warning| {
            format!(
                "warning: the built-in sample: {}",
                warning.as_str().unwrap()
            )
        })
        .collect();
    assert!(
        printed[0].contains("the energy is above the 4.1000"),
        "{printed:?}"
    );
    assert_eq!(run.stderr.lines().collect::<Vec<_>>(), printed);
    assert!(run.stdout.is_empty());
}

/// The layout is valid, and refined no more.
#[cfg(unix)]
#[test]
fn an_interrupt_while_finishing_still_writes_a_valid_layout() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    // So near to an isometry takes long.
    let mut child = Command::new(common::FAM)
        .current_dir(folder.path())
        .args(brief(&["--distortion-bound", "4.001"]))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    lines.find(|line| line.as_ref().unwrap().starts_with("finishing  "));
    let kill = ["-INT", &child.id().to_string()];
    assert!(Command::new("kill").args(kill).status().unwrap().success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(rest.iter().any(|line| line.starts_with("stopping: ")));
    let metrics = json(&folder.path().join("sample.fam/metrics.json"));
    assert_eq!(metrics["mesh"]["flipped_triangles"], 0);
    assert_eq!(metrics["mesh"]["overlapping_pairs"], 0);
    let warnings = &metrics["finish"]["warnings"];
    assert_eq!(warnings[0], "finishing was stopped early");
}

#[test]
fn options_reach_the_configuration_and_nonsense_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = "[finish]\nmargin = 2\nseam-weight = 0.5\n";
    fs::write(folder.path().join("c.toml"), file).unwrap();
    let options = [
        "-q",
        "--config",
        "c.toml",
        "--distortion-bound",
        "4.5",
        "--seam-weight",
        "2",
        "--max-charts",
        "3",
        "--resolution",
        "512",
        "--hide-seams=0.5",
        "--seen-from",
        "-z",
    ];
    succeeds(folder.path(), &brief(&options));
    let out = folder.path().join("sample.fam");
    let config: toml::Table =
        toml::from_str(&fs::read_to_string(out.join("config.toml")).unwrap()).unwrap();
    let expected: toml::Table = toml::from_str(
        "mode = \"full\"\ndistortion-bound = 4.5\nseam-weight = 2.0\nmax-charts = 3\n\
         margin = 2.0\nresolution = 512\nhide-seams = 0.5\nseen-from = [0.0, 0.0, -1.0]\n",
    )
    .unwrap();
    assert_eq!(config["finish"].as_table(), Some(&expected));
    let report = json(&out.join("metrics.json"));
    assert_eq!(report["finish"]["config"]["distortion-bound"], 4.5);

    for (option, value) in [
        ("--distortion-bound", "4"),
        ("--distortion-bound", "NaN"),
        ("--distortion-bound", "inf"),
        ("--seam-weight", "-1"),
        ("--seam-weight", "nan"),
        ("--hide-seams=-1", ""),
        ("--hide-seams=nan", ""),
        ("--max-charts", "0"),
        ("--margin", "-2"),
        ("--margin", "1e9"),
        ("--resolution", "0"),
    ] {
        let name = option.trim_start_matches('-').split('=').next();
        let arguments = ["unwrap", option, value];
        let given = arguments.iter().filter(|text| !text.is_empty());
        refuses(
            folder.path(),
            &given.copied().collect::<Vec<_>>(),
            &[name.unwrap()],
        );
    }
    fs::write(folder.path().join("c.toml"), "[finish]\nbound = 5\n").unwrap();
    let config = brief(&["--config", "c.toml"]);
    refuses(folder.path(), &config, &["unknown key finish.bound"]);
}

#[test]
fn a_batch_is_done_again_with_other_finishing() {
    let folder = tempfile::tempdir().unwrap();
    let sheets = folder.path().join("sheets");
    fs::create_dir(&sheets).unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n";
    fs::write(sheets.join("a.obj"), text).unwrap();
    let state = |options: &[&str]| {
        let arguments = [&["sheets", "-o", "out"], options].concat();
        let run = succeeds(folder.path(), &brief(&arguments));
        run.stdout.split_whitespace().nth(1).unwrap().to_string()
    };
    assert_eq!(state(&[]), "done");
    assert_eq!(state(&["--distortion-bound", "4.1"]), "skipped");
    assert_eq!(state(&["--distortion-bound", "4.2"]), "done");
    assert_eq!(state(&["--finish", "none"]), "done");
    assert_eq!(state(&["--finish", "none"]), "skipped");
}
