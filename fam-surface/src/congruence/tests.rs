use std::time::Instant;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::shapes;
use crate::vector::{add, cross, dot, normalize, scale};

/// A rigid motion.
struct Motion {
    axes: [[f64; 3]; 3],
    shift: [f64; 3],
}

impl Motion {
    fn random(random: &mut Pcg64, is_reflected: bool, far: f64) -> Self {
        let mut vector = || [0; 3].map(|_| random.random_range(-1.0..1.0));
        let first = normalize(vector());
        let third = normalize(cross(first, vector()));
        let turn = if is_reflected { -1.0 } else { 1.0 };
        let axes = [first, scale(cross(third, first), turn), third];
        Self {
            axes,
            shift: scale(vector(), far),
        }
    }

    fn place(&self, p: [f64; 3]) -> [f64; 3] {
        add(self.axes.map(|axis| dot(axis, p)), self.shift)
    }
}

fn shuffled(random: &mut Pcg64, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    order
}

/// A copy with its vertices and triangles in another order, and each triangle from another corner on.
fn permuted(mesh: &TriangleMesh, random: &mut Pcg64, is_reversed: bool) -> TriangleMesh {
    let order = shuffled(random, mesh.positions().len());
    let mut positions = vec![[0.0; 3]; order.len()];
    for (v, &to) in order.iter().enumerate() {
        positions[to] = mesh.positions()[v];
    }
    let triangles = shuffled(random, mesh.triangles().len())
        .into_iter()
        .map(|t| {
            let mut corners = mesh.triangles()[t].map(|v| order[v as usize] as u32);
            corners.rotate_left(random.random_range(0..3));
            if is_reversed {
                corners.reverse();
            }
            corners
        });
    let triangles = triangles.collect();
    TriangleMesh::new(positions, triangles).unwrap()
}

fn moved(mesh: &TriangleMesh, place: impl FnMut(&[f64; 3]) -> [f64; 3]) -> TriangleMesh {
    let positions = mesh.positions().iter().map(place).collect();
    TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap()
}

fn found(meshes: &[TriangleMesh], with_mirrored: bool) -> Vec<Option<Congruence>> {
    let meshes: Vec<&TriangleMesh> = meshes.iter().collect();
    copies(&meshes, &vec![0; meshes.len()], with_mirrored, &|_, _| true)
}

/// A lump without any symmetry.
fn lump(random: &mut Pcg64) -> TriangleMesh {
    let squares = random.random_range(2..6);
    moved(&shapes::sphere(squares), |p| {
        p.map(|c| c + random.random_range(-0.05..0.05))
    })
}

/// Every vertex and triangle is where the copy says.
fn check(meshes: &[TriangleMesh], i: usize, copy: &Congruence) {
    let (mesh, original) = (&meshes[i], &meshes[copy.original]);
    for (t, corners) in mesh.triangles().iter().enumerate() {
        let mut own = corners.map(|v| copy.vertices[v as usize]);
        if copy.is_mirrored {
            own.reverse();
        }
        let of = original.triangles()[copy.triangles[t] as usize];
        assert!((0..3).any(|k| own == [0, 1, 2].map(|c| of[(c + k) % 3])));
    }
    for v in 0..mesh.positions().len() {
        for w in [0, v / 2] {
            let own = length_between(mesh, v, w);
            let [a, b] = [v, w].map(|v| copy.vertices[v] as usize);
            let of = length_between(original, a, b);
            assert!((own - of).abs() < 1e-4 * own.max(1e-9), "{own} {of}");
        }
    }
}

fn length_between(mesh: &TriangleMesh, a: usize, b: usize) -> f64 {
    let [a, b] = [a, b].map(|v| mesh.positions()[v]);
    crate::vector::length(crate::vector::sub(a, b))
}

#[test]
fn moved_copies_are_found_whatever_their_order_and_mirrored_ones_if_asked_for() {
    for seed in 0..30 {
        let mut random = Pcg64::seed_from_u64(seed);
        let originals = [lump(&mut random), lump(&mut random), shapes::bust(0.3)];
        let unit = 10_f64.powi(random.random_range(-150..150));
        let mut meshes = Vec::new();
        let mut expected = Vec::new();
        for _ in 0..12 {
            let of = random.random_range(0..3);
            let is_mirrored = random.random_bool(0.5);
            let motion = Motion::random(&mut random, is_mirrored, 20.0);
            let copy = moved(&originals[of], |&p| motion.place(p));
            // In the precision of most files.
            let copy = moved(&copy, |p| p.map(|c| f64::from(c as f32) * unit));
            meshes.push(permuted(&copy, &mut random, is_mirrored));
            expected.push((of, is_mirrored));
        }
        // The bust is its own mirror image, but for its triangles.
        for with_mirrored in [false, true] {
            let all = found(&meshes, with_mirrored);
            for (i, copy) in all.iter().enumerate() {
                let is_same = |j: &usize| {
                    let is_turned = expected[*j].1 == expected[i].1;
                    expected[*j].0 == expected[i].0 && (with_mirrored || is_turned)
                };
                let first = (0..i).find(is_same);
                if expected[i].0 < 2 {
                    assert_eq!(copy.as_ref().map(|copy| copy.original), first, "{seed} {i}");
                }
                if let Some(copy) = copy {
                    check(&meshes, i, copy);
                    let is_mirrored = expected[i].1 != expected[copy.original].1;
                    assert!(expected[i].0 == 2 || copy.is_mirrored == is_mirrored);
                }
            }
        }
    }
}

#[test]
fn what_is_off_by_more_than_the_tolerance_is_no_copy() {
    for seed in 0..20 {
        let mut random = Pcg64::seed_from_u64(seed);
        let lump = lump(&mut random);
        let motion = Motion::random(&mut random, false, 3.0);
        let v = random.random_range(0..lump.positions().len());
        let direction = normalize([0; 3].map(|_| random.random_range(-1.0..1.0)));
        let off = |amount: f64| {
            let mut at = 0;
            moved(&lump, |&p| {
                at += 1;
                let off = if at == v + 1 { amount } else { 0.0 };
                motion.place(add(p, scale(direction, off)))
            })
        };
        let is_copy = |amount: f64| found(&[lump.clone(), off(amount)], true)[1].is_some();
        // The lump's size is about 1; an error of the three vertices that are aligned grows.
        assert!(is_copy(0.0) && is_copy(1e-6), "{seed}");
        assert!(!is_copy(1e-4) && !is_copy(1e-2), "{seed}");
        let larger = moved(&lump, |&p| motion.place(scale(p, 1.0 + 1e-4)));
        assert!(found(&[lump.clone(), larger], true)[1].is_none());
        // Turned inside out, and mirrored without that.
        let inner = permuted(&lump, &mut random, true);
        let mirror = moved(&lump, |&[x, y, z]| [-x, y, z]);
        for other in [inner.clone(), mirror.clone()] {
            assert_eq!(found(&[lump.clone(), other], true), [None, None]);
        }
        // But these two are mirror images.
        assert!(found(&[inner, mirror], true)[1].is_some());
    }
}

/// Bent in another way, with the same lengths: a fold up and a fold down.
#[test]
fn a_surface_bent_otherwise_is_no_copy() {
    let strip = |angles: [f64; 3]| {
        let mut points: Vec<[f64; 2]> = vec![[0.0; 2]];
        let mut angle: f64 = 0.0;
        for (k, turn) in angles.into_iter().enumerate() {
            let [x, y] = points[k];
            let step = 1.0 + 0.1 * k as f64;
            points.push([x + step * angle.cos(), y + step * angle.sin()]);
            angle += turn;
        }
        let positions = points.iter().flat_map(|&[x, y]| [[x, y, 0.0], [x, y, 1.3]]);
        let quads = (0..3).flat_map(|k| {
            [
                [2 * k, 2 * k + 2, 2 * k + 1],
                [2 * k + 2, 2 * k + 3, 2 * k + 1],
            ]
        });
        TriangleMesh::new(positions.collect(), quads.collect()).unwrap()
    };
    let (zigzag, round) = (strip([0.5, -0.5, 0.0]), strip([0.5, 0.5, 0.0]));
    assert_eq!(found(&[zigzag.clone(), round], true), [None, None]);
    assert!(found(&[zigzag.clone(), zigzag], false)[1].is_some());
    // A square folded along its diagonal, up or down: lengths and distances from the centre are equal.
    let square = |height: f64| {
        let corners = [
            [0.0; 3],
            [1.0, 0.0, height],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, height],
        ];
        TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    };
    for with_mirrored in [false, true] {
        assert_eq!(
            found(&[square(0.3), square(-0.3)], with_mirrored),
            [None, None]
        );
        assert!(found(&[square(0.3), square(0.3)], with_mirrored)[1].is_some());
    }
}

#[test]
fn symmetric_flat_and_tiny_meshes_are_found_at_once() {
    let mut random = Pcg64::seed_from_u64(1);
    let triangle = |side: f64| {
        let positions = vec![[0.0; 3], [3.0 * side, 0.0, 0.0], [side, side, 0.0]];
        TriangleMesh::new(positions, vec![[0, 1, 2]]).unwrap()
    };
    for mesh in [
        shapes::sphere(6),
        shapes::torus(1.0, 0.4, 30, 12),
        shapes::rectangle(2.0, 1.0, 30, 15),
        shapes::cube(1),
        shapes::moebius_strip(0.4, 24, 2),
        triangle(1.0),
    ] {
        let motion = Motion::random(&mut random, false, 5.0);
        let copy = permuted(&moved(&mesh, |&p| motion.place(p)), &mut random, false);
        let meshes = [mesh, copy];
        for with_mirrored in [false, true] {
            let all = found(&meshes, with_mirrored);
            let copy = all[1].as_ref();
            let copy = copy.unwrap_or_else(|| panic!("{}", meshes[0].triangles().len()));
            assert!(!copy.is_mirrored);
            check(&meshes, 1, copy);
        }
    }
    // A flat scalene triangle is mirrored as seen from its front.
    let [a, b, c] = [[0.0; 3], [3.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
    let turned = TriangleMesh::new(vec![a, b, c], vec![[0, 2, 1]]).unwrap();
    let mirror = moved(&turned, |&[x, y, z]| [x, -y, z]);
    let meshes = [triangle(1.0), mirror, triangle(1.0 + 1e-3)];
    assert_eq!(found(&meshes, false), [None, None, None]);
    assert!(found(&meshes, true)[1].as_ref().unwrap().is_mirrored);
}

#[test]
fn kinds_and_fits_are_asked() {
    let cube = shapes::cube(2);
    let meshes = [&cube, &cube, &cube, &cube];
    let all = copies(&meshes, &[1, 0, 1, 0], true, &|i, _| i != 3);
    let originals: Vec<Option<usize>> =
        all.iter().map(|c| c.as_ref().map(|c| c.original)).collect();
    assert_eq!(originals, [None, None, Some(0), None]);
    // A fit that only one of the cube's rotations has.
    let mut ends = std::collections::BTreeSet::new();
    for end in 0..cube.positions().len() as u32 {
        let fits = |_: usize, copy: &Congruence| copy.vertices[0] == end;
        if let Some(copy) = &copies(&meshes[..2], &[0, 0], true, &fits)[1] {
            assert_eq!(copy.vertices[0], end);
            ends.insert(end);
        }
    }
    assert!(ends.len() > 1, "{ends:?}");
}

#[test]
fn meshes_without_extent_are_no_copies() {
    let of = |positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>| {
        TriangleMesh::new(positions, triangles).unwrap()
    };
    let point = of(vec![[1e200; 3]; 3], vec![[0, 1, 2]]);
    let line = of(
        vec![[0.0; 3], [1e200, 0.0, 0.0], [3e199, 0.0, 0.0]],
        vec![[0, 1, 2]],
    );
    let small = of(
        vec![[0.0; 3], [1e-200, 0.0, 0.0], [0.0, 1e-200, 0.0]],
        vec![[0, 1, 2]],
    );
    let apart = of(
        vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [5.0; 3],
            [6.0, 5.0, 5.0],
            [5.0, 6.0, 5.0],
        ],
        vec![[0, 1, 2], [3, 4, 5]],
    );
    let folded = of(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2], [0, 0, 1]],
    );
    for mesh in [point, line, apart, folded] {
        assert_eq!(
            found(&[mesh.clone(), mesh, small.clone()], true),
            [None, None, None]
        );
    }
    assert!(found(&[small.clone(), small], true)[1].is_some());
    assert!(found(&[], true).is_empty());
}

#[test]
fn thousands_of_parts_take_seconds() {
    let mut random = Pcg64::seed_from_u64(3);
    let lump = lump(&mut random);
    let copies: Vec<TriangleMesh> = (0..5_000)
        .map(|_| {
            let motion = Motion::random(&mut random, false, 50.0);
            moved(&lump, |&p| motion.place(p))
        })
        .collect();
    let near: Vec<TriangleMesh> = (0..2_000)
        .map(|_| {
            moved(&shapes::sphere(4), |p| {
                p.map(|c| c + random.random_range(-1e-4..1e-4))
            })
        })
        .collect();
    let started = Instant::now();
    assert!(found(&copies, true)[1..].iter().all(Option::is_some));
    let of_copies = started.elapsed().as_secs_f64();
    assert!(found(&near, true).iter().all(Option::is_none));
    let all = started.elapsed().as_secs_f64();
    println!("{of_copies:.2} s, {:.2} s", all - of_copies);
    assert!(all < 60.0);
}
