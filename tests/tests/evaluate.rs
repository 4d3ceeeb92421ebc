//! `fam evaluate`: the table of what training and finishing make of meshes.

mod common;

use std::fs;
use std::path::Path;

use common::{brief, fam, refuses, succeeds};
use serde_json::Value;

const EVALUATE: [&str; 6] = [
    "evaluate",
    "-q",
    "--backend",
    "ndarray",
    "--iterations",
    "2",
];

/// A bent sheet.
fn write_sheet(path: &Path) {
    let mut text = String::new();
    for i in 0..36 {
        let (x, y) = (f64::from(i % 6), f64::from(i / 6));
        text += &format!("v {x} {y} {}\n", 0.1 * x * x);
    }
    for i in (0..30).filter(|i| i % 6 < 5) {
        let [a, b, c, d] = [i + 1, i + 2, i + 8, i + 7];
        text += &format!("f {a} {b} {c} {d}\n");
    }
    fs::write(path, text).unwrap();
}

fn layouts(table: &str) -> Vec<[String; 2]> {
    let rows = table.lines().filter(|line| line.starts_with("| ")).skip(2);
    rows.map(|row| {
        let mut cells = row.split('|').skip(1).map(|cell| cell.trim().to_string());
        [0, 1].map(|_| cells.next().unwrap())
    })
    .collect()
}

#[test]
fn every_mesh_has_its_rows_and_a_failure_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let meshes = folder.path().join("meshes");
    fs::create_dir(&meshes).unwrap();
    write_sheet(&meshes.join("sheet.obj"));
    fs::write(meshes.join("broken.obj"), "v 0 0\n").unwrap();
    fs::write(meshes.join("cloud.xyz"), "0 0 0\n1 0 0\n0 1 0\n0 0 1\n").unwrap();
    let figures = "[[columns]]\ntitle = \"theirs\"\nsource = \"a book\"\nfigures.sheet = 0.5\n";
    fs::write(folder.path().join("r.toml"), figures).unwrap();
    let files = ["meshes", "-o", "table.md", "--reference", "r.toml"];
    let run = fam(
        folder.path(),
        &[&EVALUATE[..], &files, &["--json"]].concat(),
    );
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert_eq!(run.stderr.lines().last(), Some("fam: 2 of 3 meshes failed"));
    let table = fs::read_to_string(folder.path().join("table.md")).unwrap();
    let found = layouts(&table);
    let names: Vec<&str> = found.iter().map(|[name, _]| name.as_str()).collect();
    assert_eq!(
        names,
        ["broken", "cloud", "sheet", "sheet", "sheet", "sheet"]
    );
    assert!(found[0][1].starts_with("failed: ") && found[1][1].contains("point cloud"));
    let kinds: Vec<&str> = found[2..].iter().map(|[_, kind]| kind.as_str()).collect();
    assert_eq!(kinds, ["raw map", "finished", "direct", "bound 4.03"]);
    assert!(table.contains("*theirs*: a book") && table.contains(" 2 iterations"));

    let json: Value = serde_json::from_str(&run.stdout).unwrap();
    let sheet = &json["models"][2];
    assert!(sheet["training_seconds"].as_f64().unwrap() > 0.0);
    assert_eq!(sheet["reference"]["theirs"], 0.5);
    let rows = sheet["rows"].as_array().unwrap();
    assert!(rows[0]["finishing_seconds"].is_null() && rows[1]["finishing_seconds"].is_f64());
    assert_eq!(rows[3]["metrics"]["triangles"], 50);
}

#[test]
fn models_that_were_trained_before_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    write_sheet(&folder.path().join("sheet.obj"));
    let unwrap = ["sheet.obj", "-q", "--finish", "none", "-o", "out/sheet.fam"];
    succeeds(folder.path(), &brief(&unwrap));
    let evaluate = ["evaluate", "-q", "--backend", "ndarray", "--models"];
    let run = succeeds(
        folder.path(),
        &[&evaluate[..], &["out", "sheet.obj", "--json"]].concat(),
    );
    let json: Value = serde_json::from_str(&run.stdout).unwrap();
    let sheet = &json["models"][0];
    assert!(sheet["training_seconds"].is_null());
    let report = fs::read(folder.path().join("out/sheet.fam/metrics.json")).unwrap();
    let report: Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(sheet["rows"][0]["metrics"], report["mesh"]);

    let run = fam(
        folder.path(),
        &[&evaluate[..], &["nowhere", "sheet.obj"]].concat(),
    );
    assert_eq!(run.code, Some(1));
    assert!(layouts(&run.stdout)[0][1].contains("model.safetensors"));
}

#[test]
fn what_cannot_be_evaluated_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    write_sheet(&folder.path().join("sheet.obj"));
    let with = |more: &[&'static str]| [&EVALUATE[..], &["sheet.obj"], more].concat();
    refuses(
        folder.path(),
        &with(&["--reference", "none.toml"]),
        &["none.toml"],
    );
    fs::write(folder.path().join("r.toml"), "[[column]]\n").unwrap();
    refuses(
        folder.path(),
        &with(&["--reference", "r.toml"]),
        &["r.toml", "column"],
    );
    refuses(
        folder.path(),
        &with(&["-o", "none/table.md"]),
        &["none", "no folder"],
    );
    assert_eq!(fam(folder.path(), &["evaluate"]).code, Some(2));
}
