//! How the corners of joined triangles hang together.

use std::collections::HashSet;

use super::joining::{Joined, Topology};
use super::orientation::{NONE, meeting};
use super::sets::Sets;

/// Which triangles, and which of their corners, hang together: the corners around a vertex that
/// are joined across edges are a fan, and make one vertex of a component.
pub(super) struct Fans {
    pub triangles: Sets,
    pub corners: Sets,
}

impl Fans {
    /// The fans of joined triangles.
    pub fn of(topology: &Topology, joined: &Joined) -> Self {
        let mut fans = Self {
            triangles: Sets::new(topology.welded.len()),
            corners: Sets::new(joined.across.len()),
        };
        for (h, &other) in (0..).zip(&joined.across) {
            if other == NONE || other < h {
                continue;
            }
            fans.triangles.join(h / 3, other / 3);
            for [one, beyond] in meeting(topology.welded, h, other) {
                fans.corners.join(one, beyond);
            }
        }
        fans.triangles.settle();
        fans.corners.settle();
        fans
    }

    /// How many of the file's own vertices, off the non-manifold edges, have several fans.
    pub fn non_manifold_vertices(
        &self,
        topology: &Topology,
        edges: &[(u32, [u32; 2])],
        kept: impl Fn(usize) -> bool,
    ) -> usize {
        let corners = || {
            let triangles = topology.own.iter().enumerate().filter(|&(t, _)| kept(t));
            triangles.flat_map(|(t, own)| [0, 1, 2].map(|c| (t, c, own[c])))
        };
        let fan = |t: usize, c: usize| self.corners.find((3 * t + c) as u32);
        let mut first = vec![NONE; topology.positions.len()];
        let mut several = vec![false; topology.positions.len()];
        for (t, c, v) in corners() {
            let first = &mut first[v as usize];
            if *first == NONE {
                *first = fan(t, c);
            }
            several[v as usize] |= *first != fan(t, c);
        }
        let on_edge: HashSet<(u32, u32)> = edges
            .iter()
            .flat_map(|&(group, ends)| ends.map(|v| (group, v)))
            .collect();
        let mut fans: Vec<(u32, u32, u32)> = corners()
            .filter(|&(_, _, v)| several[v as usize])
            .filter(|&(t, c, _)| !on_edge.contains(&(topology.group(t), topology.welded[t][c])))
            .map(|(t, c, v)| (topology.group(t), v, fan(t, c)))
            .collect();
        fans.sort_unstable();
        fans.dedup();
        fans.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .filter(|fans| fans.len() > 1)
            .count()
    }

    /// How many of the file's own vertices are one with an earlier one: those of one fan, and
    /// those in no kept triangle with the first at their position.
    pub fn welded_vertices(
        &self,
        topology: &Topology,
        used: &[u32],
        welded: &[u32],
        kept: impl Fn(usize) -> bool,
    ) -> usize {
        let mut vertices = Sets::new(welded.len());
        let mut has_fan = vec![false; welded.len()];
        for (t, own) in topology.own.iter().enumerate().filter(|&(t, _)| kept(t)) {
            for (c, &v) in own.iter().enumerate() {
                let first = self.corners.find((3 * t + c) as u32) as usize;
                vertices.join(v, topology.own[first / 3][first % 3]);
                has_fan[v as usize] = true;
            }
        }
        for &v in used.iter().filter(|&&v| !has_fan[v as usize]) {
            vertices.join(v, welded[v as usize]);
        }
        vertices.settle();
        let mut roots: Vec<u32> = used.iter().map(|&v| vertices.find(v)).collect();
        roots.sort_unstable();
        roots.dedup();
        used.len() - roots.len()
    }
}
