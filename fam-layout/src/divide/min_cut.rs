//! The shortest contour between two parts of a surface.

use crate::patch::topology::Topology;

/// In the place of a depth: not reached.
const UNREACHED: u32 = u32::MAX;

/// Which triangles are cut off from all `sources` where the edges between these and the `sinks`
/// that are crossed are cheapest together (`cost` is that of every half-edge: not negative,
/// finite). Both are told by triangle; none is both.
pub fn beyond_cheapest_contour(
    topology: &Topology,
    cost: &[f64],
    sources: &[bool],
    sinks: &[bool],
) -> Vec<bool> {
    // The cheapest cut is as large as the largest flow (Dinic's algorithm).
    let mut flow = Flow {
        topology,
        room: cost.to_vec(),
        depth: Vec::new(),
        next: Vec::new(),
    };
    // Rounding leaves less than this behind where nothing flows any more.
    let least = 1e-12 * cost.iter().sum::<f64>();
    loop {
        flow.measure(sources, least);
        let reached = (0..sinks.len()).any(|t| sinks[t] && flow.depth[t] != UNREACHED);
        if !reached {
            return flow.depth.iter().map(|&d| d == UNREACHED).collect();
        }
        flow.next = (0..sinks.len()).map(|_| 0).collect();
        for source in (0..sources.len()).filter(|&t| sources[t]) {
            while flow.push(source as u32, sinks, least) {}
        }
    }
}

/// A flow from triangle to triangle.
struct Flow<'a> {
    topology: &'a Topology,
    /// How much more can flow out of a triangle over each of its half-edges.
    room: Vec<f64>,
    /// Steps from the sources.
    depth: Vec<u32>,
    /// The side of every triangle that is to be tried next.
    next: Vec<u8>,
}

impl Flow<'_> {
    /// Finds the depths of what can be reached from the sources.
    fn measure(&mut self, sources: &[bool], least: f64) {
        self.depth = vec![UNREACHED; sources.len()];
        let mut front: Vec<u32> = (0..sources.len() as u32)
            .filter(|&t| sources[t as usize])
            .collect();
        for &t in &front {
            self.depth[t as usize] = 0;
        }
        let mut depth = 0;
        while !front.is_empty() {
            depth += 1;
            let mut ahead = Vec::new();
            for h in front.iter().flat_map(|&t| 3 * t..3 * t + 3) {
                let Some(twin) = self.topology.twin(h) else {
                    continue;
                };
                let beyond = &mut self.depth[twin as usize / 3];
                if self.room[h as usize] > least && *beyond == UNREACHED {
                    *beyond = depth;
                    ahead.push(twin / 3);
                }
            }
            front = ahead;
        }
    }

    /// Lets as much as there is room for flow along one way to a sink; false if there is none.
    fn push(&mut self, source: u32, sinks: &[bool], least: f64) -> bool {
        let mut way: Vec<u32> = Vec::new();
        let mut at = source;
        while !sinks[at as usize] {
            let side = self.next[at as usize];
            if side == 3 {
                let Some(last) = way.pop() else {
                    return false;
                };
                at = last / 3;
                self.next[at as usize] += 1;
                continue;
            }
            let h = 3 * at + u32::from(side);
            let open = self.topology.twin(h).filter(|&twin| {
                let deeper = self.depth[twin as usize / 3] == self.depth[at as usize] + 1;
                deeper && self.room[h as usize] > least
            });
            match open {
                Some(twin) => {
                    way.push(h);
                    at = twin / 3;
                }
                None => self.next[at as usize] += 1,
            }
        }
        let room = |h: &u32| self.room[*h as usize];
        let amount = way.iter().map(room).fold(f64::INFINITY, f64::min);
        for &h in &way {
            self.room[h as usize] -= amount;
            if let Some(twin) = self.topology.twin(h) {
                self.room[twin as usize] += amount;
            }
        }
        !way.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Patch;
    use fam_surface::shapes;

    fn contour(patch: &Patch, beyond: &[bool]) -> f64 {
        let across = |h: &u32| {
            let twin = patch.topology.twin(*h);
            twin.is_some_and(|twin| beyond[*h as usize / 3] != beyond[twin as usize / 3])
        };
        let crossed = patch.topology.edges().filter(across);
        crossed.map(|h| patch.lengths[h as usize]).sum()
    }

    /// Between the ends of a strip the contour is straight, and where an edge is cheap, there.
    #[test]
    fn a_strip_is_cut_straight_across_where_that_is_cheapest() {
        let patch = Patch::of(&shapes::rectangle(8.0, 1.0, 32, 4));
        let middle = |t: usize| -> f64 {
            let corners = patch.topology.triangles()[t];
            let sum: f64 = corners.map(|v| patch.positions[v as usize][0]).iter().sum();
            sum / 3.0
        };
        let end = patch.positions.iter().map(|p| p[0]).fold(0.0, f64::max);
        let triangles = patch.areas.len();
        let sources: Vec<bool> = (0..triangles).map(|t| middle(t) < 0.2 * end).collect();
        let sinks: Vec<bool> = (0..triangles).map(|t| middle(t) > 0.8 * end).collect();
        let beyond = beyond_cheapest_contour(&patch.topology, &patch.lengths, &sources, &sinks);
        let width = 1.0 / 8.0_f64.sqrt();
        assert!((contour(&patch, &beyond) - width).abs() < 1e-9);
        for t in 0..triangles {
            assert!(!(sources[t] && beyond[t]) && (beyond[t] || !sinks[t]));
        }
        let at = |v: u32| patch.positions[v as usize][0];
        let cost: Vec<f64> = (0..patch.topology.half_edges())
            .map(|h| {
                let ends = [patch.topology.origin(h), patch.topology.target(h)].map(at);
                let cheap = ends.iter().all(|x| (x - 0.5 * end).abs() < 1e-9);
                patch.lengths[h as usize] * if cheap { 0.9 } else { 1.0 }
            })
            .collect();
        let beyond = beyond_cheapest_contour(&patch.topology, &cost, &sources, &sinks);
        for (t, &beyond) in beyond.iter().enumerate() {
            assert_eq!(beyond, middle(t) > 0.5 * end);
        }
    }

    /// The waist of an hourglass, and nothing where the two are not connected.
    #[test]
    fn the_waist_is_found() {
        let tube = shapes::open_cylinder(1.0, 4.0, 24, 20);
        let narrow = |p: &[f64; 3]| {
            let r = 0.3 + 0.3 * (p[2] - 0.4).abs();
            [r * p[0], r * p[1], p[2]]
        };
        let positions = tube.positions().iter().map(narrow).collect();
        let tube = fam_surface::TriangleMesh::new(positions, tube.triangles().to_vec()).unwrap();
        let patch = Patch::of(&tube);
        let height = |t: usize| {
            let corners = tube.triangles()[t].map(|v| tube.positions()[v as usize][2]);
            corners.iter().sum::<f64>() / 3.0
        };
        let triangles = patch.areas.len();
        let low: Vec<bool> = (0..triangles).map(|t| height(t) < -1.5).collect();
        let high: Vec<bool> = (0..triangles).map(|t| height(t) > 1.5).collect();
        let beyond = beyond_cheapest_contour(&patch.topology, &patch.lengths, &low, &high);
        for (t, &beyond) in beyond.iter().enumerate() {
            assert_eq!(beyond, height(t) > 0.4);
        }
        let around = 24.0 * 2.0 * 0.3 * (std::f64::consts::PI / 24.0).sin() * patch.scale;
        assert!((contour(&patch, &beyond) - around).abs() < 1e-9);
    }
}
