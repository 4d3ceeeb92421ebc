//! Cuts made shorter without changing what they achieve.

use std::collections::HashSet;

use super::branch_points::moved;
use super::capped::Capped;
use super::paths::EdgeGraph;
use super::reroute::rerouted;
use super::segments::CutGraph;
use super::straightening::Straightening;
use super::{Cut, boundary_vertices};
use crate::patch::topology::Topology;

/// Most times that all branches and branching points are gone through.
const ROUNDS: usize = 20;

/// A cut that costs no more than `cut` and opens the surface to as many pieces, each of as many
/// holes and handles (or fewer holes, where it came through one).
///
/// Every branch takes the cheapest way, its ends sliding along the rest; between two pieces
/// they stay. Branching points move to where their branches are cheapest together. Ends of
/// leaves stay, and the cut goes on reaching the `pinned` vertices that it reaches.
pub fn straighten(topology: &Topology, cost: &[f64], cut: &Cut, pinned: &[u32]) -> Cut {
    if cut.is_empty() {
        return cut.clone();
    }
    let reached = cut.vertices(topology);
    let touched = |&h: &u32| reached[topology.origin(h) as usize];
    let holes: Vec<Vec<u32>> = topology
        .boundary_loops()
        .into_iter()
        .filter(|rim| !rim.iter().any(touched))
        .collect();
    let capped = Capped::new(topology, cost, &holes);
    let straight = shortened(&capped.topology, &capped.cost, capped.capped(cut), pinned);
    capped.uncapped(topology, &straight)
}

/// Shortens a cut of a surface without holes that it could come through. `cost` is finite.
pub(super) fn shortened(topology: &Topology, cost: &[f64], cut: Cut, pinned: &[u32]) -> Cut {
    let reached = cut.vertices(topology);
    let mut is_pinned = vec![false; topology.vertices()];
    for &v in pinned {
        if reached.get(v as usize) == Some(&true) {
            is_pinned[v as usize] = true;
        }
    }
    let boundary = boundary_vertices(topology);
    for leaving in CutGraph::of(topology, &cut).vertices() {
        let (v, _) = leaving[0];
        if leaving.len() == 1 && !boundary[v as usize] {
            is_pinned[v as usize] = true;
        }
    }
    let mut state = Straightening {
        topology,
        cost,
        graph: EdgeGraph::of(topology),
        cut,
        boundary,
        pinned: is_pinned,
        settled: HashSet::new(),
    };
    for _ in 0..ROUNDS {
        let shorter = state.reroute_branches();
        let moved = state.move_branch_points();
        if !shorter && !moved {
            break;
        }
    }
    state.cut
}

impl Straightening<'_> {
    /// Whether a branch took a cheaper way.
    fn reroute_branches(&mut self) -> bool {
        let mut improved = false;
        for known in self.branches() {
            let start = known.half_edges[0];
            let Some(branch) = self.branch_along(start) else {
                continue;
            };
            if let Some(path) = rerouted(self, &branch) {
                improved |= self.replace(&branch.half_edges, &path);
            }
        }
        improved
    }

    /// Whether a point where three branches meet found a better place.
    fn move_branch_points(&mut self) -> bool {
        let graph = CutGraph::of(self.topology, &self.cut);
        let forks: Vec<u32> = graph
            .vertices()
            .filter(|leaving| leaving.len() == 3)
            .map(|leaving| leaving[0].0)
            .filter(|&v| !self.boundary[v as usize] && !self.pinned[v as usize])
            .collect();
        let mut improved = false;
        for fork in forks {
            let branches = self.branches_from(fork);
            if self.settled.contains(&branches) {
                continue;
            }
            if moved(self, &branches) {
                improved = true;
            } else {
                self.settled.insert(branches);
            }
        }
        improved
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::disk::cut_to_disk;
    use super::super::paths::{cheapest_path, distances};
    use super::super::segments::branches;
    use super::super::straightening::character;
    use super::super::test_surfaces::{block, cubes, oriented, pierced_plate, random_costs};
    use super::*;
    use fam_surface::shapes;

    const DISK: (usize, i64, usize) = (1, 1, 1);

    /// The edges between vertices that follow one another, in the numbers of the mesh.
    fn along(topology: &Topology, vertices: &[u32]) -> Cut {
        let mut cut = Cut::none(topology);
        for pair in vertices.windows(2) {
            let h = (0..topology.half_edges())
                .find(|&h| topology.origin(h) == pair[0] && topology.target(h) == pair[1]);
            cut.add(topology, &[h.unwrap()]);
        }
        cut
    }

    #[test]
    fn a_detour_around_a_cylinder_becomes_a_straight_line() {
        let (cylinder, lengths) = oriented(&shapes::open_cylinder(1.0, 3.0, 20, 9));
        // Ten vertices in every column.
        let mut detour: Vec<u32> = (50..=54).collect();
        detour.extend([64, 74, 84, 94]);
        detour.extend(95..=99);
        let detour = along(&cylinder, &detour);
        assert_eq!(character(&cylinder, &detour), DISK);
        let straight = straighten(&cylinder, &lengths, &detour, &[]);
        assert_eq!(character(&cylinder, &straight), DISK);
        assert!((straight.cost(&lengths) - 3.0).abs() < 1e-6);
        let through = straighten(&cylinder, &lengths, &detour, &[74]);
        assert_eq!(character(&cylinder, &through), DISK);
        assert!(through.vertices(&cylinder)[74]);
        let whole = straighten(&cylinder, &lengths, &Cut::none(&cylinder), &[]);
        assert!(whole.is_empty());
    }

    /// A tree between three vertices is cheapest if it is a star around the vertex with the
    /// least sum of distances.
    #[test]
    fn three_tips_are_joined_in_the_best_point() {
        let (sphere, _) = oriented(&cubes([9, 9, 1], |_| true).swap_remove(0));
        let mut optimal = 0;
        for seed in 0..10 {
            let cost = random_costs(&sphere, seed);
            let tips = [5, 77, 140];
            let joined = cheapest_path(&sphere, &cost, &[5], |v| v == 77).unwrap();
            let mut tree = Cut::none(&sphere);
            tree.add(&sphere, &joined);
            let on_tree = tree.vertices(&sphere);
            if on_tree[140] {
                continue;
            }
            let third = cheapest_path(&sphere, &cost, &[140], |v| on_tree[v as usize]).unwrap();
            tree.add(&sphere, &third);
            let straight = straighten(&sphere, &cost, &tree, &tips);
            let from = tips.map(|tip| distances(&sphere, &cost, &[tip]));
            let least = (0..sphere.vertices())
                .map(|v| from.iter().map(|distance| distance[v]).sum())
                .fold(f64::INFINITY, f64::min);
            assert_eq!(character(&sphere, &straight), DISK);
            assert!(straight.cost(&cost) > least - 1e-9);
            assert!(straight.cost(&cost) < 1.1 * least);
            optimal += usize::from(straight.cost(&cost) < least + 1e-9);
        }
        assert!(optimal >= 7, "{optimal}");
    }

    #[test]
    fn a_line_between_two_pieces_becomes_straight_between_its_ends() {
        let (sheet, lengths) = oriented(&shapes::rectangle(8.0, 8.0, 8, 8));
        // Nine vertices in every column, from the third on.
        let bent = [36, 37, 46, 55, 56, 57, 48, 39, 40, 41, 42, 43, 44];
        let straight = straighten(&sheet, &lengths, &along(&sheet, &bent), &[]);
        assert_eq!(character(&sheet, &straight).0, 2);
        assert!((straight.cost(&lengths) - 8.0).abs() < 1e-9);
        // Straight, this one would go along the boundary and cut nothing off.
        let corner = along(&sheet, &[27, 28, 37, 46, 45]);
        let same = straighten(&sheet, &lengths, &corner, &[]);
        assert_eq!(character(&sheet, &same).0, 2);
    }

    #[test]
    fn a_single_loop_stays_one() {
        let (torus, lengths) = oriented(&shapes::torus(1.0, 0.4, 24, 12));
        let disk = cut_to_disk(&torus, &lengths, &[]);
        let loops = branches(&torus, &disk, |_| false);
        let closed = loops
            .iter()
            .find(|branch| branch.root(&torus) == branch.tip(&torus));
        let mut ring = Cut::none(&torus);
        match closed {
            Some(branch) => ring.add(&torus, &branch.half_edges),
            None => {
                ring.add(&torus, &loops[0].half_edges);
                ring.add(&torus, &loops[1].half_edges);
            }
        }
        assert_eq!(character(&torus, &ring), (1, 0, 2));
        let straight = straighten(&torus, &lengths, &ring, &[]);
        assert_eq!(character(&torus, &straight), (1, 0, 2));
        assert!(straight.cost(&lengths) <= ring.cost(&lengths));
    }

    /// Boundary loops of few edges, without the first.
    fn small_holes(surface: &Topology) -> Vec<Vec<u32>> {
        let loops = surface.boundary_loops().into_iter().skip(1);
        loops.filter(|edges| edges.len() < 5).collect()
    }

    /// Cuts that are cheap for other costs, with tips, around holes or through them.
    #[test]
    fn random_cuts_get_cheaper_and_open_the_surface_as_before() {
        let mut shortened = 0;
        for seed in 0..12 {
            let mut random = Pcg64::seed_from_u64(seed);
            let cells: Vec<bool> = (0..125).map(|_| random.random_bool(0.6)).collect();
            let solid = |[x, y, z]: [i32; 3]| cells[(25 * x + 5 * y + z) as usize];
            let mut meshes = cubes([5, 5, 5], solid);
            meshes.extend([block(), pierced_plate(2)]);
            for mesh in meshes {
                let surface = Topology::oriented(&mesh).topology;
                let [other, cost] = [2 * seed, 2 * seed + 1].map(|s| random_costs(&surface, s));
                let last = surface.vertices() as u32 - 1;
                let terminals = [0, last / 2, last];
                let kept = small_holes(&surface);
                let capped = Capped::new(&surface, &other, &kept);
                let cut = cut_to_disk(&capped.topology, &capped.cost, &terminals);
                let cut = capped.uncapped(&surface, &cut);
                let straight = straighten(&surface, &cost, &cut, &terminals);
                let (before, after) = (character(&surface, &cut), character(&surface, &straight));
                assert_eq!((before.0, before.1), (1, 2 - before.2 as i64));
                assert_eq!((after.0, after.1), (1, 2 - after.2 as i64));
                assert!(after.2 <= before.2);
                assert!(straight.cost(&cost) <= cut.cost(&cost));
                shortened += usize::from(straight.cost(&cost) < 0.8 * cut.cost(&cost));
                let mut reached = straight.vertices(&surface);
                for h in surface.boundary_loops().into_iter().flatten() {
                    reached[surface.origin(h) as usize] = true;
                }
                assert!(terminals.iter().all(|&v| reached[v as usize]));
            }
        }
        assert!(shortened > 12);
    }
}
