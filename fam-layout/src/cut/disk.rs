//! Cuts that open a surface to a disk.

use super::paths::{CheapestPaths, EdgeGraph, cheapest_path};
use super::straighten::shortened;
use super::tree_cotree::cut_between;
use super::{Cut, boundary_vertices, finite};
use crate::patch::topology::Topology;

/// How many triangles the candidates may have together: more are tried on small surfaces.
const CANDIDATE_TRIANGLES: usize = 800_000;
/// How many of them, the cheapest, are straightened.
const STRAIGHTENED: usize = 3;
const CANDIDATES: std::ops::RangeInclusive<usize> = 8..=48;

/// A cheap cut that opens a connected surface to a disk and reaches all `terminals`.
///
/// A sphere is slit along two edges, or between the terminals if there are more. Branches end
/// in nothing but terminals and the boundary.
pub fn cut_to_disk(topology: &Topology, cost: &[f64], terminals: &[u32]) -> Cut {
    let cost = &finite(cost);
    let on_boundary = boundary_vertices(topology);
    let all = 0..topology.vertices() as u32;
    let mut base: Vec<u32> = all.filter(|&v| on_boundary[v as usize]).collect();
    base.extend(
        terminals
            .iter()
            .filter(|&&v| (v as usize) < topology.vertices()),
    );
    base.sort_unstable();
    base.dedup();
    let graph = EdgeGraph::of(topology);
    if base.len() < 2 && topology.euler_characteristic() == 2 {
        return slit(topology, cost, &graph, base.first().copied());
    }
    let mut cuts = candidates(topology, cost, &graph, &base, terminals);
    cuts.sort_by(|a, b| a.cost(cost).total_cmp(&b.cost(cost)));
    cuts.dedup();
    cuts.truncate(STRAIGHTENED);
    let best = cuts
        .into_iter()
        .map(|cut| shortened(topology, cost, cut, terminals))
        .min_by(|a, b| a.cost(cost).total_cmp(&b.cost(cost)));
    let best = best.map(|best| two_edges_at_least(topology, cost, best));
    best.unwrap_or_else(|| Cut::none(topology))
}

/// Cuts between the vertices of `base`, which has the terminals among it, and one more, if there
/// is anything to cut.
fn candidates(
    topology: &Topology,
    cost: &[f64],
    graph: &EdgeGraph,
    base: &[u32],
    terminals: &[u32],
) -> Vec<Cut> {
    let mut keeps = vec![false; topology.vertices()];
    for &v in terminals {
        if let Some(keeps) = keeps.get_mut(v as usize) {
            *keeps = true;
        }
    }
    let between = |roots: &[u32]| {
        let cut = cut_between(topology, graph, cost, roots);
        cut.pruned(topology, |v| keeps[v as usize])
    };
    let mut cuts = Vec::new();
    if !base.is_empty() {
        cuts.push(between(base));
        if cuts[0].is_empty() {
            return cuts;
        }
    }
    let count = CANDIDATE_TRIANGLES / topology.triangles().len().max(1);
    let count = count.clamp(*CANDIDATES.start(), *CANDIDATES.end());
    for root in spread(topology, cost, graph, base, count) {
        cuts.push(between(&[base, &[root]].concat()));
    }
    cuts
}

/// Another way between the ends of the only edge that a closed surface is cut along, which
/// would leave it a boundary of two vertices.
fn two_edges_at_least(topology: &Topology, cost: &[f64], cut: Cut) -> Cut {
    let both: Vec<u32> = cut.half_edges().take(3).collect();
    let closed = (0..topology.half_edges()).all(|h| topology.twin(h).is_some());
    if both.len() != 2 || !closed {
        return cut;
    }
    let mut cost = cost.to_vec();
    for &h in &both {
        cost[h as usize] = f64::INFINITY;
    }
    let [start, end] = [topology.origin(both[0]), topology.target(both[0])];
    let mut longer = Cut::none(topology);
    if let Some(path) = cheapest_path(topology, &cost, &[start], |v| v == end) {
        longer.add(topology, &path);
    }
    longer
}

/// Up to `count` vertices, each as far as possible from those before it and from `base`.
fn spread(
    topology: &Topology,
    cost: &[f64],
    graph: &EdgeGraph,
    base: &[u32],
    count: usize,
) -> Vec<u32> {
    let vertices = topology.vertices();
    let start = if base.is_empty() { &[0] } else { base };
    let mut nearest = CheapestPaths::from(graph, cost, start).distance;
    let mut chosen = Vec::new();
    while chosen.len() < count.min(vertices) {
        let Some(farthest) = (0..vertices).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]))
        else {
            break;
        };
        chosen.push(farthest as u32);
        let own = CheapestPaths::from(graph, cost, &[farthest as u32]).distance;
        for (nearest, own) in nearest.iter_mut().zip(own) {
            *nearest = nearest.min(own);
        }
    }
    chosen
}

/// Two edges of a sphere that meet in a vertex, in `end` if it is given: cheap, and far from
/// the vertex farthest from the first one, as a tip of the shape is.
fn slit(topology: &Topology, cost: &[f64], graph: &EdgeGraph, end: Option<u32>) -> Cut {
    let vertices = topology.vertices();
    let farthest_from = |v: u32| {
        let distance = CheapestPaths::from(graph, cost, &[v]).distance;
        let far = (0..vertices).max_by(|&a, &b| distance[a].total_cmp(&distance[b]));
        (far.unwrap_or(0) as u32, distance)
    };
    let (one_tip, _) = farthest_from(0);
    let (_, distance) = farthest_from(one_tip);
    let mut cheapest: Vec<[(f64, u32); 2]> = vec![[(f64::INFINITY, 0); 2]; vertices];
    for h in 0..topology.half_edges() {
        let two = &mut cheapest[topology.origin(h) as usize];
        let own = (cost[h as usize], h);
        if own.0 < two[0].0 {
            *two = [own, two[0]];
        } else if own.0 < two[1].0 {
            two[1] = own;
        }
    }
    let both = |v: u32| cheapest[v as usize][0].0 + cheapest[v as usize][1].0;
    let rate = |v: u32| both(v) / distance[v as usize];
    let middle = end.or_else(|| {
        (0..vertices as u32)
            .filter(|&v| distance[v as usize] > 0.0)
            .min_by(|&a, &b| rate(a).total_cmp(&rate(b)))
    });
    let mut cut = Cut::none(topology);
    if let Some(middle) = middle {
        cut.add(topology, &cheapest[middle as usize].map(|(_, h)| h));
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::super::segments::{BranchKind, branches};
    use super::super::straightening::character;
    use super::super::test_surfaces::{block, cubes, oriented, pierced_plate, random_costs};
    use super::*;
    use fam_surface::shapes;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    const DISK: (usize, i64, usize) = (1, 1, 1);

    fn assert_leaves_end_in(topology: &Topology, cut: &Cut, terminals: &[u32]) {
        for branch in branches(topology, cut, |_| false) {
            if branch.kind == BranchKind::Leaf {
                assert!(terminals.contains(&branch.tip(topology)));
            }
        }
    }

    #[test]
    fn closed_surfaces_open_to_a_disk() {
        for handles in [1, 2, 4] {
            let (plate, lengths) = oriented(&pierced_plate(handles));
            assert_eq!(plate.euler_characteristic(), 2 - 2 * i64::from(handles));
            let cut = cut_to_disk(&plate, &lengths, &[]);
            assert_eq!(character(&plate, &cut), DISK);
            assert_leaves_end_in(&plate, &cut, &[]);
        }
    }

    #[test]
    fn terminals_are_reached() {
        for (mesh, terminals) in [
            (pierced_plate(2), vec![3]),
            (pierced_plate(2), vec![3, 40, 60]),
            (block(), vec![0, 20]),
            (block(), vec![0, 20, 30, 41]),
            (shapes::open_cylinder(1.0, 2.0, 12, 9), vec![65, 70, 3]),
            (shapes::rectangle(1.0, 1.0, 9, 9), vec![44, 55]),
        ] {
            let (surface, lengths) = oriented(&mesh);
            let cut = cut_to_disk(&surface, &lengths, &terminals);
            assert_eq!(character(&surface, &cut), DISK);
            let mut reached = cut.vertices(&surface);
            for edge in surface.boundary_loops().into_iter().flatten() {
                reached[surface.origin(edge) as usize] = true;
            }
            assert!(terminals.iter().all(|&v| reached[v as usize]));
            assert_leaves_end_in(&surface, &cut, &terminals);
        }
    }

    /// A tube around the ring and one across it at its inner side.
    #[test]
    fn a_torus_is_cut_along_its_two_shortest_loops() {
        let (torus, lengths) = oriented(&shapes::torus(1.0, 0.4, 96, 48));
        let cut = cut_to_disk(&torus, &lengths, &[]);
        assert_eq!(character(&torus, &cut), DISK);
        let shortest = std::f64::consts::TAU * (0.4 + 0.6);
        assert!(cut.cost(&lengths) < 1.05 * shortest);
    }

    #[test]
    fn a_cylinder_is_cut_along_its_height() {
        let (cylinder, lengths) = oriented(&shapes::open_cylinder(1.0, 3.0, 20, 9));
        let cut = cut_to_disk(&cylinder, &lengths, &[]);
        assert_eq!(character(&cylinder, &cut), DISK);
        assert!((cut.cost(&lengths) - 3.0).abs() < 1e-6);
    }

    #[test]
    fn a_sphere_is_slit_along_two_edges() {
        let (sphere, lengths) = oriented(&block());
        let neighbours = [sphere.origin(30), sphere.target(30)];
        for terminals in [&[][..], &[7], &neighbours] {
            let cut = cut_to_disk(&sphere, &lengths, terminals);
            assert_eq!(character(&sphere, &cut), DISK);
            assert_eq!(cut.half_edges().count(), 4);
            let reached = cut.vertices(&sphere);
            assert!(terminals.iter().all(|&v| reached[v as usize]));
        }
    }

    #[test]
    fn a_disk_and_a_moebius_strip_that_came_cut_stay_whole() {
        let (sheet, lengths) = oriented(&shapes::rectangle(1.0, 1.0, 4, 4));
        assert!(cut_to_disk(&sheet, &lengths, &[]).is_empty());
        let (strip, lengths) = oriented(&shapes::moebius_strip(0.5, 40, 4));
        assert!(cut_to_disk(&strip, &lengths, &[]).is_empty());
    }

    #[test]
    fn forbidden_edges_are_avoided() {
        let (cylinder, mut cost) = oriented(&shapes::open_cylinder(1.0, 3.0, 20, 9));
        // Ten vertices in every column.
        let allowed = |v: u32| v / 10 == 7;
        for h in 0..cylinder.half_edges() {
            if !allowed(cylinder.origin(h)) || !allowed(cylinder.target(h)) {
                cost[h as usize] = f64::INFINITY;
            }
        }
        let cut = cut_to_disk(&cylinder, &cost, &[]);
        assert_eq!(character(&cylinder, &cut), DISK);
        assert!(cut.half_edges().all(|h| cost[h as usize].is_finite()));
        let cut = cut_to_disk(&cylinder, &vec![f64::INFINITY; cost.len()], &[]);
        assert_eq!(character(&cylinder, &cut), DISK);
    }

    /// Surfaces of random cubes, of any genus and with any number of holes.
    #[test]
    fn random_surfaces_open_to_a_disk() {
        let mut handles = 0;
        for seed in 0..30 {
            let mut random = Pcg64::seed_from_u64(seed);
            let cells: Vec<bool> = (0..125).map(|_| random.random_bool(0.6)).collect();
            let solid = |[x, y, z]: [i32; 3]| cells[(25 * x + 5 * y + z) as usize];
            for mesh in cubes([5, 5, 5], solid) {
                let surface = Topology::oriented(&mesh).topology;
                let cost = random_costs(&surface, seed);
                let cut = cut_to_disk(&surface, &cost, &[]);
                assert_eq!(character(&surface, &cut), DISK);
                assert_leaves_end_in(&surface, &cut, &[]);
                let loops = surface.boundary_loops().len() as i64;
                handles += (2 - loops - surface.euler_characteristic()) / 2;
                let terminals = [0, surface.vertices() as u32 - 1];
                let cut = cut_to_disk(&surface, &cost, &terminals);
                assert_eq!(character(&surface, &cut), DISK);
                assert_leaves_end_in(&surface, &cut, &terminals);
            }
        }
        assert!(handles > 30);
    }
}
