//! Projected Newton on the symmetric Dirichlet energy of a chart.

use super::SolveError;
use super::boundary::{Boundary, Pair};
use super::energy::Integrals;
use super::hessian::Hessian;
use super::orientation::{first_flipped, longest_step};
use super::rest::RestShapes;
use crate::pace::Pace;

/// How near parts of the boundary come before they repel each other, in lengths of edges.
const REACH: f64 = 0.25;

/// The reach of the pairs for which the Hessian has room in advance.
const WIDE_REACH: f64 = 2.0;

/// How much of the way to the first collapsed triangle a step goes at most.
const STEP_SHARE: f64 = 0.9;

/// The part of the decrease along the gradient that a step must have (Armijo's condition).
const SUFFICIENT: f64 = 1e-4;

/// What is left of a step that was too long.
const LEAST_OF_STEP: f64 = 0.1;
const MOST_OF_STEP: f64 = 0.8;

/// How often a step is shortened before there is none.
const SHORTENINGS: usize = 100;

/// When to stop.
#[derive(Clone)]
pub(crate) struct Stop<'a> {
    /// Most Newton steps.
    pub(crate) iterations: usize,
    /// The share of the energy below which a step that is to decrease it less is not taken.
    pub(crate) relative_decrease: f64,
    /// Steps that are taken whether to go on or not.
    pub(crate) least: usize,
    /// Asked before every other step, and told of every step.
    pub(crate) pace: &'a dyn Pace,
}

/// Why the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The energy does not decrease any more.
    Converged,
    /// All steps were taken, or there are to be no more.
    OutOfIterations,
    /// No step in the direction of descent was possible.
    Stuck,
}

/// What the solver arrived at.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solved {
    /// The mean symmetric Dirichlet energy at the best uniform scale, without the barrier.
    pub(crate) energy: f64,
    /// The steps that were taken.
    pub(crate) iterations: usize,
    /// Why it stopped.
    pub(crate) outcome: Outcome,
}

/// A chart with what does not change while it is flattened.
pub(crate) struct Flattening {
    triangles: Vec<[u32; 3]>,
    rest: RestShapes,
    /// How many vertices there are, up to the last that is in a triangle.
    vertices: usize,
    /// Whether a vertex of some triangle is fixed.
    anchored: bool,
    hessian: Hessian,
}

/// A map and its energy with that of the barrier.
struct Value {
    integrals: Integrals,
    pairs: Vec<Pair>,
    total: f64,
}

impl Flattening {
    /// Of triangles over vertices of which those with `fixed` keep their place (empty: none).
    /// They may be all of a chart or some of it, numbered as they are there.
    ///
    /// # Errors
    /// The rest shapes are not as many as the triangles, or `fixed` is neither empty nor reaches as
    /// far as the vertices.
    pub(crate) fn new(
        triangles: &[[u32; 3]],
        rest: RestShapes,
        fixed: &[bool],
    ) -> Result<Self, SolveError> {
        if rest.len() != triangles.len() {
            return Err(SolveError::LengthMismatch {
                what: "rest shapes",
                expected: triangles.len(),
                found: rest.len(),
            });
        }
        let last = triangles.iter().flatten().max();
        let vertices = last.map_or(0, |&v| v as usize + 1);
        if !fixed.is_empty() {
            reaches("fixed", vertices, fixed.len())?;
        }
        let is_fixed = |v: u32| !fixed.is_empty() && fixed[v as usize];
        Ok(Self {
            hessian: Hessian::new(triangles, vertices, |v| !is_fixed(v)),
            triangles: triangles.to_vec(),
            rest,
            vertices,
            anchored: triangles.iter().flatten().any(|&v| is_fixed(v)),
        })
    }

    /// With vertices that keep one of their coordinates, or both, while they move: `held` says so for
    /// every vertex. A vertex that keeps one slides along a line parallel to an axis.
    ///
    /// # Errors
    /// `held` does not reach as far as the vertices.
    pub(crate) fn holding(mut self, held: Vec<[bool; 2]>) -> Result<Self, SolveError> {
        reaches("held", self.vertices, held.len())?;
        self.anchored = self.anchored || held.iter().flatten().any(|&h| h);
        self.hessian.hold(held);
        Ok(self)
    }

    /// Moves the free vertices, so that the energy decreases and no triangle turns over. If
    /// there is a `boundary` (of the whole chart), it stays simple, kept apart by a barrier.
    ///
    /// Without fixed vertices the map is scaled to its best size first.
    ///
    /// # Errors
    /// `uv` does not reach as far as the vertices; at the start a triangle is not
    /// counter-clockwise or the boundary not simple; or the Hessian is too large or cannot be
    /// factorised: then `uv` is the best map so far.
    pub(crate) fn minimize(
        &mut self,
        uv: &mut [[f64; 2]],
        boundary: Option<&Boundary>,
        stop: &Stop,
    ) -> Result<Solved, SolveError> {
        reaches("uv", self.vertices, uv.len())?;
        if let Some(triangle) = first_flipped(&self.triangles, uv) {
            return Err(SolveError::Flipped { triangle });
        }
        if boundary.is_some_and(|boundary| !boundary.is_simple(uv)) {
            return Err(SolveError::NotSimple);
        }
        if !self.anchored {
            self.scale_best(uv, boundary);
        }
        let area = self.rest.total_area();
        let mut value = self.value(uv, boundary);
        let mut iterations = 0;
        let outcome = loop {
            let halted = iterations >= stop.least && !stop.pace.goes_on();
            if iterations == stop.iterations || halted {
                break Outcome::OutOfIterations;
            }
            let (direction, slope) = self.direction(uv, boundary, &value.pairs)?;
            if -slope <= stop.relative_decrease * value.total {
                break Outcome::Converged;
            }
            match self.line_search(uv, boundary, &direction, slope, value.total) {
                Some(reached) => value = reached,
                None => break Outcome::Stuck,
            }
            iterations += 1;
            stop.pace.works(self.triangles.len());
        };
        Ok(Solved {
            energy: value.integrals.mean(area),
            iterations,
            outcome,
        })
    }

    /// That of a map.
    #[cfg(test)]
    pub(crate) fn mean_energy(&self, uv: &[[f64; 2]]) -> f64 {
        super::energy::mean_energy(&self.triangles, &self.rest, uv)
    }

    fn value(&self, uv: &[[f64; 2]], boundary: Option<&Boundary>) -> Value {
        let integrals = Integrals::of(&self.triangles, &self.rest, uv);
        let pairs = boundary.map_or(Vec::new(), |boundary| boundary.close_pairs(uv, REACH));
        let barrier: f64 = pairs.iter().map(|pair| pair.energy(uv)).sum();
        Value {
            integrals,
            pairs,
            total: integrals.energy() + barrier,
        }
    }

    /// Scales the map to the size at which its energy is least.
    fn scale_best(&self, uv: &mut [[f64; 2]], boundary: Option<&Boundary>) {
        let scale = Integrals::of(&self.triangles, &self.rest, uv).best_scale();
        let scaled: Vec<[f64; 2]> = uv.iter().map(|q| q.map(|c| scale * c)).collect();
        if self.is_injective(&scaled, boundary) {
            uv.copy_from_slice(&scaled);
        }
    }

    fn is_injective(&self, uv: &[[f64; 2]], boundary: Option<&Boundary>) -> bool {
        first_flipped(&self.triangles, uv).is_none()
            && boundary.is_none_or(|boundary| boundary.is_simple(uv))
    }

    fn direction(
        &mut self,
        uv: &[[f64; 2]],
        boundary: Option<&Boundary>,
        pairs: &[Pair],
    ) -> Result<(Vec<[f64; 2]>, f64), SolveError> {
        if !self.hessian.covers(pairs) {
            let wide = match boundary {
                Some(boundary) if !pairs.is_empty() => boundary.close_pairs(uv, WIDE_REACH),
                _ => Vec::new(),
            };
            self.hessian.cover(&self.triangles, &wide)?;
        }
        self.hessian.assemble(&self.triangles, &self.rest, uv);
        self.hessian.add_pairs(pairs, uv);
        let (mut direction, slope) = self.hessian.direction()?;
        direction.resize(uv.len(), [0.0; 2]);
        Ok((direction, slope))
    }

    /// Takes the longest step that decreases the energy enough; none leaves `uv` as it is.
    fn line_search(
        &self,
        uv: &mut [[f64; 2]],
        boundary: Option<&Boundary>,
        direction: &[[f64; 2]],
        slope: f64,
        total: f64,
    ) -> Option<Value> {
        let start = uv.to_vec();
        let mut step = (STEP_SHARE * longest_step(&self.triangles, uv, direction)).min(1.0);
        for _ in 0..SHORTENINGS {
            for ((q, p), d) in uv.iter_mut().zip(&start).zip(direction) {
                *q = [p[0] + step * d[0], p[1] + step * d[1]];
            }
            if !self.is_injective(uv, boundary) {
                step *= MOST_OF_STEP;
                continue;
            }
            let reached = self.value(uv, boundary);
            let change = reached.total - total;
            if change <= SUFFICIENT * step * slope {
                return Some(reached);
            }
            // The minimum of the parabola through what is known.
            let parabola = -0.5 * slope * step * step / (change - slope * step);
            step = if parabola.is_finite() {
                parabola.clamp(LEAST_OF_STEP * step, MOST_OF_STEP * step)
            } else {
                LEAST_OF_STEP * step
            };
        }
        uv.copy_from_slice(&start);
        None
    }
}

fn reaches(what: &'static str, expected: usize, found: usize) -> Result<(), SolveError> {
    if found >= expected {
        return Ok(());
    }
    Err(SolveError::LengthMismatch {
        what,
        expected,
        found,
    })
}
