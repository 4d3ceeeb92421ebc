//! Placed charts in single precision, still without flips and overlaps.
//!
//! Rounding moves every point by up to half a step of the grid of `f32` numbers. That turns
//! over triangles that are about as flat as a step, and makes boundaries cross that are about
//! as close. Where it does, the points around are pushed apart by a few steps first.

use std::collections::VecDeque;

use robust::{Coord, orient2d};

use fam_surface::metrics::for_each_overlapping_pair;
use fam_surface::{SurfaceError, UvMap};

use super::mirrored::{Mirrors, Reflection};
use super::{Chart, Packing, corner_of_tile};

/// Distance of neighbouring `f32` numbers between 1/2 and 1, where it is largest in the first tile.
const STEP: f64 = 1.0 / (1 << 24) as f64;

/// A triangle of this height stays positive: rounding moves a corner by less than 0.71 steps,
/// and so does it the point of the longest side that the height stands on.
const HEIGHT: f64 = 1.5 * STEP;

/// By how much the height asked for grows each time a triangle is found flat or overlapping.
const GROWTH: f64 = 0.5 * STEP;

/// Triangles that overlap by more are left alone: rounding does not do that.
const DEEPEST: f64 = 256.0 * STEP;

/// How often, at most, the result is rounded, judged and pushed apart.
const ROUNDS: u32 = 40;

/// After so many of these without improvement the rest is given up.
const PATIENCE: u32 = 8;

/// How many triangles are looked at in a round, per triangle of the layout.
const PUSHES: usize = 20;

/// Charts in single precision.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounded {
    /// Per chart its coordinates `[V, 2]`: in the unit square, or where its tile lies by UDIM, ten
    /// tiles to a row.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Triangles that are counter-clockwise in their chart but not here.
    pub flipped: usize,
    /// Pairs of triangles that overlap, of all charts together.
    pub overlapping: u64,
}

/// Places charts as packed and rounds them, moving points by a few steps of `f32` so that all
/// triangles that are counter-clockwise stay so, however thin, and none overlap.
///
/// What `reflections` (of every chart, or none) tells to be mirror images is so to the last bit.
///
/// What cannot be repaired is counted; charts that overlap themselves stay so.
///
/// # Errors
/// The packing is one of another number of charts.
pub fn to_f32(
    charts: &[Chart<'_>],
    packing: &Packing,
    reflections: &[Reflection],
) -> Result<Rounded, SurfaceError> {
    if packing.placements.len() != charts.len() {
        return Err(SurfaceError::LengthMismatch {
            attribute: "placements",
            expected: charts.len(),
            found: packing.placements.len(),
        });
    }
    let (uvs, count) = Repair::new(charts, packing, reflections).run()?;
    let mut rest = &uvs[..];
    let uvs = charts
        .iter()
        .map(|chart| {
            let (own, others) = rest.split_at(chart.uvs.len());
            rest = others;
            own.to_vec()
        })
        .collect();
    Ok(Rounded {
        uvs,
        flipped: count.flipped,
        overlapping: count.overlapping,
    })
}

/// What is wrong with a rounded layout.
struct Flaws {
    flipped: Vec<u32>,
    overlapping: u64,
    /// The overlapping pairs, as many as there are triangles at most.
    pairs: Vec<[u32; 2]>,
}

#[derive(Clone, Copy)]
struct FlawCount {
    flipped: usize,
    overlapping: u64,
}

impl Flaws {
    fn count(&self) -> FlawCount {
        FlawCount {
            flipped: self.flipped.len(),
            overlapping: self.overlapping,
        }
    }
}

impl FlawCount {
    fn all(self) -> u64 {
        self.flipped as u64 + self.overlapping
    }
}

/// All charts' triangles over all their points.
struct Repair {
    points: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    /// For every triangle the height that it is to have; none where it never was positive.
    heights: Vec<Option<f64>>,
    /// The triangles around vertex `v` are `around[first[v]..first[v + 1]]`.
    around: Vec<u32>,
    first: Vec<usize>,
    /// Of every point the lower left corner of its tile.
    corners: Vec<[f64; 2]>,
    /// By how much coarser `f32` is in the farthest tile than in the first.
    coarser: f64,
    mirrors: Mirrors,
}

impl Repair {
    fn new(charts: &[Chart<'_>], packing: &Packing, reflections: &[Reflection]) -> Self {
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        let mut heights = Vec::new();
        let mut corners = Vec::new();
        let tiles = packing.placements.iter().map(|at| corner_of_tile(at.tile));
        let farthest = tiles.flatten().fold(0.0, f64::max);
        let coarser = (farthest + 1.0).log2().ceil().exp2();
        for (chart, placement) in charts.iter().zip(&packing.placements) {
            let offset = points.len() as u32;
            let corner = corner_of_tile(placement.tile);
            points.extend(chart.uvs.iter().map(|&q| {
                let [x, y] = placement.place(q);
                // What lies on the border may have been moved over it by rounding.
                [x.clamp(0.0, 1.0) + corner[0], y.clamp(0.0, 1.0) + corner[1]]
            }));
            corners.resize(points.len(), corner);
            triangles.extend(chart.triangles.iter().map(|t| t.map(|v| v + offset)));
            heights.extend(chart.triangles.iter().map(|t| {
                let corners = t.map(|v| chart.uvs[v as usize]);
                is_positive(corners).then_some(coarser * HEIGHT)
            }));
        }
        let mut first = vec![0; points.len() + 1];
        for &v in triangles.iter().flatten() {
            first[v as usize + 1] += 1;
        }
        for v in 0..points.len() {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut around = vec![0; 3 * triangles.len()];
        for (t, triangle) in triangles.iter().enumerate() {
            for &v in triangle {
                around[next[v as usize]] = t as u32;
                next[v as usize] += 1;
            }
        }
        let counts: Vec<usize> = charts.iter().map(|chart| chart.uvs.len()).collect();
        Self {
            mirrors: Mirrors::of(reflections, &counts, &points, coarser * STEP),
            points,
            triangles,
            heights,
            around,
            first,
            corners,
            coarser,
        }
    }

    /// The best of the rounded layouts and its count of flaws.
    fn run(&mut self) -> Result<(Vec<[f32; 2]>, FlawCount), SurfaceError> {
        let (uvs, mut flaws) = self.rounded()?;
        let mut best = (uvs, flaws.count());
        let mut since = 0;
        for round in 1..=ROUNDS {
            let gap = self.coarser * (HEIGHT + f64::from(round) * GROWTH);
            let queue = self.push_flaws(&flaws, gap);
            if queue.is_empty() || since == PATIENCE {
                break;
            }
            self.relax(queue);
            let (uvs, found) = self.rounded()?;
            flaws = found;
            since += 1;
            if flaws.count().all() < best.1.all() {
                best = (uvs, flaws.count());
                since = 0;
            }
        }
        Ok(best)
    }

    /// Asks more height of flipped triangles and parts overlapping ones by `gap`; returns the
    /// triangles that are now to be looked at.
    fn push_flaws(&mut self, flaws: &Flaws, gap: f64) -> VecDeque<u32> {
        let mut queue = VecDeque::new();
        for &t in &flaws.flipped {
            if let Some(height) = &mut self.heights[t as usize] {
                *height += self.coarser * GROWTH;
            }
            queue.push_back(t);
        }
        for &pair in &flaws.pairs {
            self.part(pair, gap, &mut queue);
        }
        queue
    }

    /// The layout as it is rounded now.
    fn rounded(&self) -> Result<(Vec<[f32; 2]>, Flaws), SurfaceError> {
        let rounded = |p: &[f64; 2]| p.map(|c| c as f32);
        let mut uvs: Vec<[f32; 2]> = self.points.iter().map(rounded).collect();
        self.mirrors.apply(&self.points, &mut uvs);
        let uv = UvMap::new(uvs, self.triangles.clone())?;
        let flipped = (0..self.triangles.len())
            .filter(|&t| {
                let corners = uv.corners(t).map(|q| q.map(f64::from));
                self.heights[t].is_some() && !is_positive(corners)
            })
            .map(|t| t as u32)
            .collect();
        let mut overlapping = 0;
        let mut pairs = Vec::new();
        for_each_overlapping_pair(&uv, |pair| {
            overlapping += 1;
            if pairs.len() < self.triangles.len() {
                pairs.push(pair);
            }
        });
        let flaws = Flaws {
            flipped,
            overlapping,
            pairs,
        };
        Ok((uv.uvs().to_vec(), flaws))
    }

    /// Gives the triangles in the queue their height, and those around them as they give way.
    fn relax(&mut self, mut queue: VecDeque<u32>) {
        let mut queued = vec![false; self.triangles.len()];
        for &t in &queue {
            queued[t as usize] = true;
        }
        let mut left = PUSHES * self.triangles.len();
        while let Some(t) = queue.pop_front()
            && left > 0
        {
            left -= 1;
            queued[t as usize] = false;
            if !self.heighten(t) {
                continue;
            }
            let corners = self.triangles[t as usize].into_iter();
            for v in corners.flat_map(|v| [v, self.mirrors.image(v)]) {
                let v = v as usize;
                let around = &self.around[self.first[v]..self.first[v + 1]];
                for &other in around {
                    if !std::mem::replace(&mut queued[other as usize], true) {
                        queue.push_back(other);
                    }
                }
            }
        }
    }

    /// Moves the corners of a triangle that is too flat so that it has its height; returns
    /// whether it was.
    ///
    /// The step is that of Newton's method for one constraint: along the gradient of the
    /// area, as far as needed.
    fn heighten(&mut self, t: u32) -> bool {
        let Some(height) = self.heights[t as usize] else {
            return false;
        };
        let triangle = self.triangles[t as usize];
        let corners = triangle.map(|v| self.points[v as usize]);
        let edges = [0, 1, 2].map(|c| difference(corners[(c + 2) % 3], corners[(c + 1) % 3]));
        let double_area = cross(edges[1], edges[2]);
        let squares = edges.map(|e| dot(e, e));
        let longest = squares.iter().copied().fold(0.0, f64::max).sqrt();
        let missing = height * longest.max(height) - double_area;
        if missing <= 1e-3 * height * longest.max(height) {
            return false;
        }
        let sum: f64 = squares.iter().sum();
        for (v, [x, y]) in triangle.into_iter().zip(edges) {
            // The gradient of twice the area by a corner is the opposite edge, turned left.
            let push = [-y, x].map(|c| c * missing / sum.max(f64::MIN_POSITIVE));
            self.push(v, push);
        }
        true
    }

    /// Pushes two triangles apart that overlap a little; those around may have to give way.
    fn part(&mut self, [a, b]: [u32; 2], gap: f64, queue: &mut VecDeque<u32>) {
        let [a, b] = [a, b].map(|t| self.counter_clockwise(t));
        let sides = [(a, b), (b, a)]
            .into_iter()
            .flat_map(|(own, other)| [0, 1, 2].map(|c| (own, other, [own[c], own[(c + 1) % 3]])));
        let deep = |(_, other, edge): &([u32; 3], [u32; 3], [u32; 2])| {
            let mut deepest = f64::NEG_INFINITY;
            for v in other {
                deepest = deepest.max(-self.outside(*edge, *v));
            }
            deepest
        };
        let Some((own, other, edge)) = sides.min_by(|x, y| deep(x).total_cmp(&deep(y))) else {
            return;
        };
        let depth = deep(&(own, other, edge));
        if depth.is_nan() || depth > self.coarser * DEEPEST {
            return;
        }
        let normal = self.normal(edge);
        let missing: Vec<(u32, f64)> = other
            .into_iter()
            .filter(|v| !own.contains(v))
            .map(|v| (v, gap - self.outside(edge, v)))
            .filter(|(_, missing)| *missing > 0.0)
            .collect();
        let most = missing.iter().fold(0.0, |m: f64, (_, d)| m.max(*d));
        let away = missing.iter().map(|&(v, d)| (v, 0.5 * d));
        let back = edge
            .into_iter()
            .filter(|v| !other.contains(v))
            .map(|v| (v, -0.5 * most));
        for (v, distance) in away.chain(back).collect::<Vec<_>>() {
            self.push(v, normal.map(|c| c * distance));
            queue.extend(&self.around[self.first[v as usize]..self.first[v as usize + 1]]);
        }
    }

    /// The corners of a triangle, in the other order if it is clockwise.
    fn counter_clockwise(&self, t: u32) -> [u32; 3] {
        let [a, b, c] = self.triangles[t as usize];
        if is_positive([a, b, c].map(|v| self.points[v as usize])) {
            [a, b, c]
        } else {
            [a, c, b]
        }
    }

    /// How far a point lies to the right of an edge, which is outside its triangle.
    fn outside(&self, edge: [u32; 2], v: u32) -> f64 {
        let from = self.points[edge[0] as usize];
        dot(self.normal(edge), difference(self.points[v as usize], from))
    }

    /// The unit vector to the right of an edge.
    fn normal(&self, edge: [u32; 2]) -> [f64; 2] {
        let [a, b] = edge.map(|v| self.points[v as usize]);
        let [x, y] = difference(b, a);
        let length = x.hypot(y);
        [y / length, -x / length]
    }

    /// Moves a point, by a few steps at most and not out of its tile, and its mirror image as well.
    fn push(&mut self, v: u32, by: [f64; 2]) {
        let longest = 4.0 * HEIGHT * self.coarser;
        let factor = (longest / by[0].hypot(by[1])).min(1.0);
        for (v, by) in self.mirrors.moves(v, by) {
            let low = self.corners[v as usize];
            let point = &mut self.points[v as usize];
            for k in 0..2 {
                point[k] = (point[k] + factor * by[k]).clamp(low[k], low[k] + 1.0);
            }
        }
    }
}

fn is_positive(corners: [[f64; 2]; 3]) -> bool {
    let [a, b, c] = corners.map(|[x, y]| Coord { x, y });
    orient2d(a, b, c) > 0.0
}

fn difference(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::super::{PackOptions, pack};
    use super::*;

    type Flat = (Vec<[f64; 2]>, Vec<[u32; 3]>);

    fn rounded(flats: &[Flat]) -> Rounded {
        let charts: Vec<Chart> = flats
            .iter()
            .map(|(uvs, triangles)| Chart::new(uvs, triangles).unwrap())
            .collect();
        let packing = pack(&charts, &PackOptions::new(4.0, 1024), &|| true).unwrap();
        let rounded = to_f32(&charts, &packing, &[]).unwrap();
        for (chart, (uvs, placement)) in charts
            .iter()
            .zip(rounded.uvs.iter().zip(&packing.placements))
        {
            for (&q, uv) in chart.uvs.iter().zip(uvs) {
                let place = placement.place(q);
                let moved =
                    (0..2).fold(0.0, |m: f64, k| m.max((place[k] - f64::from(uv[k])).abs()));
                assert!(moved < 1e-3 && uv.iter().all(|c| (0.0..=1.0).contains(c)));
            }
        }
        rounded
    }

    /// What is counted as repaired is judged here once more, chart by chart.
    fn assert_valid(flats: &[Flat]) {
        let rounded = rounded(flats);
        assert_eq!((rounded.flipped, rounded.overlapping), (0, 0));
        for ((uvs, triangles), rounded) in flats.iter().zip(&rounded.uvs) {
            for t in triangles {
                let before = is_positive(t.map(|v| uvs[v as usize]));
                let after = is_positive(t.map(|v| rounded[v as usize].map(f64::from)));
                assert!(after || !before);
            }
            let uv = UvMap::new(rounded.clone(), triangles.clone()).unwrap();
            for_each_overlapping_pair(&uv, |pair| panic!("{pair:?} overlap"));
        }
    }

    /// A sheet whose rows have the given heights, sheared and turned.
    fn sheet(heights: &[f64], columns: u32, angle: f64) -> Flat {
        let (sin, cos) = angle.sin_cos();
        let mut levels = vec![0.0];
        for height in heights {
            levels.push(levels[levels.len() - 1] + height);
        }
        let wide = columns + 1;
        let mut uvs = Vec::new();
        for (j, y) in levels.iter().enumerate() {
            for i in 0..wide {
                let x = f64::from(i) / f64::from(columns) + 0.013 * (j % 3) as f64;
                uvs.push([cos * x - sin * y, sin * x + cos * y]);
            }
        }
        let cell = |k: u32| {
            let a = k / columns * wide + k % columns;
            [[a, a + 1, a + wide + 1], [a, a + wide + 1, a + wide]]
        };
        let triangles = (0..columns * heights.len() as u32).flat_map(cell).collect();
        (uvs, triangles)
    }

    #[test]
    fn slivers_stay_positive() {
        let mut random = Pcg64Mcg::seed_from_u64(17);
        for exponent in [-4, -6, -7, -8, -10, -12] {
            let flats: Vec<Flat> = (0..3)
                .map(|_| {
                    let heights: Vec<f64> = (0..12)
                        .map(|_| match random.random_range(0..3) {
                            0 => 0.1,
                            _ => 10f64.powi(exponent) * random.random_range(0.1..1.0),
                        })
                        .collect();
                    sheet(&heights, 5, random.random_range(0.0..6.0))
                })
                .collect();
            assert_valid(&flats);
        }
    }

    /// Twenty layers between two of some width, all within one step.
    #[test]
    fn stacked_slivers_are_spread() {
        let mut heights = vec![1e-10; 22];
        (heights[0], heights[21]) = (0.2, 0.2);
        assert_valid(&[sheet(&heights, 6, 0.7)]);
    }

    /// Rows and columns of all widths: slivers, and clusters of triangles within a step.
    #[test]
    fn lattices_of_uneven_widths_stay_valid() {
        let mut random = Pcg64Mcg::seed_from_u64(31);
        for round in 0..12 {
            let count = 14;
            let mut ticks = || {
                let mut at = 0.0;
                let widths = (0..count).map(|_| 10f64.powf(random.random_range(-8.0..-0.5)));
                let ticks = widths.map(|width| {
                    at += width;
                    at
                });
                ticks.collect::<Vec<f64>>()
            };
            let (columns, rows) = (ticks(), ticks());
            let (sin, cos) = f64::from(round).sin_cos();
            let uvs = rows
                .iter()
                .flat_map(|y| columns.iter().map(move |x| (x, y)));
            let uvs = uvs
                .map(|(x, y)| [cos * x - sin * y, sin * x + cos * y])
                .collect();
            let cells = (0..(count - 1) * (count - 1)).flat_map(|i| {
                let a = i / (count - 1) * count + i % (count - 1);
                [[a, a + 1, a + count + 1], [a, a + count + 1, a + count]]
            });
            assert_valid(&[(uvs, cells.collect())]);
        }
    }

    /// Points strewn into the middle of triangles again and again come ever closer.
    #[test]
    fn triangles_much_smaller_than_a_step_are_enlarged() {
        let mut random = Pcg64Mcg::seed_from_u64(23);
        let (mut uvs, mut triangles) = sheet(&[0.3; 3], 3, 0.2);
        for _ in 0..30 {
            let t = triangles.len() - 1 - random.random_range(0..2);
            let [a, b, c] = triangles[t];
            let v = uvs.len() as u32;
            let [p, q, r] = [a, b, c].map(|v| uvs[v as usize]);
            uvs.push([0, 1].map(|k| 0.25 * p[k] + 0.25 * q[k] + 0.5 * r[k]));
            triangles[t] = [a, b, v];
            triangles.push([b, c, v]);
            triangles.push([c, a, v]);
        }
        let flat = triangles
            .iter()
            .filter(|t| !is_positive(t.map(|v| uvs[v as usize])));
        assert_eq!(flat.count(), 0);
        assert_valid(&[(uvs, triangles)]);
    }

    /// Half of a rectangle that an aslant slit divides; `sign` tells which half.
    fn beside_slit(sign: f64, columns: u32, gap: f64) -> Flat {
        let (mut uvs, mut triangles) = sheet(&[1.0], columns, 0.0);
        for (i, p) in uvs.iter_mut().enumerate() {
            let x = f64::from(i as u32 % (columns + 1)) / f64::from(columns);
            *p = match p[1] {
                0.0 => [x, 0.3 * x + sign * 0.5 * gap],
                _ => [x, 0.15 + sign * 0.4],
            };
        }
        if sign < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        (uvs, triangles)
    }

    /// Both sides of a slit have their own points, of which rounding knows nothing.
    #[test]
    fn sides_of_a_narrow_slit_do_not_cross() {
        for gap in [1e-12, 1e-9, 3e-8, 1e-7] {
            let (mut uvs, mut triangles) = beside_slit(1.0, 37, gap);
            let (below, others) = beside_slit(-1.0, 53, gap);
            let offset = uvs.len() as u32;
            triangles.extend(others.iter().map(|t| t.map(|v| v + offset)));
            uvs.extend(below);
            let clockwise = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
            assert_valid(&[(uvs.clone(), clockwise)]);
            assert_valid(&[(uvs, triangles)]);
        }
    }

    /// A slit that ends inside: around its end the triangles share a corner.
    #[test]
    fn slit_that_ends_inside_stays_open() {
        for gap in [1e-12, 1e-9, 1e-8] {
            let rays = 41;
            let around = (0..=rays).flat_map(|i| {
                let share = f64::from(i) / f64::from(rays);
                let angle = 0.4 + gap + share * (std::f64::consts::TAU - 2.0 * gap);
                let (sin, cos) = angle.sin_cos();
                (1..8).map(move |k| [cos, sin].map(|c| c * f64::from(k) * (0.1 + 0.02 * share)))
            });
            let uvs: Vec<[f64; 2]> = [[0.0; 2]].into_iter().chain(around).collect();
            let triangles = (0..rays).flat_map(|i| {
                let [a, b] = [7 * i + 1, 7 * i + 8];
                let between = (0..6).flat_map(move |k| {
                    let [a, b] = [a + k, b + k];
                    [[a, a + 1, b + 1], [a, b + 1, b]]
                });
                between.chain([[0, a, b]])
            });
            assert_valid(&[(uvs, triangles.collect())]);
        }
    }

    #[test]
    fn what_overlaps_is_counted() {
        let (mut uvs, mut triangles) = sheet(&[0.5; 2], 2, 0.0);
        let offset = uvs.len() as u32;
        uvs.extend(uvs.clone());
        triangles.extend(triangles.clone().iter().map(|t| t.map(|v| v + offset)));
        let rounded = rounded(&[(uvs, triangles)]);
        assert_eq!(rounded.flipped, 0);
        assert!(rounded.overlapping >= 8);
    }

    #[test]
    fn another_number_of_charts_is_refused() {
        let (uvs, triangles) = sheet(&[1.0], 1, 0.0);
        let chart = Chart::new(&uvs, &triangles).unwrap();
        let packed = |charts: &[Chart]| pack(charts, &PackOptions::new(0.0, 64), &|| true);
        assert!(to_f32(&[chart, chart], &packed(&[chart]).unwrap(), &[]).is_err());
        let none = to_f32(&[], &packed(&[]).unwrap(), &[]).unwrap();
        assert!(none.uvs.is_empty());
    }
}
