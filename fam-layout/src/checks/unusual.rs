//! Input that no one hopes for.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::{Task, breaking_off, moved, together};
use crate::{LayoutConfig, Progress, Stage};
use fam_surface::TriangleMesh;
use fam_surface::shapes::{cube, moebius_strip, open_cylinder, rectangle, sphere, torus};

fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriangleMesh {
    TriangleMesh::new(positions.to_vec(), triangles.to_vec()).unwrap()
}

const SQUARE: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

#[test]
fn a_few_triangles_lie_flat() {
    let lone = mesh(&SQUARE, &[[0, 1, 2]]);
    let two = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
    let opposed = mesh(&SQUARE, &[[0, 1, 2], [0, 3, 2]]);
    let folded = moved(&two, |&[x, y, _]| [x.max(y), x.min(y), 0.0]);
    for mesh in [lone, two, opposed, folded] {
        let outcome = Task::default().run(&mesh);
        outcome.check_energy();
        assert_eq!((outcome.charts(), outcome.seam_length()), (1, 0.0));
        assert!(outcome.energy() < 4.0001, "{}", outcome.energy());
    }
    let tetrahedron = mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    );
    let outcome = Task::default().run(&tetrahedron);
    outcome.check_energy();
    assert_eq!(outcome.charts(), 1);
    assert!(outcome.energy() < 4.1, "{}", outcome.energy());
}

#[test]
fn slivers_have_a_place() {
    for thickness in [1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 0.0] {
        let near = [0.5, thickness, 0.0];
        let points = [SQUARE[0], SQUARE[1], near, SQUARE[2]];
        Task::default().run(&mesh(&points, &[[0, 1, 2]]));
        let outcome = Task::default().run(&mesh(&points, &[[0, 1, 2], [1, 3, 2], [3, 0, 2]]));
        assert_eq!((outcome.charts(), outcome.seam_length()), (1, 0.0));
        // A needle: two of its corners are next to each other.
        let tip = [1.0, thickness, 0.0];
        let points = [SQUARE[0], SQUARE[1], tip, SQUARE[3]];
        let outcome = Task::default().run(&mesh(&points, &[[0, 1, 2], [0, 2, 3]]));
        assert_eq!(outcome.charts(), 1);
    }
}

/// However thin, it is as long beside another component as on the surface.
#[test]
fn slivers_keep_their_proportion() {
    for thickness in [1e-3, 1e-9, 1e-13, 1e-15, 0.0] {
        let tip = [5.5, thickness, 0.0];
        let sliver = mesh(&[[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], tip], &[[0, 1, 2]]);
        let outcome = Task::default().run(&together(&[rectangle(1.0, 1.0, 2, 2), sliver]));
        let side = |component: usize| {
            let [a, b, _] = outcome.atlas.components[component].uvs.corners(0);
            (b[0] - a[0]).hypot(b[1] - a[1])
        };
        let ratio = side(1) / side(0);
        assert!((ratio - 2.0).abs() < 1e-2, "{ratio} at {thickness}");
    }
}

/// Rows of vertices on one line, rows of triangles without area, all of them without area.
#[test]
fn triangles_without_area_have_a_place() {
    let pressed = |row: f64| {
        moved(&rectangle(1.0, 1.0, 8, 8), |&[x, y, z]| {
            [x, if y.abs() < row { 0.0 } else { y }, z + 1e-3 * x]
        })
    };
    let pinched = moved(&open_cylinder(0.5, 2.0, 10, 8), |&[x, y, z]| {
        let width = if z.abs() < 0.4 { 0.0 } else { 1.0 };
        [width * x, y, z]
    });
    for mesh in [pressed(0.2), pressed(0.4), pinched] {
        Task::default().run(&mesh);
    }
    for line in [[1.0, 0.0, 0.0], [1e-3, 5.0, 7.0]] {
        let collinear = moved(&torus(1.0, 0.4, 8, 5), |&[x, y, z]| {
            let along = x + 0.31 * y + 0.17 * z;
            line.map(|c| c * along)
        });
        Task::default().run(&collinear);
    }
}

#[test]
fn any_unit_of_length_will_do() {
    let of = |unit: f64| Task::default().run(&moved(&sphere(4), |p| p.map(|c| c * unit)));
    let one = of(1.0);
    assert!(one.energy() <= 4.1, "{}", one.energy());
    for power in [2.0_f64, 500.0, -500.0] {
        let unit = power.exp2();
        let outcome = of(unit);
        assert_eq!(outcome.atlas.components[0].uvs, one.atlas.components[0].uvs);
        assert_eq!(outcome.seam_length(), one.seam_length() * unit);
        assert_eq!(outcome.energy(), one.energy());
    }
    let outcome = of(1e150);
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    // Where squares of lengths are out of range.
    for power in [990.0_f64, -990.0] {
        let huge = moved(&sphere(4), |p| p.map(|c| c * power.exp2()));
        let outcome = Task::default().run_unchecked(&huge);
        assert_eq!(outcome.seam_length(), one.seam_length() * power.exp2());
        let [told, expected] = [&outcome, &one].map(|o| o.atlas.relative_seam_length());
        assert_eq!(told, expected);
        assert_eq!(outcome.atlas.energy(), one.atlas.energy());
        let measured = outcome.metrics().seam_length;
        assert!(
            (measured / told - 1.0).abs() < 1e-3,
            "{measured} and {told}"
        );
    }
    let far = moved(&sphere(4), |p| p.map(|c| c + 1e9));
    assert!(Task::default().run(&far).energy() <= 4.1);
    for size in [1e-2, 1e-4] {
        let small = moved(&cube(2), |p| p.map(|c| 5.0 + c * size));
        Task::default().run(&together(&[sphere(3), small]));
    }
}

/// There is no room in single precision for the small one; it does no harm to the large one.
#[test]
fn a_speck_beside_a_world() {
    let mesh = together(&[
        moved(&sphere(3), |p| p.map(|c| c * 1e150)),
        moved(&cube(2), |p| p.map(|c| c * 1e-150)),
    ]);
    let outcome = Task::default().run_unchecked(&mesh);
    let metrics = outcome.metrics();
    assert_eq!(
        (metrics.flipped_triangles, metrics.overlapping_pairs),
        (0, 0)
    );
    assert!(outcome.atlas.components[0].distortion.energy <= 4.1);
    let alone = Task::default().run(&moved(&sphere(3), |p| p.map(|c| c * 1e150)));
    assert!(outcome.atlas.squares[0].coverage > 0.5 * alone.atlas.squares[0].coverage);
}

#[test]
fn nonsense_from_the_network_does_no_harm() {
    let huge = |p: [f64; 3]| p.map(|c| c as f32 * 1e38);
    let noise = |p: [f64; 3]| [0, 1].map(|k| (1e4 * (p[k] + 0.3 * p[2])).sin() as f32);
    let raws: [&(dyn Fn([f64; 3]) -> [f32; 2] + Sync); 4] =
        [&|_| [0.0; 2], &|p| [huge(p)[0], huge(p)[1]], &noise, &|p| {
            [if p[0] > 0.0 { f32::MAX } else { f32::MIN }, 0.0]
        }];
    for raw in raws {
        let task = Task {
            map: Some(raw),
            ..Task::default()
        };
        let outcome = task.run(&torus(1.0, 0.4, 16, 9));
        outcome.check_energy();
        assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    }
}

/// Of any size, mirrored, sheared: a sheet comes out as it is.
#[test]
fn a_faithful_map_in_any_guise_is_taken() {
    let sheet = rectangle(1.0, 2.0, 6, 12);
    let (one, large, small) = (1.0, 1e37, 1e-37);
    for [a, b, c, d] in [
        [one, 0.0, 0.0, one],
        [-one, 0.0, 0.0, one],
        [large, 0.0, 0.0, -large],
        [small, 0.0, 0.0, small],
        [one, 30.0, 0.0, one],
    ] {
        let linear = |p: [f64; 3]| [(a * p[0] + b * p[1]) as f32, (c * p[0] + d * p[1]) as f32];
        let task = Task {
            map: Some(&linear),
            ..Task::default()
        };
        let outcome = task.run(&sheet);
        outcome.check_energy();
        assert_eq!((outcome.charts(), outcome.seam_length()), (1, 0.0));
        assert!(outcome.energy() < 4.001, "{}", outcome.energy());
        for t in 0..sheet.triangles().len() {
            assert!(super::doubled_area(outcome.uv.corners(t)) > 0.0);
        }
    }
}

#[test]
fn one_chart_if_no_more_are_allowed() {
    for bound in [4.0001, 4.1] {
        let mut task = Task::within(bound);
        task.config.max_charts = Some(1);
        let outcome = task.run(&sphere(5));
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
    }
}

/// What there is then is valid, and as good as its energy says.
#[test]
fn finishing_can_be_broken_off() {
    for mesh in [
        sphere(6),
        torus(1.0, 0.4, 20, 10),
        moebius_strip(0.4, 30, 4),
    ] {
        let energies: Vec<f64> = [0, 1, 20, 100]
            .map(|rounds| {
                let seen = AtomicUsize::new(0);
                let task = Task {
                    observe: &breaking_off(rounds, &seen),
                    ..Task::default()
                };
                let outcome = task.run(&mesh);
                outcome.check_energy();
                assert_eq!(outcome.charts(), 1);
                assert!(
                    seen.load(Ordering::Relaxed) <= rounds + 1,
                    "asked again after the end"
                );
                outcome.energy()
            })
            .to_vec();
        assert!(energies.iter().all(|e| e.is_finite()), "{energies:?}");
    }
}

#[test]
fn progress_is_told() {
    let mesh = together(&[sphere(3), moved(&cube(3), |p| p.map(|c| c + 4.0))]);
    let seen = Mutex::new(Vec::new());
    let task = Task {
        observe: &|progress| {
            seen.lock().unwrap().push(progress);
            ControlFlow::Continue(())
        },
        ..Task::default()
    };
    task.run(&mesh);
    let seen = seen.into_inner().unwrap();
    assert!(seen.iter().all(|p| p.components == 2 && p.component < 2));
    assert!(seen.windows(2).all(|p| p[0].done <= p[1].done));
    let (first, last) = (seen.first().unwrap(), seen.last().unwrap());
    assert_eq!((first.stage, last.stage), (Stage::Refine, Stage::Pack));
    assert_eq!((first.done, first.fraction), (0, 0.0));
    assert_eq!(last.done, 2);
    assert!((last.fraction - 1.0).abs() < 1e-9, "{}", last.fraction);
    assert!(seen.windows(2).all(|p| p[0].fraction <= p[1].fraction));
    // Also while the larger one is worked on, and not at once.
    let within = |p: &&Progress| p.done == 0 && (0.1..0.9).contains(&p.fraction);
    assert!(seen.iter().filter(within).count() > 3);
    for component in 0..2 {
        let reached = |p: &&Progress| p.component == component && p.energy.is_finite();
        assert!(seen.iter().any(|p| reached(&p)));
    }
}

/// Surfaces of all sizes, flat ones among them, and one that is cut on simpler ones.
#[test]
fn the_number_of_threads_makes_no_difference() {
    let mut parts = vec![torus(1.0, 0.5, 64, 48), rectangle(1.0, 1.0, 3, 2)];
    for i in 0..6 {
        let sphere = moved(&sphere(2 + i), |p| p.map(|c| c + 4.0 * f64::from(i)));
        let sheet = moved(&rectangle(1.0, 1.0, 2, 2), |p| p.map(|c| c - f64::from(i)));
        parts.extend([sphere, sheet]);
    }
    let mesh = together(&parts);
    assert_is_independent_of_threads(&Task::default(), &mesh);
}

fn assert_is_independent_of_threads(task: &Task, mesh: &TriangleMesh) -> usize {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| task.run(mesh))
    };
    let alone = on(1);
    assert!(alone.atlas == on(2).atlas);
    assert!(alone.atlas == on(8).atlas);
    alone.charts()
}

/// What a component is divided into is laid out at once.
#[test]
fn the_number_of_threads_makes_no_difference_to_divided_components() {
    let torus = torus(1.0, 0.5, 36, 18);
    let positions = torus.positions();
    let edges = torus
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let is_across = |edge: &[u32; 2]| edge.iter().all(|&v| positions[v as usize][1].abs() < 1e-9);
    let across: Vec<[u32; 2]> = edges.filter(is_across).collect();
    let halved = Task {
        wanted: &across,
        ..Task::default()
    };
    assert_eq!(assert_is_independent_of_threads(&halved, &torus), 2);
    let tight = Task::within(4.001);
    let charts = assert_is_independent_of_threads(&tight, &sphere(8));
    assert!(charts > 1, "{charts}");
}

#[test]
fn the_same_input_has_the_same_result() {
    let mesh = torus(1.0, 0.5, 18, 9);
    let unrolled = |p: [f64; 3]| [p[1].atan2(p[0]) as f32, p[2] as f32];
    let task = Task {
        map: Some(&unrolled),
        ..Task::default()
    };
    let (one, other) = (task.run(&mesh), task.run(&mesh));
    assert!(one.atlas == other.atlas);
}

/// Triangles of labels in different squares may lie over each other.
#[test]
fn every_square_is_filled_on_its_own() {
    let mesh = together(&[
        rectangle(1.0, 1.0, 4, 4),
        moved(&rectangle(1.0, 1.0, 4, 4), |&[x, y, z]| [x, y, z + 1.0]),
        moved(&rectangle(1.0, 1.0, 4, 4), |&[x, y, z]| [x, y, z + 2.0]),
    ]);
    let labels: Vec<u32> = (0..96).map(|t| t / 32).collect();
    let task = Task {
        labels: &labels,
        squares: &[0, 1, 0],
        ..Task::default()
    };
    let outcome = task.run(&mesh);
    let side = |f: usize| {
        let uvs = &outcome.atlas.components[f].uvs;
        (0..32)
            .map(|t| 0.5 * super::doubled_area(uvs.corners(t)))
            .sum::<f64>()
            .sqrt()
    };
    assert!(side(1) > 0.99, "{}", side(1));
    assert!((side(0) / side(2) - 1.0).abs() < 1e-3 && side(0) < 0.51);
    assert_eq!(outcome.atlas.squares.len(), 2);
}

#[test]
fn charts_keep_the_winding_of_the_mesh() {
    let outcome = Task {
        config: LayoutConfig::default(),
        ..Task::default()
    }
    .run(&cube(4));
    let uv = &outcome.uv;
    for t in 0..uv.triangles().len() {
        assert!(super::doubled_area(uv.corners(t)) > 0.0);
    }
}
