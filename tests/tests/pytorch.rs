//! `fam import` and `fam export`: weights of the authors' PyTorch program.

mod common;

use std::fs;
use std::path::Path;

use common::{brief, fam, refuses, succeeds, write_mesh};
use fam_surface::shapes;

/// UVs of the vertices of a mesh by a model, as the lines of an OBJ file.
fn uvs(folder: &Path, model: &str) -> Vec<[f64; 2]> {
    let arguments = ["map", "--model", model, "torus.obj", "-o", "mapped.obj"];
    succeeds(folder, &arguments);
    let text = fs::read_to_string(folder.join("mapped.obj")).unwrap();
    let line = |line: &str| {
        let mut numbers = line
            .strip_prefix("vt ")?
            .split(' ')
            .map(|n| n.parse().unwrap());
        Some([numbers.next()?, numbers.next()?])
    };
    text.lines().filter_map(line).collect()
}

#[test]
fn weights_go_to_pytorch_and_come_back() {
    let folder = tempfile::tempdir().unwrap();
    write_mesh(
        &folder.path().join("torus.obj"),
        &shapes::torus(1.0, 0.4, 12, 8),
    );
    succeeds(folder.path(), &brief(&["torus.obj", "-o", "out"]));
    let model = "out/model.safetensors";
    succeeds(folder.path(), &["export", model, "-o", "weights.pth"]);
    // With the surface, it is the same map again.
    let import = [
        "import",
        "weights.pth",
        "-o",
        "back.safetensors",
        "--surface",
        "torus.obj",
    ];
    succeeds(folder.path(), &import);
    let (before, after) = (
        uvs(folder.path(), model),
        uvs(folder.path(), "back.safetensors"),
    );
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        let difference = (before[0] - after[0])
            .abs()
            .max((before[1] - after[1]).abs());
        assert!(difference < 1e-4, "{before:?} {after:?}");
    }
    // Without, its weights are.
    let import = ["import", "weights.pth", "-o", "unit.safetensors"];
    succeeds(folder.path(), &import);
    succeeds(
        folder.path(),
        &["export", "unit.safetensors", "-o", "again.pth"],
    );
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("weights.pth") == read("again.pth"));
}

#[test]
fn other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("text.pth"), "no archive").unwrap();
    let import = |name| ["import", name, "-o", "model.safetensors"];
    refuses(
        folder.path(),
        &import("text.pth"),
        &["text.pth", "no file of PyTorch"],
    );
    refuses(folder.path(), &import("missing.pth"), &["missing.pth"]);
    fs::write(folder.path().join("text.safetensors"), "no tensors").unwrap();
    refuses(
        folder.path(),
        &import("text.safetensors"),
        &["text.safetensors", "no valid"],
    );
    fs::write(folder.path().join("point.obj"), "v 0 0 0\n").unwrap();
    write_mesh(
        &folder.path().join("torus.obj"),
        &shapes::torus(1.0, 0.4, 12, 8),
    );
    succeeds(folder.path(), &brief(&["torus.obj", "-o", "out"]));
    succeeds(
        folder.path(),
        &["export", "out/model.safetensors", "-o", "good.pth"],
    );
    let at_a_point = [&import("good.pth")[..], &["--surface", "point.obj"]].concat();
    refuses(folder.path(), &at_a_point, &["point.obj"]);
    let export = ["export", "text.safetensors", "-o", "weights.pth"];
    refuses(folder.path(), &export, &["text.safetensors"]);
    assert!(!folder.path().join("weights.pth").exists());
    let help = fam(folder.path(), &["import", "--help"]);
    assert!(help.stdout.contains("torch.save"), "{}", help.stdout);
}
