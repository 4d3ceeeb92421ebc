//! `--resume`: a training that was killed goes on, and ends in the same files.

mod common;

#[cfg(unix)]
mod killed {
    use super::common::{FAM, fam, refuses, succeeds, write_mesh};

    use std::fs;
    use std::path::Path;
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::Duration;

    use fam_surface::shapes;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Two parts, of which each has networks of its own. Their starts are compared, too.
    const TRAINING: &str = "--method neural --iterations 120 --points 300 --starts 3 --backend flex \
                            --checkpoint-every 0.02s --quiet --format ply";

    fn arguments<'a>(input: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        let mut arguments = vec!["unwrap", input, "-o", out];
        arguments.extend(TRAINING.split_whitespace());
        arguments.extend(more);
        arguments
    }

    fn write_parts(path: &Path) {
        let [torus, tube] = [
            shapes::torus(1.0, 0.4, 24, 12),
            shapes::open_cylinder(0.7, 2.0, 24, 12),
        ];
        let mut positions = torus.positions().to_vec();
        let first = positions.len() as u32;
        positions.extend(tube.positions().iter().map(|[x, y, z]| [x + 4.0, *y, *z]));
        let mut triangles = torus.triangles().to_vec();
        triangles.extend(tube.triangles().iter().map(|t| t.map(|v| v + first)));
        let both = fam_surface::TriangleMesh::new(positions, triangles).unwrap();
        write_mesh(path, &both);
    }

    /// How often a training is killed, at random moments; `FAM_KILLS` for more.
    fn kills() -> usize {
        let kills = std::env::var("FAM_KILLS").ok();
        kills.map_or(4, |kills| kills.parse().unwrap())
    }

    #[test]
    fn a_training_that_is_killed_goes_on_and_ends_in_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        write_parts(&folder.path().join("parts.obj"));
        succeeds(folder.path(), &arguments("parts.obj", "whole", &[]));
        let mut rng = Pcg64::seed_from_u64(7);
        let mut left = kills();
        for run in 0.. {
            if left == 0 {
                break;
            }
            let out = format!("killed-{run}");
            let checkpoint = folder.path().join(&out).join("checkpoint.safetensors");
            let more = ["--resume"];
            // Some kills for every run, so that runs that went on are killed as well.
            for _ in 0..left.min(4) {
                let mut child = Command::new(FAM)
                    .current_dir(folder.path())
                    .args(arguments("parts.obj", &out, &more))
                    .stderr(Stdio::null())
                    .spawn()
                    .unwrap();
                // Not before there is something to go on with.
                while !checkpoint.exists() && child.try_wait().unwrap().is_none() {
                    sleep(Duration::from_millis(5));
                }
                sleep(Duration::from_millis(rng.random_range(0..600)));
                child.kill().unwrap();
                child.wait().unwrap();
                left -= 1;
            }
            succeeds(folder.path(), &arguments("parts.obj", &out, &more));
            assert!(!checkpoint.exists());
            for name in [
                "parts.ply",
                "model.safetensors",
                "seams.json",
                "config.toml",
            ] {
                let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
                assert!(read(&out) == read("whole"), "{name} of {out}");
            }
        }
    }

    /// Ctrl-C while the first of two parts is trained: the second has hardly any training then.
    #[test]
    fn a_training_that_is_interrupted_goes_on_and_ends_in_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        write_parts(&folder.path().join("parts.obj"));
        succeeds(folder.path(), &arguments("parts.obj", "whole", &[]));
        let mut child = Command::new(FAM)
            .current_dir(folder.path())
            .args(arguments("parts.obj", "out", &[]))
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let checkpoint = folder.path().join("out/checkpoint.safetensors");
        while !checkpoint.exists() {
            sleep(Duration::from_millis(5));
        }
        let pid = child.id().to_string();
        Command::new("kill").args(["-INT", &pid]).status().unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert!(checkpoint.exists() && folder.path().join("out/metrics.json").exists());
        succeeds(folder.path(), &arguments("parts.obj", "out", &["--resume"]));
        for name in ["parts.ply", "model.safetensors"] {
            let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
            assert!(read("out") == read("whole"), "{name}");
        }
    }

    #[test]
    fn a_checkpoint_of_something_else_is_refused_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        write_parts(&folder.path().join("parts.obj"));
        let mut child = Command::new(FAM)
            .current_dir(folder.path())
            .args(arguments("parts.obj", "out", &[]))
            .spawn()
            .unwrap();
        let checkpoint = folder.path().join("out/checkpoint.safetensors");
        while !checkpoint.exists() {
            sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let other = arguments("parts.obj", "out", &["--resume", "--seed", "3"]);
        refuses(
            folder.path(),
            &other,
            &["checkpoint.safetensors", "other options"],
        );
        let kept = fs::read(&checkpoint).unwrap();
        fs::write(&checkpoint, &kept[..kept.len() / 2]).unwrap();
        let same = arguments("parts.obj", "out", &["--resume"]);
        refuses(
            folder.path(),
            &same,
            &["checkpoint.safetensors", "no valid safetensors"],
        );
        fs::write(&checkpoint, kept).unwrap();
        write_mesh(
            &folder.path().join("parts.obj"),
            &shapes::torus(1.0, 0.4, 24, 12),
        );
        refuses(
            folder.path(),
            &same,
            &["checkpoint.safetensors", "the input has changed"],
        );
        // Anew.
        let run = fam(folder.path(), &arguments("parts.obj", "out", &[]));
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert!(!checkpoint.exists());
    }
}
