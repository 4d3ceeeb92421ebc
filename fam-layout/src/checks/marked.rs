//! Surfaces on which somebody marked where to cut and where not to.

use std::sync::atomic::AtomicUsize;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Outcome, Task, breaking_off, together};
use crate::cut::test_surfaces::pierced_plate;
use fam_surface::TriangleMesh;
use fam_surface::shapes::{cube, moebius_strip, open_cylinder, rectangle, sphere, torus};

/// The edges of a mesh for whose ends something holds.
pub(super) fn edges_where(
    mesh: &TriangleMesh,
    holds: impl Fn([[f64; 3]; 2]) -> bool,
) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|edge| holds(edge.map(|v| mesh.positions()[v as usize])))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

fn wanting(mesh: &TriangleMesh, wanted: &[[u32; 2]]) -> Outcome {
    let task = Task {
        wanted,
        ..Task::default()
    };
    task.run(mesh)
}

fn forbidding(mesh: &TriangleMesh, forbidden: &[[u32; 2]]) -> Outcome {
    let task = Task {
        forbidden,
        ..Task::default()
    };
    task.run(mesh)
}

/// However few charts are allowed.
#[test]
fn a_cube_cut_along_all_its_creases_is_six_squares() {
    let cube = cube(3);
    let creases = edges_where(&cube, |ends| {
        let along = |k: usize| ends[0][k] == ends[1][k] && [0.0, 1.0].contains(&ends[0][k]);
        (0..3).filter(|&k| along(k)).count() == 2
    });
    assert_eq!(creases.len(), 36);
    let mut task = Task {
        wanted: &creases,
        ..Task::default()
    };
    task.config.max_charts = Some(1);
    let outcome = task.run(&cube);
    outcome.check_energy();
    assert_eq!(outcome.charts(), 6);
    assert!(outcome.energy() < 4.0001, "{}", outcome.energy());
    assert!((outcome.seam_length() - 12.0).abs() < 1e-9);
    assert_eq!(outcome.seam_edges(), creases);
}

/// Its sides lie on each other in the raw map.
#[test]
fn a_slit_in_a_sheet_stays_open() {
    let sheet = rectangle(1.0, 1.0, 8, 8);
    let slit = edges_where(&sheet, |ends| {
        ends.iter().all(|p| p[1] == 0.0 && p[0].abs() < 0.3)
    });
    assert_eq!(slit.len(), 4);
    let task = Task {
        wanted: &slit,
        map: Some(&|p| [p[0] as f32, p[1] as f32]),
        ..Task::default()
    };
    let outcome = task.run(&sheet);
    outcome.check_energy();
    assert_eq!(outcome.charts(), 1);
    assert!(outcome.energy() < 4.05, "{}", outcome.energy());
    assert!((0.5..1.3).contains(&outcome.seam_length()));
}

/// Alone it would leave two triangles with the same two vertices on both sides.
#[test]
fn an_edge_on_its_own_is_opened_too() {
    for mesh in [rectangle(1.0, 1.0, 6, 6), sphere(4), torus(1.0, 0.4, 16, 8)] {
        let [a, b, _] = mesh.triangles()[30];
        let outcome = wanting(&mesh, &[[a, b]]);
        assert!(outcome.seam_edges().contains(&[a.min(b), a.max(b)]));
        assert_eq!(outcome.charts(), 1);
    }
}

#[test]
fn a_loop_cuts_a_surface_in_two() {
    let sphere = sphere(4);
    let equator = edges_where(&sphere, |ends| ends.iter().all(|p| p[2] == 0.0));
    assert_eq!(equator.len(), 16);
    let outcome = wanting(&sphere, &equator);
    outcome.check_energy();
    assert_eq!(outcome.charts(), 2);
    assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
}

/// Where a surface has but one side it is cut somewhere; here somebody says where.
#[test]
fn a_moebius_strip_is_cut_where_it_is_wanted() {
    let strip = moebius_strip(0.4, 40, 4);
    // Vertices come in columns of 5.
    let across: Vec<[u32; 2]> = (50..54).map(|v| [v, v + 1]).collect();
    let outcome = wanting(&strip, &across);
    assert_eq!(outcome.seam_edges(), across);
    assert_eq!(outcome.charts(), 1);
}

#[test]
fn a_cylinder_is_cut_along_the_only_column_that_is_free() {
    let cylinder = open_cylinder(1.0, 2.0, 24, 9);
    // Vertices come in columns of 10.
    for column in [0, 7] {
        let free = |v: &u32| v / 10 == column;
        let all = edges_where(&cylinder, |_| true);
        let (own, forbidden): (Vec<[u32; 2]>, Vec<[u32; 2]>) =
            all.into_iter().partition(|edge| edge.iter().all(free));
        let outcome = forbidding(&cylinder, &forbidden);
        assert_eq!(outcome.seam_edges(), own);
        assert_eq!(outcome.forbidden_cut(), 0);
    }
}

#[test]
fn cuts_for_the_sake_of_distortion_stop_where_they_are_forbidden() {
    let sphere = sphere(6);
    let upper = edges_where(&sphere, |ends| ends.iter().any(|p| p[2] > 0.01));
    let outcome = forbidding(&sphere, &upper);
    outcome.check_energy();
    assert_eq!(outcome.forbidden_cut(), 0);
    assert!(outcome.seam_length() > 1.0);
    let free = Task::default().run(&sphere).seam_edges();
    assert!(free.iter().any(|edge| upper.contains(edge)));
}

#[test]
fn what_cannot_be_laid_out_whole_is_cut_although_it_is_forbidden() {
    for (mesh, genus) in [
        (torus(1.0, 0.4, 20, 10), 1),
        (pierced_plate(2), 2),
        (sphere(3), 0),
        (moebius_strip(0.4, 20, 4), 1),
    ] {
        let all = edges_where(&mesh, |_| true);
        let outcome = forbidding(&mesh, &all);
        assert_eq!(outcome.charts(), 1, "genus {genus}");
        assert!(outcome.forbidden_cut() > 1);
        assert_eq!(outcome.forbidden_cut(), outcome.seam_edges().len());
    }
}

/// An edge that is both wanted and forbidden is cut, and counted.
#[test]
fn to_be_wanted_outweighs_to_be_forbidden() {
    let sheet = rectangle(1.0, 1.0, 4, 4);
    let middle = edges_where(&sheet, |ends| ends.iter().all(|p| p[0] == 0.0));
    let task = Task {
        wanted: &middle,
        forbidden: &middle,
        ..Task::default()
    };
    let outcome = task.run(&sheet);
    assert_eq!((outcome.charts(), outcome.forbidden_cut()), (2, 4));
}

/// Whatever is marked on whatever mesh, the result is valid and has what is wanted.
#[test]
fn random_marks_do_no_harm() {
    let mut random = Pcg64::seed_from_u64(5);
    for round in 0..12 {
        let mesh = match round % 4 {
            0 => torus(1.0, 0.4, 10, 6),
            1 => together(&[cube(3), moebius_strip(0.4, 12, 2)]),
            2 => pierced_plate(1),
            _ => heap(&mut random),
        };
        let shares = [0; 2].map(|_| random.random_range(0.0..0.4));
        let [wanted, forbidden] = shares.map(|share| {
            let mut all = edges_where(&mesh, |_| true);
            all.retain(|_| random.random_bool(share));
            all
        });
        let task = Task {
            wanted: &wanted,
            forbidden: &forbidden,
            ..Task::default()
        };
        task.run(&mesh);
    }
}

/// Triangles over any three of a few points.
fn heap(random: &mut Pcg64) -> TriangleMesh {
    let positions = (0..12)
        .map(|_| [0; 3].map(|_| f64::from(random.random_range(0..5_u32))))
        .collect();
    let triangles = (0..30)
        .map(|_| [0; 3].map(|_| random.random_range(0..12)))
        .collect();
    TriangleMesh::new(positions, triangles).unwrap()
}

/// The edges in the midst of the quads of a grid, of which each is two triangles.
fn diagonals(grid: &TriangleMesh) -> Vec<[u32; 2]> {
    let common = |pair: &[[u32; 3]]| {
        let shared: Vec<u32> = pair[0]
            .into_iter()
            .filter(|v| pair[1].contains(v))
            .collect();
        [shared[0].min(shared[1]), shared[0].max(shared[1])]
    };
    grid.triangles().chunks(2).map(common).collect()
}

/// Also where they are too many to be searched as they are.
#[test]
fn polygons_stay_whole() {
    for torus in [torus(1.0, 0.4, 24, 12), torus(1.0, 0.4, 72, 36)] {
        let diagonals = diagonals(&torus);
        let task = Task {
            diagonals: &diagonals,
            ..Task::default()
        };
        let outcome = task.run(&torus);
        assert_eq!((outcome.charts(), outcome.forbidden_cut()), (1, 0));
        let seams = outcome.seam_edges();
        assert!(seams.len() > 40);
        assert!(diagonals.iter().all(|edge| !seams.contains(edge)));
        let triangles = Task::default().run(&torus).seam_edges();
        assert!(diagonals.iter().any(|edge| triangles.contains(edge)));
    }
}

#[test]
fn polygons_stay_whole_after_a_break_off_too() {
    let torus = torus(1.0, 0.4, 72, 36);
    let diagonals = diagonals(&torus);
    for rounds in [0, 3, 10] {
        let seen = AtomicUsize::new(0);
        let task = Task {
            diagonals: &diagonals,
            observe: &breaking_off(rounds, &seen),
            ..Task::default()
        };
        let seams = task.run(&torus).seam_edges();
        let across = diagonals.iter().filter(|edge| seams.contains(edge));
        assert_eq!(across.count(), 0, "{rounds}");
    }
}

#[test]
fn a_large_mesh_is_cut_beside_what_is_forbidden() {
    let sphere = sphere(24);
    let upper = edges_where(&sphere, |ends| ends.iter().all(|p| p[2] > 0.2));
    let outcome = forbidding(&sphere, &upper);
    assert_eq!(outcome.forbidden_cut(), 0);
    assert!(outcome.seam_length() > 0.5);
    assert!(outcome.energy() <= 4.1);
}

#[test]
fn a_large_mesh_without_a_way_beside_what_is_forbidden_is_cut_across_it() {
    let torus = torus(1.0, 0.4, 90, 36);
    let all = edges_where(&torus, |_| true);
    let outcome = forbidding(&torus, &all);
    assert!(outcome.forbidden_cut() > 0);
    assert_eq!(outcome.charts(), 1);
}
