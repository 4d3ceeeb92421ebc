//! Charts that share a border, joined where they still lie flat side by side.
//!
//! The smaller chart is turned and moved to the larger one, which stays where it is, so that a
//! chart with thousands of triangles costs nothing when a few are added to it.

use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use super::Piece;
use super::flat::{EFFORT, NEXT_TO_ISOMETRIC};
use super::grid::{Grid, distance};
use crate::cut::Cut;
use crate::patch::Patch;
use crate::patch::topology::next;
use crate::refine::problem::Problem;
use crate::solve::energy::energy_of;
use crate::solve::layout::Layout;
use crate::solve::rest::RestShapes;

/// How far apart the ends of two sides of an edge may lie to be joined, in lengths of the edge:
/// what is taken up by the triangles there. Those that fit best are joined first; the charts that
/// come of it are relaxed before the next round.
const SNAPS: [f64; 4] = [0.15, 0.3, 0.6, 1.0];

/// The gap that charts keep where they are not joined, in lengths of the edges there.
const GAP: f64 = 0.02;

/// The least angle between borders of two charts that are joined at a vertex, as its cosine: some
/// three degrees.
const MOST_COSINE: f64 = 0.9986;

/// How many of the common borders of two charts are tried, the longest first.
const TRIED: usize = 3;

/// The sizes that a chart is tried in beside another. Sides of boxes often come to lie exactly along
/// other sides, and need a little room. The smaller size fits along short borders only: at long ones,
/// the ends move too far.
const SIZES: [f64; 2] = [1.0, 0.9];

/// The least share of a common border that must fit.
const LEAST_FIT: f64 = 0.5;

/// Joins pieces of a patch, those first that share the longest border, as long as the mean energy
/// of a chart stays within the bound.
pub(super) fn joined(
    patch: &Patch,
    pieces: Vec<Piece>,
    bound: f64,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Vec<Piece> {
    let round = |pieces, snap: &f64| joined_within(patch, pieces, bound, *snap, goes_on);
    SNAPS.iter().fold(pieces, round)
}

/// The same, where the ends of sides are no farther apart than `snap` times their length.
fn joined_within(
    patch: &Patch,
    pieces: Vec<Piece>,
    bound: f64,
    snap: f64,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Vec<Piece> {
    let mut charts = Charts::new(patch, &pieces, bound, snap);
    let mut queue = BinaryHeap::new();
    for (a, borders) in (0..).zip(&charts.borders) {
        for (&b, price) in borders.range(a + 1..) {
            queue.push((price.to_bits(), a, b));
        }
    }
    while let Some((bits, a, b)) = queue.pop() {
        let price = charts.borders[a as usize].get(&b);
        if price.is_none_or(|price| price.to_bits() != bits) || !goes_on() {
            continue;
        }
        let is_larger = charts.members[a as usize].len() >= charts.members[b as usize].len();
        let [large, small] = if is_larger { [a, b] } else { [b, a] };
        if let Some(placing) = charts.placing(large, small) {
            for (other, price) in charts.join(large, small, placing) {
                queue.push((price.to_bits(), large.min(other), large.max(other)));
            }
        }
    }
    charts.finished(pieces, goes_on)
}

/// Charts, each in a plane of its own.
struct Charts<'a> {
    patch: &'a Patch,
    bound: f64,
    snap: f64,
    rest: RestShapes,
    /// The chart of every triangle.
    of: Vec<u32>,
    /// The triangles of every chart; none of those that are part of another now.
    members: Vec<Vec<u32>>,
    /// For every half-edge the vertex that it starts from in the plane, and the places of these.
    vertices: Vec<u32>,
    uv: Vec<[f64; 2]>,
    /// Of every half-edge, whether there is a neighbour beyond it in the plane.
    is_inner: Vec<bool>,
    /// Of every chart what the border with each of its neighbours costs as a seam.
    borders: Vec<BTreeMap<u32, f64>>,
    /// Of every chart its energy times its area, and its area.
    energies: Vec<f64>,
    areas: Vec<f64>,
    /// The border of every chart in its plane. Half-edges that are inner by now are still there.
    grids: Vec<Grid>,
    /// No gap need be wider.
    widest_gap: f64,
}

/// How a chart comes to lie beside another.
struct Placing {
    /// The place of every vertex of it.
    places: BTreeMap<u32, [f64; 2]>,
    /// The vertices of it that become one of the other.
    same: BTreeMap<u32, u32>,
    /// Its half-edges that are joined to their twins.
    glued: BTreeSet<u32>,
    /// Its energy times its area.
    energy: f64,
}

/// A weight, a point and the place that it is to come to.
type Pair = (f64, [f64; 2], [f64; 2]);

impl<'a> Charts<'a> {
    fn new(patch: &'a Patch, pieces: &[Piece], bound: f64, snap: f64) -> Self {
        let topology = &patch.topology;
        let corners: Vec<[[f64; 3]; 3]> = topology
            .triangles()
            .iter()
            .map(|t| t.map(|v| patch.positions[v as usize]))
            .collect();
        let count = topology.half_edges() as usize;
        let edges = patch.lengths.iter().sum::<f64>() / count.max(1) as f64;
        let cell = (2.0 * edges).max(f64::MIN_POSITIVE);
        let mut charts = Self {
            patch,
            bound,
            snap,
            rest: RestShapes::new(&corners, Some(1.0)),
            of: vec![0; count / 3],
            members: Vec::new(),
            vertices: vec![0; count],
            uv: Vec::new(),
            is_inner: vec![false; count],
            borders: vec![BTreeMap::new(); pieces.len()],
            energies: Vec::new(),
            areas: Vec::new(),
            grids: Vec::new(),
            widest_gap: 0.5 * cell,
        };
        for (number, piece) in (0..).zip(pieces) {
            let first = charts.uv.len() as u32;
            charts.uv.extend(&piece.layout.uv);
            let flat = piece.layout.opened.topology.triangles();
            for (&t, corners) in piece.triangles.iter().zip(flat) {
                charts.of[t as usize] = number;
                for (h, v) in (3 * t..).zip(corners) {
                    charts.vertices[h as usize] = first + v;
                }
            }
            charts.members.push(piece.triangles.clone());
            charts.grids.push(Grid::new(cell));
        }
        for h in 0..topology.half_edges() {
            let (chart, beyond) = (charts.of[h as usize / 3], topology.twin(h));
            if let Some(twin) = beyond {
                let other = charts.of[twin as usize / 3];
                if other != chart {
                    let price = charts.borders[chart as usize].entry(other).or_default();
                    *price += patch.prices[h as usize];
                } else if charts.ends(h) == charts.ends_of_twin(twin) {
                    charts.is_inner[h as usize] = true;
                    continue;
                }
            }
            let ends = charts.ends(h).map(|v| charts.uv[v as usize]);
            charts.grids[chart as usize].insert(h, ends);
        }
        for chart in 0..pieces.len() {
            let members = charts.members[chart].iter();
            let energy = members
                .clone()
                .map(|&t| charts.energy(t, |v| charts.uv[v as usize]));
            let energy = energy.sum();
            let area = members.map(|&t| charts.rest.area(t as usize)).sum();
            charts.energies.push(energy);
            charts.areas.push(area);
        }
        charts
    }

    /// The vertices in the plane of a half-edge.
    fn ends(&self, h: u32) -> [u32; 2] {
        [h, next(h)].map(|h| self.vertices[h as usize])
    }

    /// The same of a twin, in the direction of the half-edge.
    fn ends_of_twin(&self, twin: u32) -> [u32; 2] {
        let [end, start] = self.ends(twin);
        [start, end]
    }

    /// The energy of a triangle times its area, with its vertices at places.
    fn energy(&self, t: u32, place: impl Fn(u32) -> [f64; 2]) -> f64 {
        let corners = [3 * t, 3 * t + 1, 3 * t + 2].map(|h| place(self.vertices[h as usize]));
        energy_of(&self.rest, t as usize, corners)
    }

    /// Where a chart can lie beside another.
    fn placing(&self, large: u32, small: u32) -> Option<Placing> {
        let topology = &self.patch.topology;
        let is_shared = |&(_, twin): &(u32, u32)| self.of[twin as usize / 3] == large;
        let shared: Vec<(u32, u32)> = self.members[small as usize]
            .iter()
            .flat_map(|&t| 3 * t..3 * t + 3)
            .filter_map(|h| Some((h, topology.twin(h)?)))
            .filter(is_shared)
            .collect();
        let chains = self.chains(&shared);
        let tried = chains.iter().take(TRIED);
        let mut tried = tried.flat_map(|chain| SIZES.map(|size| (chain, size)));
        tried.find_map(|(chain, size)| self.beside(large, small, chain, &shared, size))
    }

    /// The runs of common edges without a gap, the longest first.
    fn chains(&self, shared: &[(u32, u32)]) -> Vec<Vec<(u32, u32)>> {
        // By the vertices at the start, in both planes.
        let key =
            |at: usize, &(h, twin): &(u32, u32)| (self.ends(h)[at], self.ends_of_twin(twin)[at]);
        let starts: BTreeMap<(u32, u32), (u32, u32)> =
            shared.iter().map(|pair| (key(0, pair), *pair)).collect();
        let ends: BTreeMap<(u32, u32), u32> =
            shared.iter().map(|pair| (key(1, pair), pair.0)).collect();
        let has_no_start = |pair: &&(u32, u32)| !ends.contains_key(&key(0, pair));
        // Closed runs begin anywhere.
        let first = shared.iter().filter(has_no_start).chain(shared);
        let mut done = BTreeMap::new();
        let mut chains: Vec<(f64, Vec<(u32, u32)>)> = Vec::new();
        for &start in first {
            let (mut chain, mut price, mut at) = (Vec::new(), 0.0, Some(start));
            while let Some(pair) = at
                && done.insert(pair.0, ()).is_none()
            {
                chain.push(pair);
                price += self.patch.prices[pair.0 as usize];
                at = starts.get(&key(1, &pair)).copied();
            }
            if !chain.is_empty() {
                chains.push((price, chain));
            }
        }
        chains.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        chains.into_iter().map(|(_, chain)| chain).collect()
    }

    /// Where a chart can lie beside another so that a chain of common edges fits best.
    fn beside(
        &self,
        large: u32,
        small: u32,
        chain: &[(u32, u32)],
        shared: &[(u32, u32)],
        size: f64,
    ) -> Option<Placing> {
        let turned = self.fitted(chain, size)?;
        let mut placing = Placing {
            places: BTreeMap::new(),
            same: BTreeMap::new(),
            glued: BTreeSet::new(),
            energy: 0.0,
        };
        let mut taken: BTreeMap<u32, u32> = BTreeMap::new();
        let mut fit = 0.0;
        for (i, &(h, twin)) in chain.iter().chain(shared).enumerate() {
            let (own, others) = (self.ends(h), self.ends_of_twin(twin));
            let most = self.snap * self.patch.lengths[h as usize];
            let is_near = |k: usize| {
                let [p, q] = [
                    turned(self.uv[own[k] as usize]),
                    self.uv[others[k] as usize],
                ];
                (p[0] - q[0]).hypot(p[1] - q[1]) <= most
            };
            let is_free = |k: usize| {
                placing.same.get(&own[k]).is_none_or(|v| *v == others[k])
                    && taken.get(&others[k]).is_none_or(|v| *v == own[k])
            };
            if placing.glued.contains(&h) || !(0..2).all(|k| is_near(k) && is_free(k)) {
                continue;
            }
            for k in 0..2 {
                placing.same.insert(own[k], others[k]);
                taken.insert(others[k], own[k]);
            }
            placing.glued.insert(h);
            if i < chain.len() {
                fit += self.patch.lengths[h as usize];
            }
        }
        let whole: f64 = chain
            .iter()
            .map(|&(h, _)| self.patch.lengths[h as usize])
            .sum();
        if placing.glued.is_empty() || fit < LEAST_FIT * whole {
            return None;
        }
        for &t in &self.members[small as usize] {
            for v in [3 * t, 3 * t + 1, 3 * t + 2].map(|h| self.vertices[h as usize]) {
                placing
                    .places
                    .entry(v)
                    .or_insert_with(|| match placing.same.get(&v) {
                        Some(&other) => self.uv[other as usize],
                        None => turned(self.uv[v as usize]),
                    });
            }
        }
        let members = self.members[small as usize].iter();
        placing.energy = members
            .map(|&t| self.energy(t, |v| placing.places[&v]))
            .sum();
        let [energy, area] = [&self.energies, &self.areas].map(|sums| sums[large as usize]);
        let together = (energy + placing.energy) / (area + self.areas[small as usize]);
        let is_good = together <= self.bound && placing.energy.is_finite();
        (is_good && self.is_clear(large, small, &placing)).then_some(placing)
    }

    /// The motion that takes the half-edges of a chain, scaled by `size`, to their twins as well as it
    /// can.
    fn fitted(
        &self,
        chain: &[(u32, u32)],
        size: f64,
    ) -> Option<impl Fn([f64; 2]) -> [f64; 2] + use<>> {
        let pairs: Vec<Pair> = chain
            .iter()
            .flat_map(|&(h, twin)| {
                let (own, others) = (self.ends(h), self.ends_of_twin(twin));
                let weight = self.patch.lengths[h as usize].max(f64::MIN_POSITIVE);
                let at = |v: u32| self.uv[v as usize];
                [0, 1].map(|k| (weight, at(own[k]), at(others[k])))
            })
            .collect();
        let total: f64 = pairs.iter().map(|pair| pair.0).sum();
        let mean = |of: fn(&Pair) -> [f64; 2]| {
            [0, 1].map(|k| pairs.iter().map(|pair| pair.0 * of(pair)[k]).sum::<f64>() / total)
        };
        let (from, to) = (mean(|pair| pair.1), mean(|pair| pair.2));
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (weight, p, q) in &pairs {
            let [p, q] = [
                [p[0] - from[0], p[1] - from[1]],
                [q[0] - to[0], q[1] - to[1]],
            ];
            cosine += weight * (p[0] * q[0] + p[1] * q[1]);
            sine += weight * (p[0] * q[1] - p[1] * q[0]);
        }
        let norm = cosine.hypot(sine);
        (norm > 0.0 && norm.is_finite()).then(|| {
            let (cosine, sine) = (size * cosine / norm, size * sine / norm);
            move |p: [f64; 2]| {
                let [x, y] = [p[0] - from[0], p[1] - from[1]];
                [to[0] + cosine * x - sine * y, to[1] + sine * x + cosine * y]
            }
        })
    }

    /// Whether a chart that is placed beside another keeps a gap to it, but for where they are
    /// joined.
    fn is_clear(&self, large: u32, small: u32, placing: &Placing) -> bool {
        let topology = &self.patch.topology;
        let half_edges = self.members[small as usize]
            .iter()
            .flat_map(|&t| 3 * t..3 * t + 3);
        let mut border =
            half_edges.filter(|h| !self.is_inner[*h as usize] && !placing.glued.contains(h));
        let is_free = |f: u32| {
            let is_glued = topology.twin(f).is_some_and(|g| placing.glued.contains(&g));
            !self.is_inner[f as usize] && !is_glued
        };
        border.all(|g| {
            let own = self.ends(g);
            let places = own.map(|v| placing.places[&v]);
            let joined = own.map(|v| placing.same.get(&v).copied());
            let near = self.grids[large as usize].near(places);
            near.into_iter().filter(|&f| is_free(f)).all(|f| {
                let ends = self.ends(f);
                let others = ends.map(|v| self.uv[v as usize]);
                let common = |i: usize, k: usize| joined[i] == Some(ends[k]);
                let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
                let mut meeting = pairs.into_iter().filter(|&(i, k)| common(i, k));
                match (meeting.next(), meeting.next()) {
                    (None, _) => {
                        let shorter = [f, g].map(|h| self.patch.lengths[h as usize]);
                        let gap = GAP * shorter[0].min(shorter[1]);
                        distance(places, others) > gap.min(self.widest_gap)
                    }
                    (Some((i, k)), None) => {
                        let away = |ends: [[f64; 2]; 2], at: usize| {
                            [0, 1].map(|axis| ends[1 - at][axis] - ends[at][axis])
                        };
                        let (p, q) = (away(places, i), away(others, k));
                        let dot = p[0] * q[0] + p[1] * q[1];
                        dot < MOST_COSINE * p[0].hypot(p[1]) * q[0].hypot(q[1])
                    }
                    (Some(_), Some(_)) => false,
                }
            })
        })
    }

    /// Makes a chart part of another. What the other's borders are then with neighbours of both.
    fn join(&mut self, large: u32, small: u32, placing: Placing) -> Vec<(u32, f64)> {
        let topology = &self.patch.topology;
        for (&v, &place) in &placing.places {
            self.uv[v as usize] = place;
        }
        for &h in &placing.glued {
            self.is_inner[h as usize] = true;
            if let Some(twin) = topology.twin(h) {
                self.is_inner[twin as usize] = true;
            }
        }
        let members = std::mem::take(&mut self.members[small as usize]);
        for &t in &members {
            self.of[t as usize] = large;
            for h in 3 * t..3 * t + 3 {
                let v = &mut self.vertices[h as usize];
                *v = placing.same.get(v).copied().unwrap_or(*v);
            }
        }
        for h in members.iter().flat_map(|&t| 3 * t..3 * t + 3) {
            if !self.is_inner[h as usize] {
                let ends = self.ends(h).map(|v| self.uv[v as usize]);
                self.grids[large as usize].insert(h, ends);
            }
        }
        self.members[large as usize].extend(members);
        self.energies[large as usize] += placing.energy;
        self.areas[large as usize] += self.areas[small as usize];
        self.borders[large as usize].remove(&small);
        let mut changed = Vec::new();
        for (other, price) in std::mem::take(&mut self.borders[small as usize]) {
            if other == large {
                continue;
            }
            let sum = self.borders[large as usize].entry(other).or_default();
            *sum += price;
            changed.push((other, *sum));
            let beyond = &mut self.borders[other as usize];
            beyond.remove(&small);
            beyond.insert(large, changed[changed.len() - 1].1);
        }
        changed
    }

    /// The charts, relaxed; the pieces that one was made of where it is not valid for rounding.
    fn finished(self, pieces: Vec<Piece>, goes_on: &(dyn Fn() -> bool + Sync)) -> Vec<Piece> {
        let mut made_of: BTreeMap<u32, Vec<Piece>> = BTreeMap::new();
        for piece in pieces {
            let chart = piece.triangles.first().map_or(0, |&t| self.of[t as usize]);
            made_of.entry(chart).or_default().push(piece);
        }
        let of_chart = |(chart, pieces): (u32, Vec<Piece>)| match pieces.len() {
            1 => pieces,
            _ => match self.relaxed(chart, goes_on) {
                Some(piece) => vec![piece],
                None => pieces,
            },
        };
        made_of.into_iter().flat_map(of_chart).collect()
    }

    fn relaxed(&self, chart: u32, goes_on: &(dyn Fn() -> bool + Sync)) -> Option<Piece> {
        let mut triangles = self.members[chart as usize].clone();
        triangles.sort_unstable();
        let own = self.patch.subset(&triangles);
        let half_edges = triangles.iter().flat_map(|&t| 3 * t..3 * t + 3);
        let place = |h: u32| self.uv[self.vertices[h as usize] as usize];
        let corners: Vec<[f64; 2]> = half_edges.map(place).collect();
        let cut = Cut::between(&own.topology, &corners);
        let mut layout = Layout::of(&own.topology, cut, &corners);
        let mut problem = Problem::new(&own, own.lengths.clone(), &goes_on);
        problem.injective = true;
        if !problem.is_valid(&layout) {
            return None;
        }
        problem.measure(&mut layout);
        if layout.energy > NEXT_TO_ISOMETRIC {
            // What was reached stays valid when a step fails.
            let _ = problem.relax(&mut layout, EFFORT);
            problem.measure(&mut layout);
        }
        Some(Piece { triangles, layout })
    }
}
