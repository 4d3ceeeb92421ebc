//! Places in the plane for the vertices that come back.

use super::Simplification;
use super::collapse::Collapse;
use crate::patch::topology::next;
use crate::solve::orientation::first_flipped;
use fam_surface::vector::{dot, length, sub};

/// How often a place is moved towards the neighbour before there is none.
const HALVINGS: i32 = 40;

/// How many of the valid places are compared.
const COMPARED: usize = 4;

/// A place no farther beyond an edge than this share of its length lies on it, for rounding.
const ON_EDGE: f64 = 1e-12;

impl Simplification<'_> {
    /// Undoes collapses until there are at least `wanted` triangles. A layout of what was left,
    /// with a place for every vertex of the surface that matters, is carried on: vertices come
    /// back within the triangles that they left, so that what was covered once is covered once.
    /// `None` if a vertex finds no place, for rounding.
    pub fn refine(&mut self, wanted: usize, uv: &mut [[f64; 2]]) -> Option<()> {
        while self.left < wanted
            && let Some(collapse) = self.collapses.pop()
        {
            self.restore(&collapse);
            self.place(&collapse, uv)?;
        }
        Some(())
    }

    pub(super) fn restore(&mut self, collapse: &Collapse) {
        collapse.undo(&mut self.surface);
        for h in collapse.half_edges() {
            self.gone[h as usize / 3] = false;
            self.left += 1;
        }
    }

    /// Finds a place for a vertex that came back: where its neighbours have it on the surface,
    /// or nearer to the one that it came from.
    fn place(&self, collapse: &Collapse, uv: &mut [[f64; 2]]) -> Option<()> {
        let surface = &self.surface;
        let fan = surface.fan(collapse.leaving_from(surface));
        let triangles: Vec<[u32; 3]> = fan
            .iter()
            .map(|&h| surface.triangles()[h as usize / 3])
            .collect();
        let from = uv[collapse.into as usize];
        let mut targets = self.targets(collapse.from, &fan, uv);
        targets.extend(self.within(collapse.into, &fan, uv));
        let mut best: Option<(f64, [f64; 2])> = None;
        let mut compared = 0;
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            for target in &targets {
                let place = [0, 1].map(|k| from[k] + share * (target[k] - from[k]));
                uv[collapse.from as usize] = place;
                if first_flipped(&triangles, uv).is_some() || self.is_outside(&fan, place, uv) {
                    continue;
                }
                let energy: f64 = triangles.iter().map(|&t| self.energy(t, uv)).sum();
                compared += 1;
                if best.is_none_or(|best| energy < best.0) {
                    best = Some((energy, place));
                }
            }
            if compared >= COMPARED {
                break;
            }
            share *= 0.5;
        }
        uv[collapse.from as usize] = best?.1;
        Some(())
    }

    /// Whether a place for a vertex on the boundary lies beyond the edge that was there without it:
    /// other parts of the boundary may be there.
    fn is_outside(&self, fan: &[u32], place: [f64; 2], uv: &[[f64; 2]]) -> bool {
        let surface = &self.surface;
        let last = fan[fan.len() - 1];
        if surface.twin(last).is_some() {
            return false;
        }
        let ends = [surface.target(next(fan[0])), surface.target(last)];
        let [before, after] = ends.map(|v| uv[v as usize]);
        let from_before = |p: [f64; 2]| [p[0] - before[0], p[1] - before[1]];
        let (edge, own) = (from_before(after), from_before(place));
        let area = edge[0] * own[1] - edge[1] * own[0];
        area < -ON_EDGE * (edge[0] * edge[0] + edge[1] * edge[1])
    }

    /// A place in the middle of the angle that the triangles of a vertex had at the one that it was
    /// moved into. Near to there it always is a valid one; the others are not where the angle is
    /// wide or bent.
    fn within(&self, into: u32, fan: &[u32], uv: &[[f64; 2]]) -> Option<[f64; 2]> {
        let surface = &self.surface;
        let at = uv[into as usize];
        let side = |v: u32| [0, 1].map(|k| uv[v as usize][k] - at[k]);
        let ends = |&h: &u32| [surface.target(h), surface.target(next(h))];
        let kept: Vec<[u32; 2]> = fan
            .iter()
            .map(ends)
            .filter(|ends| !ends.contains(&into))
            .collect();
        let is_first = |v: &u32| kept.iter().all(|ends| ends[1] != *v);
        let first = side(kept.iter().map(|ends| ends[0]).find(is_first)?);
        let (mut angle, mut size) = (0.0, 0.0);
        for [p, q] in kept.iter().map(|ends| ends.map(side)) {
            angle += (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]);
            size += p[0].hypot(p[1]);
        }
        let (sin, cos) = (0.5 * angle).sin_cos();
        let along = [
            cos * first[0] - sin * first[1],
            sin * first[0] + cos * first[1],
        ];
        let scale = 0.5 * size / kept.len() as f64 / first[0].hypot(first[1]);
        let place = [0, 1].map(|k| at[k] + scale * along[k]);
        place.iter().all(|c: &f64| c.is_finite()).then_some(place)
    }

    /// Where a vertex could be, by its neighbours: their mean by mean value coordinates, and
    /// their plain mean; on the boundary between the two that it lies between.
    fn targets(&self, v: u32, fan: &[u32], uv: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let surface = &self.surface;
        let spoke = |h: u32| {
            let [a, b] = [v, surface.target(h)].map(|v| self.positions[v as usize]);
            sub(b, a)
        };
        let mean = |weights: &[(f64, u32)]| {
            let sum: f64 = weights.iter().map(|w| w.0).sum();
            [0, 1].map(|k| {
                let parts = weights.iter().map(|&(w, v)| w * uv[v as usize][k]);
                parts.sum::<f64>() / sum
            })
        };
        let last = fan[fan.len() - 1];
        let all: Vec<(f64, u32)> = fan
            .iter()
            .flat_map(|&h| [surface.target(h), surface.target(next(h))])
            .map(|v| (1.0, v))
            .collect();
        let plain = mean(&all);
        let finite = |q: &[f64; 2]| q.iter().all(|c| c.is_finite());
        let by_shape = if surface.twin(last).is_none() {
            let first = surface.target(next(fan[0]));
            let back = sub(self.positions[first as usize], self.positions[v as usize]);
            let weight = |side: [f64; 3]| 1.0 / length(side);
            mean(&[
                (weight(back), first),
                (weight(spoke(last)), surface.target(last)),
            ])
        } else {
            let weights: Vec<(f64, u32)> = fan
                .iter()
                .flat_map(|&h| {
                    let ahead = surface.target(next(h));
                    let (a, b) = (
                        spoke(h),
                        sub(self.positions[ahead as usize], self.positions[v as usize]),
                    );
                    let (m, n) = (length(a), length(b));
                    let cosine = (dot(a, b) / (m * n)).clamp(-1.0, 1.0);
                    let half_tangent = ((1.0 - cosine) / (1.0 + cosine).max(1e-6)).sqrt();
                    [
                        (half_tangent / m, surface.target(h)),
                        (half_tangent / n, ahead),
                    ]
                })
                .collect();
            mean(&weights)
        };
        [by_shape, plain].into_iter().filter(finite).collect()
    }

    /// The symmetric Dirichlet energy of a triangle times its area.
    fn energy(&self, triangle: [u32; 3], uv: &[[f64; 2]]) -> f64 {
        let [a, b, c] = triangle.map(|v| self.positions[v as usize]);
        let (p, q) = (sub(b, a), sub(c, a));
        let (pp, pq, qq) = (dot(p, p), dot(p, q), dot(q, q));
        let [x, y, z] = triangle.map(|v| uv[v as usize]);
        let (r, s) = ([y[0] - x[0], y[1] - x[1]], [z[0] - x[0], z[1] - x[1]]);
        let gram = pp * qq - pq * pq;
        let image = r[0] * s[1] - r[1] * s[0];
        // |J|² by the metric of the surface, and det J.
        let along = |k: usize| qq * r[k] * r[k] - 2.0 * pq * r[k] * s[k] + pp * s[k] * s[k];
        let squared_norm = (along(0) + along(1)) / gram;
        let determinant = image * image / gram;
        0.5 * gram.sqrt() * squared_norm * (1.0 + 1.0 / determinant)
    }
}
