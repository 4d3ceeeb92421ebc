//! Surfaces whose answer is known.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Task, moved, part, smoothed, subdivided, together};
use crate::cut::test_surfaces::pierced_plate;
use fam_surface::TriangleMesh;
use fam_surface::shapes::{
    cone, cube, draped_cloth, moebius_strip, open_cylinder, open_sphere, rectangle, sphere, spiral,
    torus,
};
use fam_surface::vector::{length, sub};

/// The bound at which developable surfaces have to be unrolled.
const ISOMETRIC: f64 = 4.001;

fn is_close(value: f64, to: f64) -> bool {
    (value - to).abs() < 1e-9 * to
}

#[test]
fn a_cylinder_is_unrolled_along_its_height() {
    for bound in [ISOMETRIC, 4.1] {
        let outcome = Task::within(bound).run(&open_cylinder(1.0, 2.0, 24, 9));
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() < ISOMETRIC, "{}", outcome.energy());
        assert!(
            is_close(outcome.seam_length(), 2.0),
            "{}",
            outcome.seam_length()
        );
    }
}

/// The shortest cut runs from the rim to the apex, or, as far as the bound allows, not quite.
#[test]
fn a_cone_is_unrolled_from_its_rim_to_its_apex() {
    for (radius, height) in [(0.6, 0.8), (0.28, 0.96), (0.96, 0.28)] {
        let outcome = Task::within(ISOMETRIC).run(&cone(radius, height, 30, 10));
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() <= ISOMETRIC, "{}", outcome.energy());
        let seam = outcome.seam_length();
        assert!((0.5..1.0 + 1e-9).contains(&seam), "{seam}");
    }
}

/// A tent with more than a full turn around its apex: without distortion it does not fit into
/// the plane in one piece.
#[test]
fn a_surface_of_more_than_a_full_turn_is_divided() {
    let ruff = moved(&cone(1.0, 0.0, 32, 5), |&[x, y, _]| {
        let wave = 0.5 * (4.0 * y.atan2(x)).sin() * x.hypot(y);
        [x, y, wave]
    });
    let mut task = Task::within(ISOMETRIC);
    let outcome = task.run(&ruff);
    outcome.check_energy();
    assert!(outcome.energy() <= ISOMETRIC, "{}", outcome.energy());
    assert!((2..=10).contains(&outcome.charts()), "{}", outcome.charts());
    task.config.max_charts = Some(1);
    let outcome = task.run(&ruff);
    outcome.check_energy();
    assert_eq!(outcome.charts(), 1);
    assert!(outcome.energy() > ISOMETRIC);
}

fn double_torus() -> TriangleMesh {
    smoothed(&subdivided(&pierced_plate(2)), 2)
}

#[test]
fn closed_surfaces_become_one_disk() {
    for (mesh, genus) in [
        (sphere(6), 0),
        (torus(1.0, 0.4, 20, 10), 1),
        (double_torus(), 2),
    ] {
        let edges = 3 * mesh.triangles().len() / 2;
        let euler = mesh.positions().len() as i64 - edges as i64 + mesh.triangles().len() as i64;
        assert_eq!(euler, 2 - 2 * genus);
        let outcome = Task::default().run(&mesh);
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1, "genus {genus}");
        assert!(
            outcome.energy() <= 4.1,
            "{} at genus {genus}",
            outcome.energy()
        );
    }
}

#[test]
fn a_moebius_strip_is_cut_across() {
    let outcome = Task::default().run(&moebius_strip(0.4, 40, 5));
    outcome.check_energy();
    assert_eq!(outcome.charts(), 1);
    assert!(outcome.energy() <= 4.05, "{}", outcome.energy());
    // A line across is 0.4 long wherever it is; one along edges may have to be oblique.
    let seam = outcome.seam_length();
    assert!((0.4 - 1e-9..0.6).contains(&seam), "{seam}");
}

/// The cube with the vertices inside its sides moved about there: no line across a side is as
/// short as its edges.
fn uneven_cube(squares: u32) -> TriangleMesh {
    let mut random = Pcg64::seed_from_u64(11);
    let step = 0.3 / f64::from(squares);
    moved(&cube(squares), |p| {
        let crease = p.iter().filter(|c| [0.0, 1.0].contains(*c)).count() > 1;
        p.map(|c| match crease || c == 0.0 || c == 1.0 {
            true => c,
            false => c + random.random_range(-step..step),
        })
    })
}

#[test]
fn a_cube_is_cut_along_its_edges() {
    // Between the squares of an even cube many other ways are as short.
    let uneven = [1, 2, 3, 6].map(uneven_cube);
    for mesh in uneven.iter().chain(&[cube(6), cube(7)]) {
        let outcome = Task::within(ISOMETRIC).run(mesh);
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() <= ISOMETRIC, "{}", outcome.energy());
        assert!(
            is_close(outcome.seam_length(), 7.0),
            "{}",
            outcome.seam_length()
        );
        for [a, b] in outcome.seams() {
            let on_side = |k: usize| a[k] == b[k] && (a[k] == 0.0 || a[k] == 1.0);
            let sides = (0..3).filter(|&k| on_side(k)).count();
            assert_eq!(sides, 2, "{a:?} to {b:?}");
        }
    }
    // Its corners are smoothed over where they may.
    let outcome = Task::default().run(&uneven_cube(6));
    outcome.check_energy();
    assert_eq!(outcome.charts(), 1);
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    assert!(outcome.seam_length() < 6.5, "{}", outcome.seam_length());
}

#[test]
fn sheets_stay_whole() {
    for mesh in [
        rectangle(1.0, 3.0, 6, 18),
        rectangle(1.0, 0.01, 4, 4),
        rectangle(1.0, 0.001, 16, 4),
        draped_cloth(30, 10),
        spiral(1.0, 0.5, 12.0, 2.0, 60, 6),
    ] {
        let outcome = Task::default().run(&mesh);
        outcome.check_energy();
        assert_eq!((outcome.charts(), outcome.seam_length()), (1, 0.0));
        assert!(outcome.energy() < ISOMETRIC, "{}", outcome.energy());
    }
}

/// A mesh without the triangles around `centre` that are no farther than `radius` from it.
fn pierced(mesh: &TriangleMesh, centre: [f64; 3], radius: f64) -> TriangleMesh {
    part(mesh, |p| length(sub(p, centre)) > radius)
}

#[test]
fn sheets_with_holes_stay_whole() {
    let sheet = rectangle(2.0, 2.0, 16, 16);
    let two = pierced(
        &pierced(&sheet, [-0.4, -0.4, 0.0], 0.3),
        [0.5, 0.3, 0.0],
        0.2,
    );
    let many = [[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.0], [0.6, -0.6]]
        .iter()
        .fold(sheet.clone(), |sheet, &[x, y]| {
            pierced(&sheet, [x, y, 0.0], 0.2)
        });
    let ring = pierced(&cone(1.0, 0.0, 30, 10), [0.0; 3], 0.4);
    let rolled = moved(&two, |&[x, y, _]| [x.cos(), x.sin(), y]);
    for bound in [ISOMETRIC, 4.1] {
        for mesh in [&two, &many, &ring, &rolled] {
            let outcome = Task::within(bound).run(mesh);
            outcome.check_energy();
            assert_eq!((outcome.charts(), outcome.seam_length()), (1, 0.0));
            assert!(outcome.energy() < 4.0 + 1e-6, "{}", outcome.energy());
        }
    }
}

/// One cut from rim to rim, whether through the hole or beside it.
#[test]
fn a_cylinder_with_a_hole_is_cut_once() {
    let cylinder = open_cylinder(1.0, 2.0, 24, 12);
    for radius in [0.3, 0.7] {
        let outcome = Task::within(ISOMETRIC).run(&pierced(&cylinder, [1.0, 0.0, 1.0], radius));
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() < ISOMETRIC, "{}", outcome.energy());
        let seam = outcome.seam_length();
        assert!((0.5..2.0 + 1e-9).contains(&seam), "{seam}");
    }
}

#[test]
fn handles_stay_cut_where_holes_do_not() {
    let ring = torus(1.0, 0.4, 20, 10);
    let pierced = pierced(
        &pierced(&ring, [1.4, 0.0, 0.0], 0.25),
        [-1.4, 0.0, 0.0],
        0.25,
    );
    let outcome = Task::default().run(&pierced);
    outcome.check_energy();
    assert_eq!(outcome.charts(), 1);
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
}

#[test]
fn bent_surfaces_of_several_boundaries_are_cut() {
    let pierced = part(&sphere(10), |p| p.iter().all(|c| c.abs() < 0.93));
    let tube = part(&torus(1.0, 0.3, 32, 10), |p| p[0] < 0.2 || p[1] < 0.0);
    for mesh in [pierced, tube, open_sphere(0.5, 20, 10)] {
        let outcome = Task::default().run(&mesh);
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
    }
}

/// All at one scale: that of the surface.
#[test]
fn components_lie_side_by_side_in_their_proportions() {
    let at = |mesh: TriangleMesh, x: f64, size: f64| {
        moved(&mesh, |p| [x + size * p[0], size * p[1], size * p[2]])
    };
    let mesh = together(&[
        at(sphere(4), 0.0, 1.0),
        at(torus(1.0, 0.4, 16, 8), 5.0, 0.3),
        at(rectangle(1.0, 2.0, 3, 3), 8.0, 2.0),
        at(open_cylinder(1.0, 2.0, 12, 4), 12.0, 0.1),
    ]);
    let outcome = Task::default().run(&mesh);
    outcome.check_energy();
    assert_eq!(outcome.components.list.len(), 4);
    let metrics = outcome.metrics();
    assert_eq!(metrics.charts, outcome.charts());
    assert!(
        metrics.symmetric_dirichlet <= 4.11,
        "{}",
        metrics.symmetric_dirichlet
    );
    let areas: Vec<f64> = outcome
        .components
        .list
        .iter()
        .zip(&outcome.atlas.components)
        .map(|(component, finished)| {
            let flat = (0..finished.uvs.triangles().len())
                .map(|t| 0.5 * super::doubled_area(finished.uvs.corners(t)).abs());
            flat.sum::<f64>() / component.mesh.triangle_areas().iter().sum::<f64>()
        })
        .collect();
    for area in &areas {
        assert!((area / areas[0] - 1.0).abs() < 0.05, "{areas:?}");
    }
}

/// The raw map unrolls it, torn along a column of its quads.
#[test]
fn a_tube_is_opened_where_the_network_tore_it() {
    let tube = open_cylinder(0.5, 1.0, 20, 6);
    let seam_at = |torn: f64| {
        let unrolled = |p: [f64; 3]| {
            let turn = (p[1].atan2(p[0]) / (2.0 * PI) - torn).rem_euclid(1.0);
            [turn as f32, p[2] as f32 / PI as f32]
        };
        let task = Task {
            map: Some(&unrolled),
            ..Task::default()
        };
        let outcome = task.run(&tube);
        assert!(
            is_close(outcome.seam_length(), 1.0),
            "{}",
            outcome.seam_length()
        );
        outcome.seams()
    };
    for column in [0.0, 7.0, 13.0] {
        let torn = (column + 0.5) / 20.0;
        for p in seam_at(torn).into_iter().flatten() {
            let off = (p[1].atan2(p[0]) / (2.0 * PI) - torn).rem_euclid(1.0);
            assert!(off.min(1.0 - off) < 0.026, "{off} from column {column}");
        }
    }
}

/// A surface of many triangles is cut on simpler ones: its seams are no longer for that.
#[test]
fn a_fine_surface_is_cut_as_short_as_a_coarse_one() {
    let [coarse, fine] = [(20, 10), (90, 36)].map(|(around, across)| {
        let mesh = torus(1.0, 0.4, around, across);
        let outcome = Task::default().run(&mesh);
        outcome.check_energy();
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
        outcome.seam_length()
    });
    assert!(fine < 1.1 * coarse, "{fine}, {coarse}");
}
