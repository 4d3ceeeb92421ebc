//! Projected Newton on the symmetric Dirichlet energy of a chart.

use robust::{Coord, orient2d};

use super::SolveError;
use super::rest::RestShapes;
use super::sparse::{Slot, SparseSystem};
use super::symmetric_dirichlet::{Jacobian, derivatives, determinant, squared_norm};

/// In the place of a node: the vertex is fixed or in no triangle.
const NONE: u32 = u32::MAX;

/// By what the diagonal of the Hessian is raised at first: what rounding leaves of the
/// directions in which the energy does not change.
const DAMPING: f64 = 1e-10;

/// By what the damping grows when the Hessian is still not positive definite.
const DAMPING_GROWTH: f64 = 1e3;

/// The damping above which there is no further attempt.
const MOST_DAMPING: f64 = 1e3;

/// How much of the way to the first collapsed triangle a step goes at most.
const STEP_SHARE: f64 = 0.9;

/// The part of the decrease along the gradient that a step must have (Armijo's condition).
const SUFFICIENT: f64 = 1e-4;

/// How often a step is shortened before there is none.
const SHORTENINGS: usize = 40;

/// When to stop.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stop {
    /// Most Newton steps.
    pub(crate) iterations: usize,
    /// The share of the energy below which a step that is to decrease it less is not taken.
    pub(crate) relative_decrease: f64,
    /// The mean energy at which the map is good enough.
    pub(crate) energy_bound: Option<f64>,
}

/// Why the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The energy does not decrease any more.
    Converged,
    /// The mean energy is at the bound or below.
    BoundReached,
    /// All steps were taken.
    OutOfIterations,
    /// No step in the direction of descent was possible.
    Stuck,
}

/// What the solver arrived at.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solved {
    /// The mean symmetric Dirichlet energy at the best uniform scale.
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
    /// The node of every vertex.
    nodes: Vec<u32>,
    /// The vertex of every node.
    free: Vec<u32>,
    /// Whether a vertex of some triangle is fixed.
    anchored: bool,
    system: SparseSystem<2>,
    /// Per triangle the blocks of its corners 0 and 1, 1 and 2, 2 and 0.
    slots: Vec<[Option<Slot<2>>; 3]>,
}

/// The two integrals that make up the energy: `D` of `σ₁² + σ₂²`, `I` of `1/σ₁² + 1/σ₂²`.
#[derive(Debug, Clone, Copy)]
struct Integrals {
    dirichlet: f64,
    inverse: f64,
}

impl Integrals {
    fn energy(&self) -> f64 {
        self.dirichlet + self.inverse
    }
}

impl Flattening {
    /// Of triangles over vertices of which those with `fixed` keep their place (empty: none).
    ///
    /// # Errors
    /// The rest shapes are not as many as the triangles, `fixed` is neither empty nor reaches
    /// as far as the vertices, or the system is too large.
    pub(crate) fn new(
        triangles: &[[u32; 3]],
        rest: RestShapes,
        fixed: &[bool],
    ) -> Result<Self, SolveError> {
        same_length("rest shapes", triangles.len(), rest.len())?;
        let vertices = vertex_count(triangles);
        if !fixed.is_empty() && fixed.len() < vertices {
            same_length("fixed", vertices, fixed.len())?;
        }
        let mut used = vec![false; vertices];
        let mut anchored = false;
        for &v in triangles.iter().flatten() {
            used[v as usize] = !fixed.get(v as usize).is_some_and(|&fixed| fixed);
            anchored |= !used[v as usize];
        }
        let free: Vec<u32> = (0..vertices as u32).filter(|&v| used[v as usize]).collect();
        let mut nodes = vec![NONE; vertices];
        for (node, &v) in free.iter().enumerate() {
            nodes[v as usize] = node as u32;
        }
        let sides = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| nodes[v as usize]);
            [[a, b], [b, c], [c, a]]
        };
        let inner = |link: &[u32; 2]| !link.contains(&NONE);
        let links: Vec<[u32; 2]> = triangles.iter().flat_map(sides).filter(inner).collect();
        let system = SparseSystem::new(free.len(), &links)?;
        let slot = |link: [u32; 2]| {
            let [a, b] = Some(link).filter(inner)?;
            system.slot(a, b)
        };
        let slots = triangles.iter().map(|t| sides(t).map(slot)).collect();
        Ok(Self {
            triangles: triangles.to_vec(),
            rest,
            nodes,
            free,
            anchored,
            system,
            slots,
        })
    }

    /// Moves the free vertices, so that the energy decreases and no triangle turns over.
    ///
    /// # Errors
    /// `uv` does not reach as far as the vertices, a triangle is not counter-clockwise at the
    /// start, or the Hessian cannot be factorised; then `uv` is the best map so far.
    pub(crate) fn minimize(
        &mut self,
        uv: &mut [[f64; 2]],
        stop: &Stop,
    ) -> Result<Solved, SolveError> {
        if uv.len() < self.nodes.len() {
            same_length("uv", self.nodes.len(), uv.len())?;
        }
        if let Some(triangle) = first_flipped(&self.triangles, uv) {
            return Err(SolveError::Flipped { triangle });
        }
        if !self.anchored {
            self.scale_best(uv);
        }
        let mut value = self.integrals(uv);
        let mut iterations = 0;
        let outcome = loop {
            if stop
                .energy_bound
                .is_some_and(|bound| self.mean(value) <= bound)
            {
                break Outcome::BoundReached;
            }
            if iterations == stop.iterations {
                break Outcome::OutOfIterations;
            }
            let gradient = self.assemble(uv);
            let direction = self.direction(&gradient)?;
            let slope = dot(&gradient, &direction);
            if -slope <= stop.relative_decrease * value.energy() {
                break Outcome::Converged;
            }
            match self.line_search(uv, &direction, slope, value) {
                Some(reached) => value = reached,
                None => break Outcome::Stuck,
            }
            iterations += 1;
        };
        Ok(Solved {
            energy: self.mean(value),
            iterations,
            outcome,
        })
    }

    /// The mean symmetric Dirichlet energy of a map at its best uniform scale; infinite where
    /// a triangle is flipped or collapsed.
    pub(crate) fn mean_energy(&self, uv: &[[f64; 2]]) -> f64 {
        self.mean(self.integrals(uv))
    }

    fn mean(&self, value: Integrals) -> f64 {
        2.0 * value.dirichlet.sqrt() * (value.inverse.sqrt() / self.rest.total_area())
    }

    fn integrals(&self, uv: &[[f64; 2]]) -> Integrals {
        let mut sum = Integrals {
            dirichlet: 0.0,
            inverse: 0.0,
        };
        for t in 0..self.triangles.len() {
            let jacobian = self.jacobian(t, uv);
            let determinant = determinant(&jacobian);
            let dirichlet = self.rest.area(t) * squared_norm(&jacobian);
            sum.dirichlet += dirichlet;
            sum.inverse += if determinant > 0.0 {
                dirichlet / (determinant * determinant)
            } else {
                f64::INFINITY
            };
        }
        sum
    }

    fn jacobian(&self, t: usize, uv: &[[f64; 2]]) -> Jacobian {
        let [a, b, c] = self.triangles[t].map(|v| uv[v as usize]);
        let [_, g1, g2] = self.rest.gradients(t);
        [0, 1].map(|i| {
            let (e1, e2) = (b[i] - a[i], c[i] - a[i]);
            [0, 1].map(|k| e1 * g1[k] + e2 * g2[k])
        })
    }

    /// Scales the map to the size at which its energy is least.
    fn scale_best(&self, uv: &mut [[f64; 2]]) {
        let value = self.integrals(uv);
        let scale = (value.inverse / value.dirichlet).sqrt().sqrt();
        if scale.is_finite() && scale > 0.0 {
            for c in uv.iter_mut().flatten() {
                *c *= scale;
            }
        }
    }

    /// Fills the system with the projected Hessian; returns the gradient per node.
    fn assemble(&mut self, uv: &[[f64; 2]]) -> Vec<[f64; 2]> {
        self.system.clear();
        let mut gradient = vec![[0.0; 2]; self.free.len()];
        for t in 0..self.triangles.len() {
            let hats = self.rest.gradients(t);
            let area = self.rest.area(t);
            let derivatives = derivatives(&self.jacobian(t, uv));
            let nodes = self.triangles[t].map(|v| self.nodes[v as usize]);
            // The modes as displacements of the three corners.
            let modes = derivatives
                .modes
                .map(|(eigenvalue, mode)| (area * eigenvalue, hats.map(|hat| times(&mode, hat))));
            let block = |one: usize, other: usize| {
                let mut block = [[0.0; 2]; 2];
                for (eigenvalue, corners) in &modes {
                    for i in 0..2 {
                        for k in 0..2 {
                            block[i][k] += eigenvalue * corners[one][i] * corners[other][k];
                        }
                    }
                }
                block
            };
            for c in 0..3 {
                if nodes[c] != NONE {
                    let force = times(&derivatives.gradient, hats[c]);
                    let sum = &mut gradient[nodes[c] as usize];
                    *sum = [0, 1].map(|i| sum[i] + area * force[i]);
                    self.system.add_diagonal(nodes[c], &block(c, c));
                }
                if let Some(slot) = self.slots[t][c] {
                    self.system.add(slot, &block(c, (c + 1) % 3));
                }
            }
        }
        gradient
    }

    /// The Newton direction per node.
    fn direction(&mut self, gradient: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, SolveError> {
        let mut damping = DAMPING;
        self.system.scale_diagonal(1.0 + damping);
        while let Err(error) = self.system.factorize() {
            if damping > MOST_DAMPING {
                return Err(error);
            }
            self.system
                .scale_diagonal((1.0 + DAMPING_GROWTH * damping) / (1.0 + damping));
            damping *= DAMPING_GROWTH;
        }
        let mut direction: Vec<[f64; 2]> = gradient.iter().map(|g| g.map(|c| -c)).collect();
        self.system.solve(&mut direction);
        if direction.iter().flatten().all(|c| c.is_finite()) {
            Ok(direction)
        } else {
            Err(SolveError::Singular)
        }
    }

    /// Takes the longest step that decreases the energy enough; none leaves `uv` as it is.
    fn line_search(
        &self,
        uv: &mut [[f64; 2]],
        direction: &[[f64; 2]],
        slope: f64,
        value: Integrals,
    ) -> Option<Integrals> {
        let start: Vec<[f64; 2]> = self.free.iter().map(|&v| uv[v as usize]).collect();
        let mut step = (STEP_SHARE * self.longest_step(uv, direction)).min(1.0);
        for _ in 0..SHORTENINGS {
            self.place(uv, &start, direction, step);
            let reached = self.integrals(uv);
            let decrease = reached.energy() - value.energy();
            if decrease <= SUFFICIENT * step * slope && first_flipped(&self.triangles, uv).is_none()
            {
                return Some(reached);
            }
            // The minimum of the parabola through what is known.
            let parabola = -0.5 * slope * step * step / (decrease - slope * step);
            step = if parabola.is_finite() {
                parabola.clamp(0.1 * step, 0.5 * step)
            } else {
                0.5 * step
            };
        }
        self.place(uv, &start, direction, 0.0);
        None
    }

    fn place(&self, uv: &mut [[f64; 2]], start: &[[f64; 2]], direction: &[[f64; 2]], step: f64) {
        for ((&v, p), d) in self.free.iter().zip(start).zip(direction) {
            uv[v as usize] = [p[0] + step * d[0], p[1] + step * d[1]];
        }
    }

    /// How far the free vertices can move until the first triangle collapses.
    fn longest_step(&self, uv: &[[f64; 2]], direction: &[[f64; 2]]) -> f64 {
        let speed = |v: u32| match self.nodes[v as usize] {
            NONE => [0.0; 2],
            node => direction[node as usize],
        };
        self.triangles
            .iter()
            .map(|t| first_collapse(t.map(|v| uv[v as usize]), t.map(speed)))
            .fold(f64::INFINITY, f64::min)
    }
}

/// The first triangle that is not strictly counter-clockwise, decided exactly.
pub(crate) fn first_flipped(triangles: &[[u32; 3]], uv: &[[f64; 2]]) -> Option<usize> {
    triangles.iter().position(|t| {
        let [a, b, c] = t.map(|v| {
            let [x, y] = uv[v as usize];
            Coord { x, y }
        });
        // Not a number is no positive area either.
        !(orient2d(a, b, c) > 0.0)
    })
}

/// The first positive time at which a counter-clockwise triangle that moves steadily has no
/// area; infinite if there is none.
fn first_collapse(corners: [[f64; 2]; 3], speeds: [[f64; 2]; 3]) -> f64 {
    let sides = |p: [[f64; 2]; 3]| [1, 2].map(|c| [p[c][0] - p[0][0], p[c][1] - p[0][1]]);
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let ([p, q], [u, v]) = (sides(corners), sides(speeds));
    let (constant, linear, square) = (cross(p, q), cross(p, v) + cross(u, q), cross(u, v));
    let discriminant = linear * linear - 4.0 * square * constant;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let root = discriminant.sqrt();
    let time = if linear < 0.0 {
        2.0 * constant / (root - linear)
    } else {
        -0.5 * (linear + root) / square
    };
    if time > 0.0 { time } else { f64::INFINITY }
}

/// `J x`.
fn times(j: &Jacobian, x: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| j[i][0] * x[0] + j[i][1] * x[1])
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    std::iter::zip(a.iter().flatten(), b.iter().flatten())
        .map(|(a, b)| a * b)
        .sum()
}

fn vertex_count(triangles: &[[u32; 3]]) -> usize {
    let last = triangles.iter().flatten().max();
    last.map_or(0, |&v| v as usize + 1)
}

fn same_length(what: &'static str, expected: usize, found: usize) -> Result<(), SolveError> {
    if expected == found {
        return Ok(());
    }
    Err(SolveError::LengthMismatch {
        what,
        expected,
        found,
    })
}
