//! Layouts of surfaces that are symmetric, or nearly so, without vertices that correspond.

use std::collections::HashMap;
use std::sync::atomic::AtomicUsize;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::symmetric::task;
use super::{Outcome, Task, breaking_off, moved, part};
use crate::Symmetry;
use fam_surface::TriangleMesh;
use fam_surface::metrics::mirrored_share;
use fam_surface::shapes::{hemisphere, sphere, torus};
use fam_surface::symmetry::MirrorPlane;

/// A mesh whose edges lie in directions that have nothing to do with the axes.
fn turned(mesh: &TriangleMesh) -> TriangleMesh {
    let [(s, c), (t, d)] = [0.7_f64.sin_cos(), 0.4_f64.sin_cos()];
    moved(mesh, |&[x, y, z]| {
        let [x, y] = [c * x - s * y, s * x + c * y];
        [d * x - t * z, y, t * x + d * z]
    })
}

/// A ball with two ears and a nose, symmetric at x = 0; its vertices are not.
fn head() -> TriangleMesh {
    let bump = |at: [f64; 3], p: [f64; 3], width: f64| {
        let squared: f64 = (0..3).map(|k| (p[k] - at[k]).powi(2)).sum();
        (-squared / (width * width)).exp()
    };
    moved(&turned(&sphere(18)), |&[x, y, z]| {
        let side = [x.abs(), y, z];
        let ears = 0.7 * bump([0.75, 0.1, 0.65], side, 0.35);
        let nose = 0.4 * bump([0.0, -1.0, 0.0], side, 0.3);
        [x, y, z].map(|c| c * (1.0 + ears + nose))
    })
}

fn share(outcome: &Outcome) -> f64 {
    let plane = MirrorPlane::across(0, 0.0);
    mirrored_share(&outcome.mesh, &outcome.uv, &plane)
}

/// Checks a mesh's layout with a mirror plane at x = 0, and that it is not symmetric without.
fn check(mesh: &TriangleMesh) {
    let usual = Task::default().run(mesh);
    assert!(share(&usual) < 0.5);
    let outcome = task(Symmetry::X).run(mesh);
    let energy = outcome.energy();
    assert!(energy <= 4.1, "{energy}");
    let share = share(&outcome);
    assert!(share >= 0.95, "{share}");
    let (own, most) = (outcome.seam_length(), 1.5 * usual.seam_length());
    assert!(own <= most, "{own} {most}");
}

#[test]
fn vertices_need_not_correspond() {
    check(&head());
    let (sin, cos) = 0.05_f64.sin_cos();
    let spun = |&[x, y, z]: &[f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
    check(&moved(&torus(1.0, 0.45, 36, 20), spun));
}

#[test]
fn open_surfaces_may_end_where_their_images_do_not() {
    check(&part(&head(), |p| p[2] < 0.45));
}

#[test]
fn scans_need_not_be_quite_symmetric() {
    let mut random = Pcg64::seed_from_u64(5);
    check(&moved(&head(), |&[x, y, z]| {
        let noise = 1.0 + random.random_range(-0.003..0.003);
        [x + 0.03 * y * z, y, z + 0.03 * x].map(|c| c * noise)
    }));
}

/// A dome of rings, in some of which a triangle lies across the plane.
#[test]
fn faces_across_the_plane_are_no_charts_of_their_own() {
    let outcome = task(Symmetry::Y).run(&hemisphere(0.08));
    assert_eq!(outcome.charts(), 1);
    let plane = MirrorPlane::across(1, 0.0);
    let share = mirrored_share(&outcome.mesh, &outcome.uv, &plane);
    assert!(share >= 0.95, "{share}");
}

#[test]
fn stopping_leaves_a_valid_layout() {
    for rounds in [0, 20, 200, 1000, 2000] {
        let seen = AtomicUsize::new(0);
        let observe = breaking_off(rounds, &seen);
        let task = Task {
            observe: &observe,
            ..task(Symmetry::X)
        };
        task.run(&head());
    }
}

/// Triangles without area that wanted seams cut off, as thin as scans have them.
#[test]
fn charts_without_area_do_no_harm() {
    let head = head();
    let mut positions = head.positions().to_vec();
    let mut triangles = head.triangles().to_vec();
    let [a, b, c] = triangles[0];
    let [p, q] = [a, b].map(|v| positions[v as usize]);
    let middle = positions.len() as u32;
    positions.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
    triangles[0] = [middle, b, c];
    triangles.extend([[a, middle, c], [b, middle, a]]);
    let mesh = TriangleMesh::new(positions, triangles).unwrap();
    let mut task = task(Symmetry::X);
    let wanted = [[a, b], [a, middle], [middle, b]];
    task.wanted = &wanted;
    let outcome = task.run_unchecked(&mesh);
    assert_eq!(outcome.metrics().flipped_triangles, 0);
    assert_eq!(outcome.metrics().unintended_overlaps(), 0);
    let share = share(&outcome);
    assert!(share >= 0.95, "{share}");
}

/// Seams that are wanted on one side are cut on the other too.
#[test]
fn wanted_seams_are_mirrored() {
    let mesh = head();
    for side in [1.0, -1.0] {
        // A ring around an ear.
        let at = |v: u32| mesh.positions()[v as usize];
        let is_inside = |t: &[u32; 3]| t.iter().all(|&v| side * at(v)[0] > 0.75);
        let mut sides: HashMap<[u32; 2], [bool; 2]> = HashMap::new();
        for t in mesh.triangles() {
            let [a, b, c] = *t;
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let own = sides.entry([a.min(b), a.max(b)]).or_default();
                own[usize::from(is_inside(t))] = true;
            }
        }
        let ring = sides.iter().filter(|(_, own)| **own == [true; 2]);
        let mut wanted: Vec<[u32; 2]> = ring.map(|(edge, _)| *edge).collect();
        wanted.sort_unstable();
        assert!(wanted.len() > 10);
        let mut task = task(Symmetry::X);
        task.wanted = &wanted;
        let outcome = task.run(&mesh);
        assert_eq!(outcome.metrics().charts, 3);
        let share = share(&outcome);
        assert!(share >= 0.95, "{share}");
    }
}
