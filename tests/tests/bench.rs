//! `fam bench`: the backends are compared, and compute the same.

mod common;

use std::path::Path;

use common::{fam, succeeds};
use serde_json::Value;

#[test]
fn backends_on_the_cpu_end_with_the_same_loss() {
    let backends = [
        "bench",
        "--backends",
        "flex,ndarray",
        "--steps",
        "2",
        "--json",
    ];
    let run = succeeds(Path::new("."), &backends);
    let found: Value = serde_json::from_str(&run.stdout).unwrap();
    assert!(
        found["machine"]
            .as_str()
            .is_some_and(|text| !text.is_empty())
    );
    let measured = found["backends"].as_array().unwrap();
    let names: Vec<&str> = measured
        .iter()
        .map(|m| m["backend"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["flex (CPU)", "ndarray (CPU)"]);
    let number = |m: &Value, key: &str| m[key].as_f64().unwrap();
    for m in measured {
        for key in ["step", "forward", "jacobian", "neighbors", "backward"] {
            assert!(number(m, key) > 0.0, "{key} of {m}");
        }
        for key in ["points_per_second", "gflops", "product_gflops", "loss"] {
            assert!(number(m, key) > 0.0, "{key} of {m}");
        }
        let differences = ["losses", "optimizer"];
        assert!(differences.iter().all(|part| number(m, part) >= 0.0));
        if cfg!(target_os = "linux") {
            assert!(number(m, "peak_memory_mib") > 10.0);
        }
    }
    let [flex, ndarray] = [0, 1].map(|i| number(&measured[i], "loss"));
    assert!(
        (flex - ndarray).abs() < 1e-4 * ndarray,
        "{flex} against {ndarray}"
    );
}

#[test]
fn both_jacobian_modes_are_measured_and_end_with_the_same_loss() {
    let measured = |mode: &str| {
        let bench = [
            "bench",
            "--backends",
            "flex",
            "--steps",
            "1",
            "--json",
            "--jacobian",
            mode,
        ];
        let run = succeeds(Path::new("."), &bench);
        let found: Value = serde_json::from_str(&run.stdout).unwrap();
        let one = &found["backends"][0];
        ["jacobian", "loss"].map(|key| one[key].as_f64().unwrap())
    };
    let [double, loss] = measured("double-backward");
    let [tangents, same] = measured("forward-tangent");
    assert!(double > 0.0 && tangents > 0.0);
    assert!((loss - same).abs() < 1e-3 * same, "{loss} against {same}");
}

#[test]
fn the_table_has_a_row_for_every_backend() {
    let bench = ["bench", "--backends", "ndarray,flex", "--steps", "1"];
    let run = succeeds(Path::new("."), &bench);
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert!(lines[0].starts_with("backend") && lines[0].contains("Jacobian"));
    assert!(lines[1].starts_with("ndarray (CPU)") && lines[2].starts_with("flex (CPU)"));
    assert_eq!(lines.len(), 4);
}

#[test]
fn what_cannot_be_measured_is_a_usage_error() {
    for arguments in [["--steps", "0"], ["--backends", "abacus"]] {
        let bench = [&["bench"], arguments.as_slice()].concat();
        assert_eq!(fam(Path::new("."), &bench).code, Some(2));
    }
}
