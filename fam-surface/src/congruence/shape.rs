use std::collections::HashMap;

use crate::TriangleMesh;
use crate::orientation::{NONE, across, ends};
use crate::vector::{add, cross, dot, length, scale, sub};

use super::{MOST_TOLERANCE, ROUNDING, TOLERANCE};

/// How much farther measures and lengths of edges may be off than vertices are: an edge has two ends.
const REACH: f64 = 4.0;

/// Lengths are of one class if they lie in one step, in units of what they may be off. Classes only
/// say which shapes are rare.
const STEP: f64 = 64.0;

/// Rings of triangles that are taken for the surroundings of one.
const RINGS: usize = 4;

/// A mesh, ready to be held against others.
pub(super) struct Shape<'a> {
    pub triangles: &'a [[u32; 3]],
    /// In a unit that all meshes share.
    pub positions: Vec<[f64; 3]>,
    /// For every half-edge the other one of its edge.
    pub across: Vec<u32>,
    /// How far vertices may be off.
    pub allowed: f64,
    /// Lengths that stay the same in all copies: the mean of all sides of triangles, the root mean
    /// square and the largest of the distances from the mean of all vertices.
    pub measures: [f64; 3],
    open: usize,
    /// For every triangle a number that says how the mesh hangs together around it, the same in
    /// all copies.
    pub surroundings: Vec<u64>,
    /// A triangle of a rare shape.
    pub rare: u32,
    /// Three vertices far apart.
    pub far: [u32; 3],
}

impl<'a> Shape<'a> {
    /// A mesh whose coordinates are multiplied by `unit`; none if it has no extent in two
    /// directions.
    pub(super) fn new(mesh: &'a TriangleMesh, unit: f64) -> Option<Self> {
        let positions: Vec<[f64; 3]> = mesh.positions().iter().map(|&p| scale(p, unit)).collect();
        let triangles = mesh.triangles();
        let count = positions.len() as f64;
        let sum = positions.iter().fold([0.0; 3], |sum, &p| add(sum, p));
        let center = scale(sum, 1.0 / count);
        let distances = || positions.iter().map(|&p| length(sub(p, center)));
        let size = distances().fold(0.0, f64::max);
        let squares: f64 = distances().map(|d| d * d).sum();
        let side = |h: u32| {
            let [a, b] = ends(triangles, h).map(|v| positions[v as usize]);
            length(sub(b, a))
        };
        let sides: f64 = (0..3 * triangles.len() as u32).map(side).sum();
        let largest = positions
            .iter()
            .flatten()
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        let rounding = ROUNDING * largest;
        let allowed = (TOLERANCE * size + rounding).min(MOST_TOLERANCE * size);
        let across = across(triangles);
        let mut shape = Self {
            triangles,
            measures: [
                sides / (3 * triangles.len()) as f64,
                (squares / count).sqrt(),
                size,
            ],
            open: across.iter().filter(|&&h| h == NONE).count(),
            surroundings: surroundings(triangles, positions.len(), &across),
            across,
            allowed,
            positions,
            rare: 0,
            far: [0; 3],
        };
        shape.far = shape.far_apart(center)?;
        shape.rare = shape.rare_triangle();
        Some(shape)
    }

    /// How far lengths may be off.
    pub(super) fn reach(&self) -> f64 {
        REACH * self.allowed
    }

    /// Whether another mesh has the same measures.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let reach = self.reach().max(other.reach());
        let is_near = |k: usize| (self.measures[k] - other.measures[k]).abs() <= reach;
        self.open == other.open && (0..3).all(is_near)
    }

    pub(super) fn position(&self, vertex: u32) -> [f64; 3] {
        self.positions[vertex as usize]
    }

    pub(super) fn distance(&self, a: u32, b: u32) -> f64 {
        length(sub(self.position(b), self.position(a)))
    }

    /// The lengths of the sides of a triangle, from corner 0 to 1, 1 to 2 and 2 to 0.
    pub(super) fn sides(&self, triangle: u32) -> [f64; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [[a, b], [b, c], [c, a]].map(|[a, b]| self.distance(a, b))
    }

    /// The vertex farthest from the centre, that farthest from it, and that farthest from the line
    /// through both; none if all lie on a line.
    fn far_apart(&self, center: [f64; 3]) -> Option<[u32; 3]> {
        let farthest = |distance: &dyn Fn([f64; 3]) -> f64| {
            let mut best = (0.0, 0);
            for (v, &p) in (0..).zip(&self.positions) {
                let distance = distance(p);
                if distance > best.0 {
                    best = (distance, v);
                }
            }
            (best.0 > REACH * self.allowed).then_some(best.1)
        };
        let a = farthest(&|p| length(sub(p, center)))?;
        let from = self.position(a);
        let b = farthest(&|p| length(sub(p, from)))?;
        let along = sub(self.position(b), from);
        let along = scale(along, 1.0 / length(along));
        let c = farthest(&|p| {
            let to = sub(p, from);
            length(sub(to, scale(along, dot(to, along))))
        })?;
        Some([a, b, c])
    }

    /// The largest triangle of the rarest shape and surroundings.
    fn rare_triangle(&self) -> u32 {
        let step = STEP * self.allowed;
        let class = |t: u32| {
            let mut sides = self.sides(t).map(|side| (side / step).floor() as i64);
            sides.sort_unstable();
            (self.surroundings[t as usize], sides)
        };
        let all = 0..self.triangles.len() as u32;
        let mut counts: HashMap<(u64, [i64; 3]), usize> = HashMap::new();
        for t in all.clone() {
            *counts.entry(class(t)).or_default() += 1;
        }
        let area = |t: u32| {
            let [a, b, c] = self.triangles[t as usize].map(|v| self.position(v));
            length(cross(sub(b, a), sub(c, a)))
        };
        let rarer = |&a: &u32, &b: &u32| {
            let by_count = counts[&class(a)].cmp(&counts[&class(b)]);
            by_count.then(area(b).total_cmp(&area(a))).then(a.cmp(&b))
        };
        all.min_by(rarer).unwrap_or(0)
    }
}

/// For every triangle a hash of the valences of its corners, of which sides are open, and of the
/// same of the triangles around it.
fn surroundings(triangles: &[[u32; 3]], vertices: usize, across: &[u32]) -> Vec<u64> {
    let mut valences = vec![0_u64; vertices];
    for &v in triangles.iter().flatten() {
        valences[v as usize] += 1;
    }
    let hash = |first: u64, mut others: [u64; 3]| {
        others.sort_unstable();
        others.into_iter().fold(first, mixed)
    };
    let corners = |t: &[u32; 3]| hash(1, t.map(|v| valences[v as usize]));
    let mut all: Vec<u64> = triangles.iter().map(corners).collect();
    for _ in 0..RINGS {
        let beyond = |h: u32| match across[h as usize] {
            NONE => 0,
            other => all[other as usize / 3],
        };
        let ring = |t: u32| hash(all[t as usize], [0, 1, 2].map(|c| beyond(3 * t + c)));
        all = (0..triangles.len() as u32).map(ring).collect();
    }
    all
}

/// One of two numbers, as if by chance.
fn mixed(a: u64, b: u64) -> u64 {
    // Odd constants with bits at random places.
    let product = (a ^ b.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    product ^ (product >> 32)
}
