//! Charts of another shape: straight, upright, and so that they fill the square.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::random::{closed, jittered, torn, with_slivers};
use super::{Outcome, Task, moved, part, together};
use crate::LayoutConfig;
use crate::patch::topology::Topology;
use fam_surface::vector::{dot, sub};
use fam_surface::{TriangleMesh, shapes};

/// By what coordinates differ at most that `f32` cannot tell apart.
const ROUNDING: f64 = 3e-7;

fn with(change: impl Fn(&mut LayoutConfig)) -> Task<'static> {
    let mut config = LayoutConfig::default();
    change(&mut config);
    Task {
        config,
        ..Task::default()
    }
}

fn filling(weight: f64) -> Task<'static> {
    with(|config| config.coverage_weight = weight)
}

fn straightening() -> Task<'static> {
    with(|config| config.straighten = true)
}

/// Share of the length of all boundaries in the plane that runs along the axes.
fn straight_share(outcome: &Outcome) -> f64 {
    let place = |&[u, v]: &[f32; 2]| [u.into(), v.into(), 0.0];
    let positions: Vec<[f64; 3]> = outcome.uv.uvs().iter().map(place).collect();
    let plane = TriangleMesh::new(positions.clone(), outcome.uv.triangles().to_vec()).unwrap();
    let opened = Topology::oriented(&plane);
    let at = |v: u32| positions[opened.source[v as usize] as usize];
    let (mut along, mut all) = (0.0, 0.0);
    for h in opened.topology.boundary_loops().into_iter().flatten() {
        let [x, y, _] = sub(at(opened.topology.target(h)), at(opened.topology.origin(h)));
        all += x.hypot(y);
        if x.abs().min(y.abs()) <= ROUNDING {
            along += x.hypot(y);
        }
    }
    along / all
}

/// A strip of quads along a curve in the plane, of the given width.
fn along_curve(steps: u32, width: f64, place: impl Fn(f64) -> [f64; 2]) -> TriangleMesh {
    let positions = (0..=steps).flat_map(|i| {
        let at = f64::from(i) / f64::from(steps);
        let ([x, y], [p, q]) = (place(at), place(at + 1e-6));
        let long = (p - x).hypot(q - y);
        let side = [-(q - y) / long, (p - x) / long];
        [-0.5, 0.5].map(|s| [x + s * width * side[0], y + s * width * side[1], 0.0])
    });
    let quad = |i: u32| {
        let a = 2 * i;
        [[a, a + 2, a + 3], [a, a + 3, a + 1]]
    };
    TriangleMesh::new(positions.collect(), (0..steps).flat_map(quad).collect()).unwrap()
}

/// Two turns of a spiral whose windings are as far apart as they are wide.
fn spiral() -> TriangleMesh {
    along_curve(300, 1.0, |t| {
        let angle = TAU * (1.0 + 2.0 * t);
        let radius = angle / PI;
        [radius * angle.cos(), radius * angle.sin()]
    })
}

#[test]
fn a_cylinder_becomes_a_rectangle() {
    for (height, rows) in [(3.0, 6), (30.0, 40), (0.4, 2)] {
        let mesh = shapes::open_cylinder(1.0, height, 24, rows);
        let outcome = straightening().run(&mesh);
        assert_eq!(outcome.charts(), 1);
        assert!(outcome.energy() < 4.0 + 1e-6, "{}", outcome.energy());
        assert!(straight_share(&outcome) > 1.0 - 1e-9);
        let around = 24.0 * 2.0 * (PI / 24.0).sin();
        let (long, short) = (f64::max(around, height), f64::min(around, height));
        let side = 1.0 - 4.0 / 2048.0;
        let expected = side * side * short / long;
        let found = outcome.atlas.squares[0].coverage;
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "{found}, not {expected}"
        );
    }
}

/// Sides that wave by a few per cent are brought into line, those of a frame as well.
#[test]
fn what_is_nearly_a_rectangle_becomes_one() {
    let wavy = |p: &[f64; 3]| {
        let [x, y, _] = *p;
        [
            x + 0.02 * (5.0 * y).sin(),
            y + 0.02 * (4.0 * x).sin() + 0.1 * x,
            0.0,
        ]
    };
    let panel = shapes::rectangle(3.0, 2.0, 30, 20);
    let frame = part(&panel, |[x, y, _]| x.abs() > 1.0 || y.abs() > 0.6);
    for mesh in [&panel, &frame].map(|mesh| moved(mesh, wavy)) {
        let before = straight_share(&Task::default().run(&mesh));
        let outcome = straightening().run(&mesh);
        outcome.check_energy();
        let (energy, share) = (outcome.energy(), straight_share(&outcome));
        assert!(before < 0.3 && energy <= 4.1, "{before}, {energy}");
        assert!(share > 0.6, "{share}");
    }
    let outcome = straightening().run(&moved(&panel, wavy));
    assert!(straight_share(&outcome) > 1.0 - 1e-9);
}

/// A strip around a torus is curved in itself, but little.
#[test]
fn a_strip_of_a_torus_becomes_straight_within_the_bound() {
    let torus = shapes::torus(3.0, 1.0, 120, 80);
    let strip = part(&torus, |[x, y, z]| {
        x.hypot(y) > 3.0 && z.abs() < 0.3 && y > 0.2 * x.abs()
    });
    let outcome = straightening().run(&strip);
    outcome.check_energy();
    assert!(outcome.energy() > 4.0 + 1e-5 && outcome.energy() <= 4.1);
    let share = straight_share(&outcome);
    assert!(share > 1.0 - 1e-9, "{share}");
}

/// Neither is near to a rectangle: a sector of a ring through a right angle, and a disk.
#[test]
fn what_is_far_from_a_rectangle_stays_as_it_is() {
    let ring = along_curve(60, 1.0, |t| [(1.6 * t).cos(), (1.6 * t).sin()]);
    let disk = shapes::cone(1.0, 0.0, 32, 6);
    for mesh in [ring, disk] {
        let [one, other] = [Task::default(), straightening()].map(|task| task.run(&mesh));
        assert_eq!(one.uv, other.uv);
    }
}

#[test]
fn a_hairline_fills_the_square() {
    let ribbon = shapes::rectangle(10_000.0, 1.0, 1_000, 1);
    let before = Task::default().run(&ribbon);
    assert!(before.atlas.squares[0].coverage < 0.01);
    let outcome = filling(1.0).run(&ribbon);
    let (coverage, seams) = (
        outcome.atlas.squares[0].coverage,
        outcome.atlas.relative_seam_length(),
    );
    assert!(coverage >= 0.6, "{coverage}");
    assert!(seams < 2.0, "{seams}");
}

#[test]
fn a_spiral_is_divided_where_that_pays() {
    let mesh = spiral();
    let cost = |weight: f64, outcome: &Outcome| {
        let seams = outcome.atlas.relative_seam_length();
        seams + 2.0 * weight / outcome.atlas.squares[0].coverage.sqrt()
    };
    let whole = Task::default().run(&mesh);
    for weight in [1.0, 10.0] {
        let outcome = filling(weight).run(&mesh);
        let [before, after] = [&whole, &outcome].map(|of| cost(weight, of));
        let [less, more] = [&whole, &outcome].map(|of| of.atlas.squares[0].coverage);
        assert!(after <= before && more >= less, "{after}, {before}");
        assert!(weight < 3.0 || more > 1.1 * less, "{more}, {less}");
    }
}

/// A cut through any of these is longer than the little that there is to win.
#[test]
fn compact_charts_stay_whole() {
    let shapes = [
        shapes::torus(1.0, 0.4, 24, 12),
        shapes::cube(4),
        shapes::sphere(4),
        shapes::rectangle(2.0, 1.0, 6, 3),
    ];
    for mesh in shapes {
        let [one, other] = [Task::default(), filling(0.3)].map(|task| task.run(&mesh));
        assert_eq!(one.uv, other.uv);
    }
}

#[test]
fn no_more_charts_than_allowed_and_no_forbidden_edges() {
    let ribbon = shapes::rectangle(100.0, 1.0, 200, 1);
    for most in [1, 2, 5] {
        let task = with(|config| {
            config.coverage_weight = 1.0;
            config.max_charts = Some(most);
        });
        assert!(task.run(&ribbon).charts() <= most);
    }
    let edges: Vec<[u32; 2]> = (ribbon.triangles().iter())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .collect();
    let task = Task {
        forbidden: &edges,
        ..filling(1.0)
    };
    assert_eq!(task.run(&ribbon).charts(), 1);
}

/// The mean over a chart of how a direction on the surface lies in the plane.
fn direction_in_plane(outcome: &Outcome, up: [f64; 3], triangles: &[usize]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for &t in triangles {
        let [a, b, c] = outcome.mesh.corners(t);
        let (e, f) = (sub(b, a), sub(c, a));
        // The least squares solution of `x e + y f = up`.
        let (ee, ef, ff) = (dot(e, e), dot(e, f), dot(f, f));
        let determinant = ee * ff - ef * ef;
        let (eu, fu) = (dot(e, up), dot(f, up));
        let x = (ff * eu - ef * fu) / determinant;
        let y = (ee * fu - ef * eu) / determinant;
        let [p, q, r] = outcome.uv.corners(t).map(|q| q.map(f64::from));
        for k in 0..2 {
            sum[k] += determinant.sqrt() * (x * (q[k] - p[k]) + y * (r[k] - p[k]));
        }
    }
    sum
}

#[test]
fn what_is_up_on_the_surface_is_up_in_the_plane() {
    for up in [[0.0, 0.0, 2.0], [0.3, -0.8, 0.5]] {
        let task = with(|config| config.upright = Some(up));
        let tube = shapes::open_cylinder(1.0, 3.0, 24, 6);
        let sheets = [0.0, 0.7, 1.9].map(|angle: f64| {
            moved(&shapes::rectangle(2.0, 1.0, 4, 3), |&[x, y, _]| {
                [
                    5.0 + x * angle.cos(),
                    x * angle.sin() + 7.0 * angle,
                    y + 0.4 * x,
                ]
            })
        });
        let mesh = together(&[&[tube], &sheets[..]].concat());
        let outcome = task.run(&mesh);
        let mut first = 0;
        for component in &outcome.components.list {
            let triangles: Vec<usize> = (first..first + component.mesh.triangles().len()).collect();
            first += triangles.len();
            let [x, y] = direction_in_plane(&outcome, up, &triangles);
            assert!(y > 0.0 && x.abs() < 1e-3 * y, "{x}, {y}");
        }
    }
}

/// With straight sides as well, by right angles.
#[test]
fn upright_and_straight_charts_are_both() {
    let up = [0.0, 0.0, 1.0];
    let task = with(|config| {
        config.upright = Some(up);
        config.straighten = true;
    });
    let outcome = task.run(&shapes::open_cylinder(1.0, 3.0, 24, 6));
    let all: Vec<usize> = (0..outcome.mesh.triangles().len()).collect();
    let [x, y] = direction_in_plane(&outcome, up, &all);
    assert!(y > 0.0 && x.abs() < 1e-3 * y, "{x}, {y}");
    assert!(straight_share(&outcome) > 1.0 - 1e-9);
}

/// What lies flat has no up: its box lies along the axes.
#[test]
fn horizontal_charts_lie_along_the_axes() {
    let task = with(|config| config.upright = Some([0.0, 1.0, 0.0]));
    let (sin, cos) = 0.5_f64.sin_cos();
    let floor = moved(&shapes::rectangle(2.0, 1.0, 4, 3), |&[x, y, _]| {
        [cos * x - sin * y, 0.0, sin * x + cos * y]
    });
    assert!(straight_share(&task.run(&floor)) > 1.0 - 1e-9);
}

#[test]
fn whatever_is_wanted_the_result_is_valid() {
    let mut random = Pcg64::seed_from_u64(7);
    for round in 0..16 {
        let mesh = match round % 4 {
            0 => torn(&together(&closed(&mut random)), &mut random),
            _ => together(&closed(&mut random)),
        };
        let mesh = jittered(&mesh, random.random_range(0.0..0.4), &mut random);
        let mesh = with_slivers(&mesh, random.random_range(0..6), &mut random);
        // Some are long, so that they are divided.
        let stretch = 10_f64.powf(random.random_range(0.0..2.0));
        let mesh = moved(&mesh, |&[x, y, z]| [stretch * x, y, z]);
        let wants = [1, 2, 4, 7][round / 4 % 4];
        let task = with(|config| {
            config.straighten = wants & 1 > 0;
            config.upright = (wants & 2 > 0).then_some([0.1, 1.0, 0.2]);
            config.coverage_weight = if wants & 4 > 0 { 3.0 } else { 0.0 };
        });
        let plain = Task::default().run(&mesh);
        let outcome = task.run(&mesh);
        for (one, other) in plain.atlas.components.iter().zip(&outcome.atlas.components) {
            let [before, after] = [one, other].map(|of| of.distortion.energy);
            let bound = before.max(4.1);
            assert!(
                after <= bound * (1.0 + 1e-9) || one.root_area == 0.0,
                "{after} in round {round}"
            );
        }
        if wants == 4 {
            assert!(outcome.atlas.squares[0].coverage >= plain.atlas.squares[0].coverage);
        }
    }
}

/// Of any size, and however small the unit.
#[test]
fn sizes_out_of_range_do_no_harm() {
    for unit in [1e-200, 1e-30, 1e100, 1e200] {
        let strip = moved(&shapes::rectangle(50.0, 1.0, 60, 2), |p| {
            p.map(|c| unit * c)
        });
        let task = with(|config| {
            config.straighten = true;
            config.upright = Some([1e-200, 1e-190, 0.0]);
            config.coverage_weight = 1.0;
        });
        // Of such sizes the metrics know nothing.
        let outcome = task.run_unchecked(&strip);
        assert!(
            outcome.atlas.squares[0].coverage > 0.6,
            "{}",
            outcome.atlas.squares[0].coverage
        );
    }
    let line = TriangleMesh::new(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2]]).unwrap();
    let task = with(|config| {
        config.straighten = true;
        config.upright = Some([0.0, 1.0, 0.0]);
        config.coverage_weight = 1.0;
    });
    task.run(&line);
}
