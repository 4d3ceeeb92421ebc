use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

use super::*;
use crate::TriangleMesh;
use crate::vector::{add, cross, dot, length, scale, sub};

/// What a surface hangs together like.
#[derive(Debug, PartialEq)]
struct Topology {
    components: usize,
    /// Vertices − edges + triangles.
    euler: i64,
    boundary_loops: usize,
}

impl Topology {
    /// Of a mesh all of whose edges have one triangle or two of one winding, and all of whose
    /// vertices have one fan of triangles.
    fn of_manifold(mesh: &TriangleMesh) -> Self {
        let mut sides = BTreeSet::new();
        for &[a, b, c] in mesh.triangles() {
            for side in [[a, b], [b, c], [c, a]] {
                assert!(sides.insert(side), "two triangles on one side of {side:?}");
            }
        }
        let boundary: BTreeMap<u32, u32> = sides
            .iter()
            .filter(|[a, b]| !sides.contains(&[*b, *a]))
            .map(|&[a, b]| (a, b))
            .collect();
        let open = sides.iter().filter(|[a, b]| !sides.contains(&[*b, *a]));
        assert_eq!(open.count(), boundary.len(), "the boundary meets itself");
        // Triangles around a vertex, from one to the next.
        let mut fans: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
        for &[a, b, c] in mesh.triangles() {
            for [at, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
                fans.entry(at).or_default().insert(from, to);
            }
        }
        for (at, fan) in &fans {
            let ends: BTreeSet<u32> = fan.values().copied().collect();
            let start = fan.keys().find(|from| !ends.contains(from));
            let start = *start.unwrap_or(fan.keys().next().unwrap());
            let mut steps = 0;
            let mut on = Some(start);
            while let Some(&next) = on.and_then(|v| fan.get(&v)) {
                steps += 1;
                on = Some(next).filter(|&v| v != start);
            }
            assert_eq!(steps, fan.len(), "vertex {at} has several fans");
        }
        assert_eq!(
            fans.len(),
            mesh.positions().len(),
            "all vertices have triangles"
        );
        let cycles = |next: &BTreeMap<u32, u32>| {
            let mut left: BTreeSet<u32> = next.keys().copied().collect();
            let mut count = 0;
            while let Some(start) = left.pop_first() {
                count += 1;
                let mut at = next[&start];
                while left.remove(&at) {
                    at = next[&at];
                }
            }
            count
        };
        let edges = (sides.len() + boundary.len()) / 2;
        let vertices = mesh.positions().len() as i64;
        Self {
            components: parts(mesh).len(),
            euler: vertices - edges as i64 + mesh.triangles().len() as i64,
            boundary_loops: cycles(&boundary),
        }
    }

    fn closed(genus: i64) -> Self {
        Self::open(genus, 0)
    }

    fn open(genus: i64, boundary_loops: usize) -> Self {
        Self {
            components: 1,
            euler: 2 - 2 * genus - boundary_loops as i64,
            boundary_loops,
        }
    }
}

/// The triangles of every connected part, by numbers.
fn parts(mesh: &TriangleMesh) -> Vec<Vec<usize>> {
    let mut of: Vec<usize> = (0..mesh.positions().len()).collect();
    fn root(of: &[usize], mut v: usize) -> usize {
        while of[v] != v {
            v = of[v];
        }
        v
    }
    for &[a, b, c] in mesh.triangles() {
        for [a, b] in [[a, b], [b, c]] {
            let (a, b) = (root(&of, a as usize), root(&of, b as usize));
            of[a.max(b)] = a.min(b);
        }
    }
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (t, corners) in mesh.triangles().iter().enumerate() {
        parts
            .entry(root(&of, corners[0] as usize))
            .or_default()
            .push(t);
    }
    parts.into_values().collect()
}

fn area(mesh: &TriangleMesh) -> f64 {
    mesh.triangle_areas().iter().sum()
}

/// Positive where triangles are counter-clockwise from outside.
fn volume(mesh: &TriangleMesh) -> f64 {
    let signed = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        dot(a, cross(b, c)) / 6.0
    };
    (0..mesh.triangles().len()).map(signed).sum()
}

/// Degrees at the corners of all triangles.
fn angles(mesh: &TriangleMesh) -> Vec<f64> {
    let corner = |p: [[f64; 3]; 3]| {
        let (u, v) = (sub(p[1], p[0]), sub(p[2], p[0]));
        length(cross(u, v)).atan2(dot(u, v)).to_degrees()
    };
    (0..mesh.triangles().len())
        .map(|t| mesh.corners(t))
        .flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]].map(corner))
        .collect()
}

fn mean_edge(mesh: &TriangleMesh) -> f64 {
    let around = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        length(sub(b, a)) + length(sub(c, b)) + length(sub(a, c))
    };
    let count = mesh.triangles().len();
    (0..count).map(around).sum::<f64>() / (3 * count) as f64
}

fn assert_near(a: f64, b: f64) {
    assert!((a / b - 1.0).abs() < 5e-3, "{a} against {b}");
}

type Shape = (&'static str, f64, fn(f64) -> TriangleMesh);

/// The surfaces of even triangles, with a spacing that keeps their features.
const EVEN: [Shape; 10] = [
    ("hemisphere", 0.1, hemisphere),
    ("shirt", 0.06, shirt),
    ("car shell", 0.07, car_shell),
    ("double torus", 0.15, double_torus),
    ("slab", 0.1, three_holed_slab),
    ("bucket", 0.1, bucket),
    ("nail", 0.05, nail),
    ("brain", 0.05, |spacing| brain(spacing, 1)),
    ("knot", 0.2, |spacing| knot(0.5, spacing)),
    ("tube", 0.2, |spacing| hilbert_tube(2, 0.25, spacing)),
];

/// All of these with their meshes, made once.
fn even() -> impl Iterator<Item = (Shape, &'static TriangleMesh)> {
    static MESHES: OnceLock<Vec<TriangleMesh>> = OnceLock::new();
    let make = || EVEN.map(|(_, spacing, shape)| shape(spacing)).to_vec();
    EVEN.into_iter().zip(MESHES.get_or_init(make))
}

fn mesh(name: &str) -> &'static TriangleMesh {
    even().find(|(shape, _)| shape.0 == name).unwrap().1
}

#[test]
fn areas_are_those_of_the_smooth_surfaces() {
    let near = |mesh: TriangleMesh, expected| assert_near(area(&mesh), expected);
    near(torus(1.0, 0.4, 120, 60), 4.0 * PI * PI * 0.4);
    near(open_cylinder(0.5, 2.0, 100, 4), TAU);
    near(rectangle(2.0, 3.0, 4, 5), 6.0);
    near(cone(3.0, 4.0, 100, 5), 15.0 * PI);
    near(cube(7), 6.0);
    near(sphere(24), 2.0 * TAU);
    near(open_sphere(0.5, 100, 60), TAU * (1.0 + 0.5_f64.cos()));
    near(hemisphere(0.05), TAU);
    // A tube has the area of the cylinder it is bent from.
    near(knot(0.5, 0.06), TAU * 0.5 * 28.826);
    // Straight through some of the 64 cells, half a cell at either end, else in quarter circles.
    let curve = hilbert::hilbert_curve(2);
    let straight = curve
        .windows(3)
        .filter(|p| sub(p[1], p[0]) == sub(p[2], p[1]))
        .count() as f64;
    let total = straight + 1.0 + (62.0 - straight) * PI / 4.0;
    near(hilbert_tube(2, 0.25, 0.05), TAU * 0.25 * total);
}

#[test]
fn closed_surfaces_enclose_their_volume() {
    assert!((volume(&cube(3)) - 1.0).abs() < 1e-12);
    assert_near(volume(&sphere(24)), 4.0 / 3.0 * PI);
    let apex = cone(3.0, 4.0, 100, 5);
    let down = |p: &[f64; 3]| [p[0], p[1], p[2] - 4.0];
    let positions = apex.positions().iter().map(down).collect();
    let from_apex = TriangleMesh::new(positions, apex.triangles().to_vec()).unwrap();
    assert!(volume(&from_apex).abs() < 1e-9);
    assert!((volume(&apex) - 12.0 * PI).abs() < 0.1 * PI);
    assert_near(volume(&knot(0.5, 0.06)), PI * 0.25 * 28.826);
    // A shaft, a point and a head, all a little less for their round edges.
    let straight = PI * (0.16 * 0.16 * (2.31 + 0.55 / 3.0) + 0.44 * 0.44 * 0.18);
    assert!((0.93..1.0).contains(&(volume(&nail(0.03)) / straight)));
    for name in ["double torus", "slab", "bucket", "brain"] {
        assert!(volume(mesh(name)) > 0.5, "{name}");
    }
}

#[test]
fn surfaces_have_their_genus_and_their_boundary_loops() {
    let expected = [
        Topology::open(0, 1),
        Topology::open(0, 4),
        Topology::open(0, 7),
        Topology::closed(2),
        Topology::closed(3),
        Topology::closed(1),
        Topology::closed(0),
        Topology::closed(0),
        Topology::closed(1),
        Topology::open(0, 2),
    ];
    for (((name, spacing, shape), mesh), expected) in even().zip(expected) {
        let found = Topology::of_manifold(mesh);
        assert_eq!(found, expected, "{name}");
        let found = Topology::of_manifold(&shape(0.77 * spacing));
        assert_eq!(found, expected, "{name}, finer");
    }
}

#[test]
fn surfaces_stay_whole_at_any_size() {
    for size in [f64::NAN, 0.0, 0.1, 1e9, f64::INFINITY] {
        let spacing = size.max(0.1);
        let found = Topology::of_manifold(&knot(size, spacing));
        assert_eq!(found, Topology::closed(1), "{size}");
        let found = Topology::of_manifold(&hilbert_tube(0, size, spacing));
        assert_eq!(found, Topology::open(0, 2), "{size}");
    }
    for coarse in [f64::NAN, 1e9] {
        let found = Topology::of_manifold(&hemisphere(coarse));
        assert_eq!(found, Topology::open(0, 1), "{coarse}");
        let found = Topology::of_manifold(&three_holed_slab(coarse));
        assert_eq!(found, Topology::closed(3), "{coarse}");
        let found = Topology::of_manifold(&car_shell(coarse));
        assert_eq!(found, Topology::open(0, 7), "{coarse}");
        let found = Topology::of_manifold(&knot(0.5, coarse));
        assert_eq!(found, Topology::closed(1), "{coarse}");
    }
    // However fine: no more than memory holds.
    assert!(hilbert_tube(1, 0.05, 1e-9).triangles().len() < 11_000_000);
}

#[test]
fn edges_are_about_as_long_as_asked_for() {
    for ((name, spacing, _), mesh) in even() {
        let found = mean_edge(mesh) / spacing;
        assert!((0.9..1.2).contains(&found), "{name}: {found}");
    }
}

#[test]
fn no_triangle_is_a_sliver() {
    for ((name, ..), mesh) in even() {
        let angles = angles(mesh);
        let narrowest = angles.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(narrowest > 10.0, "{name}: {narrowest}");
    }
}

#[test]
fn the_same_arguments_make_the_same_bits() {
    let same = |name, one: &TriangleMesh, other: &TriangleMesh| {
        let bits = |mesh: &TriangleMesh| -> Vec<u64> {
            let numbers = mesh.positions().iter().flatten();
            numbers.map(|c| c.to_bits()).collect()
        };
        assert_eq!(bits(one), bits(other), "{name}");
        assert_eq!(one.triangles(), other.triangles(), "{name}");
    };
    for ((name, spacing, shape), mesh) in even() {
        same(name, mesh, &shape(spacing));
    }
    same("assembly", &assembly(7), &assembly(7));
    assert_ne!(assembly(7), assembly(8));
    assert_ne!(&brain(0.05, 7), mesh("brain"));
}

#[test]
fn boundaries_lie_where_the_surface_was_cut() {
    let boundary = |mesh: &TriangleMesh| -> Vec<[f64; 3]> {
        let across = crate::orientation::across(mesh.triangles());
        let open = (0..across.len()).filter(|&h| across[h] == crate::orientation::NONE);
        open.map(|h| mesh.corners(h / 3)[h % 3]).collect()
    };
    // The waist of a shirt is flat.
    let shirt = mesh("shirt");
    let waist: Vec<_> = boundary(shirt)
        .into_iter()
        .filter(|p| p[2] < -0.8)
        .collect();
    assert!(waist.len() > 30);
    let off = waist.iter().map(|p| (p[2] + 1.0).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off}");
    assert!(shirt.positions().iter().all(|p| p[2] > -1.0 - 1e-6));
    // So is the lower edge of a car between the wheels.
    let below = |p: &&[f64; 3]| p[0].abs() < 0.6 && p[2] < 0.4;
    let edge: Vec<_> = boundary(mesh("car shell"));
    let edge: Vec<_> = edge.iter().filter(below).collect();
    assert!(edge.len() > 20);
    let off = edge.iter().map(|p| (p[2] - 0.2).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off}");
}

/// The centres of the rings of a tube that has so many vertices around.
fn centres(tube: &TriangleMesh, around: usize) -> Vec<[f64; 3]> {
    let rings = tube.positions().chunks(around);
    let mean = |ring: &[[f64; 3]]| {
        [0, 1, 2].map(|k| ring.iter().map(|p| p[k]).sum::<f64>() / around as f64)
    };
    rings.map(mean).collect()
}

/// However thick they are asked to be. Where the curve through the middle of a tube comes back near itself, there is more than twice
/// the radius between; and it bends in circles of more than the radius.
#[test]
fn tubes_do_not_touch_themselves() {
    let check = |name: &str, tube: &TriangleMesh, radius: f64, spacing: f64, is_closed: bool| {
        let around = (TAU * radius / spacing).round() as usize;
        let centres = centres(tube, around);
        let mut ways = vec![0.0];
        for ends in centres.windows(2) {
            ways.push(ways[ways.len() - 1] + length(sub(ends[1], ends[0])));
        }
        let total = ways[centres.len() - 1] + spacing;
        for i in 0..centres.len() {
            for j in 0..i {
                let way = ways[i] - ways[j];
                let way = if is_closed { way.min(total - way) } else { way };
                // On a circle of the radius the other side is half a turn away.
                if way > PI * radius {
                    let apart = length(sub(centres[i], centres[j]));
                    assert!(apart > 2.0 * radius, "{name}: {apart} after {way}");
                }
            }
        }
        for p in centres.windows(3) {
            let (a, b) = (sub(p[1], p[0]), sub(p[2], p[1]));
            let bend = length(cross(a, b)).atan2(dot(a, b)) / length(a);
            assert!(bend < 1.0 / radius, "{name}: bends by {bend}");
        }
    };
    for order in 1..=3 {
        let tube = hilbert_tube(order, 1e9, 0.1);
        check("hilbert tube", &tube, 0.45, 0.1, false);
    }
    check("knot", &knot(1e9, 0.1), 0.6, 0.1, true);
}

#[test]
fn an_assembly_is_many_parts_that_cross_each_other() {
    for seed in 0..20 {
        let mesh = assembly(seed);
        let triangles = mesh.triangles().len();
        assert!((5_000..15_000).contains(&triangles), "{triangles}");
        Topology::of_manifold(&mesh);
        assert!(mesh.triangle_areas().iter().all(|a| *a > 1e-5));
        let parts = parts(&mesh);
        assert!((40..=60).contains(&parts.len()), "{}", parts.len());
        let bounds: Vec<[[f64; 2]; 3]> = parts
            .iter()
            .map(|part| {
                let points = part.iter().flat_map(|&t| mesh.corners(t));
                points.fold([[f64::INFINITY, f64::NEG_INFINITY]; 3], |bounds, p| {
                    [0, 1, 2].map(|k| [bounds[k][0].min(p[k]), bounds[k][1].max(p[k])])
                })
            })
            .collect();
        // Boxes in boxes.
        let within = |a: usize, b: usize| {
            (0..3).all(|k| bounds[a][k][0] > bounds[b][k][0] && bounds[a][k][1] < bounds[b][k][1])
        };
        assert!((0..3).all(|i| within(i + 1, i)));
        // Both windings are there.
        assert!(part_volume(&mesh, &parts[0]) > 0.0 && part_volume(&mesh, &parts[1]) < 0.0);
        // Parts that go through a wall of the housing.
        let through = (4..parts.len())
            .filter(|&i| {
                (0..3)
                    .any(|k| bounds[i][k][0] < bounds[0][k][0] || bounds[i][k][1] > bounds[0][k][1])
            })
            .count();
        assert!(through >= 3, "{through}");
    }
}

fn part_volume(mesh: &TriangleMesh, part: &[usize]) -> f64 {
    part.iter()
        .map(|&t| mesh.corners(t))
        .map(|[a, b, c]| dot(a, cross(b, c)) / 6.0)
        .sum()
}

/// The surface of a brain goes once around its centre: no triangle overhangs by more than the
/// corners that the folds cut.
#[test]
fn a_brain_has_no_triangle_that_faces_inwards() {
    for seed in [1, 2] {
        let mesh = brain(0.05, seed);
        let inwards = (0..mesh.triangles().len()).filter(|&t| {
            let [a, b, c] = mesh.corners(t);
            let middle = scale(add(add(a, b), c), 1.0 / 3.0);
            dot(mesh.area_vector(t), middle) < 0.0
        });
        let inwards = inwards.count();
        assert!(inwards * 500 < mesh.triangles().len(), "{inwards}");
    }
}
