//! The triangles of a polygon that its fan would fold over: ears are clipped from it one by one.
//!
//! The predicates are exact on the coordinates of the file, so that corners of several holes may
//! share positions, as they do where holes are bridged to the outline.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use robust::{Coord, orient2d};

use crate::vector::{add, cross, sub};

/// Of the area of a polygon, the share by which the triangles of its fan may exceed it and count
/// as not folded: coordinates in single precision are not rounded more.
const ROUNDING: f64 = 1e-6;

/// How many corners are compared with ears before a polygon is left as it is: some ten seconds.
const MOST_COMPARISONS: usize = 1_000_000_000;

/// The triangles of a polygon by the numbers of its corners, two less than these; none where a
/// fan around the first corner does as well.
///
/// A polygon that is not flat is seen along the axis to which it is turned most.
pub fn ears(corners: &[[f64; 3]]) -> Option<Vec<[u32; 3]>> {
    if corners.len() < 4 {
        return None;
    }
    let spoke = |k: usize| sub(corners[k], corners[0]);
    let areas = || (2..corners.len()).map(|k| cross(spoke(k - 1), spoke(k)));
    let normal = areas().fold([0.0; 3], add);
    let steepest = |a: &usize, b: &usize| normal[*a].abs().total_cmp(&normal[*b].abs());
    let axis = (0..3).max_by(steepest)?;
    let folded: f64 = areas().map(|area| area[axis].abs()).sum();
    if folded <= (1.0 + ROUNDING) * normal[axis].abs() || !folded.is_finite() {
        return None;
    }
    let [x, y] = match normal[axis] > 0.0 {
        true => [(axis + 1) % 3, (axis + 2) % 3],
        false => [(axis + 2) % 3, (axis + 1) % 3],
    };
    let points: Vec<Coord<f64>> = corners.iter().map(|p| Coord { x: p[x], y: p[y] }).collect();
    let triangles = Ring::of(&points).clip()?;
    let area = |t: &[u32; 3]| 0.5 * orient(t.map(|c| points[c as usize])).abs();
    let covered: f64 = triangles.iter().map(area).sum();
    (covered < 0.5 * folded).then_some(triangles)
}

/// Twice the area, positive where counter-clockwise; the sign is exact.
fn orient([a, b, c]: [Coord<f64>; 3]) -> f64 {
    orient2d(a, b, c)
}

/// What is left of a polygon that runs counter-clockwise.
struct Ring<'a> {
    points: &'a [Coord<f64>],
    previous: Vec<usize>,
    next: Vec<usize>,
    is_left: Vec<bool>,
    /// The corners that are not convex, by x: only they can be in the way of an ear.
    obstacles: Vec<usize>,
    /// The convex corners, the one whose triangle is the roundest on top, with their neighbours
    /// at the time.
    candidates: BinaryHeap<(u64, Reverse<usize>, [usize; 2])>,
    comparisons: usize,
}

impl<'a> Ring<'a> {
    fn of(points: &'a [Coord<f64>]) -> Self {
        let count = points.len();
        let mut ring = Self {
            points,
            previous: (0..count).map(|c| (c + count - 1) % count).collect(),
            next: (0..count).map(|c| (c + 1) % count).collect(),
            is_left: vec![true; count],
            obstacles: Vec::new(),
            candidates: BinaryHeap::new(),
            comparisons: 0,
        };
        ring.obstacles = (0..count).filter(|&c| ring.turn(c) <= 0.0).collect();
        let by_x = |a: &usize, b: &usize| points[*a].x.total_cmp(&points[*b].x);
        ring.obstacles.sort_by(by_x);
        (0..count).for_each(|c| ring.consider(c));
        ring
    }

    /// All triangles; none if no corner can be clipped any more, as in a polygon that crosses
    /// itself.
    fn clip(mut self) -> Option<Vec<[u32; 3]>> {
        let mut triangles = Vec::with_capacity(self.points.len() - 2);
        let mut waiting = Vec::new();
        let mut last = 0;
        while triangles.len() + 3 < self.points.len() {
            let ear = self
                .ear(&mut waiting)
                .or_else(|| self.touched_ear(&waiting))
                .or_else(|| self.flat_corner())?;
            triangles.push(self.triangle(ear).map(|c| c as u32));
            last = self.remove(ear);
            waiting.into_iter().for_each(|c| self.consider(c));
            waiting = Vec::new();
        }
        triangles.push(self.triangle(last).map(|c| c as u32));
        Some(triangles)
    }

    /// The best corner whose triangle no other corner touches. Those that are `waiting` for others
    /// to go are taken from the candidates.
    fn ear(&mut self, waiting: &mut Vec<usize>) -> Option<usize> {
        while let Some((_, Reverse(corner), neighbours)) = self.candidates.pop() {
            let now = [self.previous[corner], self.next[corner]];
            if !self.is_left[corner] || now != neighbours {
                continue;
            }
            if self.is_free(corner, |sides| sides.iter().all(|&s| s >= 0.0)) {
                return Some(corner);
            }
            waiting.push(corner);
        }
        None
    }

    /// A corner whose triangle others touch, but not from inside and not at the edge that clipping
    /// it makes.
    fn touched_ear(&mut self, waiting: &[usize]) -> Option<usize> {
        let blocks = |[one, other, cut]: [f64; 3]| one > 0.0 && other > 0.0 && cut >= 0.0;
        waiting.iter().copied().find(|&c| self.is_free(c, blocks))
    }

    /// A corner without area: first of those that are at the place of a neighbour or between two
    /// of one place, else on the line between its neighbours.
    fn flat_corner(&self) -> Option<usize> {
        let left = || (0..self.points.len()).filter(|&c| self.is_left[c] && self.turn(c) == 0.0);
        let is_nothing = |&c: &usize| {
            let [a, b, c] = self.triangle(c).map(|c| self.points[c]);
            a == b || b == c || c == a
        };
        left().find(is_nothing).or_else(|| left().next())
    }

    /// Whether no corner blocks an ear, by the sides of the ear's edges on which it is (positive
    /// inside): those before and after the ear's corner, and the one that clipping it makes.
    fn is_free(&mut self, corner: usize, blocks: impl Fn([f64; 3]) -> bool) -> bool {
        let [a, b, c] = self.triangle(corner).map(|c| self.points[c]);
        let [low, high] = [a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x)];
        let first = self.obstacles.partition_point(|&o| self.points[o].x < low);
        for &obstacle in &self.obstacles[first..] {
            self.comparisons += 1;
            let p = self.points[obstacle];
            if p.x > high {
                break;
            }
            let is_corner = p == a || p == b || p == c;
            if self.is_left[obstacle]
                && !is_corner
                && blocks([[a, b, p], [b, c, p], [c, a, p]].map(orient))
            {
                return false;
            }
        }
        self.comparisons < MOST_COMPARISONS
    }

    /// Adds a corner to the candidates if it is left and convex.
    fn consider(&mut self, corner: usize) {
        let turn = self.turn(corner);
        if !self.is_left[corner] || turn <= 0.0 {
            return;
        }
        let [a, b, c] = self.triangle(corner).map(|c| self.points[c]);
        let squared = |p: Coord<f64>, q: Coord<f64>| (q.x - p.x).powi(2) + (q.y - p.y).powi(2);
        let longest = squared(a, b).max(squared(b, c)).max(squared(c, a));
        let neighbours = [self.previous[corner], self.next[corner]];
        // Positive numbers are in the order of their bits.
        let roundness = (turn / longest).to_bits();
        self.candidates
            .push((roundness, Reverse(corner), neighbours));
    }

    /// Clips a corner; returns the next one.
    fn remove(&mut self, corner: usize) -> usize {
        let [previous, next] = [self.previous[corner], self.next[corner]];
        self.is_left[corner] = false;
        self.next[previous] = next;
        self.previous[next] = previous;
        self.consider(previous);
        self.consider(next);
        next
    }

    /// Twice the area at a corner, positive if it is convex.
    fn turn(&self, corner: usize) -> f64 {
        orient(self.triangle(corner).map(|c| self.points[c]))
    }

    fn triangle(&self, corner: usize) -> [usize; 3] {
        [self.previous[corner], corner, self.next[corner]]
    }
}
