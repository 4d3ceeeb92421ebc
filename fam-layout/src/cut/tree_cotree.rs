use super::Cut;
use super::paths::{CheapestPaths, EdgeGraph};
use crate::patch::topology::Topology;

/// A cut that opens a connected surface to a disk: paths between the `roots`, which have all
/// of the boundary among them. It reaches every root.
///
/// Among cuts made of cheapest paths that meet in roots it is the cheapest (the greedy system
/// of loops by Erickson and Whittlesey, *Greedy optimal homotopy and homology generators*;
/// with several roots or a boundary, of arcs). A sphere with one root is left whole.
pub(super) fn cut_between(
    topology: &Topology,
    graph: &EdgeGraph,
    cost: &[f64],
    roots: &[u32],
) -> Cut {
    let paths = CheapestPaths::from(graph, cost, roots);
    let mut in_tree = vec![false; topology.half_edges() as usize];
    for v in 0..topology.vertices() as u32 {
        if let Some((h, _)) = paths.arrival(v) {
            in_tree[h as usize] = true;
            if let Some(twin) = topology.twin(h) {
                in_tree[twin as usize] = true;
            }
        }
    }
    let arc = |h: u32| {
        let [a, b] = [topology.origin(h), topology.target(h)];
        paths.distance[a as usize] + cost[h as usize] + paths.distance[b as usize]
    };
    let mut across: Vec<(f64, u32, u32)> = topology
        .edges()
        .filter(|&h| !in_tree[h as usize])
        .filter_map(|h| topology.twin(h).map(|twin| (arc(h), h, twin)))
        .collect();
    across.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut joined = Joined::new(topology.triangles().len());
    let mut cut = Cut::none(topology);
    for (_, h, twin) in across {
        if joined.join(h / 3, twin / 3) {
            continue;
        }
        cut.add(topology, &[h]);
        for end in [topology.origin(h), topology.target(h)] {
            let mut at = end;
            while let Some((h, before)) = paths.arrival(at).filter(|&(h, _)| !cut.contains(h)) {
                cut.add(topology, &[h]);
                at = before;
            }
        }
    }
    cut
}

/// Disjoint sets of triangles.
struct Joined {
    parents: Vec<u32>,
}

impl Joined {
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    fn find(&mut self, mut t: u32) -> u32 {
        while self.parents[t as usize] != t {
            let parent = self.parents[t as usize];
            self.parents[t as usize] = self.parents[parent as usize];
            t = parent;
        }
        t
    }

    /// Joins the sets of two triangles; false if they are one already.
    fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.parents[a.max(b) as usize] = a.min(b);
        a != b
    }
}
