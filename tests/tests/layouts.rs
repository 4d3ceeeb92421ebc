//! What can be asked of a layout, and what is done with UVs that are there.

mod common;

use std::fs;
use std::path::Path;

use common::{fam, refuses, succeeds};
use fam_surface::metrics::Metrics;
use fam_surface::{Surface, UvMap, shapes};
use serde_json::Value;

/// Three objects of two materials: a ball, a box and a smaller ball, far from each other.
fn write_parts(path: &Path) {
    let mut text = String::new();
    let mut first = 1;
    for (name, material, mesh, [scale, at]) in [
        ("ball", "skin", shapes::sphere(5), [1.0, 0.0]),
        ("box", "metal", shapes::cube(3), [1.0, 4.0]),
        ("bead", "skin", shapes::sphere(5), [0.5, 8.0]),
    ] {
        text += &format!("o {name}\nusemtl {material}\n");
        for [x, y, z] in mesh.positions() {
            text += &format!("v {} {} {}\n", scale * x + at, scale * y, scale * z);
        }
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|v| v + first);
            text += &format!("f {a} {b} {c}\n");
        }
        first += mesh.positions().len() as u32;
    }
    fs::write(path, text).unwrap();
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The UVs of a file, and the material of every triangle.
fn uvs(path: &Path) -> (UvMap, Vec<Option<u32>>) {
    let document = fam_io::read_surface(path).unwrap();
    let materials = document.labels().materials.clone();
    (document.uv_map().unwrap().clone(), materials)
}

fn metrics_of(path: &Path) -> Metrics {
    let document = fam_io::read_surface(path).unwrap();
    let Surface::Mesh(mesh) = document.surface() else {
        panic!("a mesh");
    };
    Metrics::measure(mesh, document.uv_map().unwrap()).unwrap()
}

#[test]
fn whatever_is_asked_for_the_layout_is_valid_and_config_toml_has_it() {
    let folder = tempfile::tempdir().unwrap();
    write_parts(&folder.path().join("parts.obj"));
    for (options, key) in [
        (&["--hide-seams=0.5"][..], "hide-seams = 0.5"),
        (&["--hard-angle", "80"], "hard-angle = 80"),
        (&["--crease-weight", "5"], "crease-weight = 5"),
        (&["--symmetry", "z"], "symmetry = \"z\""),
        (&["--symmetry", "0,0,2,0"], "[finish.symmetry.plane]"),
        (&["--stack", "identical"], "stack = \"identical\""),
        (&["--straighten", "--upright"], "straighten = true"),
        (&["--upright=-z"], "upright = [0.0, 0.0, -1.0]"),
        (&["--coverage-weight"], "coverage-weight = 1"),
        (&["--udim", "3", "--per-material"], "tiles = 3"),
        (
            &["--udim", "3", "--texel-density", "300"],
            "texel-density = 300",
        ),
        (&["--whole-texels", "--per-object"], "whole-texels = true"),
    ] {
        let out = folder.path().join("out");
        let arguments = [&["unwrap", "parts.obj", "-q", "-o", "out"], options].concat();
        succeeds(folder.path(), &arguments);
        let report = json(&out.join("metrics.json"));
        assert_eq!(report["mesh"]["flipped_triangles"], 0, "{options:?}");
        assert_eq!(report["mesh"]["overlapping_pairs"], 0, "{options:?}");
        assert_eq!(
            report["finish"]["warnings"],
            serde_json::json!([]),
            "{options:?}"
        );
        assert!(
            report["finish"]["energy"].as_f64().unwrap() <= 4.1,
            "{options:?}"
        );
        let config = fs::read_to_string(out.join("config.toml")).unwrap();
        assert!(config.contains(key), "{key} is not in {config}");
        // It reads back.
        let again = [
            "unwrap",
            "parts.obj",
            "-q",
            "-o",
            "again",
            "--config",
            "out/config.toml",
        ];
        let rest: Vec<&str> = options
            .iter()
            .copied()
            .filter(|option| option.starts_with("--per"))
            .collect();
        succeeds(folder.path(), &[&again, &rest[..]].concat());
        let files = ["out", "again"].map(|of| fs::read(folder.path().join(of).join("parts.obj")));
        let [one, other] = files.map(Result::unwrap);
        assert!(one == other, "{options:?}");
        fs::remove_dir_all(&out).unwrap();
    }
    for (options, words) in [
        (["--hard-angle", "0"], "hard-angle"),
        (["--symmetry", "0,0,0,1"], "symmetry must be"),
        (["--udim", "0"], "tiles"),
        (["--texel-density", "-3"], "texel-density"),
        (["--texel-density", "1e30"], "texel density"),
        (
            ["--weight", "hair=2"],
            "no material or object `hair`; there are skin, metal",
        ),
        (["--only", "hair"], "texture coordinates"),
        (["--paint", "_SEAMS"], "no attribute `_SEAMS`"),
    ] {
        let arguments = [&["unwrap", "parts.obj", "-q"], &options[..]].concat();
        refuses(folder.path(), &arguments, &[words]);
    }
    for option in [
        ["--symmetry", "w"],
        ["--upright=0,0,0", "-q"],
        ["--weight", "skin"],
        ["--paint", "=3"],
        ["--stack", "all"],
    ] {
        let run = fam(
            folder.path(),
            &[&["unwrap", "parts.obj"], &option[..]].concat(),
        );
        assert_eq!(run.code, Some(2), "{option:?}");
        let name = option[0].split('=').next().unwrap_or_default();
        assert!(run.stderr.contains(name), "{}", run.stderr);
    }
}

#[test]
fn materials_and_objects_have_tiles_and_densities() {
    let folder = tempfile::tempdir().unwrap();
    write_parts(&folder.path().join("parts.obj"));
    let unwrap = |options: &[&str]| {
        let arguments = [&["unwrap", "parts.obj", "-q", "-o", "out"], options].concat();
        succeeds(folder.path(), &arguments);
        uvs(&folder.path().join("out/parts.obj"))
    };
    let tile = |map: &UvMap, t: usize| map.corners(t).map(|q| q.map(|c| c as u32))[0];
    let (map, materials) = unwrap(&["--per-material", "--udim", "2"]);
    for (t, material) in materials.iter().enumerate() {
        assert_eq!(tile(&map, t), [material.unwrap(), 0]);
    }
    let told = &json(&folder.path().join("out/metrics.json"))["mesh"]["uv_coverage"];
    let found = metrics_of(&folder.path().join("out/parts.obj")).uv_coverage;
    assert!(
        (told.as_f64().unwrap() - found).abs() < 1e-9,
        "{told}, not {found}"
    );
    let density = |map: &UvMap, material: u32| {
        let document = fam_io::read_surface(folder.path().join("out/parts.obj")).unwrap();
        let Surface::Mesh(mesh) = document.surface() else {
            panic!("a mesh");
        };
        let own = (0..materials.len()).filter(|&t| materials[t] == Some(material));
        let areas = mesh.triangle_areas();
        let (in_plane, on_surface) = own.fold((0.0, 0.0), |(plane, surface), t| {
            let [a, b, c] = map.corners(t).map(|q| q.map(f64::from));
            let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
            (plane + area, surface + areas[t])
        });
        (in_plane / on_surface).sqrt()
    };
    let (map, _) = unwrap(&["--weight", "metal=2"]);
    let ratio = density(&map, 1) / density(&map, 0);
    assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
    let (map, _) = unwrap(&["--texel-density", "100"]);
    let finish = &json(&folder.path().join("out/metrics.json"))["finish"];
    let texels = finish["resolution"][0].as_f64().unwrap();
    assert!((density(&map, 0) * texels / 100.0 - 1.0).abs() < 0.05);
}

#[test]
fn what_stays_stays_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_parts(&path("parts.obj"));
    succeeds(folder.path(), &["unwrap", "parts.obj", "-q", "-o", "first"]);
    let (before, materials) = uvs(&path("first/parts.obj"));

    let only = [
        "unwrap",
        "first/parts.obj",
        "-q",
        "-o",
        "only",
        "--only",
        "metal",
    ];
    succeeds(
        folder.path(),
        &[&only[..], &["--hard-angle", "80"]].concat(),
    );
    let (after, _) = uvs(&path("only/parts.obj"));
    let mut changed = 0;
    for (t, material) in materials.iter().enumerate() {
        let is_same = before.corners(t) == after.corners(t);
        assert!(is_same || *material == Some(1), "triangle {t}");
        changed += usize::from(!is_same);
    }
    assert!(changed > 0);
    let metrics = metrics_of(&path("only/parts.obj"));
    assert_eq!(
        (metrics.flipped_triangles, metrics.overlapping_pairs),
        (0, 0)
    );
    assert_eq!(metrics.charts, 2 + 6, "two balls, and the faces of a box");

    // All is fine already.
    let improve = ["unwrap", "first/parts.obj", "-q", "-o", "same", "--improve"];
    succeeds(folder.path(), &improve);
    let (same, _) = uvs(&path("same/parts.obj"));
    assert!((0..materials.len()).all(|t| same.corners(t) == before.corners(t)));

    // One object is stretched.
    let document = fam_io::read_surface(path("first/parts.obj")).unwrap();
    let objects = &document.labels().objects;
    let corners: Vec<[f32; 2]> = (0..objects.len())
        .flat_map(|t| {
            let factor = if objects[t] == objects[0] { 0.5 } else { 1.0 };
            before.corners(t).map(|[u, v]| [u, factor * v])
        })
        .collect();
    let stretched = UvMap::of_corners(&corners).unwrap();
    let options = fam_io::WriteOptions::default();
    document
        .write_mesh_uvs(&stretched, path("stretched.obj"), &options)
        .unwrap();
    succeeds(
        folder.path(),
        &["unwrap", "stretched.obj", "-q", "-o", "better", "--improve"],
    );
    let (better, _) = uvs(&path("better/stretched.obj"));
    for (t, object) in objects.iter().enumerate() {
        let is_same = better.corners(t) == stretched.corners(t);
        assert!(is_same || *object == objects[0], "triangle {t}");
    }
    let metrics = metrics_of(&path("better/stretched.obj"));
    assert_eq!(
        (metrics.flipped_triangles, metrics.overlapping_pairs),
        (0, 0)
    );
    assert_eq!(metrics.charts, metrics_of(&path("first/parts.obj")).charts);
    assert!(
        metrics.symmetric_dirichlet < 4.2,
        "{}",
        metrics.symmetric_dirichlet
    );

    let keep = [
        "unwrap",
        "only/parts.obj",
        "-q",
        "-o",
        "kept",
        "--keep-seams",
    ];
    succeeds(folder.path(), &keep);
    assert_eq!(metrics_of(&path("kept/parts.obj")).charts, 2 + 6);
    let neural = [&only[..], &["--method", "neural"]].concat();
    refuses(folder.path(), &neural, &["direct method"]);
}

#[test]
fn painted_and_selected_vertices_count() {
    let folder = tempfile::tempdir().unwrap();
    let cylinder = shapes::open_cylinder(1.0, 2.0, 24, 6);
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nproperty float seams\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        cylinder.positions().len(),
        cylinder.triangles().len()
    );
    for [x, y, z] in cylinder.positions() {
        let paint = u8::from(x * 0.6 + y * 0.8 < 0.9);
        ply += &format!("{x} {y} {z} {paint}\n");
    }
    for [a, b, c] in cylinder.triangles() {
        ply += &format!("3 {a} {b} {c}\n");
    }
    fs::write(folder.path().join("can.ply"), ply).unwrap();
    succeeds(
        folder.path(),
        &["unwrap", "can.ply", "-q", "-o", "out", "--paint", "seams=2"],
    );
    let seams = json(&folder.path().join("out/seams.json"));
    let edges = seams["edges"].as_array().unwrap();
    assert!(!edges.is_empty());
    for v in edges.iter().flat_map(|edge| edge.as_array().unwrap()) {
        let [x, y, _] = cylinder.positions()[v.as_u64().unwrap() as usize];
        assert!(x * 0.6 + y * 0.8 > 0.89);
    }
    let selected = [
        "unwrap",
        "out/can.ply",
        "-q",
        "-o",
        "part",
        "--selected",
        "seams",
    ];
    succeeds(folder.path(), &selected);
    let [(before, _), (after, _)] =
        ["out", "part"].map(|of| uvs(&folder.path().join(of).join("can.ply")));
    let is_painted = |t: usize| {
        let corners = cylinder.corners(t);
        corners.iter().all(|[x, y, _]| x * 0.6 + y * 0.8 < 0.9)
    };
    let count = cylinder.triangles().len();
    assert!((0..count).all(|t| is_painted(t) || before.corners(t) == after.corners(t)));
    assert!((0..count).any(|t| before.corners(t) != after.corners(t)));
    assert_eq!(
        metrics_of(&folder.path().join("part/can.ply")).overlapping_pairs,
        0
    );
    refuses(
        folder.path(),
        &["unwrap", "can.ply", "-q", "--selected", "seams"],
        &["texture coordinates", "--selected"],
    );
}

#[test]
fn charts_are_packed_anew() {
    let folder = tempfile::tempdir().unwrap();
    // Two squares on one place, one of them mirrored.
    let quads = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 5\nv 2 0 5\nv 2 2 5\nv 0 2 5\n\
                 vt 0 0\nvt 0.5 0\nvt 0.5 0.5\nvt 0 0.5\nvt 0.6 0\nvt 0.1 0\nvt 0.1 0.5\nvt 0.6 0.5\n\
                 usemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf 5/5 6/6 7/7 8/8\n";
    fs::write(folder.path().join("quads.obj"), quads).unwrap();
    let done = succeeds(
        folder.path(),
        &[
            "pack",
            "quads.obj",
            "-o",
            "packed.obj",
            "--json",
            "--margin",
            "2",
        ],
    );
    assert!(done.stderr.contains("material \"b\"") && done.stderr.contains("mirrored"));
    let summary: Value = serde_json::from_str(&done.stdout).unwrap();
    assert_eq!(summary["squares"][0]["charts"], 2);
    assert_eq!(summary["squares"][0]["margin"], 2.0);
    let metrics = metrics_of(&folder.path().join("packed.obj"));
    assert_eq!(metrics.overlapping_pairs, 0);
    let sides = |name: &str| {
        let (map, _) = uvs(&folder.path().join(name));
        [0, 2].map(|t| {
            let [a, b, _] = map.corners(t).map(|q| q.map(f64::from));
            (a[0] - b[0]).hypot(a[1] - b[1])
        })
    };
    let [one, other] = sides("packed.obj");
    assert!((one / other - 1.0).abs() < 1e-3, "they keep their sizes");
    let dense = [
        "pack",
        "quads.obj",
        "-o",
        "dense.glb",
        "--texel-density",
        "100",
    ];
    let told = succeeds(folder.path(), &dense).stderr;
    assert!(told.contains("2 charts cover"), "{told}");
    let [one, other] = sides("dense.glb");
    assert!(
        (other / one - 2.0).abs() < 1e-3,
        "they have the same density"
    );
    // A chart of two materials, and one of a third.
    let mixed = quads.replace("usemtl b", "usemtl c").replace(
        "f 1/1 2/2 3/3 4/4",
        "f 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4",
    );
    fs::write(folder.path().join("mixed.obj"), mixed).unwrap();
    for (input, options, expected) in [
        ("quads.obj", &["--weight", "b=3"][..], 3.0),
        ("quads.obj", &["--weight", "a=2", "--weight", "b=0.5"], 0.25),
        (
            "quads.obj",
            &["--weight", "b=3", "--texel-density", "50"],
            6.0,
        ),
        // The two are in squares of their own.
        ("quads.obj", &["--weight", "b=3", "--per-material"], 1.0),
        ("mixed.obj", &["--weight", "b=2"], 0.5),
        ("mixed.obj", &["--weight", "b=0.5"], 1.0),
    ] {
        let pack = ["pack", input, "-o", "weighted.obj"];
        succeeds(folder.path(), &[&pack[..], options].concat());
        let [one, other] = sides("weighted.obj");
        let found = other / one;
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "{options:?}: {found}"
        );
    }

    fs::write(folder.path().join("more.obj"), quads).unwrap();
    let both = [
        "pack",
        "quads.obj",
        "more.obj",
        "-o",
        "both",
        "--turns",
        "none",
    ];
    succeeds(folder.path(), &both);
    let maps = ["quads.obj", "more.obj"].map(|name| uvs(&folder.path().join("both").join(name)).0);
    let corners: Vec<[f32; 2]> = maps
        .iter()
        .flat_map(|map| (0..4).flat_map(|t| map.corners(t)).collect::<Vec<_>>())
        .collect();
    let mut overlapping = 0;
    let all = UvMap::of_corners(&corners).unwrap();
    fam_surface::metrics::for_each_overlapping_pair(&all, |_| overlapping += 1);
    assert_eq!(overlapping, 0, "they share one square");

    let tiles = [
        "pack",
        "quads.obj",
        "-o",
        "tiles.obj",
        "--per-material",
        "--udim",
        "2",
    ];
    succeeds(folder.path(), &tiles);
    let (map, _) = uvs(&folder.path().join("tiles.obj"));
    assert_eq!([0, 2].map(|t| map.corners(t)[0][0] as u32), [0, 1]);

    let bare = quads.lines().filter(|line| !line.starts_with("vt"));
    fs::write(
        folder.path().join("bare.obj"),
        bare.collect::<Vec<_>>().join("\n"),
    )
    .unwrap();
    for (arguments, words) in [
        (
            &["pack", "bare.obj", "-o", "o.obj"][..],
            "bare.obj: it has no texture",
        ),
        (&["pack", "none.obj", "-o", "o.obj"], "none.obj"),
        (
            &["pack", "quads.obj", "-o", "o.obj", "--margin", "-1"],
            "margin must lie",
        ),
        (
            &["pack", "quads.obj", "-o", "o.obj", "--weight", "c=2"],
            "quads.obj: there is no material or object `c`",
        ),
        (
            &["pack", "quads.obj", "quads.obj", "-o", "both"],
            "would be one file",
        ),
        (
            &[
                "pack",
                "quads.obj",
                "-o",
                "o.obj",
                "--texel-density",
                "5000",
                "--udim",
                "2",
            ],
            "needs a tile of",
        ),
    ] {
        refuses(folder.path(), arguments, &[words]);
    }
}

#[test]
fn metrics_say_what_an_engine_would_complain_about() {
    let folder = tempfile::tempdir().unwrap();
    write_parts(&folder.path().join("parts.obj"));
    succeeds(folder.path(), &["unwrap", "parts.obj", "-q", "-o", "out"]);
    for purpose in ["texture", "lightmap"] {
        let done = succeeds(
            folder.path(),
            &["metrics", "out/parts.obj", "--for", purpose],
        );
        let fine = format!("as a {purpose}: nothing to complain about");
        assert!(done.stdout.contains(&fine), "{}", done.stdout);
    }
    let near = [
        "metrics",
        "out/parts.obj",
        "--for",
        "lightmap",
        "--margin",
        "200",
    ];
    let found = fam(folder.path(), &near);
    assert_eq!(found.code, Some(1));
    assert!(
        found.stdout.contains("nearer than 200 texels"),
        "{}",
        found.stdout
    );
    let found = fam(folder.path(), &[&near[..], &["--json"]].concat());
    assert_eq!(found.code, Some(1));
    let printed: Value = serde_json::from_str(&found.stdout).unwrap();
    assert_eq!(printed["findings"][0]["kind"], "near");
    refuses(
        folder.path(),
        &[
            "metrics",
            "out/parts.obj",
            "--for",
            "lightmap",
            "--margin",
            "-1",
        ],
        &["margin must lie"],
    );
    let without = fam(
        folder.path(),
        &["metrics", "out/parts.obj", "--margin", "2"],
    );
    assert_eq!(without.code, Some(2));
    assert!(without.stderr.contains("--for"), "{}", without.stderr);
}
