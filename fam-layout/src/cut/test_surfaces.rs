use std::collections::HashMap;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::patch::topology::{Opened, Topology};
use fam_surface::vector::{length, sub};
use fam_surface::{Components, TriangleMesh};

/// The half-edges of a mesh and their lengths.
pub(super) fn oriented(mesh: &TriangleMesh) -> (Topology, Vec<f64>) {
    let Opened { topology, source } = Topology::oriented(mesh);
    let position = |v: u32| mesh.positions()[source[v as usize] as usize];
    let lengths = (0..topology.half_edges())
        .map(|h| {
            length(sub(
                position(topology.target(h)),
                position(topology.origin(h)),
            ))
        })
        .collect();
    (topology, lengths)
}

/// Costs between 0.1 and 1.
pub(super) fn random_costs(topology: &Topology, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut cost: Vec<f64> = (0..topology.half_edges())
        .map(|_| random.random_range(0.1..1.0))
        .collect();
    for h in topology.edges() {
        if let Some(twin) = topology.twin(h) {
            cost[twin as usize] = cost[h as usize];
        }
    }
    cost
}

/// The faces of the cells of a grid of unit cubes for which `solid` holds, two triangles each;
/// where the surface touches itself it is taken apart.
pub(in super::super) fn cubes(
    size: [i32; 3],
    solid: impl Fn([i32; 3]) -> bool,
) -> Vec<TriangleMesh> {
    let inside =
        |cell: [i32; 3]| (0..3).all(|axis| (0..size[axis]).contains(&cell[axis])) && solid(cell);
    let mut positions = Vec::new();
    let mut numbers: HashMap<[i32; 3], u32> = HashMap::new();
    let mut triangles = Vec::new();
    for x in 0..size[0] {
        for y in 0..size[1] {
            for z in 0..size[2] {
                let cell = [x, y, z];
                for (axis, side) in [0, 1, 2].into_iter().flat_map(|a| [(a, 0), (a, 1)]) {
                    let mut beyond = cell;
                    beyond[axis] += 2 * side - 1;
                    if !inside(cell) || inside(beyond) {
                        continue;
                    }
                    let mut corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                        let mut corner = cell;
                        corner[axis] += side;
                        corner[(axis + 1) % 3] += u;
                        corner[(axis + 2) % 3] += v;
                        *numbers.entry(corner).or_insert_with(|| {
                            positions.push(corner.map(f64::from));
                            positions.len() as u32 - 1
                        })
                    });
                    if side == 0 {
                        corners.reverse();
                    }
                    let [a, b, c, d] = corners;
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    let mesh = TriangleMesh::new(positions, triangles).unwrap();
    let components = Components::of(&mesh, &[]).unwrap();
    components.list.into_iter().map(|part| part.mesh).collect()
}

/// A plate with holes through it: a closed surface with as many handles.
pub(in super::super) fn pierced_plate(holes: i32) -> TriangleMesh {
    let solid = |[x, y, _]: [i32; 3]| x % 4 < 2 || y % 4 < 2;
    cubes([4 * holes + 2, 6, 2], solid).swap_remove(0)
}

/// The faces of the corners of a box: a sphere.
pub(super) fn block() -> TriangleMesh {
    cubes([4, 3, 2], |_| true).swap_remove(0)
}
