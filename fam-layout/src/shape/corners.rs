//! Where the outline of a chart has its four corners, if it is to be a rectangle.

use std::f64::consts::{FRAC_PI_2, PI};

use fam_surface::vector::{cross, dot, length, sub};

use crate::pack::rectangle_around;
use crate::patch::Patch;

/// Over which part of the outline it turns at a corner, to both sides, as shares of the chart's width:
/// at one vertex, or around a corner that is frayed or round.
const WINDOWS: [f64; 3] = [0.0, 0.1, 0.3];

/// So many of the places where the outline turns most may be corners.
const MOST_PEAKS: usize = 10;

/// What sides of different lengths count against corners that turn by more or less than a right angle.
const UNEQUAL: f64 = 4.0;

/// Sets of four vertices of an outline, by their places in it and ascending, that may be its corners.
/// `outline` has its half-edges in order, `uv` where the vertices lie.
pub fn corners(patch: &Patch, outline: &[u32], uv: &[[f64; 2]]) -> Vec<[usize; 4]> {
    let outline = Outline::new(patch, outline);
    let found = WINDOWS
        .iter()
        .filter_map(|window| outline.at_turns(window * outline.width));
    let mut sets: Vec<[usize; 4]> = found.chain(outline.nearest_to_box(uv)).collect();
    let mut known = Vec::new();
    sets.retain(|set| {
        let is_new = !known.contains(set);
        known.push(*set);
        is_new
    });
    sets
}

struct Outline {
    vertices: Vec<u32>,
    /// By how much it turns at every vertex, on the surface.
    turns: Vec<f64>,
    /// The sum of the turns before every vertex.
    before: Vec<f64>,
    /// How far along it every vertex lies.
    along: Vec<f64>,
    /// Its length.
    length: f64,
    /// That of a long strip of this length and area.
    width: f64,
}

impl Outline {
    fn new(patch: &Patch, outline: &[u32]) -> Self {
        let topology = &patch.topology;
        let vertices: Vec<u32> = outline.iter().map(|&h| topology.origin(h)).collect();
        let mut inner = vec![0.0; topology.vertices()];
        for triangle in topology.triangles() {
            let p = triangle.map(|v| patch.positions[v as usize]);
            for c in 0..3 {
                let (one, other) = (sub(p[(c + 1) % 3], p[c]), sub(p[(c + 2) % 3], p[c]));
                inner[triangle[c] as usize] += length(cross(one, other)).atan2(dot(one, other));
            }
        }
        let mut end = 0.0;
        let along = outline.iter().map(|&h| {
            let start = end;
            end += patch.lengths[h as usize];
            start
        });
        let along = along.collect();
        let turns: Vec<f64> = vertices.iter().map(|&v| PI - inner[v as usize]).collect();
        let mut sum = 0.0;
        let before = turns.iter().map(|turn| {
            let before = sum;
            sum += turn;
            before
        });
        Self {
            before: before.chain([turns.iter().sum()]).collect(),
            along,
            turns,
            vertices,
            length: end,
            width: 2.0 * patch.areas.iter().sum::<f64>() / end,
        }
    }

    /// The four places where it turns most like a rectangle does, within a distance to both sides.
    fn at_turns(&self, reach: f64) -> Option<[usize; 4]> {
        let turns: Vec<f64> = (0..self.turns.len())
            .map(|i| self.turn_around(i, reach))
            .collect();
        let peaks = self.peaks(&turns, reach);
        let count = peaks.len();
        let mut best: Option<(f64, [usize; 4])> = None;
        for a in 0..count {
            for b in a + 1..count {
                for c in b + 1..count {
                    for d in c + 1..count {
                        let set = [a, b, c, d].map(|k| peaks[k]);
                        let misfit = self.misfit(set, &turns);
                        if best.is_none_or(|(least, _)| misfit < least) {
                            best = Some((misfit, set));
                        }
                    }
                }
            }
        }
        best.map(|(_, set)| set)
    }

    /// By how much it turns within a distance of a vertex, to both sides.
    fn turn_around(&self, i: usize, reach: f64) -> f64 {
        if reach <= 0.0 {
            return self.turns[i];
        }
        // The sum of the turns from the start of the outline to a place on it, in any round.
        let until = |place: f64, and_there: bool| {
            let rounds = (place / self.length).floor();
            let place = place - rounds * self.length;
            let is_before = |at: &f64| *at < place || (and_there && *at == place);
            let whole = self.before[self.turns.len()];
            rounds * whole + self.before[self.along.partition_point(is_before)]
        };
        until(self.along[i] + reach, true) - until(self.along[i] - reach, false)
    }

    /// The shorter way along it from one vertex to another.
    fn distance(&self, i: usize, j: usize) -> f64 {
        let way = (self.along[i] - self.along[j]).abs();
        way.min(self.length - way)
    }

    /// The vertices around which it turns most, ascending. Around the same place, the one at which it
    /// turns most itself.
    fn peaks(&self, turns: &[f64], reach: f64) -> Vec<usize> {
        let mut order: Vec<usize> = (0..turns.len()).collect();
        // Sums over the same vertices differ by rounding only.
        let rounded = |i: usize| (1e6 * turns[i]).round();
        order.sort_by(|&i, &j| {
            let around = rounded(j).total_cmp(&rounded(i));
            around
                .then(self.turns[j].total_cmp(&self.turns[i]))
                .then(i.cmp(&j))
        });
        let mut peaks: Vec<usize> = Vec::new();
        for i in order {
            if peaks.iter().all(|&p| self.distance(i, p) > 2.0 * reach) {
                peaks.push(i);
            }
            if peaks.len() == MOST_PEAKS {
                break;
            }
        }
        peaks.sort_unstable();
        peaks
    }

    /// How far four places are from the corners of a rectangle.
    fn misfit(&self, set: [usize; 4], turns: &[f64]) -> f64 {
        let angles: f64 = set
            .iter()
            .map(|&i| (turns[i] / FRAC_PI_2 - 1.0).powi(2))
            .sum();
        let [a, b, c, d] = self.sides(set);
        let unequal = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
        angles + UNEQUAL * (unequal(a, c) + unequal(b, d))
    }

    /// The lengths from every corner to the next.
    fn sides(&self, set: [usize; 4]) -> [f64; 4] {
        let [a, b, c, d] = set.map(|i| self.along[i]);
        [b - a, c - b, d - c, self.length - d + a]
    }

    /// The vertices nearest to the corners of the tightest rectangle around them in the plane.
    fn nearest_to_box(&self, uv: &[[f64; 2]]) -> Option<[usize; 4]> {
        let points: Vec<[f64; 2]> = self.vertices.iter().map(|&v| uv[v as usize]).collect();
        let (sin, cos) = rectangle_around(&points).angle.sin_cos();
        let turned: Vec<[f64; 2]> = points
            .iter()
            .map(|&[x, y]| [cos * x + sin * y, cos * y - sin * x])
            .collect();
        let nearest = |signs: [f64; 2]| {
            let reach = |i: &usize| signs[0] * turned[*i][0] + signs[1] * turned[*i][1];
            (0..turned.len()).max_by(|i, j| reach(i).total_cmp(&reach(j)))
        };
        let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let mut set = [0; 4];
        for (place, signs) in set.iter_mut().zip(signs) {
            *place = nearest(signs)?;
        }
        set.sort_unstable();
        let is_distinct = set.windows(2).all(|pair| pair[0] < pair[1]);
        is_distinct.then_some(set)
    }
}
