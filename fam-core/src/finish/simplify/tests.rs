use super::*;
use crate::finish::cut::disk::cut_to_disk;
use crate::finish::cut::test_surfaces::{cubes, pierced_plate};
use crate::finish::patch::Patch;
use crate::surface::{TriangleMesh, shapes};

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

#[test]
fn handles_and_holes_stay() {
    for mesh in all() {
        let patch = Patch::of(&mesh);
        for wanted in [0, 60, 300] {
            let less = Simplification::new(&patch.topology, &patch.positions, wanted);
            let left = less.simplified(1.0).patch.topology;
            assert_eq!(kind(&left), kind(&patch.topology));
            assert_eq!(left.triangles().len(), less.triangles());
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
            let mut less = Simplification::new(&patch.topology, &patch.positions, wanted);
            let left = less.simplified(1.0);
            let coarse = &left.patch;
            let last = coarse.topology.vertices() as u32 - 1;
            let tips = [last / 3, last / 2, last];
            let cut = cut_to_disk(&coarse.topology, &coarse.lengths, &tips, |_| false);
            let before = kind(&cut.open(&coarse.topology).topology);
            let carried = less.carried(&cut, &left.triangles);
            assert_eq!(kind(&carried.open(&patch.topology).topology), before);
            assert_eq!(
                less.simplified(1.0).patch.topology.triangles(),
                patch.topology.triangles()
            );
        }
    }
}
