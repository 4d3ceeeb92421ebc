//! Equal parts that share their place.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Outcome, Task, moved, together};
use crate::{LayoutConfig, Stack};
use fam_surface::TriangleMesh;
use fam_surface::metrics::engine::{EngineCheck, Kind, Severity, findings};
use fam_surface::shapes::{bucket, cone, cube, open_cylinder, rectangle, sphere};
use fam_surface::vector::{cross, dot, normalize, scale};

fn stacking(stack: Stack) -> Task<'static> {
    Task {
        config: LayoutConfig {
            stack,
            ..LayoutConfig::default()
        },
        ..Task::default()
    }
}

/// Turned and moved by chance, maybe mirrored with its outside still outside, its vertices and
/// triangles in another order.
fn copy(mesh: &TriangleMesh, is_mirrored: bool, random: &mut Pcg64) -> TriangleMesh {
    let mut vector = || [0; 3].map(|_| random.random_range(-1.0..1.0));
    let first = normalize(vector());
    let third = normalize(cross(first, vector()));
    let turn = if is_mirrored { -1.0 } else { 1.0 };
    let axes = [first, scale(cross(third, first), turn), third];
    let shift = scale(vector(), 40.0);
    let count = mesh.positions().len();
    let mut order: Vec<u32> = (0..count as u32).collect();
    for i in (1..count).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    let mut positions = vec![[0.0; 3]; count];
    for (&p, &to) in mesh.positions().iter().zip(&order) {
        positions[to as usize] = [0, 1, 2].map(|k| dot(axes[k], p) + shift[k]);
    }
    let mut triangles: Vec<[u32; 3]> = mesh
        .triangles()
        .iter()
        .map(|t| {
            let mut corners = t.map(|v| order[v as usize]);
            corners.rotate_left(random.random_range(0..3));
            if is_mirrored {
                corners.reverse();
            }
            corners
        })
        .collect();
    for i in (1..triangles.len()).rev() {
        triangles.swap(i, random.random_range(0..=i));
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// A ball without any symmetry.
fn lump(random: &mut Pcg64) -> TriangleMesh {
    moved(&sphere(3), |p| {
        p.map(|c| c + random.random_range(-0.03..0.03))
    })
}

/// A bent sheet without any symmetry, in several charts if it has to be.
fn sheet(random: &mut Pcg64) -> TriangleMesh {
    moved(&rectangle(2.0, 1.0, 9, 6), |&[x, y, _]| {
        [
            x,
            y,
            0.3 * x * x + 0.2 * x * y + random.random_range(-0.01..0.01),
        ]
    })
}

/// All that holds of layouts with stacks: parts lie on their originals bit for bit, and all originals
/// beside each other.
fn check(outcome: &Outcome, stack: Stack) {
    let metrics = outcome.metrics();
    assert_eq!(metrics.unintended_overlaps(), 0, "{metrics}");
    assert_eq!(
        (metrics.flipped_triangles, metrics.collapsed_triangles),
        (0, 0)
    );
    let all = &outcome.atlas.components;
    let upon = || all.iter().filter_map(|one| Some((one, one.stacked?)));
    let (mut charts, mut mirrored) = (0, 0);
    for (one, stacked) in upon() {
        let original = &all[stacked.on];
        assert_eq!(original.stacked, None);
        assert!(!stacked.is_mirrored || stack == Stack::Mirrored);
        assert_eq!(one.uvs.uvs(), original.uvs.uvs());
        assert_eq!(one.charts, original.charts);
        charts += one.charts as u64;
        mirrored += if stacked.is_mirrored {
            one.charts as u64
        } else {
            0
        };
    }
    assert_eq!(
        (metrics.stacked_charts, metrics.mirrored_charts),
        (charts, mirrored)
    );
    assert_eq!(metrics.stacked_pairs > 0, charts > 0);
    assert_eq!(metrics.charts, outcome.charts());
    let apart = all.iter().filter(|one| one.stacked.is_none());
    let area: f64 = apart
        .flat_map(|one| (0..one.uvs.triangles().len()).map(|t| one.uvs.corners(t)))
        .map(|corners| 0.5 * super::doubled_area(corners).abs())
        .sum();
    let covered: f64 = outcome.atlas.squares.iter().map(|one| one.coverage).sum();
    assert!((covered - area).abs() < 1e-3);
}

#[test]
fn equal_parts_share_their_place() {
    for seed in 0..3 {
        let mut random = Pcg64::seed_from_u64(seed);
        let originals = [lump(&mut random), sheet(&mut random), cone(1.0, 2.0, 9, 3)];
        let mut parts = Vec::new();
        let mut kinds = Vec::new();
        for _ in 0..random.random_range(5..9) {
            let (of, is_mirrored) = (random.random_range(0..3), random.random_bool(0.4));
            parts.push(copy(&originals[of], is_mirrored, &mut random));
            kinds.push((of, is_mirrored));
        }
        // Off by a thousandth.
        parts.push(moved(&originals[0], |&[x, y, z]| [1.001 * x + 90.0, y, z]));
        let mesh = together(&parts);
        let mut seen = Vec::new();
        for stack in [Stack::None, Stack::Identical, Stack::Mirrored] {
            let outcome = stacking(stack).run_unchecked(&mesh);
            assert_eq!(outcome.components.list.len(), parts.len());
            check(&outcome, stack);
            if stack == Stack::None {
                outcome.check(true);
            }
            let all = &outcome.atlas.components;
            assert_eq!(all[parts.len() - 1].stacked, None);
            for (i, &(of, is_mirrored)) in kinds.iter().enumerate() {
                // A cone is its own mirror image, but for its diagonals.
                let is_equal = |other: &(usize, bool)| {
                    other.0 == of && (stack == Stack::Mirrored || other.1 == is_mirrored)
                };
                let first = kinds[..i].iter().position(is_equal);
                let first = first.filter(|_| stack != Stack::None);
                if of < 2 {
                    assert_eq!(all[i].stacked.map(|one| one.on), first, "{seed} {i}");
                }
            }
            seen.push(all.iter().filter(|one| one.stacked.is_none()).count());
        }
        assert!(seen[0] >= seen[1] && seen[1] >= seen[2]);
    }
}

/// The scale is that of the originals alone.
#[test]
fn a_stack_has_the_texels_of_one() {
    let mut random = Pcg64::seed_from_u64(7);
    let lump = lump(&mut random);
    let copies: Vec<TriangleMesh> = (0..9).map(|_| copy(&lump, false, &mut random)).collect();
    let area = |meshes: &[TriangleMesh], stack| {
        let outcome = stacking(stack).run_unchecked(&together(meshes));
        check(&outcome, stack);
        let one = &outcome.atlas.components[0].uvs;
        let corners = (0..one.triangles().len()).map(|t| one.corners(t));
        corners.map(|c| super::doubled_area(c).abs()).sum::<f64>()
    };
    let alone = area(&copies[..1], Stack::None);
    assert_eq!(area(&copies, Stack::Identical), alone);
    assert!(area(&copies, Stack::None) < 0.2 * alone);
}

/// Two cylinders one beside the other, as labels or marks or a map tell them apart.
#[test]
fn parts_are_stacked_only_with_what_is_asked_for_alike() {
    let cylinder = moved(&open_cylinder(1.0, 2.0, 16, 4), |&[x, y, z]| {
        [x + 0.05 * y * z, y + 0.04 * x * x, z]
    });
    let beside = moved(&cylinder, |&[x, y, z]| [x + 5.0, y, z]);
    let mesh = together(&[cylinder.clone(), beside]);
    let (vertices, triangles) = (
        cylinder.positions().len() as u32,
        cylinder.triangles().len(),
    );
    let stacks = |task: Task| {
        let outcome = task.run_unchecked(&mesh);
        assert_eq!(outcome.metrics().unintended_overlaps(), 0);
        outcome.atlas.components[1].stacked.is_some()
    };
    let task = || stacking(Stack::Identical);
    assert!(stacks(task()));
    let labels: Vec<u32> = (0..2 * triangles)
        .map(|t| u32::from(t >= triangles))
        .collect();
    let labelled = |squares| Task {
        labels: &labels,
        squares,
        ..task()
    };
    assert!(stacks(labelled(&[])) && stacks(labelled(&[0, 0])));
    assert!(
        !labelled(&[0, 1])
            .run_unchecked(&mesh)
            .atlas
            .components
            .iter()
            .any(|c| c.stacked.is_some())
    );
    let edge = |shift: u32| {
        let [a, b, _] = cylinder.triangles()[10];
        [a + shift, b + shift]
    };
    for edges in [&[edge(0)][..], &[edge(vertices)]] {
        assert!(!stacks(Task {
            wanted: edges,
            ..task()
        }));
        assert!(!stacks(Task {
            forbidden: edges,
            ..task()
        }));
    }
    let both = [edge(0), edge(vertices)];
    assert!(stacks(Task {
        wanted: &both,
        ..task()
    }));
    assert!(stacks(Task {
        forbidden: &both,
        ..task()
    }));
    let same = |[x, y, _]: [f64; 3]| {
        [if x > 2.5 { x - 5.0 } else { x }, y].map(|c| (c * 64.0).round() as f32)
    };
    let other = |[x, y, _]: [f64; 3]| [x, y].map(|c| c as f32);
    assert!(stacks(Task {
        map: Some(&same),
        ..task()
    }));
    assert!(!stacks(Task {
        map: Some(&other),
        ..task()
    }));
}

/// What an engine says of our own layouts.
#[test]
fn engines_have_nothing_against_layouts_and_know_stacks() {
    let mut random = Pcg64::seed_from_u64(11);
    let lump = lump(&mut random);
    let parts = [
        copy(&lump, false, &mut random),
        copy(&lump, true, &mut random),
        copy(&lump, false, &mut random),
        moved(&cube(3), |p| p.map(|c| c + 100.0)),
        bucket(0.3),
    ];
    let mesh = together(&parts);
    let of = |stack, check| {
        let outcome = stacking(stack).run_unchecked(&mesh);
        let found = findings(&mesh, &outcome.uv, check).unwrap();
        found
            .iter()
            .map(|one| (one.kind, one.severity, one.count))
            .collect::<Vec<_>>()
    };
    for check in [&EngineCheck::LIGHTMAP, &EngineCheck::TEXTURE] {
        assert_eq!(of(Stack::None, check), []);
    }
    let texture = of(Stack::Mirrored, &EngineCheck::TEXTURE);
    let kinds: Vec<_> = texture
        .iter()
        .map(|&(kind, severity, _)| (kind, severity))
        .collect();
    let expected = [
        (Kind::Mirrored, Severity::Warning),
        (Kind::Stacked, Severity::Note),
    ];
    assert_eq!(kinds, expected);
    assert_eq!(2 * texture[0].2, texture[1].2);
    let lightmap = of(Stack::Identical, &EngineCheck::LIGHTMAP);
    assert_eq!(lightmap.len(), 1);
    assert_eq!(
        (lightmap[0].0, lightmap[0].1),
        (Kind::Stacked, Severity::Error)
    );
}

/// Degenerate, tiny and huge parts, and thousands of them.
#[test]
fn whatever_the_parts_are_stacks_are_valid() {
    let triangle = |size: f64, at: f64| {
        let positions = vec![[at, 0.0, 0.0], [at + size, 0.0, 0.0], [at, 0.5 * size, 0.0]];
        TriangleMesh::new(positions, vec![[0, 1, 2]]).unwrap()
    };
    let scaled = |mesh: &TriangleMesh, by: f64| moved(mesh, |p| p.map(|c| by * c));
    let many: Vec<TriangleMesh> = (0..2000)
        .map(|i| triangle(1.0, 3.0 * f64::from(i)))
        .collect();
    let line = TriangleMesh::new(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2]]).unwrap();
    let sets = [
        many,
        vec![
            triangle(1e-200, 0.0),
            triangle(1e-200, 1e-190),
            triangle(1e-9, 1.0),
        ],
        vec![
            scaled(&cube(2), 1e200),
            moved(&scaled(&cube(2), 1e200), |p| p.map(|c| c + 1e201)),
        ],
        vec![
            line.clone(),
            moved(&line, |p| p.map(|c| c + 7.0)),
            triangle(1.0, 50.0),
        ],
    ];
    for (set, parts) in sets.iter().enumerate() {
        let mesh = together(parts);
        for stack in [Stack::Identical, Stack::Mirrored] {
            let outcome = stacking(stack).run_unchecked(&mesh);
            let is_stacked = |one: &&crate::ComponentLayout| one.stacked.is_some();
            let count = outcome.atlas.components.iter().filter(is_stacked).count();
            assert_eq!(count, [1999, 0, 1, 0][set]);
            assert_eq!(outcome.metrics().unintended_overlaps(), 0);
        }
    }
}
