use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::Reconstruction;
use crate::patch::topology::Topology;
use crate::{LayoutConfig, lay_out_cloud};
use fam_surface::vector::{add, cross, dot, length, scale, sub};
use fam_surface::{Components, SurfaceError, TriangleMesh, shapes};

/// The surface through points.
fn found_by(points: &[[f64; 3]], uvs: &[[f32; 2]]) -> Result<Reconstruction, SurfaceError> {
    let found = Reconstruction::of(points, uvs, &|| true)?;
    Ok(found.unwrap())
}

#[test]
fn there_is_no_surface_once_the_search_is_to_stop() {
    let points = shapes::torus(1.0, 0.4, 30, 12).positions().to_vec();
    let stopped_after = |steps: i32| {
        let left = std::cell::Cell::new(steps);
        let goes_on = || left.replace(left.get() - 1) > 0;
        Reconstruction::of(&points, &flat(&points), &goes_on).unwrap()
    };
    let asked = (0..).find(|&steps| stopped_after(steps).is_some()).unwrap();
    assert_eq!(asked, 5, "after each of the long steps");
}

/// A mesh whose vertices were moved along their triangles, so that they lie in no rows.
fn jittered(mesh: &TriangleMesh, seed: u64) -> TriangleMesh {
    let mut rng = Pcg64::seed_from_u64(seed);
    let old = mesh.positions();
    let mut new = old.to_vec();
    for t in mesh.triangles() {
        for c in 0..3 {
            let [p, a, b] = [0, 1, 2].map(|k| t[(c + k) % 3] as usize);
            let [s, t] = [0, 1].map(|_| rng.random_range(0.0..0.24));
            let along = [(a, s), (b, t)].map(|(q, s)| scale(sub(old[q], old[p]), s));
            new[p] = add(old[p], add(along[0], along[1]));
        }
    }
    TriangleMesh::new(new, mesh.triangles().to_vec()).unwrap()
}

fn noisy(points: &[[f64; 3]], amount: f64) -> Vec<[f64; 3]> {
    let mut rng = Pcg64::seed_from_u64(8);
    let mut moved = |p: &[f64; 3]| p.map(|c| c + amount * rng.random_range(-1.0..1.0));
    points.iter().map(&mut moved).collect()
}

/// The parameters of the vertices of a sheet of `columns` × `rows` quads of side 1.
fn parameters(columns: u32, rows: u32) -> Vec<[f64; 2]> {
    let row = |i: u32| (0..=rows).map(move |j| [f64::from(i), f64::from(j)]);
    (0..=columns).flat_map(row).collect()
}

/// What a network may make of them: warped, torn (with a smear), folded and overlapping.
fn torn(parameters: &[[f64; 2]]) -> Vec<[f32; 2]> {
    let size = parameters.iter().flatten().fold(0.0, |m: f64, &c| m.max(c));
    let uv = |&[s, t]: &[f64; 2]| {
        let (s, t) = (s / size, t / size);
        let tear = 0.5 / (1.0 + ((0.45 - s) / 0.004).exp());
        let (du, dv) = match s {
            s if s > 0.7 => (1.8 * (0.7 - s), 0.02),
            s if s < 0.15 => (0.3, -0.01),
            _ => (0.0, 0.0),
        };
        let u = s + 0.04 * (9.0 * t + 3.0 * s).sin() + du;
        let v = t + 0.04 * (8.0 * s).sin() + tear + dv;
        [u as f32, v as f32]
    };
    parameters.iter().map(uv).collect()
}

fn flat(points: &[[f64; 3]]) -> Vec<[f32; 2]> {
    vec![[0.0; 2]; points.len()]
}

/// The longest distance between ends of an edge along the known surface, in edges of it.
fn farthest_hop(known: &TriangleMesh, found: &TriangleMesh) -> usize {
    let mut neighbors = vec![Vec::new(); known.positions().len()];
    for t in known.triangles() {
        for c in 0..3 {
            neighbors[t[c] as usize].push(t[(c + 1) % 3]);
            neighbors[t[c] as usize].push(t[(c + 2) % 3]);
        }
    }
    let hops = |[a, b]: [u32; 2]| {
        let mut reached = vec![a];
        for hops in 0..6 {
            if reached.contains(&b) {
                return hops;
            }
            let next = reached.iter().flat_map(|&v| neighbors[v as usize].clone());
            reached = reached.iter().copied().chain(next).collect();
            reached.sort_unstable();
            reached.dedup();
        }
        6
    };
    let edges = found
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.map(hops).max().unwrap_or(0)
}

fn area(mesh: &TriangleMesh) -> f64 {
    mesh.triangle_areas().iter().sum()
}

/// Asserts that a mesh is one manifold; its Euler characteristic and boundary loops.
fn manifold(mesh: &TriangleMesh) -> (i64, Vec<usize>) {
    let parts = Components::of(mesh, &[]).unwrap();
    assert_eq!(parts.conditioning.non_manifold_edges, 0);
    assert_eq!(parts.list.len(), 1);
    let topology = Topology::oriented(&parts.list[0].mesh).topology;
    let loops = topology.boundary_loops().iter().map(Vec::len).collect();
    (topology.euler_characteristic(), loops)
}

/// The cloud of a disk gives a disk through all points that bridges nothing.
fn gives_a_disk(known: &TriangleMesh, uvs: &[[f32; 2]]) {
    let found = found_by(known.positions(), uvs).unwrap();
    assert_eq!(found.unreached(), 0);
    let (characteristic, loops) = manifold(&found.mesh);
    assert_eq!((characteristic, loops.len()), (1, 1));
    assert!(farthest_hop(known, &found.mesh) <= 3);
    let ratio = area(&found.mesh) / area(known);
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn disks_are_found_with_and_without_a_map() {
    let cloth = jittered(&shapes::draped_cloth(60, 42), 1);
    gives_a_disk(&cloth, &torn(&parameters(60, 42)));
    gives_a_disk(&cloth, &flat(cloth.positions()));
    let bust = jittered(&shapes::bust(0.1), 2);
    gives_a_disk(&bust, &flat(bust.positions()));
}

/// Every grid square has two triangulations that are as good.
#[test]
fn exact_grids_are_no_worse() {
    gives_a_disk(&shapes::draped_cloth(60, 42), &torn(&parameters(60, 42)));
    let sheet = shapes::rectangle(20.0, 12.0, 20, 12);
    gives_a_disk(&sheet, &flat(sheet.positions()));
}

/// Of half of all angles, whatever is torn along seams.
#[test]
fn clouds_are_finished_with_little_distortion() {
    let bust = jittered(&shapes::bust(0.2), 13);
    let going = &mut |_| ControlFlow::Continue(());
    let raw = flat(bust.positions());
    let cloud = lay_out_cloud(&LayoutConfig::default(), bust.positions(), &raw, going).unwrap();
    assert_eq!(cloud.unreached, 0);
    let angle = |[a, b, c]: [[f64; 3]; 3]| {
        let (u, v) = (sub(b, a), sub(c, a));
        length(cross(u, v)).atan2(dot(u, v))
    };
    let place = |v: u32| cloud.uvs[v as usize].map(f64::from);
    let mut errors: Vec<f64> = bust
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]])
        .map(|corner| {
            let flat = corner.map(place).map(|[u, v]| [u, v, 0.0]);
            let known = corner.map(|v| bust.positions()[v as usize]);
            (angle(flat) - angle(known)).abs()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    assert!(median < 0.03, "{median}");
}

#[test]
fn layers_of_a_spiral_stay_apart() {
    let layered = |gap| jittered(&shapes::spiral(4.0, gap, 160.0, 20.0, 160, 20), 3);
    gives_a_disk(&layered(3.0), &flat(layered(3.0).positions()));
    gives_a_disk(&layered(2.0), &torn(&parameters(160, 20)));
}

/// Two sheets as far apart as their points, one over the middles of the squares of the other.
#[test]
fn the_map_tells_sheets_apart_that_are_as_close_as_their_points() {
    let below = shapes::rectangle(24.0, 24.0, 24, 24);
    let above = below.positions().iter().map(|p| add(*p, [0.5, 0.5, 1.0]));
    let points: Vec<[f64; 3]> = below.positions().iter().copied().chain(above).collect();
    let uvs: Vec<[f32; 2]> = (0..points.len())
        .map(|i| {
            let [x, y, _] = points[i].map(|c| c as f32);
            if i < points.len() / 2 {
                [x, y]
            } else {
                [y + 60.0, x]
            }
        })
        .collect();
    let bridges = |uvs: &[[f32; 2]]| {
        let found = found_by(&points, uvs).unwrap();
        let side = |v: u32| (v as usize) < points.len() / 2;
        let triangles = found.mesh.triangles();
        triangles
            .iter()
            .filter(|t| side(t[0]) != side(t[1]) || side(t[1]) != side(t[2]))
            .count()
    };
    assert_eq!(bridges(&uvs), 0);
    assert!(bridges(&flat(&points)) > 0);
}

#[test]
fn closed_and_one_sided_surfaces_are_found() {
    let found = |mesh: &TriangleMesh| {
        let points = jittered(mesh, 4).positions().to_vec();
        let found = found_by(&points, &flat(&points)).unwrap();
        assert_eq!(found.unreached(), 0);
        manifold(&found.mesh)
    };
    assert_eq!(found(&shapes::torus(1.0, 0.4, 60, 24)), (0, vec![]));
    let (characteristic, loops) = found(&shapes::open_cylinder(1.0, 2.0, 40, 13));
    assert_eq!((characteristic, loops.len()), (0, 2));
    // Cut where its sides do not fit, a Möbius strip is a disk.
    let (characteristic, loops) = found(&shapes::moebius_strip(0.6, 60, 6));
    assert_eq!((characteristic, loops.len()), (1, 1));
}

/// The ends of a tube have as few edges as a hole that is closed.
#[test]
fn thin_tubes_stay_open() {
    let tube = shapes::open_cylinder(1.0, 12.0, 8, 16);
    let found = found_by(tube.positions(), &flat(tube.positions())).unwrap();
    assert_eq!(manifold(&found.mesh), (0, vec![8, 8]));
}

#[test]
fn small_gaps_are_closed_and_large_ones_stay() {
    let sheet = jittered(&shapes::rectangle(40.0, 40.0, 40, 40), 5);
    let without = |radius: f64| {
        let points: Vec<[f64; 3]> = sheet
            .positions()
            .iter()
            .copied()
            .filter(|&p| length(p) > radius)
            .collect();
        let found = found_by(&points, &flat(&points)).unwrap();
        manifold(&found.mesh)
    };
    let (characteristic, loops) = without(1.5);
    assert_eq!((characteristic, loops.len()), (1, 1));
    let (characteristic, loops) = without(6.0);
    assert_eq!((characteristic, loops.len()), (0, 2));
}

#[test]
fn noise_of_a_fifth_of_the_spacing_tears_nothing() {
    let cloth = jittered(&shapes::draped_cloth(60, 42), 6);
    let points = noisy(cloth.positions(), 0.2 / 60.0);
    let found = found_by(&points, &torn(&parameters(60, 42))).unwrap();
    assert_eq!(found.unreached(), 0);
    let (characteristic, loops) = manifold(&found.mesh);
    assert_eq!((characteristic, loops.len()), (1, 1));
    assert!(farthest_hop(&cloth, &found.mesh) <= 3);
}

#[test]
fn density_may_vary() {
    let even = shapes::rectangle(2.0, 1.0, 80, 40);
    let squeezed = even.positions().iter().map(|&[x, y, z]| {
        let s = x + 1.0;
        [s * (0.5 + 0.25 * s), y * (0.5 + 0.5 * s), z]
    });
    let known = TriangleMesh::new(squeezed.collect(), even.triangles().to_vec()).unwrap();
    gives_a_disk(&jittered(&known, 7), &flat(known.positions()));
}

#[test]
fn points_off_the_surface_are_counted() {
    let cloth = jittered(&shapes::draped_cloth(60, 42), 9);
    let mut points = cloth.positions().to_vec();
    points.extend([[0.2, 1.0, 0.4], [1e9, 0.0, 0.0], [0.1, 0.0, 0.7]]);
    let found = found_by(&points, &flat(&points)).unwrap();
    assert_eq!(found.unreached(), 3);
    assert!(
        found.vertices[cloth.positions().len()..]
            .iter()
            .all(Option::is_none)
    );
    assert_eq!(manifold(&found.mesh).0, 1);
}

#[test]
fn coinciding_points_share_a_vertex() {
    let sheet = shapes::rectangle(8.0, 8.0, 8, 8);
    let once = sheet.positions();
    let twice: Vec<[f64; 3]> = once.iter().chain(once).copied().collect();
    let found = found_by(&twice, &flat(&twice)).unwrap();
    assert_eq!(found.unreached(), 0);
    assert_eq!(manifold(&found.mesh).0, 1);
    for i in 0..once.len() {
        assert_eq!(found.vertices[i], Some(i as u32));
        assert_eq!(found.vertices[i + once.len()], Some(i as u32));
    }
}

#[test]
fn few_points_give_their_triangles() {
    let of = |points: &[[f64; 3]]| found_by(points, &flat(points));
    let square = [
        [0.0, 0.0, 5.0],
        [1.0, 0.0, 5.0],
        [1.0, 1.1, 5.0],
        [0.0, 1.0, 5.0],
    ];
    assert_eq!(of(&square[..3]).unwrap().mesh.triangles().len(), 1);
    assert_eq!(of(&square).unwrap().mesh.triangles().len(), 2);
    let mut rng = Pcg64::seed_from_u64(10);
    let ten: Vec<[f64; 3]> = (0..10)
        .map(|_| [rng.random_range(0.0..1.0), rng.random_range(0.0..1.0), 0.0])
        .collect();
    let found = of(&ten).unwrap();
    assert_eq!((manifold(&found.mesh).0, found.unreached()), (1, 0));
}

#[test]
fn what_spans_no_surface_is_an_error() {
    let of = |points: &[[f64; 3]]| found_by(points, &flat(points)).map(|_| ());
    let flat_error = Err(SurfaceError::TooSmall("its points span no surface"));
    assert_eq!(of(&[]), flat_error);
    assert_eq!(of(&[[1.0; 3]]), flat_error);
    assert_eq!(of(&[[1.0; 3]; 40]), flat_error);
    assert_eq!(of(&[[0.0; 3], [1.0; 3]]), flat_error);
    let line: Vec<[f64; 3]> = (0..50).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    assert_eq!(of(&line), flat_error);
    assert_eq!(
        of(&[[0.0; 3], [f64::NAN; 3]]),
        Err(SurfaceError::NonFinitePosition { index: 1 })
    );
    let no_uvs = found_by(&line, &[]).map(|_| ());
    assert!(matches!(no_uvs, Err(SurfaceError::LengthMismatch { .. })));
}

#[test]
fn scale_and_place_do_not_matter() {
    let cloth = jittered(&shapes::draped_cloth(30, 20), 11);
    let triangles = |points: Vec<[f64; 3]>| {
        let found = found_by(&points, &flat(&points)).unwrap();
        found.mesh.triangles().to_vec()
    };
    let expected = triangles(cloth.positions().to_vec());
    for factor in [1e-200, 1e200] {
        let scaled = cloth.positions().iter().map(|p| p.map(|c| c * factor));
        assert_eq!(triangles(scaled.collect()).len(), expected.len());
    }
    let far = cloth.positions().iter().map(|p| p.map(|c| c + 1e6));
    assert_eq!(triangles(far.collect()).len(), expected.len());
}

/// Whatever comes, no edge has three triangles and no point panics.
#[test]
fn soups_give_manifolds_or_errors() {
    let mut rng = Pcg64::seed_from_u64(12);
    for round in 0..120 {
        let count = rng.random_range(1..120);
        let steps = [3.0, 1e3, 1e9][round % 3];
        let mut coordinate = || {
            let step = f64::round(rng.random_range(-1.0..1.0) * steps) / steps;
            step * if rng.random_bool(0.1) { 1e-180 } else { 1.0 }
        };
        let points: Vec<[f64; 3]> = (0..count)
            .map(|_| {
                [
                    coordinate(),
                    coordinate(),
                    coordinate() * (round % 2) as f64,
                ]
            })
            .collect();
        let uvs: Vec<[f32; 2]> = points.iter().map(|p| [p[2] as f32, p[0] as f32]).collect();
        if let Ok(found) = found_by(&points, &uvs) {
            let parts = Components::of(&found.mesh, &[]).unwrap();
            assert_eq!(parts.conditioning.non_manifold_edges, 0);
            assert_eq!(parts.conditioning.duplicate_triangles, 0);
        }
    }
}
