//! Layouts of symmetric surfaces are symmetric to the last bit.

use std::collections::HashMap;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Outcome, Task, moved, part, subdivided, together};
use crate::cut::test_surfaces::cubes;
use crate::{LayoutConfig, Stack, Symmetry};
use fam_surface::TriangleMesh;
use fam_surface::charts::charts;
use fam_surface::metrics::Metrics;
use fam_surface::shapes::{cube, rectangle, sphere, torus};
use fam_surface::symmetry::{MirrorPlane, paired};

pub(super) fn task(symmetry: Symmetry) -> Task<'static> {
    Task {
        config: LayoutConfig {
            symmetry,
            ..LayoutConfig::default()
        },
        ..Task::default()
    }
}

/// A mesh and its mirror image at x = 0 as one: vertices there are shared.
pub(super) fn glued(half: &TriangleMesh) -> TriangleMesh {
    let mut positions = half.positions().to_vec();
    let images: Vec<u32> = half
        .positions()
        .iter()
        .zip(0..)
        .map(|(&[x, y, z], v)| match x == 0.0 {
            true => v,
            false => {
                positions.push([-x, y, z]);
                positions.len() as u32 - 1
            }
        })
        .collect();
    let mirrored = half.triangles().iter().map(|&[a, b, c]| [a, c, b]);
    let mirrored = mirrored.map(|t| t.map(|v| images[v as usize]));
    let triangles = half.triangles().iter().copied().chain(mirrored).collect();
    TriangleMesh::new(positions, triangles).unwrap()
}

/// Every chart and its mirror image (or itself) are mirror images at a vertical line, up to a shift, to
/// the last bit; how many charts are their own.
fn check_mirrored(outcome: &Outcome, plane: &MirrorPlane) -> usize {
    let (mesh, uv) = (&outcome.mesh, &outcome.uv);
    let pairing = paired(mesh, mesh, plane).unwrap();
    let of_triangle = charts(uv);
    let mut shifts: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    let mut own = 0;
    for (u, corners) in pairing.corners.iter().enumerate() {
        for (c, &corner) in corners.iter().enumerate() {
            let t = corner as usize / 3;
            let [a, b] = uv.corners(u)[c];
            let [p, q] = uv.corners(t)[corner as usize % 3];
            let pair = [of_triangle[u], of_triangle[t]];
            let shift = [a + p, b - q].map(f32::to_bits);
            // The sums are exact.
            assert_eq!(f64::from(a + p), f64::from(a) + f64::from(p));
            assert_eq!(f64::from(b - q), f64::from(b) - f64::from(q));
            let known = *shifts.entry(pair).or_insert_with(|| {
                own += usize::from(pair[0] == pair[1]);
                shift
            });
            assert_eq!(known, shift, "of charts {pair:?}");
            assert!(pair[0] != pair[1] || b == q);
        }
    }
    own
}

/// With stacks every half lies on the other, mirrored, bit for bit.
fn check_stacked(outcome: &Outcome, plane: &MirrorPlane) {
    let (mesh, uv) = (&outcome.mesh, &outcome.uv);
    let pairing = paired(mesh, mesh, plane).unwrap();
    for (u, corners) in pairing.corners.iter().enumerate() {
        for (c, &corner) in corners.iter().enumerate() {
            let of = uv.corners(corner as usize / 3)[corner as usize % 3];
            assert_eq!(uv.corners(u)[c].map(f32::to_bits), of.map(f32::to_bits));
        }
    }
    let metrics = Metrics::measure(mesh, uv).unwrap();
    assert_eq!(metrics.flipped_triangles, 0);
    assert_eq!(metrics.unintended_overlaps(), 0);
    assert_eq!(metrics.stacked_charts, metrics.charts as u64 / 2);
    assert_eq!(metrics.mirrored_charts, metrics.charts as u64 / 2);
}

#[test]
fn halves_of_symmetric_surfaces_share_their_place() {
    let stacked = || {
        let mut task = task(Symmetry::X);
        task.config.stack = Stack::Mirrored;
        task
    };
    for mesh in [sphere(8), torus(1.0, 0.4, 24, 12)] {
        let outcome = stacked().run_unchecked(&mesh);
        assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
        check_stacked(&outcome, &MirrorPlane::across(0, 0.0));
    }
}

#[test]
fn known_shapes_are_laid_out_symmetrically() {
    for mesh in [sphere(8), torus(1.0, 0.4, 24, 12)] {
        let outcome = task(Symmetry::X).run(&mesh);
        outcome.check_energy();
        assert!(outcome.energy() <= 4.1, "{}", outcome.energy());
        let own = check_mirrored(&outcome, &MirrorPlane::across(0, 0.0));
        assert_eq!((outcome.charts(), own), (1, 1));
        // Half of the way around the plane is a seam, and what one side has the other has as well.
        let usual = Task::default().run(&mesh).seam_length();
        assert!(
            outcome.seam_length() < 2.0 * usual,
            "{} {usual}",
            outcome.seam_length()
        );
    }
}

/// The squares in the middle lie across the plane, and all diagonals run the same way.
#[test]
fn faces_across_the_plane_are_symmetric() {
    for squares in [3, 5] {
        let mesh = moved(&cube(squares), |p| p.map(|c| c - 0.5));
        let outcome = task(Symmetry::X).run(&mesh);
        assert!(outcome.energy() <= 4.1);
        check_mirrored(&outcome, &MirrorPlane::across(0, 0.0));
    }
    let sheet = rectangle(2.0, 1.0, 7, 4);
    let outcome = task(Symmetry::Auto).run(&sheet);
    assert_eq!(outcome.charts(), 1);
}

/// Two ears and a head, a lone part on one side.
#[test]
fn parts_that_are_images_of_each_other_are_laid_out_alike() {
    let head = sphere(6);
    let ear = |side: f64| {
        let ear = moved(&torus(0.3, 0.1, 12, 8), |p| {
            [side * (p[0] + 1.5), p[1], p[2] + 1.0]
        });
        match side < 0.0 {
            true => {
                let turned = ear.triangles().iter().map(|&[a, b, c]| [a, c, b]);
                TriangleMesh::new(ear.positions().to_vec(), turned.collect()).unwrap()
            }
            false => ear,
        }
    };
    let mesh = together(&[head.clone(), ear(1.0), ear(-1.0)]);
    let outcome = task(Symmetry::X).run(&mesh);
    check_mirrored(&outcome, &MirrorPlane::across(0, 0.0));
    let odd = moved(&cube(2), |p| [0.2 * p[0] + 3.0, 0.2 * p[1], 0.2 * p[2]]);
    let with_odd = together(&[head, ear(1.0), ear(-1.0), odd]);
    let outcome = task(Symmetry::X).run(&with_odd);
    assert!(
        outcome
            .atlas
            .components
            .iter()
            .all(|c| c.distortion.energy <= 4.1)
    );
}

#[test]
fn without_a_mirror_plane_nothing_changes() {
    let mut random = Pcg64::seed_from_u64(8);
    let bumps: Vec<f64> = (0..4).map(|_| random.random_range(-0.4..0.4)).collect();
    let mesh = moved(&sphere(8), |&[x, y, z]| {
        let r =
            1.0 + bumps[0] * x * y + bumps[1] * y * z * z + bumps[2] * x * x * x + bumps[3] * z * x;
        [
            1.3 * r * x + 0.3 * y * z,
            0.8 * r * y + 0.4 * x * x,
            r * z + 0.3 * x * y,
        ]
    });
    let usual = Task::default().run(&mesh);
    let outcome = task(Symmetry::Auto).run(&mesh);
    assert!(outcome.uv == usual.uv && outcome.atlas == usual.atlas);
}

/// Halves of random solids, with noise, glued to their mirror images: closed, or open with some
/// triangles left out.
#[test]
fn random_symmetric_surfaces_are_laid_out_symmetrically() {
    let mut random = Pcg64::seed_from_u64(21);
    for round in 0..10 {
        let share = random.random_range(0.4..0.9);
        let solid: Vec<bool> = (0..36).map(|_| random.random_bool(share)).collect();
        let cell = |[x, y, z]: [i32; 3]| (9 * x.abs_diff(2).min(3) as i32 + 3 * y + z) as usize;
        let meshes = cubes([4, 3, 3], |at| {
            at == [2, 1, 1] || at == [1, 1, 1] || solid[cell(at)]
        });
        let whole = subdivided(&together(&meshes));
        let half = part(&moved(&whole, |p| [p[0] - 2.0, p[1], p[2]]), |p| p[0] > 0.0);
        let noisy = moved(&half, |p| {
            let noise = [0; 3].map(|_| random.random_range(-0.1..0.1));
            let x = if p[0] == 0.0 { 0.0 } else { p[0] + noise[0] };
            [x, p[1] + noise[1], p[2] + noise[2]]
        });
        let open = round % 2 == 1;
        let kept = noisy.triangles().iter().enumerate();
        let kept = kept
            .filter(|(t, _)| !open || t % 29 != 3)
            .map(|(_, t)| *t)
            .collect();
        let mesh = glued(&TriangleMesh::new(noisy.positions().to_vec(), kept).unwrap());
        let outcome = task(Symmetry::Auto).run(&mesh);
        for component in &outcome.atlas.components {
            assert!(
                component.distortion.energy <= 4.1,
                "{}",
                component.distortion.energy
            );
        }
        check_mirrored(&outcome, &MirrorPlane::across(0, 0.0));
        let mut stacked = task(Symmetry::Auto);
        stacked.config.stack = Stack::Mirrored;
        check_stacked(&stacked.run_unchecked(&mesh), &MirrorPlane::across(0, 0.0));
    }
}
