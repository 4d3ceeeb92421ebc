//! Seams of a proxy, carried to the surface that it lies close to.

use std::collections::{HashMap, HashSet};

use super::places::Frame;
use super::proxy::{Proxy, mean_edge};
use crate::cut::paths::cheapest_path;
use crate::patch::Patch;
use fam_surface::TriangleMesh;
use fam_surface::neighbors::nearest;
use fam_surface::orientation::{NONE, across, ends};
use fam_surface::vector::{add, length, scale, sub};

/// How far beside the line that it follows a path is looked for, as a share of the diagonal. Farther
/// away it costs no more.
const REACH: f64 = 0.08;

/// Factor on the price of an edge that touches another path or the boundary.
const TAKEN: f64 = 20.0;

/// The edges of a surface, by their vertices, the smaller first, along which the seams of its proxy run
/// there: the same edges on the side that the proxy is made of; elsewhere the paths that stay nearest to
/// the seams. `seams` are edges of the proxy; `patch` is the surface's. `None` once `goes_on` says no.
pub fn carried(
    proxy: &Proxy,
    seams: &[[u32; 2]],
    surface: &TriangleMesh,
    patch: &Patch,
    goes_on: &dyn Fn() -> bool,
) -> Option<HashSet<[u32; 2]>> {
    let mut paths = Paths::new(proxy, surface, patch);
    let chains = chains(
        seams,
        |edge| paths.kind(edge),
        |v| paths.is_boundary[0][v as usize],
    );
    let (own, others): (Vec<_>, Vec<_>) = chains.into_iter().partition(|c| paths.is_own(c));
    let places = paths.places(&own, &others);
    for chain in &own {
        paths.keep(chain);
    }
    for chain in &others {
        if !goes_on() {
            return None;
        }
        paths.follow(chain, &places);
    }
    Some(paths.found)
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Edges of one kind each as chains of vertices. They end where one edge or more than two meet, or two
/// of different kinds, and at vertices for which `is_end` holds. A closed one is divided in three.
fn chains(
    edges: &[[u32; 2]],
    kind: impl Fn([u32; 2]) -> Kind,
    is_end: impl Fn(u32) -> bool,
) -> Vec<Vec<u32>> {
    let mut around: HashMap<u32, Vec<u32>> = HashMap::new();
    for &[a, b] in edges {
        around.entry(a).or_default().push(b);
        around.entry(b).or_default().push(a);
    }
    let mut vertices: Vec<u32> = around.keys().copied().collect();
    vertices.sort_unstable();
    let is_inner = |v: u32| match around[&v][..] {
        [a, b] => kind([a, v]) == kind([v, b]) && !is_end(v),
        _ => false,
    };
    let mut done: HashSet<[u32; 2]> = HashSet::new();
    let mut found = Vec::new();
    let walk = |start: u32, next: u32, done: &mut HashSet<[u32; 2]>| {
        let mut chain = vec![start];
        let mut at = next;
        while done.insert(sorted([chain[chain.len() - 1], at])) {
            chain.push(at);
            if !is_inner(at) || at == start {
                break;
            }
            let before = chain[chain.len() - 2];
            let onwards = around[&at].iter().find(|&&v| v != before);
            at = *onwards.unwrap_or(&before);
        }
        chain
    };
    let ends = vertices.iter().filter(|&&v| !is_inner(v));
    let starts = ends.flat_map(|&v| around[&v].iter().map(move |&next| (v, next)));
    let others = vertices.iter().filter(|&&v| is_inner(v));
    for (v, next) in starts.chain(others.map(|&v| (v, around[&v][0]))) {
        let chain = walk(v, next, &mut done);
        let last = chain.len() - 1;
        if last == 0 {
            continue;
        }
        let parts = if chain[0] == chain[last] { 3 } else { 1 };
        for part in 0..parts {
            let [from, to] = [part, part + 1].map(|k| k * last / parts);
            found.push(chain[from..=to].to_vec());
        }
    }
    found
}

/// How an edge of the proxy is carried.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// It is an edge of the surface.
    Own,
    /// It lies on the plane.
    OnPlane,
    /// It is neither.
    Other,
}

/// Paths over a surface that follow seams of its proxy.
struct Paths<'a> {
    proxy: &'a Proxy,
    surface: &'a TriangleMesh,
    patch: &'a Patch,
    /// The edges of the surface.
    edges: HashSet<[u32; 2]>,
    /// Of the proxy and of the surface: which vertices lie on a boundary.
    is_boundary: [Vec<bool>; 2],
    /// For every vertex of the surface one of the patch.
    numbers: Vec<u32>,
    frame: Frame,
    /// The mean length of edges.
    spacing: f64,
    is_taken: Vec<bool>,
    found: HashSet<[u32; 2]>,
}

impl<'a> Paths<'a> {
    fn new(proxy: &'a Proxy, surface: &'a TriangleMesh, patch: &'a Patch) -> Self {
        let triangles = surface.triangles().iter();
        let sides = triangles.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(sorted));
        let mut numbers = vec![NONE; surface.positions().len()];
        for (number, &v) in patch.source.iter().enumerate().rev() {
            numbers[v as usize] = number as u32;
        }
        Self {
            proxy,
            surface,
            patch,
            edges: sides.collect(),
            is_boundary: [&proxy.mesh, surface].map(on_boundary),
            numbers,
            frame: Frame::of(surface),
            spacing: mean_edge(surface).max(f64::MIN_POSITIVE),
            is_taken: vec![false; surface.positions().len()],
            found: HashSet::new(),
        }
    }

    /// How an edge of the proxy is carried.
    fn kind(&self, edge: [u32; 2]) -> Kind {
        let is_fixed = |v: u32| self.proxy.pairing.images[v as usize] == Some(v);
        let own = edge.map(|v| self.proxy.origins[v as usize]);
        if edge.iter().all(|&v| is_fixed(v)) {
            Kind::OnPlane
        } else if edge.iter().all(|&v| self.proxy.is_own[v as usize])
            && self.edges.contains(&sorted(own))
        {
            Kind::Own
        } else {
            Kind::Other
        }
    }

    /// Whether a chain is one of edges of the surface.
    fn is_own(&self, chain: &[u32]) -> bool {
        self.kind([chain[0], chain[1]]) == Kind::Own
    }

    /// The vertices of the surface for the ends of chains.
    fn places(&self, own: &[Vec<u32>], others: &[Vec<u32>]) -> HashMap<u32, u32> {
        let mut places = HashMap::new();
        for &v in own.iter().flatten() {
            places.insert(v, self.proxy.origins[v as usize]);
        }
        let ends = others.iter().flat_map(|c| [c[0], c[c.len() - 1]]);
        let mut unknown: Vec<u32> = ends.filter(|v| !places.contains_key(v)).collect();
        unknown.sort_unstable();
        unknown.dedup();
        let (proxy, surface) = (&self.proxy.mesh, self.surface);
        let used = surface.used_vertices();
        let edge: Vec<u32> = used
            .iter()
            .copied()
            .filter(|&v| self.is_boundary[1][v as usize])
            .collect();
        let (at_boundary, inner): (Vec<u32>, Vec<u32>) = unknown
            .iter()
            .partition(|&&v| self.is_boundary[0][v as usize] && !edge.is_empty());
        for (queries, targets) in [(at_boundary, &edge), (inner, &used)] {
            let near = nearest(
                &self.frame.vertices(surface, targets),
                &self.frame.vertices(proxy, &queries),
            );
            for (v, near) in queries.into_iter().zip(near) {
                places.insert(v, targets[near as usize]);
            }
        }
        places
    }

    /// Adds the edges of a chain that are edges of the surface.
    fn keep(&mut self, chain: &[u32]) {
        let path: Vec<u32> = chain
            .iter()
            .map(|&v| self.proxy.origins[v as usize])
            .collect();
        for edge in path.windows(2) {
            self.add([edge[0], edge[1]]);
        }
    }

    fn add(&mut self, edge: [u32; 2]) {
        self.found.insert(sorted(edge));
        for v in edge {
            self.is_taken[v as usize] = true;
        }
    }

    /// Adds the path that follows a chain.
    fn follow(&mut self, chain: &[u32], places: &HashMap<u32, u32>) {
        let ends = [chain[0], chain[chain.len() - 1]].map(|v| places[&v]);
        let [start, end] = ends.map(|v| self.numbers[v as usize]);
        if start == end || start == NONE || end == NONE {
            return;
        }
        let away = self.distances(chain);
        let (topology, source) = (&self.patch.topology, &self.patch.source);
        let cost = |h: u32| {
            if self.patch.forbidden[h as usize] {
                return f64::INFINITY;
            }
            let sides = [topology.origin(h), topology.target(h)].map(|v| source[v as usize]);
            let [a, b] = sides.map(|v| away[v as usize] / self.spacing);
            let is_taken = |v: &u32| {
                let is_held = self.is_taken[*v as usize] || self.is_boundary[1][*v as usize];
                is_held && !ends.contains(v)
            };
            let factor = if sides.iter().any(is_taken) {
                TAKEN
            } else {
                1.0
            };
            self.patch.lengths[h as usize] * (1.0 + 0.5 * (a * a + b * b)) * factor
        };
        let costs: Vec<f64> = (0..topology.half_edges()).map(cost).collect();
        let Some(path) = cheapest_path(topology, &costs, &[start], |v| v == end) else {
            return;
        };
        for h in path {
            let edge = [topology.origin(h), topology.target(h)];
            self.add(edge.map(|v| source[v as usize]));
        }
    }

    /// How far every vertex of the surface is from a chain of the proxy, as far as it matters.
    fn distances(&self, chain: &[u32]) -> Vec<f64> {
        let reach = REACH * self.frame.diagonal;
        let at = |v: u32| self.proxy.mesh.positions()[v as usize];
        let mut samples = vec![at(chain[0])];
        for pair in chain.windows(2) {
            let [p, q] = [at(pair[0]), at(pair[1])];
            let steps = (2.0 * length(sub(p, q)) / self.spacing)
                .ceil()
                .clamp(1.0, 100.0);
            samples.extend((1..=steps as u32).map(|i| {
                let share = f64::from(i) / steps;
                add(p, scale(sub(q, p), share))
            }));
        }
        let bound = |fold: fn(f64, f64) -> f64, start: f64| {
            [0, 1, 2].map(|k| samples.iter().map(|p| p[k]).fold(start, fold))
        };
        let (low, high) = (
            bound(f64::min, f64::INFINITY),
            bound(f64::max, f64::NEG_INFINITY),
        );
        let positions = self.surface.positions();
        let is_near =
            |p: &[f64; 3]| (0..3).all(|k| p[k] > low[k] - reach && p[k] < high[k] + reach);
        let near: Vec<usize> = (0..positions.len())
            .filter(|&v| is_near(&positions[v]))
            .collect();
        let point = |&v: &usize| self.frame.point(positions[v]);
        let queries: Vec<[f32; 3]> = near.iter().map(point).collect();
        let points: Vec<[f32; 3]> = samples.iter().map(|&p| self.frame.point(p)).collect();
        let mut away = vec![reach; positions.len()];
        for (&v, n) in near.iter().zip(nearest(&points, &queries)) {
            away[v] = length(sub(positions[v], samples[n as usize])).min(reach);
        }
        away
    }
}

/// Which vertices of a mesh lie on its boundary.
fn on_boundary(mesh: &TriangleMesh) -> Vec<bool> {
    let mut is_boundary = vec![false; mesh.positions().len()];
    for (h, &twin) in (0..).zip(&across(mesh.triangles())) {
        if twin == NONE {
            for v in ends(mesh.triangles(), h) {
                is_boundary[v as usize] = true;
            }
        }
    }
    is_boundary
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes::rectangle;
    use fam_surface::symmetry::MirrorPlane;

    #[test]
    fn chains_end_where_others_meet() {
        // A line into a ring of six, and a loose ring of four.
        let line = [[0, 1], [1, 2]];
        let ring = [[2, 3], [3, 4], [4, 5], [5, 6], [6, 7], [7, 2]];
        let loose = [[10, 11], [11, 12], [12, 13], [13, 10]];
        let all: Vec<[u32; 2]> = line.iter().chain(&ring).chain(&loose).copied().collect();
        let found = chains(&all, |_| Kind::Other, |_| false);
        let mut sizes: Vec<usize> = found.iter().map(Vec::len).collect();
        sizes.sort_unstable();
        assert_eq!(sizes, [2, 2, 3, 3, 3, 3, 3]);
        let edges = found.iter().flat_map(|chain| chain.windows(2));
        let mut edges: Vec<[u32; 2]> = edges.map(|e| sorted([e[0], e[1]])).collect();
        edges.sort_unstable();
        let mut expected: Vec<[u32; 2]> = all.into_iter().map(sorted).collect();
        expected.sort_unstable();
        assert_eq!(edges, expected);
    }

    #[test]
    fn chains_end_where_the_kind_changes() {
        let edges = [[0, 1], [1, 2], [2, 3], [3, 4]];
        let kind = |[a, b]: [u32; 2]| if a.max(b) < 3 { Kind::Own } else { Kind::Other };
        let mut found = chains(&edges, kind, |_| false);
        found.sort();
        assert_eq!(found, [vec![0, 1, 2], vec![2, 3, 4]]);
        let mut found = chains(&edges, |_| Kind::Own, |v| v == 1);
        found.sort();
        assert_eq!(found, [vec![0, 1], vec![1, 2, 3, 4]]);
    }

    /// A line along the middle of a sheet whose other half is moved aside.
    #[test]
    fn lines_are_carried_to_the_nearest_edges() {
        let sheet = rectangle(2.0, 1.0, 12, 6);
        for aside in [0.0, 0.05, 0.15] {
            let place = |&[x, y, z]: &[f64; 3]| [x, y + aside * (-4.0 * x).clamp(0.0, 1.0), z];
            let positions = sheet.positions().iter().map(place).collect();
            let moved = TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap();
            let heights: Vec<f64> = moved.positions().iter().map(|p| p[0]).collect();
            let plane = MirrorPlane::across(0, 0.0);
            let proxy = Proxy::of(&moved, &plane, &heights).unwrap();
            let is_on = |v: u32| proxy.mesh.positions()[v as usize][1].abs() < 1e-9;
            let sides = proxy.mesh.triangles().iter();
            let mut line: Vec<[u32; 2]> = sides
                .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
                .filter(|edge| edge.iter().all(|&v| is_on(v)))
                .map(sorted)
                .collect();
            line.sort_unstable();
            line.dedup();
            assert_eq!(line.len(), 12);
            let patch = Patch::of(&moved);
            let found = carried(&proxy, &line, &moved, &patch, &|| true).unwrap();
            let at = |v: &u32| moved.positions()[*v as usize];
            let mut beyond = found.iter().flatten().filter(|v| at(v)[0] < -0.3);
            assert!(beyond.all(|v| at(v)[1].abs() < 0.06));
            let span = |edge: &[u32; 2]| (at(&edge[0])[0] - at(&edge[1])[0]).abs();
            let total: f64 = found.iter().map(span).sum();
            assert!((total - 2.0).abs() < 1e-9, "{total}");
        }
    }
}
