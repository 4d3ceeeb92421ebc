use super::*;
use crate::cut::disk::cut_to_disk;
use crate::cut::test_surfaces::{cubes, pierced_plate};
use crate::patch::Patch;
use crate::solve::boundary::Boundary;
use crate::solve::orientation::first_flipped;
use crate::solve::rest::RestShapes;
use crate::solve::tutte::embed;
use fam_surface::{TriangleMesh, shapes};

fn all() -> Vec<TriangleMesh> {
    vec![
        shapes::sphere(12),
        shapes::torus(1.0, 0.4, 40, 20),
        pierced_plate(2),
        shapes::rectangle(1.0, 1.0, 20, 20),
        shapes::open_cylinder(1.0, 2.0, 30, 12),
        shapes::bust(0.1),
        shapes::moebius_strip(0.5, 40, 4),
        cubes([6, 6, 6], |[x, y, z]| (x * y + z) % 3 != 0).swap_remove(0),
    ]
}

fn kind(topology: &Topology) -> (usize, i64, usize) {
    (
        topology.pieces().1,
        topology.euler_characteristic(),
        topology.boundary_loops().len(),
    )
}

/// Whether no two edges have the same ends: Tutte's embedding needs that.
fn is_simplicial(topology: &Topology) -> bool {
    let ends = |h| [topology.origin(h), topology.target(h)];
    let mut edges: Vec<[u32; 2]> = topology.edges().map(ends).collect();
    edges.iter_mut().for_each(|ends| ends.sort_unstable());
    edges.sort_unstable();
    edges.windows(2).all(|pair| pair[0] != pair[1])
}

#[test]
fn handles_and_holes_stay() {
    for mesh in all() {
        let patch = Patch::of(&mesh);
        for wanted in [0, 60, 300] {
            let less = Simplification::new(&patch.topology, &patch.positions, wanted);
            let left = less.simplified(1.0).patch.topology;
            assert_eq!(kind(&left), kind(&patch.topology));
            assert_eq!(left.triangles().len(), less.triangles());
            assert!(is_simplicial(&left));
            for h in 0..left.half_edges() {
                if let Some(twin) = left.twin(h) {
                    assert_eq!(left.twin(twin), Some(h));
                    assert_eq!(left.origin(h), left.target(twin));
                }
            }
        }
    }
}

#[test]
fn a_carried_cut_opens_the_surface_as_before() {
    for mesh in all() {
        let patch = Patch::of(&mesh);
        for wanted in [0, 60, 300] {
            let less = Simplification::new(&patch.topology, &patch.positions, wanted);
            let left = less.simplified(1.0);
            let coarse = &left.patch;
            let last = coarse.topology.vertices() as u32 - 1;
            let tips = [last / 3, last / 2, last];
            let cut = cut_to_disk(&coarse.topology, &coarse.lengths, &tips);
            let before = kind(&cut.open(&coarse.topology).topology);
            let carried = less.carried(&cut, &left.triangles);
            assert_eq!(kind(&carried.open(&patch.topology).topology), before);
        }
    }
}

/// A sheet is flat, so its own coordinates are a layout at every stage.
#[test]
fn a_refined_layout_stays_valid_and_near_to_the_surface() {
    let sheet = shapes::rectangle(2.0, 1.0, 40, 20);
    let patch = Patch::of(&sheet);
    let mut less = Simplification::new(&patch.topology, &patch.positions, 60);
    let left = less.simplified(1.0).patch;
    let mut uv = vec![[f64::NAN; 2]; patch.positions.len()];
    for &v in &left.source {
        let [x, y, _] = patch.positions[v as usize];
        uv[v as usize] = [x, y];
    }
    for wanted in [200, 700, usize::MAX] {
        less.refine(wanted, &mut uv).unwrap();
        let stage = less.simplified(1.0).patch;
        let own: Vec<[f64; 2]> = stage.source.iter().map(|&v| uv[v as usize]).collect();
        assert_eq!(first_flipped(stage.topology.triangles(), &own), None);
    }
    assert_eq!(less.triangles(), sheet.triangles().len());
    for (q, p) in uv.iter().zip(&patch.positions) {
        let away = (q[0] - p[0]).hypot(q[1] - p[1]);
        assert!(away < 1e-6, "{away}");
    }
}

/// A layout with deep folds of its boundary: no two triangles overlap, however far it is from
/// the surface.
#[test]
fn a_refined_layout_covers_no_more_than_before() {
    let patch = Patch::of(&shapes::open_sphere(0.6, 40, 24));
    let mut less = Simplification::new(&patch.topology, &patch.positions, 300);
    let left = less.simplified(1.0).patch;
    let rest = |patch: &Patch| {
        let corners = |t: &[u32; 3]| t.map(|v| patch.positions[v as usize]);
        let all: Vec<_> = patch.topology.triangles().iter().map(corners).collect();
        RestShapes::new(&all, Some(1.0))
    };
    let embedded = embed(&left.topology, &rest(&left)).unwrap();
    let mut uv = vec![[f64::NAN; 2]; patch.positions.len()];
    for (q, &v) in embedded.iter().zip(&left.source) {
        uv[v as usize] = *q;
    }
    less.refine(usize::MAX, &mut uv).unwrap();
    assert_eq!(first_flipped(patch.topology.triangles(), &uv), None);
    let boundary = Boundary::new(&patch.topology, |h| patch.lengths[h as usize]);
    assert!(boundary.is_simple(&uv));
}

/// Around the teeth of a comb the boundary turns by more than half a turn at a vertex: what comes
/// back there has its place neither between its neighbours nor beyond the boundary.
#[test]
fn what_comes_back_stays_within_a_boundary_that_turns_sharply() {
    let sheet = shapes::rectangle(1.0, 1.0, 90, 12);
    let place = |p: &[f64; 3]| [p[0], p[1] * (0.55 + 0.5 * (40.0 * p[0]).sin()), 0.0];
    let positions: Vec<[f64; 3]> = sheet.positions().iter().map(place).collect();
    let comb = TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap();
    let patch = Patch::of(&comb);
    let boundary = Boundary::new(&patch.topology, |h| patch.lengths[h as usize]);
    for (wanted, turn) in [(60, 0.0), (100, 0.4), (150, 1.0), (300, 2.0)] {
        let mut less = Simplification::new(&patch.topology, &patch.positions, wanted);
        // The way around has nothing to do with axes.
        let (sin, cos) = f64::sin_cos(turn);
        let flat = |p: &[f64; 3]| [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1]];
        let mut uv: Vec<[f64; 2]> = patch.positions.iter().map(flat).collect();
        let left = less.simplified(1.0).patch;
        let own: Vec<[f64; 2]> = left.source.iter().map(|&v| uv[v as usize]).collect();
        let outline = Boundary::new(&left.topology, |h| left.lengths[h as usize]);
        assert!(outline.is_simple(&own), "{wanted}");
        less.refine(usize::MAX, &mut uv).unwrap();
        assert_eq!(first_flipped(patch.topology.triangles(), &uv), None);
        assert!(boundary.is_simple(&uv), "{wanted}");
    }
}

#[test]
fn degenerate_surfaces_come_to_an_end() {
    let torus = shapes::torus(1.0, 0.4, 20, 12);
    type Place = fn(&[f64; 3]) -> [f64; 3];
    let places: [Place; 3] = [
        |_| [0.5; 3],
        |p| [p[0], 0.0, 0.0],
        |p| [p[0], if p[1] > 0.0 { 0.0 } else { p[1] }, p[2]],
    ];
    for place in places {
        let positions: Vec<[f64; 3]> = torus.positions().iter().map(place).collect();
        let mesh = TriangleMesh::new(positions, torus.triangles().to_vec()).unwrap();
        let patch = Patch::of(&mesh);
        let less = Simplification::new(&patch.topology, &patch.positions, 0);
        let left = less.simplified(1.0).patch.topology;
        assert_eq!(kind(&left), kind(&patch.topology));
        assert!(is_simplicial(&left));
    }
}

#[test]
fn restored_it_is_what_it_was_on_the_way() {
    let patch = Patch::of(&shapes::torus(1.0, 0.4, 40, 20));
    let of = |wanted| Simplification::new(&patch.topology, &patch.positions, wanted);
    let triangles = |s: Simplification| s.simplified(1.0).patch.topology.triangles().to_vec();
    assert_ne!(triangles(of(200)), triangles(of(600)));
    assert_eq!(triangles(of(200).restored(600)), triangles(of(600)));
    assert_eq!(
        triangles(of(200).restored(usize::MAX)),
        patch.topology.triangles()
    );
}

/// Triangles of a sphere stay alike in size, and none is a sliver.
#[test]
fn what_is_left_is_even_and_near_to_the_surface() {
    let patch = Patch::of(&shapes::sphere(24));
    let less = Simplification::new(&patch.topology, &patch.positions, 500);
    let left = less.simplified(1.0).patch;
    let area: f64 = left.areas.iter().sum();
    assert!(area > 0.98, "{area}");
    let mean = area / left.areas.len() as f64;
    let largest = left.areas.iter().fold(0.0, |m: f64, &a| m.max(a));
    assert!(largest < 4.0 * mean, "{}", largest / mean);
}
