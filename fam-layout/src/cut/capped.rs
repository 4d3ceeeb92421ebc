use super::{Cut, finite};
use crate::patch::topology::Topology;

/// A surface whose holes are closed. Their rims can be cut for nothing, their caps cannot.
pub(super) struct Capped {
    pub(super) topology: Topology,
    /// Finite.
    pub(super) cost: Vec<f64>,
}

impl Capped {
    pub(super) fn new(topology: &Topology, cost: &[f64], holes: &[Vec<u32>]) -> Self {
        let capped = topology.capped(holes);
        let mut cost = cost.to_vec();
        cost.resize(capped.half_edges() as usize, f64::INFINITY);
        for &h in holes.iter().flatten() {
            cost[h as usize] = 0.0;
            if let Some(twin) = capped.twin(h) {
                cost[twin as usize] = 0.0;
            }
        }
        Self {
            topology: capped,
            cost: finite(&cost),
        }
    }

    /// A cut of the surface without caps.
    pub(super) fn capped(&self, cut: &Cut) -> Cut {
        let mut same = Cut::none(&self.topology);
        same.add(&self.topology, &cut.half_edges().collect::<Vec<u32>>());
        same
    }

    /// The part of a cut that is on the surface without caps.
    pub(super) fn uncapped(&self, topology: &Topology, cut: &Cut) -> Cut {
        let mut part = Cut::none(topology);
        let half_edges: Vec<u32> = cut.half_edges().collect();
        let on_surface = half_edges.partition_point(|&h| h < topology.half_edges());
        part.add(topology, &half_edges[..on_surface]);
        part
    }
}
