//! Whatever the mesh, the result is valid.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Task, smoothed, subdivided, together};
use crate::cut::test_surfaces::{cubes, pierced_plate};
use crate::{LayoutConfig, Symmetry};
use fam_surface::TriangleMesh;

/// The surfaces of random sets of cells: closed, of some genus.
pub(super) fn closed(random: &mut Pcg64) -> Vec<TriangleMesh> {
    let size = [0; 3].map(|_| random.random_range(1..=3));
    let share = random.random_range(0.3..0.9);
    let solid: Vec<bool> = (0..27).map(|_| random.random_bool(share)).collect();
    let cell = |[x, y, z]: [i32; 3]| (9 * x + 3 * y + z) as usize;
    match solid.iter().any(|&s| s) {
        true => cubes(size, |at| cell(at) == 0 || solid[cell(at)]),
        false => Vec::new(),
    }
}

/// With every vertex moved by up to `amount` along each axis.
pub(super) fn jittered(mesh: &TriangleMesh, amount: f64, random: &mut Pcg64) -> TriangleMesh {
    super::moved(mesh, |p| {
        p.map(|c| c + random.random_range(-amount..=amount))
    })
}

/// With some edges divided next to one of their ends, or some triangles next to an edge.
pub(super) fn with_slivers(mesh: &TriangleMesh, count: usize, random: &mut Pcg64) -> TriangleMesh {
    let mut positions = mesh.positions().to_vec();
    let mut triangles = mesh.triangles().to_vec();
    for _ in 0..count {
        let t = random.random_range(0..triangles.len());
        let thickness = 10_f64.powf(random.random_range(-18.0..-1.0));
        let [a, b, c] = triangles[t];
        let at = |v: u32| positions[v as usize];
        let new = positions.len() as u32;
        if random.random_bool(0.5) {
            let (p, q) = (at(a), at(b));
            positions.push([0, 1, 2].map(|k| p[k] + thickness * (q[k] - p[k])));
            let divided = triangles.iter().flat_map(|&t| {
                let at = (0..3).find(|&c| {
                    let ends = [t[c], t[(c + 1) % 3]];
                    ends == [a, b] || ends == [b, a]
                });
                match at {
                    Some(c) => vec![
                        [t[c], new, t[(c + 2) % 3]],
                        [new, t[(c + 1) % 3], t[(c + 2) % 3]],
                    ],
                    None => vec![t],
                }
            });
            triangles = divided.collect();
        } else {
            let (p, q, r) = (at(a), at(b), at(c));
            let share = random.random_range(0.0..1.0) * (1.0 - thickness);
            let rest = 1.0 - thickness - share;
            positions.push([0, 1, 2].map(|k| share * p[k] + rest * q[k] + thickness * r[k]));
            triangles[t] = [a, b, new];
            triangles.extend([[b, c, new], [c, a, new]]);
        }
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// With some triangles turned over and some left out.
pub(super) fn torn(mesh: &TriangleMesh, random: &mut Pcg64) -> TriangleMesh {
    let mut triangles = Vec::new();
    for &[a, b, c] in mesh.triangles() {
        match random.random_range(0..12) {
            0 => {}
            1 => triangles.push([a, c, b]),
            _ => triangles.push([a, b, c]),
        }
    }
    triangles.push(mesh.triangles()[0]);
    TriangleMesh::new(mesh.positions().to_vec(), triangles).unwrap()
}

#[test]
fn closed_surfaces_of_any_genus_reach_the_bound() {
    let mut random = Pcg64::seed_from_u64(1);
    let mut genera = std::collections::BTreeSet::new();
    for round in 0..12 {
        // Few random solids have a hole through them.
        let pierced = (round < 2).then(|| pierced_plate(round + 1));
        for mesh in closed(&mut random).into_iter().chain(pierced) {
            let mesh = jittered(&smoothed(&subdivided(&mesh), 1), 0.05, &mut random);
            let (v, t) = (mesh.positions().len() as i64, mesh.triangles().len() as i64);
            genera.insert((2 - v + t / 2) / 2);
            let outcome = Task::default().run(&mesh);
            outcome.check_energy();
            assert!(
                outcome.energy() <= 4.1,
                "{} in round {round}",
                outcome.energy()
            );
        }
    }
    assert!(genera.len() > 2, "{genera:?}");
}

#[test]
fn noise_and_slivers_do_no_harm() {
    let mut random = Pcg64::seed_from_u64(2);
    for _ in 0..16 {
        let meshes = closed(&mut random);
        let amount = random.random_range(0.0..0.6);
        let mesh = jittered(&together(&meshes), amount, &mut random);
        let count = random.random_range(0..12);
        let mesh = with_slivers(&mesh, count, &mut random);
        Task::default().run(&mesh);
    }
}

#[test]
fn torn_surfaces_do_no_harm() {
    let mut random = Pcg64::seed_from_u64(3);
    for _ in 0..10 {
        let mesh = torn(&together(&closed(&mut random)), &mut random);
        let mesh = with_slivers(&mesh, 3, &mut random);
        let seed = random.random_range(1.0..100.0);
        let raw = |p: [f64; 3]| [0, 1].map(|k| (seed * p[k] + p[2]).sin() as f32);
        let task = Task {
            map: Some(&raw),
            ..Task::default()
        };
        task.run(&mesh);
    }
}

/// Whatever seams cost, from nearly nothing to a million times as much, at any size of the surface.
#[test]
fn costs_of_seams_do_no_harm() {
    let mut random = Pcg64::seed_from_u64(5);
    for round in 0..16 {
        let mesh = torn(&together(&closed(&mut random)), &mut random);
        let mesh = jittered(&mesh, random.random_range(0.0..0.4), &mut random);
        let mesh = with_slivers(&mesh, 5, &mut random);
        let unit = [1.0, 1e-150, 1e150][round % 3];
        let seed = random.random_range(1.0..100.0);
        let paint = move |p: [f64; 3]| (seed * p[0] / unit).sin() + (p[1] / unit).cos();
        let mesh = super::moved(&mesh, |p| p.map(|c| c * unit));
        let mut pick = |share: f64| {
            let mut edges = super::marked::edges_where(&mesh, |_| true);
            edges.retain(|_| random.random_bool(share));
            edges
        };
        let (wanted, forbidden, hard) = (pick(0.02), pick(0.1), pick(0.3));
        let mut weight = |most: i32| 10_f64.powi(random.random_range(-1..=most));
        let task = Task {
            config: LayoutConfig {
                hide_seams: weight(6),
                seen_from: (round % 2 == 0).then_some([0.3, -1.0, 0.2]),
                paint_weight: weight(6),
                crease_weight: 9.0 * weight(0),
                tear_weight: 9.0 * weight(0),
                hard_angle: (round % 4 == 1).then_some(80.0),
                max_charts: (round % 5 == 2).then_some(2),
                ..LayoutConfig::default()
            },
            wanted: &wanted,
            forbidden: &forbidden,
            hard: &hard,
            paint: Some(&paint),
            ..Task::default()
        };
        task.run(&mesh);
    }
}

#[test]
fn symmetry_does_no_harm() {
    let mut random = Pcg64::seed_from_u64(6);
    let aslant = Symmetry::Plane {
        normal: [1.0, -1.0, 0.0],
        offset: 0.0,
    };
    for round in 0..12 {
        let mesh = together(&closed(&mut random));
        let mesh = if round % 3 == 0 {
            torn(&mesh, &mut random)
        } else {
            mesh
        };
        let amount = [0.0, 0.004, 0.3][round % 3];
        let mesh = jittered(&mesh, amount, &mut random);
        let mesh = with_slivers(&mesh, round % 4, &mut random);
        let task = Task {
            config: LayoutConfig {
                symmetry: [Symmetry::Auto, Symmetry::X, aslant, Symmetry::Z][round % 4],
                max_charts: (round % 5 == 4).then_some(3),
                ..LayoutConfig::default()
            },
            ..Task::default()
        };
        task.run(&mesh);
    }
}

/// Triangles over any three of a few points.
#[test]
fn heaps_of_triangles_do_no_harm() {
    let mut random = Pcg64::seed_from_u64(4);
    for round in 0..20 {
        let points = random.random_range(4..12);
        let side: f64 = if round % 2 == 0 { 3.0 } else { 1e6 };
        let positions = (0..points)
            .map(|_| [0; 3].map(|_| random.random_range(0.0..side).floor()))
            .collect();
        let triangles = (0..random.random_range(1..30))
            .map(|_| [0; 3].map(|_| random.random_range(0..points)))
            .collect();
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        if fam_surface::Components::of(&mesh, &[]).is_ok() {
            Task::default().run(&mesh);
        }
    }
}
