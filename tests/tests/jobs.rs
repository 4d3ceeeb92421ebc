//! `fam unwrap` of many files at once: `--jobs`, `--timeout`, `--shard`, manifests and `fam report`.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::{fam, refuses, succeeds, write_mesh};
use fam_surface::shapes;
use serde_json::Value;

/// Small meshes named a0.obj, a1.obj and so on.
fn write_some(folder: &Path, count: u32) {
    for number in 0..count {
        let mesh = shapes::torus(1.0, 0.3 + 0.01 * f64::from(number), 12, 8);
        write_mesh(&folder.join(format!("a{number}.obj")), &mesh);
    }
}

fn entries(manifest: &Path) -> Vec<Value> {
    let text = fs::read_to_string(manifest).unwrap();
    let entry = |line: &str| serde_json::from_str(line).unwrap();
    text.lines().map(entry).collect()
}

/// The state of every file in a manifest, by its name. The manifest has each of them once.
fn states(manifest: &Path) -> BTreeMap<String, String> {
    let mut states = BTreeMap::new();
    for entry in entries(manifest) {
        let text = |key: &str| entry[key].as_str().unwrap().to_string();
        let input = text("input");
        assert!(Path::new(&input).is_absolute());
        let name = input.rsplit('/').next().unwrap().to_string();
        let before = states.insert(name, text("state"));
        assert_eq!(before, None, "{entry}");
    }
    states
}

#[test]
fn files_at_once_give_the_same_results_as_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    write_some(&folder.path().join("in"), 5);
    fs::write(folder.path().join("in/broken.obj"), "v 0 0\n").unwrap();
    // What a killed run left of its results is no input.
    let torus = shapes::torus(1.0, 0.4, 12, 8);
    write_mesh(&folder.path().join("in/killed.fam/killed.obj"), &torus);
    for (out, jobs) in [("one", "1"), ("three", "3")] {
        let run = fam(folder.path(), &["unwrap", "in", "-o", out, "--jobs", jobs]);
        assert_eq!(run.code, Some(1), "{}", run.stderr);
        assert_eq!(run.stdout.lines().count(), 6, "{}", run.stdout);
        let last = run.stderr.lines().last();
        assert_eq!(last, Some("fam: 1 of 6 files failed"));
    }
    for number in 0..5 {
        for name in [format!("a{number}.obj"), String::from("seams.json")] {
            let read = |out: &str| {
                let path = format!("{out}/a{number}.fam/{name}");
                fs::read(folder.path().join(path)).unwrap()
            };
            assert!(read("one") == read("three"), "{name}");
        }
    }
    let manifest = folder.path().join("three/manifest.jsonl");
    let states = states(&manifest);
    assert_eq!(states.len(), 6);
    assert_eq!(states["broken.obj"], "failed");
    assert_eq!(states.values().filter(|state| *state == "done").count(), 5);
    for entry in entries(&manifest) {
        assert_eq!(entry["hash"].as_str().unwrap().len(), 64, "{entry}");
        assert!(entry["seconds"].as_f64().unwrap() > 0.0, "{entry}");
        let flips = &entry["metrics"]["mesh"]["flipped_triangles"];
        match entry["state"] == "done" {
            true => assert_eq!(*flips, 0),
            false => assert!(entry["message"].as_str().unwrap().contains("line 1")),
        }
    }
}

#[test]
fn shards_have_all_files_and_a_report_merges_them() {
    let folder = tempfile::tempdir().unwrap();
    write_some(&folder.path().join("in"), 5);
    fs::write(folder.path().join("in/broken.obj"), "v 0 0\n").unwrap();
    for shard in ["1/3", "2/3", "3/3"] {
        fam(
            folder.path(),
            &["unwrap", "in", "-o", "out", "--shard", shard, "-q"],
        );
    }
    let out = folder.path().join("out");
    let of_shard = |number: u32| states(&out.join(format!("manifest-{number}-of-3.jsonl")));
    assert_eq!([1, 2, 3].map(|number| of_shard(number).len()), [2, 2, 2]);
    let report = succeeds(folder.path(), &["report", "out"]).stdout;
    assert!(
        report.starts_with("6 files: 5 done, 1 failed\n"),
        "{report}"
    );
    assert!(report.contains("in/broken.obj"), "{report}");
    let merged = succeeds(folder.path(), &["report", "out", "--json"]).stdout;
    assert_eq!(merged.lines().count(), 6);

    // Mended and started again: the latest entry counts, and what is done is not done again.
    write_mesh(
        &folder.path().join("in/broken.obj"),
        &shapes::torus(1.0, 0.4, 12, 8),
    );
    for shard in ["1/3", "2/3", "3/3"] {
        let arguments = ["unwrap", "in", "-o", "out", "--shard", shard, "-q"];
        succeeds(folder.path(), &arguments);
    }
    let report = succeeds(folder.path(), &["report", "out"]).stdout;
    assert!(report.starts_with("6 files: 6 done\n"), "{report}");
    let lines: usize = (1..=3)
        .map(|number| entries(&out.join(format!("manifest-{number}-of-3.jsonl"))).len())
        .sum();
    assert_eq!(lines, 7);
    for (shard, reason) in [("4/3", "from 1/N to N/N"), ("slurm", "SLURM_ARRAY_TASK_ID")] {
        let run = fam(folder.path(), &["unwrap", "in", "--shard", shard]);
        assert_eq!(run.code, Some(2));
        assert!(run.stderr.contains(reason), "{}", run.stderr);
    }
    // A single file is in one shard, too.
    for (shard, is_done) in [("1/2", true), ("2/2", false)] {
        let arguments = ["unwrap", "in/a0.obj", "-o", shard, "--shard", shard, "-q"];
        succeeds(folder.path(), &arguments);
        assert_eq!(folder.path().join(shard).join("a0.fam").exists(), is_done);
    }
    refuses(
        folder.path(),
        &["unwrap", "in/a0*", "--seams", "/dev/null"],
        &["/dev/null", "regular file"],
    );
    refuses(
        folder.path(),
        &["report", "in/a0.obj"],
        &["in/a0.obj", "no manifest: line 1"],
    );
    refuses(
        folder.path(),
        &["report", "in"],
        &["in", "no manifest.jsonl"],
    );
}

/// Options reach the processes of all files, and files are told apart whatever their names are.
#[cfg(target_os = "linux")]
#[test]
fn a_batch_has_the_options_and_names_of_its_command_line() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = tempfile::tempdir().unwrap();
    let names: [&[u8]; 4] = [
        b"a.obj",
        b"line\nand\x1b[31mcolour.obj",
        b"\xfe.obj",
        b"\xff.obj",
    ];
    for name in names {
        let path = folder.path().join("in").join(OsStr::from_bytes(name));
        write_mesh(&path, &shapes::torus(1.0, 0.4, 12, 8));
    }
    fs::write(folder.path().join("margin.toml"), "finish.margin = 3.1\n").unwrap();
    let options = "--config margin.toml --resolution 512 --format ply --per-material --quiet";
    let options: Vec<&str> = options.split(' ').collect();
    let inputs = ["unwrap", "in", "./in/a.obj", "-o", "out"];
    let run = fam(folder.path(), &[&inputs[..], &options[..]].concat());
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let single = ["unwrap", "in/a.obj", "-o", "single"];
    succeeds(folder.path(), &[&single[..], &options[..]].concat());
    for name in ["a.ply", "config.toml"] {
        let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
        assert!(read("out/a.fam") == read("single"), "{name}");
    }

    let manifest = entries(&folder.path().join("out/manifest.jsonl"));
    let mut inputs: Vec<&str> = manifest
        .iter()
        .filter_map(|e| e["input"].as_str())
        .collect();
    inputs.sort_unstable();
    inputs.dedup();
    assert_eq!((manifest.len(), inputs.len()), (4, 4), "{inputs:?}");

    fs::remove_dir_all(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("in/line\nfeed.obj"), "v 0 0\n").unwrap();
    let run = fam(folder.path(), &["unwrap", "in", "-o", "out"]);
    assert_eq!(run.stdout.lines().count(), 5, "{}", run.stdout);
    let report = succeeds(folder.path(), &["report", "out"]).stdout;
    for text in [&run.stdout, &run.stderr, &report] {
        assert!(
            !text.contains('\u{1b}') && text.contains("line\\nfeed.obj"),
            "{text}"
        );
    }
}

/// What a process does that has no end: it waits at a pipe that nobody writes to.
#[cfg(unix)]
mod endless {
    use super::*;

    use std::path::PathBuf;
    use std::process::{Child, Command, Stdio};
    use std::thread::sleep;
    use std::time::Duration;

    fn pipe(folder: &Path, name: &str) -> PathBuf {
        let path = folder.join(name);
        assert!(
            Command::new("mkfifo")
                .arg(&path)
                .status()
                .unwrap()
                .success()
        );
        path
    }

    fn start(folder: &Path, arguments: &[&str]) -> Child {
        let mut command = Command::new(common::FAM);
        command.current_dir(folder).args(arguments);
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// The workers of a process.
    fn workers(parent: u32) -> Vec<String> {
        let listed = Command::new("pgrep")
            .args(["-P", &parent.to_string()])
            .output()
            .unwrap();
        let text = String::from_utf8(listed.stdout).unwrap();
        text.lines().map(str::to_string).collect()
    }

    /// Waits until something holds, for a minute at most.
    fn wait_until(mut holds: impl FnMut() -> bool) {
        for _ in 0..600 {
            if holds() {
                return;
            }
            sleep(Duration::from_millis(100));
        }
        panic!("it never held");
    }

    fn signal(name: &str, process: &str) {
        let sent = Command::new("kill").args([name, process]).status().unwrap();
        assert!(sent.success());
    }

    #[test]
    fn as_many_files_are_at_work_as_are_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.obj", "b.obj", "c.obj"] {
            pipe(folder.path(), name);
        }
        let arguments = ["unwrap", "a.obj", "b.obj", "c.obj", "--jobs", "2"];
        let mut parent = start(folder.path(), &arguments);
        wait_until(|| workers(parent.id()).len() == 2);
        sleep(Duration::from_secs(1));
        assert_eq!(workers(parent.id()).len(), 2);
        parent.kill().unwrap();
        parent.wait().unwrap();
    }

    #[test]
    fn a_file_without_end_is_given_up_and_the_others_are_done() {
        let folder = tempfile::tempdir().unwrap();
        write_some(&folder.path().join("in"), 3);
        pipe(folder.path(), "endless.obj");
        let arguments = ["unwrap", "in", "endless.obj", "-o", "out", "--jobs", "2"];
        let run = fam(
            folder.path(),
            &[&arguments[..], &["--timeout", "20s"]].concat(),
        );
        assert_eq!(run.code, Some(1), "{}", run.stderr);
        let states = states(&folder.path().join("out/manifest.jsonl"));
        assert_eq!(states["endless.obj"], "timed-out");
        assert_eq!(states.values().filter(|state| *state == "done").count(), 3);
        assert!(
            run.stdout.contains("not done within 20 s"),
            "{}",
            run.stdout
        );
        assert!(!folder.path().join("out/endless.fam").exists());

        // Alone, a file has its time as well.
        let run = fam(
            folder.path(),
            &["unwrap", "endless.obj", "--timeout", "0.5s"],
        );
        assert_eq!(run.code, Some(1));
        assert_eq!(
            run.stderr,
            "fam: endless.obj: not done within 0.5 s (--timeout)\n"
        );
    }

    #[test]
    fn a_file_that_takes_too_long_is_known_by_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let gltf = r#"{
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "buffers": [{"uri": "endless.bin", "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                           "min": [0, 0, 0], "max": [1, 1, 0]}]
        }"#;
        fs::create_dir(folder.path().join("in")).unwrap();
        fs::write(folder.path().join("in/a.gltf"), gltf).unwrap();
        pipe(&folder.path().join("in"), "endless.bin");
        let arguments = ["unwrap", "in", "-o", "out", "--timeout", "20s"];
        assert_eq!(fam(folder.path(), &arguments).code, Some(1));
        let entry = &entries(&folder.path().join("out/manifest.jsonl"))[0];
        assert_eq!(entry["state"], "timed-out");
        assert_eq!(entry["hash"].as_str().unwrap().len(), 64);
        assert!(!folder.path().join("out/a.fam").exists());
    }

    #[test]
    fn a_worker_that_is_killed_is_tried_again_and_then_named() {
        let folder = tempfile::tempdir().unwrap();
        write_some(&folder.path().join("in"), 3);
        pipe(folder.path(), "endless.obj");
        let arguments = ["unwrap", "in", "endless.obj", "-o", "out", "--jobs", "1"];
        let parent = start(folder.path(), &arguments);
        let manifest = folder.path().join("out/manifest.jsonl");
        wait_until(|| manifest.exists() && entries(&manifest).len() == 3);
        let mut killed: Vec<String> = Vec::new();
        while killed.len() < 2 {
            wait_until(|| {
                workers(parent.id())
                    .iter()
                    .any(|worker| !killed.contains(worker))
            });
            let worker = workers(parent.id()).pop().unwrap();
            signal("-KILL", &worker);
            killed.push(worker);
        }
        let output = parent.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            said.contains("it waits until more memory is free"),
            "{said}"
        );
        let states = states(&manifest);
        assert_eq!(
            (states.len(), states["endless.obj"].as_str()),
            (4, "failed")
        );
        let named = |entry: &Value| entry["message"].as_str().unwrap().contains("killed");
        assert!(entries(&manifest).iter().any(named));
    }

    #[test]
    fn after_an_end_in_the_middle_what_is_missing_is_done() {
        let folder = tempfile::tempdir().unwrap();
        write_some(&folder.path().join("in"), 6);
        let path = pipe(folder.path(), "endless.obj");
        let manifest = folder.path().join("out/manifest.jsonl");
        let arguments = ["unwrap", "in", "endless.obj", "-o", "out", "--jobs", "2"];
        let mut parent = start(folder.path(), &arguments);
        wait_until(|| manifest.exists() && !entries(&manifest).is_empty());
        let left = workers(parent.id());
        parent.kill().unwrap();
        parent.wait().unwrap();
        let runs = |worker: &String| Path::new("/proc").join(worker).join("exe").exists();
        wait_until(|| !left.iter().any(runs));
        for entry in fs::read_dir(folder.path().join("out")).unwrap() {
            let path = entry.unwrap().path();
            let is_whole = path.is_file() || path.join("metrics.json").exists();
            assert!(is_whole, "{}", path.display());
        }
        fs::remove_file(&path).unwrap();
        write_mesh(&path, &shapes::torus(1.0, 0.4, 12, 8));
        succeeds(folder.path(), &arguments);
        let done = entries(&manifest)
            .into_iter()
            .filter(|entry| entry["state"] == "done");
        let done: Vec<String> = done.map(|entry| entry["input"].to_string()).collect();
        assert_eq!(done.len(), 7, "{done:?}");
        let report = succeeds(folder.path(), &["report", "out"]).stdout;
        assert!(report.starts_with("7 files: 7 done\n"), "{report}");
    }

    #[test]
    fn an_interrupt_stops_all_workers_and_starts_no_others() {
        let folder = tempfile::tempdir().unwrap();
        let large = shapes::torus(1.0, 0.4, 300, 150);
        write_mesh(&folder.path().join("in/large.ply"), &large);
        write_some(&folder.path().join("in"), 2);
        let arguments = ["unwrap", "in", "-o", "out", "--jobs", "1"];
        let parent = start(folder.path(), &arguments);
        let large = folder.path().join("out/large.fam");
        // The folder is there once the file is read.
        wait_until(|| large.exists());
        signal("-INT", &parent.id().to_string());
        let output = parent.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        let states = states(&folder.path().join("out/manifest.jsonl"));
        assert_eq!(
            states,
            BTreeMap::from([("large.ply".into(), "interrupted".into())])
        );
        assert!(large.join("metrics.json").exists());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            said.matches("Ctrl-C again ends at once").count(),
            1,
            "{said}"
        );
    }
}
