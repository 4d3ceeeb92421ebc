use std::sync::atomic::{AtomicUsize, Ordering};

use super::boundary::{Boundary, open_slits};
use super::newton::{Flattening, Outcome, Solved, Stop};
use super::rest::RestShapes;
use super::{SolveError, tutte};
use crate::patch::topology::Topology;
use fam_surface::{TriangleMesh, shapes};

/// A chart with its 3D corners.
struct Chart {
    topology: Topology,
    corners: Vec<[[f64; 3]; 3]>,
}

impl Chart {
    /// Cut along the edges between vertices for which `cut` holds.
    fn new(mesh: &TriangleMesh, cut: impl Fn([f64; 3]) -> bool) -> Self {
        let whole = Topology::oriented(mesh);
        let position = |v: u32| mesh.positions()[whole.source[v as usize] as usize];
        let opened = whole.topology.open(|h| {
            [whole.topology.origin(h), whole.topology.target(h)]
                .iter()
                .all(|&v| cut(position(v)))
        });
        let corners = opened.topology.triangles().iter();
        let corners = corners
            .map(|t| t.map(|v| position(opened.source[v as usize])))
            .collect();
        Self {
            topology: opened.topology,
            corners,
        }
    }

    /// A sheet of squares over the unit square, bent.
    fn bent(cells: u32, bend: impl Fn(f64, f64) -> [f64; 3]) -> Self {
        let sheet = shapes::rectangle(1.0, 1.0, cells, cells);
        let positions = sheet.positions().iter();
        let positions = positions
            .map(|&[x, y, _]| bent_point(&bend, x, y))
            .collect();
        let mesh = TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap();
        Self::new(&mesh, |_| false)
    }

    fn rest(&self) -> RestShapes {
        RestShapes::new(&self.corners, None)
    }

    fn boundary(&self, rest: &RestShapes) -> Boundary {
        Boundary::new(&self.topology, |h| {
            rest.edge_length(h as usize / 3, h as usize % 3)
        })
    }

    fn flattening(&self, rest: &RestShapes) -> Flattening {
        Flattening::new(self.topology.triangles(), rest.clone(), &[]).unwrap()
    }

    /// From Tutte's embedding, with the barrier; whether the result is injective is checked.
    fn flatten(&self) -> (Vec<[f64; 2]>, Solved) {
        let rest = self.rest();
        let boundary = self.boundary(&rest);
        let mut uv = tutte::embed(&self.topology, &rest).unwrap();
        let mut flattening = self.flattening(&rest);
        let solved = flattening
            .minimize(&mut uv, Some(&boundary), &STOP)
            .unwrap();
        assert!(tutte::valid(&self.topology, &uv));
        assert!(boundary.is_simple(&uv));
        assert_eq!(solved.energy, flattening.mean_energy(&uv));
        (uv, solved)
    }
}

fn bent_point(bend: &impl Fn(f64, f64) -> [f64; 3], x: f64, y: f64) -> [f64; 3] {
    bend(x + 0.5, y + 0.5)
}

const STOP: Stop = Stop {
    iterations: 100,
    relative_decrease: 1e-10,
    least: 0,
    pace: &|| true,
};

fn cap(cells: u32) -> Chart {
    Chart::bent(cells, |s, t| {
        let (x, y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        let polar = 1.2 * x.hypot(y);
        let angle = y.atan2(x);
        [
            polar.sin() * angle.cos(),
            polar.sin() * angle.sin(),
            polar.cos(),
        ]
    })
}

#[test]
fn a_cylinder_that_is_cut_open_becomes_flat() {
    let cylinder = shapes::open_cylinder(1.0, 3.0, 24, 10);
    let chart = Chart::new(&cylinder, |[x, y, _]| x > 0.99 && y.abs() < 1e-9);
    assert_eq!(chart.topology.boundary_loops().len(), 1);
    let (_, solved) = chart.flatten();
    assert_eq!(solved.outcome, Outcome::Converged);
    assert!((solved.energy - 4.0).abs() < 1e-8, "{solved:?}");
}

#[test]
fn a_cone_becomes_flat() {
    let cone = Chart::bent(16, |s, t| {
        let (angle, distance) = (5.0 * s, 0.2 + t);
        [
            distance * angle.cos(),
            distance * angle.sin(),
            2.0 * distance,
        ]
    });
    let (_, solved) = cone.flatten();
    assert!((solved.energy - 4.0).abs() < 1e-8, "{solved:?}");
}

/// A ring around a cylinder is no disk: without a cut it lies flat as an annulus.
#[test]
fn a_cylinder_without_a_cut_becomes_an_annulus() {
    let ring = shapes::open_cylinder(1.0, 0.3, 24, 4);
    let chart = Chart::new(&ring, |_| false);
    assert_eq!(chart.topology.boundary_loops().len(), 2);
    let (_, solved) = chart.flatten();
    assert!((4.0..4.2).contains(&solved.energy), "{solved:?}");
}

#[test]
fn no_step_is_taken_once_there_are_to_be_no_more() {
    let chart = cap(6);
    let rest = chart.rest();
    let mut uv = tutte::embed(&chart.topology, &rest).unwrap();
    let asked = AtomicUsize::new(0);
    let two = Stop {
        pace: &|| asked.fetch_add(1, Ordering::Relaxed) < 2,
        ..STOP
    };
    let mut flattening = chart.flattening(&rest);
    let solved = flattening.minimize(&mut uv, None, &two).unwrap();
    assert_eq!(
        (solved.iterations, solved.outcome),
        (2, Outcome::OutOfIterations)
    );
    assert_eq!(solved.energy, flattening.mean_energy(&uv));
    let three = Stop {
        least: 3,
        pace: &|| false,
        ..STOP
    };
    let mut uv = tutte::embed(&chart.topology, &rest).unwrap();
    assert_eq!(
        flattening
            .minimize(&mut uv, None, &three)
            .unwrap()
            .iterations,
        3
    );
}

#[test]
fn every_iteration_decreases_the_energy_and_keeps_the_map_injective() {
    let chart = cap(12);
    let rest = chart.rest();
    let boundary = chart.boundary(&rest);
    let mut flattening = chart.flattening(&rest);
    let mut uv = tutte::embed(&chart.topology, &rest).unwrap();
    let one = Stop {
        iterations: 1,
        ..STOP
    };
    let mut energy = flattening.mean_energy(&uv);
    for _ in 0..30 {
        let solved = flattening.minimize(&mut uv, Some(&boundary), &one).unwrap();
        assert!(tutte::valid(&chart.topology, &uv) && boundary.is_simple(&uv));
        assert!(solved.energy <= energy * (1.0 + 1e-12));
        energy = solved.energy;
    }
    assert!((4.0..4.5).contains(&energy), "{energy}");
}

#[test]
fn the_result_does_not_depend_on_place_and_size() {
    let reference = cap(8).flatten();
    for factor in [1e-30, 1e-3, 1e30] {
        let mut chart = cap(8);
        for x in chart.corners.iter_mut().flatten().flatten() {
            *x = factor * (*x + 3.0);
        }
        let (uv, solved) = chart.flatten();
        assert!((solved.energy - reference.1.energy).abs() < 1e-9);
        for (p, q) in uv.iter().flatten().zip(reference.0.iter().flatten()) {
            assert!((p - q).abs() < 1e-4);
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    assert_eq!(cap(9).flatten(), cap(9).flatten());
}

#[test]
fn holes_stay_open() {
    let sheet = shapes::rectangle(1.0, 1.0, 12, 12);
    let far = |t: &&[u32; 3]| {
        t.iter().all(|&v| {
            let [x, y, _] = sheet.positions()[v as usize];
            (x.abs() - 0.25).abs().max(y.abs()) > 0.1
        })
    };
    let triangles = sheet.triangles().iter().filter(far).copied().collect();
    let positions = sheet.positions().iter();
    let positions = positions.map(|&[x, y, _]| [x, y, 0.6 * x * x - 0.5 * y * y]);
    let mesh = TriangleMesh::new(positions.collect(), triangles).unwrap();
    let chart = Chart::new(&mesh, |_| false);
    assert_eq!(chart.topology.boundary_loops().len(), 3);
    let (_, solved) = chart.flatten();
    assert!((4.0..4.1).contains(&solved.energy), "{solved:?}");
}

/// A sheet with collapsed edges, triangles without area and needles.
#[test]
fn degenerate_triangles_are_laid_flat_too() {
    let chart = Chart::bent(10, |s, t| {
        let column = (10.0 * s).round();
        let shift = match column {
            3.0 => 0.1,
            6.0 => 0.1 * (1.0 - 1e-9),
            8.0 => -0.1 * (1.0 - 1e-4),
            _ => 0.0,
        };
        let down = if (10.0 * t).round() == 5.0 { 0.1 } else { 0.0 };
        [s + shift, t + down, 0.0]
    });
    let (uv, solved) = chart.flatten();
    assert!(uv.iter().flatten().all(|c| c.is_finite()));
    assert!(solved.energy < 5.0, "{solved:?}");
    let point = Chart::bent(3, |_, _| [1.0; 3]);
    let (_, solved) = point.flatten();
    assert!(solved.energy.is_finite());
}

/// A tube with cones on both ends, cut along half a ring in the middle.
fn closed_tube(around: u32, along: u32, height: f64) -> Chart {
    let tube = shapes::open_cylinder(1.0, height, around, along);
    let mut positions = tube.positions().to_vec();
    let mut triangles = tube.triangles().to_vec();
    for end in [-0.5, 0.5] {
        let apex = positions.len() as u32;
        let on_rim = |&v: &u32| (positions[v as usize][2] - end * height).abs() < 1e-9;
        let rim: Vec<u32> = (0..around * (along + 1)).filter(on_rim).collect();
        for (k, &v) in rim.iter().enumerate() {
            let next = rim[(k + 1) % rim.len()];
            triangles.push(if end > 0.0 {
                [v, next, apex]
            } else {
                [next, v, apex]
            });
        }
        positions.push([0.0, 0.0, end * (height + 2.0)]);
    }
    let mesh = TriangleMesh::new(positions, triangles).unwrap();
    Chart::new(&mesh, |[_, y, z]| z.abs() < 1e-9 && y > -1e-9)
}

/// Tutte's embedding alone shrinks the ends of these tubes by e^(-2π · 6) and e^(-2π · 12);
/// double precision does not tell the second from a point.
#[test]
fn long_tubes_unfold() {
    let tube = |circumferences: f64| {
        let height = 2.0 * circumferences * std::f64::consts::TAU;
        closed_tube(12, (24.0 * circumferences) as u32, height)
    };
    let long = tube(6.0);
    assert_eq!(long.topology.euler_characteristic(), 1);
    let (_, solved) = long.flatten();
    assert!(solved.energy < 200.0, "{solved:?}");
    let longer = tube(12.0);
    let uv = tutte::embed(&longer.topology, &longer.rest()).unwrap();
    assert!(tutte::valid(&longer.topology, &uv));
}

#[test]
fn affine_maps_have_their_energy_and_scale() {
    let sheet = Chart::bent(5, |s, t| [s, t, 0.0]);
    let (a, b) = (3.0, 0.5);
    let mut uv: Vec<[f64; 2]> = vec![[0.0; 2]; sheet.topology.vertices()];
    for (t, corners) in sheet.topology.triangles().iter().zip(&sheet.corners) {
        for (&v, [x, y, _]) in t.iter().zip(corners) {
            uv[v as usize] = [a * x, b * y];
        }
    }
    let mut flattening = sheet.flattening(&sheet.rest());
    let expected = 2.0 * ((a * a + b * b) * (1.0 / (a * a) + 1.0 / (b * b))).sqrt();
    assert!((flattening.mean_energy(&uv) - expected).abs() < 1e-12);
    let none = Stop {
        iterations: 0,
        ..STOP
    };
    flattening.minimize(&mut uv, None, &none).unwrap();
    // The scale at which both integrals are equal.
    let area =
        uv.iter().fold(0.0, |m: f64, q| m.max(q[0])) * uv.iter().fold(0.0, |m: f64, q| m.max(q[1]));
    assert!((area - 1.0).abs() < 1e-9);
}

/// Part of a flat map is pushed out of place and finds back, between neighbours that stay.
#[test]
fn fixed_vertices_stay() {
    let sheet = Chart::bent(10, |s, t| [s, t, 0.0]);
    let rest = sheet.rest();
    let mut flat = vec![[0.0; 2]; sheet.topology.vertices()];
    for (t, corners) in sheet.topology.triangles().iter().zip(&sheet.corners) {
        for (&v, [x, y, _]) in t.iter().zip(corners) {
            flat[v as usize] = [*x, *y];
        }
    }
    let free = |q: &[f64; 2]| (q[0] - 0.5).abs().max((q[1] - 0.5).abs()) < 0.25;
    let fixed: Vec<bool> = flat.iter().map(|q| !free(q)).collect();
    let some = sheet.topology.triangles().iter().enumerate();
    let patch: Vec<u32> = some
        .filter(|(_, t)| t.iter().any(|&v| !fixed[v as usize]))
        .map(|(t, _)| t as u32)
        .collect();
    let triangles: Vec<[u32; 3]> = patch
        .iter()
        .map(|&t| sheet.topology.triangles()[t as usize])
        .collect();
    let mut uv = flat.clone();
    for (k, (q, fixed)) in uv.iter_mut().zip(&fixed).enumerate() {
        if !fixed {
            *q = [
                q[0] + 0.03 * (k as f64).sin(),
                q[1] + 0.03 * (k as f64).cos(),
            ];
        }
    }
    let pushed = uv.clone();
    let mut flattening = Flattening::new(&triangles, rest.subset(&patch), &fixed).unwrap();
    let solved = flattening.minimize(&mut uv, None, &STOP).unwrap();
    assert!(solved.iterations > 0 && (solved.energy - 4.0).abs() < 1e-9);
    for ((p, q), (pushed, fixed)) in uv.iter().zip(&flat).zip(pushed.iter().zip(&fixed)) {
        assert!((p[0] - q[0]).abs().max((p[1] - q[1]).abs()) < 1e-5);
        assert!(!fixed || p == pushed);
    }
}

/// The barrier holds a spiral strip apart that would otherwise overlap itself.
#[test]
fn what_would_overlap_comes_to_lie_side_by_side() {
    let strip = |turns: f64| {
        move |s: f64, t: f64| {
            let angle = turns * std::f64::consts::TAU * s;
            let radius = 1.0 + 0.5 * t;
            [radius * angle.cos(), radius * angle.sin(), 0.7 * s]
        }
    };
    let chart = Chart::bent(24, strip(1.3));
    let (_, solved) = chart.flatten();
    let rest = chart.rest();
    let boundary = chart.boundary(&rest);
    let mut free = tutte::embed(&chart.topology, &rest).unwrap();
    let alone = chart
        .flattening(&rest)
        .minimize(&mut free, None, &STOP)
        .unwrap();
    assert!(tutte::valid(&chart.topology, &free) && !boundary.is_simple(&free));
    assert!(
        alone.energy < solved.energy && solved.energy < 6.0,
        "{alone:?} {solved:?}"
    );
}

#[test]
fn what_cannot_be_flattened_is_an_error() {
    let torus = Chart::new(&shapes::torus(1.0, 0.4, 8, 6), |_| false);
    assert_eq!(
        tutte::embed(&torus.topology, &torus.rest()),
        Err(SolveError::NotADisk)
    );
    let sheet = Chart::bent(2, |s, t| [s, t, 0.0]);
    let rest = sheet.rest();
    let few = rest.subset(&[0, 1]);
    assert!(matches!(
        tutte::embed(&sheet.topology, &few),
        Err(SolveError::LengthMismatch { found: 2, .. })
    ));
    assert!(Flattening::new(sheet.topology.triangles(), few, &[]).is_err());
    assert!(Flattening::new(sheet.topology.triangles(), rest.clone(), &[true]).is_err());
    let mut flattening = sheet.flattening(&rest);
    let mut nothing = vec![[0.0; 2]; sheet.topology.vertices()];
    assert_eq!(
        flattening.minimize(&mut nothing, None, &STOP),
        Err(SolveError::Flipped { triangle: 0 })
    );
    assert!(flattening.minimize(&mut nothing[1..], None, &STOP).is_err());
}

/// A solved cap is cut from its boundary to its middle; the solver goes on from there.
#[test]
fn a_longer_cut_lowers_the_energy_from_where_the_map_was() {
    let chart = cap(12);
    let (uv, before) = chart.flatten();
    let topology = &chart.topology;
    let mut heights = vec![[0.0; 3]; topology.vertices()];
    for (t, corners) in topology.triangles().iter().zip(&chart.corners) {
        for (&v, corner) in t.iter().zip(corners) {
            heights[v as usize] = *corner;
        }
    }
    let on_path = |v: u32| heights[v as usize][1].abs() < 1e-9 && heights[v as usize][0] > -1e-9;
    let longer = topology.open(|h| on_path(topology.origin(h)) && on_path(topology.target(h)));
    assert_eq!(longer.topology.vertices(), topology.vertices() + 6);
    let rest = chart.rest();
    let boundary = Boundary::new(&longer.topology, |h| {
        rest.edge_length(h as usize / 3, h as usize % 3)
    });
    let mut uv: Vec<[f64; 2]> = longer.source.iter().map(|&v| uv[v as usize]).collect();
    open_slits(&longer.topology, &longer.source, &boundary, &mut uv).unwrap();
    let mut flattening = Flattening::new(longer.topology.triangles(), rest, &[]).unwrap();
    let after = flattening
        .minimize(&mut uv, Some(&boundary), &STOP)
        .unwrap();
    assert!(tutte::valid(&longer.topology, &uv) && boundary.is_simple(&uv));
    assert!(
        after.energy - 4.0 < 0.7 * (before.energy - 4.0),
        "{before:?} {after:?}"
    );
}
