//! Injective starts: the outer boundary on a circle, every other vertex in the midst of its
//! neighbours (Tutte's embedding).

use super::SolveError;
use super::energy::{Integrals, jacobian};
use super::orientation::{count_flipped, first_flipped};
use super::rest::RestShapes;
use super::sparse::SparseSystem;
use super::symmetric_dirichlet::determinant;
use crate::patch::topology::Topology;

/// Bounds on half the cotangents, of which the weights are made.
const LEAST_WEIGHT: f64 = 0.05;
const MOST_WEIGHT: f64 = 5.0;

/// In the place of a node: the vertex is on the outer boundary.
const NONE: u32 = u32::MAX;

/// The share of the circle that is spread evenly over the edges of the boundary; the rest goes
/// by their lengths.
const EVEN_SHARE: f64 = 0.1;

/// How often the weights are adapted.
const ROUNDS: usize = 50;

/// The share of the energy above which a further round is not worth its time.
const LEAST_GAIN: f64 = 0.8;

/// The least factor of a weight in a round: smaller scales are lost in rounding.
const LEAST_CHANGE: f64 = 1e-10;

/// Whether there is a position for every vertex and all triangles are strictly
/// counter-clockwise, decided exactly.
#[cfg(test)]
pub(crate) fn valid(topology: &Topology, uv: &[[f64; 2]]) -> bool {
    uv.len() >= topology.vertices() && first_flipped(topology.triangles(), uv).is_none()
}

/// Positions of all vertices of a disk (with holes) at which every triangle is strictly
/// counter-clockwise and no two overlap; the outer boundary, its longest, lies on the unit
/// circle.
///
/// Limbs shrink exponentially along their length, beyond what double precision can tell apart.
/// So the links within small triangles are loosened (as Yoshizawa, Belyaev & Seidel 2004 do to
/// lessen stretch) and the system is solved again, until every triangle has its place and the
/// energy hardly decreases.
///
/// # Errors
/// The rest shapes are not those of the triangles, it is no disk with holes, its outer boundary
/// has fewer than three edges, or a limb is so long that triangles stay collapsed.
pub(crate) fn embed(topology: &Topology, rest: &RestShapes) -> Result<Vec<[f64; 2]>, SolveError> {
    if rest.len() != topology.triangles().len() {
        return Err(SolveError::LengthMismatch {
            what: "rest shapes",
            expected: topology.triangles().len(),
            found: rest.len(),
        });
    }
    let (outer, holes) = outer_and_holes(topology, rest)?;
    embed_within(topology, rest, on_circle(topology, rest, &outer), &holes)
}

/// The same with the vertices of the outer boundary elsewhere: in the order that they have there,
/// around a convex region. `places` has those, and none for all others; `holes` are all other loops
/// of the boundary.
///
/// # Errors
/// As [`embed`]; also where an edge runs from one vertex to another along one straight side of the
/// region, so that a triangle collapses.
pub(crate) fn embed_within(
    topology: &Topology,
    rest: &RestShapes,
    places: Vec<Option<[f64; 2]>>,
    holes: &[Vec<u32>],
) -> Result<Vec<[f64; 2]>, SolveError> {
    let mut disk = Disk::new(topology, rest, places, holes)?;
    let mut best = disk.solve()?;
    let (mut flipped, mut energy) = rank(topology, rest, &best);
    for _ in 0..ROUNDS {
        disk.loosen(&best);
        let uv = disk.solve()?;
        let (new_flipped, new_energy) = rank(topology, rest, &uv);
        let enough = flipped == 0 && (new_flipped > 0 || new_energy > LEAST_GAIN * energy);
        if new_flipped == 0 || flipped > 0 {
            (flipped, energy, best) = (new_flipped, new_energy, uv);
        }
        if enough {
            break;
        }
    }
    match first_flipped(topology.triangles(), &best) {
        None => Ok(best),
        Some(triangle) => Err(SolveError::Collapsed { triangle }),
    }
}

/// The longest loop of the boundary of a disk, and all others.
fn outer_and_holes(
    topology: &Topology,
    rest: &RestShapes,
) -> Result<(Vec<u32>, Vec<Vec<u32>>), SolveError> {
    let mut loops = topology.boundary_loops();
    if topology.euler_characteristic() != 2 - loops.len() as i64 || loops.is_empty() {
        return Err(SolveError::NotADisk);
    }
    let lengths: Vec<f64> = loops.iter().map(|edges| loop_length(rest, edges)).collect();
    let longer = |best, k: usize| if lengths[k] > lengths[best] { k } else { best };
    let outer = loops.swap_remove((0..loops.len()).fold(0, longer));
    match outer.len() < 3 {
        true => Err(SolveError::ShortBoundary),
        false => Ok((outer, loops)),
    }
}

/// How many triangles are flipped or collapsed, and the mean energy if there are none.
fn rank(topology: &Topology, rest: &RestShapes, uv: &[[f64; 2]]) -> (usize, f64) {
    let integrals = Integrals::of(topology.triangles(), rest, uv);
    let flipped = count_flipped(topology.triangles(), uv);
    (flipped, integrals.mean(rest.total_area()))
}

/// A disk whose holes are filled with fans around further vertices.
struct Disk<'a> {
    topology: &'a Topology,
    rest: &'a RestShapes,
    /// Per vertex its place on the outer boundary, or none in the interior; then the centres of holes.
    places: Vec<Option<[f64; 2]>>,
    /// The node of every vertex in the interior.
    nodes: Vec<u32>,
    system: SparseSystem<1>,
    /// Half-edges around holes, each with the centre of its own.
    spokes: Vec<(u32, u32)>,
    /// By what the links within every triangle are multiplied.
    tightness: Vec<f64>,
}

impl<'a> Disk<'a> {
    fn new(
        topology: &'a Topology,
        rest: &'a RestShapes,
        mut places: Vec<Option<[f64; 2]>>,
        holes: &[Vec<u32>],
    ) -> Result<Self, SolveError> {
        let mut spokes = Vec::new();
        // Holes of two edges are closed, those of three are triangles.
        for edges in holes.iter().filter(|edges| edges.len() > 3) {
            spokes.extend(edges.iter().map(|&h| (h, places.len() as u32)));
            places.push(None);
        }
        let mut nodes = vec![NONE; places.len()];
        let mut count = 0;
        for (node, place) in nodes.iter_mut().zip(&places) {
            if place.is_none() {
                *node = count;
                count += 1;
            }
        }
        let edges = topology
            .edges()
            .map(|h| [topology.origin(h), topology.target(h)]);
        let links: Vec<[u32; 2]> = edges
            .chain(
                spokes
                    .iter()
                    .map(|&(h, centre)| [topology.origin(h), centre]),
            )
            .map(|ends| ends.map(|v| nodes[v as usize]))
            .filter(|link| !link.contains(&NONE) && link[0] != link[1])
            .collect();
        Ok(Self {
            topology,
            rest,
            system: SparseSystem::new(count as usize, &links)?,
            places,
            nodes,
            spokes,
            tightness: vec![1.0; topology.triangles().len()],
        })
    }

    /// The positions at which every inner vertex is the weighted mean of its neighbours.
    fn solve(&mut self) -> Result<Vec<[f64; 2]>, SolveError> {
        let topology = self.topology;
        let inner = self.places.iter().filter(|place| place.is_none()).count();
        let mut pull = vec![[0.0; 2]; inner];
        self.system.clear();
        for (t, corners) in topology.triangles().iter().enumerate() {
            let cotangents = self.rest.half_cotangents(t);
            for c in 0..3 {
                let weight = cotangents[(c + 2) % 3].clamp(LEAST_WEIGHT, MOST_WEIGHT);
                let ends = [corners[c], corners[(c + 1) % 3]];
                self.link(ends, self.tightness[t] * weight, &mut pull);
            }
        }
        for k in 0..self.spokes.len() {
            let (h, centre) = self.spokes[k];
            let ends = [topology.origin(h), centre];
            self.link(ends, self.tightness[h as usize / 3], &mut pull);
        }
        self.system.factorize()?;
        self.system.solve(&mut pull);
        let all = self.places.iter().zip(&self.nodes);
        Ok(all
            .take(topology.vertices())
            .map(|(place, &node)| place.unwrap_or_else(|| pull[node as usize]))
            .collect())
    }

    /// Ties two vertices to each other; what is on the outer boundary pulls.
    fn link(&mut self, [a, b]: [u32; 2], weight: f64, pull: &mut [[f64; 2]]) {
        let (one, other) = (self.nodes[a as usize], self.nodes[b as usize]);
        for (node, beyond) in [(one, b), (other, a)] {
            if node == NONE {
                continue;
            }
            self.system.add_diagonal(node, &[[weight]]);
            if let Some([x, y]) = self.places[beyond as usize] {
                let sum = &mut pull[node as usize];
                *sum = [sum[0] + weight * x, sum[1] + weight * y];
            }
        }
        if one != NONE
            && other != NONE
            && let Some(slot) = self.system.slot(one, other)
        {
            self.system.add(slot, &[[-weight]]);
        }
    }

    /// Loosens the links within every triangle by as much as it is too small.
    fn loosen(&mut self, uv: &[[f64; 2]]) {
        let scales: Vec<f64> = (0..self.rest.len())
            .map(|t| {
                let corners = self.topology.triangles()[t].map(|v| uv[v as usize]);
                let area = determinant(&jacobian(self.rest, t, corners));
                area.max(f64::MIN_POSITIVE).sqrt()
            })
            .collect();
        let mean = scales.iter().sum::<f64>() / scales.len() as f64;
        for (tightness, scale) in self.tightness.iter_mut().zip(scales) {
            *tightness *= (scale / mean).max(LEAST_CHANGE);
        }
    }
}

/// The length of a loop of half-edges.
fn loop_length(rest: &RestShapes, edges: &[u32]) -> f64 {
    edges.iter().map(|&h| half_edge_length(rest, h)).sum()
}

fn half_edge_length(rest: &RestShapes, h: u32) -> f64 {
    rest.edge_length(h as usize / 3, h as usize % 3)
}

/// The places of the vertices of a loop of half-edges on the unit circle.
fn on_circle(topology: &Topology, rest: &RestShapes, edges: &[u32]) -> Vec<Option<[f64; 2]>> {
    let length = loop_length(rest, edges);
    let mut places = vec![None; topology.vertices()];
    let mut turn = 0.0;
    for &h in edges {
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        places[topology.origin(h) as usize] = Some([cos, sin]);
        turn += EVEN_SHARE / edges.len() as f64
            + (1.0 - EVEN_SHARE) * half_edge_length(rest, h) / length;
    }
    places
}
