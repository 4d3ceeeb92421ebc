//! The projected Hessian of the energy of a chart, and Newton's direction.

use super::SolveError;
use super::boundary::Pair;
use super::energy::jacobian;
use super::rest::RestShapes;
use super::sparse::{Slot, SparseSystem};
use super::symmetric_dirichlet::{Jacobian, derivatives};

/// In the place of a node: the vertex does not move.
const NONE: u32 = u32::MAX;

/// By what share of it the diagonal is raised at first: for the directions in which the
/// energy does not change, and rounding.
const DAMPING: f64 = 1e-10;

/// By what the damping grows while the matrix is not positive definite.
const DAMPING_GROWTH: f64 = 1e3;

/// The damping above which there is no further attempt.
const MOST_DAMPING: f64 = 1e3;

/// A Hessian by the free vertices of a chart, with the gradient.
pub(super) struct Hessian {
    /// The node of every vertex.
    nodes: Vec<u32>,
    /// The vertex of every node.
    free: Vec<u32>,
    /// The links along the edges of triangles.
    edges: Vec<[u32; 2]>,
    /// Of every vertex the coordinates that do not change; empty if all do.
    held: Vec<[bool; 2]>,
    /// None before the pattern is analysed.
    system: Option<SparseSystem<2>>,
    /// Per triangle the blocks of its corners 0 and 1, 1 and 2, 2 and 0.
    slots: Vec<[Option<Slot<2>>; 3]>,
    gradient: Vec<[f64; 2]>,
}

impl Hessian {
    /// The Hessian of `triangles` over so many vertices. Only vertices for which `free` holds move.
    /// [`cover`](Self::cover) analyses its pattern later.
    pub(super) fn new(triangles: &[[u32; 3]], vertices: usize, free: impl Fn(u32) -> bool) -> Self {
        let mut used = vec![false; vertices];
        for &v in triangles.iter().flatten() {
            used[v as usize] = free(v);
        }
        let free: Vec<u32> = (0..vertices as u32).filter(|&v| used[v as usize]).collect();
        let mut nodes = vec![NONE; vertices];
        for (node, &v) in free.iter().enumerate() {
            nodes[v as usize] = node as u32;
        }
        let edges: Vec<[u32; 2]> = triangles
            .iter()
            .flat_map(|t| sides(t.map(|v| nodes[v as usize])))
            .filter(|link| !link.contains(&NONE))
            .collect();
        Self {
            system: None,
            gradient: vec![[0.0; 2]; free.len()],
            nodes,
            free,
            edges,
            held: Vec::new(),
            slots: Vec::new(),
        }
    }

    /// Where some vertices keep one of their coordinates, or both: `held` says so for every vertex.
    pub(super) fn hold(&mut self, held: Vec<[bool; 2]>) {
        self.held = held;
    }

    /// A vector of a vertex without the coordinates that it keeps.
    fn free_part(&self, vertex: u32, vector: [f64; 2]) -> [f64; 2] {
        match self.held.get(vertex as usize) {
            Some(held) => [0, 1].map(|k| if held[k] { 0.0 } else { vector[k] }),
            None => vector,
        }
    }

    /// Makes the rows of coordinates that are kept those of the identity.
    fn keep_held(&mut self) {
        let Some(system) = &mut self.system else {
            return;
        };
        for (&node, held) in self.nodes.iter().zip(&self.held) {
            if node != NONE {
                let [u, v] = held.map(f64::from);
                system.add_diagonal(node, &[[u, 0.0], [0.0, v]]);
            }
        }
    }

    fn node(&self, vertex: u32) -> u32 {
        self.nodes.get(vertex as usize).copied().unwrap_or(NONE)
    }

    /// The links between the vertices of a pair that move.
    fn links(&self, pair: &Pair) -> impl Iterator<Item = [u32; 2]> + use<> {
        sides(pair.vertices.map(|v| self.node(v)))
            .into_iter()
            .filter(|link| !link.contains(&NONE))
    }

    /// Whether the pattern is analysed and all pairs of boundary parts have their blocks.
    pub(super) fn covers(&self, pairs: &[Pair]) -> bool {
        let mut links = pairs.iter().flat_map(|pair| self.links(pair));
        let system = self.system.as_ref();
        system.is_some_and(|system| links.all(|link| slot(system, link).is_some()))
    }

    /// Analyses the pattern, with blocks for pairs of boundary parts.
    ///
    /// # Errors
    /// The system is too large.
    pub(super) fn cover(
        &mut self,
        triangles: &[[u32; 3]],
        pairs: &[Pair],
    ) -> Result<(), SolveError> {
        let mut links = self.edges.clone();
        links.extend(pairs.iter().flat_map(|pair| self.links(pair)));
        let system = SparseSystem::new(self.free.len(), &links)?;
        let nodes = |t: &[u32; 3]| t.map(|v| self.nodes[v as usize]);
        self.slots = triangles
            .iter()
            .map(|t| sides(nodes(t)).map(|link| slot(&system, link)))
            .collect();
        self.system = Some(system);
        Ok(())
    }

    /// Computes gradient and Hessian of the symmetric Dirichlet energy at a map, once the pattern
    /// is analysed.
    pub(super) fn assemble(&mut self, triangles: &[[u32; 3]], rest: &RestShapes, uv: &[[f64; 2]]) {
        let Some(mut system) = self.system.take() else {
            return;
        };
        system.clear();
        self.gradient.fill([0.0; 2]);
        for (t, corners) in triangles.iter().enumerate() {
            let hats = rest.gradients(t);
            let area = rest.area(t);
            let derivatives = derivatives(&jacobian(rest, t, corners.map(|v| uv[v as usize])));
            // The modes as displacements of the three corners.
            let modes = derivatives.modes.map(|(eigenvalue, mode)| {
                let moved = [0, 1, 2].map(|c| self.free_part(corners[c], times(&mode, hats[c])));
                (area * eigenvalue, moved)
            });
            let block = |one: usize, other: usize| {
                let mut block = [[0.0; 2]; 2];
                for (eigenvalue, corners) in &modes {
                    for i in 0..2 {
                        let factor = eigenvalue * corners[one][i];
                        for k in 0..2 {
                            block[i][k] += factor * corners[other][k];
                        }
                    }
                }
                block
            };
            for c in 0..3 {
                let node = self.nodes[corners[c] as usize];
                if node != NONE {
                    let force = self.free_part(corners[c], times(&derivatives.gradient, hats[c]));
                    let sum = &mut self.gradient[node as usize];
                    *sum = [0, 1].map(|i| sum[i] + area * force[i]);
                    system.add_diagonal(node, &block(c, c));
                }
                if let Some(slot) = self.slots[t][c] {
                    system.add(slot, &block(c, (c + 1) % 3));
                }
            }
        }
        self.system = Some(system);
        self.keep_held();
    }

    /// Adds the barrier of pairs of boundary parts that have their blocks.
    pub(super) fn add_pairs(&mut self, pairs: &[Pair], uv: &[[f64; 2]]) {
        for pair in pairs {
            let nodes = pair.vertices.map(|v| self.node(v));
            let mut derivatives = pair.derivatives(uv);
            for (c, &v) in pair.vertices.iter().enumerate() {
                let free = self.free_part(v, [1.0; 2]);
                for i in (0..2).filter(|&i| free[i] == 0.0) {
                    derivatives.gradient[2 * c + i] = 0.0;
                    derivatives.hessian[2 * c + i] = [0.0; 6];
                    derivatives
                        .hessian
                        .iter_mut()
                        .for_each(|row| row[2 * c + i] = 0.0);
                }
            }
            let Some(system) = &mut self.system else {
                return;
            };
            let block = |one: usize, other: usize| {
                [0, 1].map(|i| [0, 1].map(|k| derivatives.hessian[2 * one + i][2 * other + k]))
            };
            for c in 0..3 {
                if nodes[c] != NONE {
                    let sum = &mut self.gradient[nodes[c] as usize];
                    *sum = [0, 1].map(|i| sum[i] + derivatives.gradient[2 * c + i]);
                    system.add_diagonal(nodes[c], &block(c, c));
                }
                if let Some(slot) = slot(system, [nodes[c], nodes[(c + 1) % 3]]) {
                    system.add(slot, &block(c, (c + 1) % 3));
                }
            }
        }
    }

    /// Newton's direction for every vertex, 0 for those that do not move, and the slope of
    /// the energy along it.
    ///
    /// # Errors
    /// The system cannot be solved: its pattern is not analysed, or there are values that are no
    /// finite numbers.
    pub(super) fn direction(&mut self) -> Result<(Vec<[f64; 2]>, f64), SolveError> {
        let system = self.system.as_mut().ok_or(SolveError::Singular)?;
        let mut damping = DAMPING;
        system.scale_diagonal(1.0 + damping);
        while let Err(error) = system.factorize() {
            if damping > MOST_DAMPING {
                return Err(error);
            }
            let grown = DAMPING_GROWTH * damping;
            system.scale_diagonal((1.0 + grown) / (1.0 + damping));
            damping = grown;
        }
        let mut step: Vec<[f64; 2]> = self.gradient.iter().map(|g| g.map(|c| -c)).collect();
        system.solve(&mut step);
        let slope: f64 = std::iter::zip(self.gradient.iter().flatten(), step.iter().flatten())
            .map(|(g, d)| g * d)
            .sum();
        if !slope.is_finite() {
            return Err(SolveError::Singular);
        }
        let mut direction = vec![[0.0; 2]; self.nodes.len()];
        for (&v, step) in self.free.iter().zip(step) {
            direction[v as usize] = step;
        }
        Ok((direction, slope))
    }
}

/// The block of two nodes; none if they do not move or are not linked.
fn slot(system: &SparseSystem<2>, [a, b]: [u32; 2]) -> Option<Slot<2>> {
    if a == NONE || b == NONE {
        return None;
    }
    system.slot(a, b)
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// `J x`.
fn times(j: &Jacobian, x: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| j[i][0] * x[0] + j[i][1] * x[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::energy::Integrals;
    use fam_surface::shapes;
    use rand::{RngExt, SeedableRng};

    /// A sheet whose inner vertices are moved a little.
    struct Sheet {
        triangles: Vec<[u32; 3]>,
        rest: RestShapes,
        uv: Vec<[f64; 2]>,
    }

    impl Sheet {
        fn new(noise: f64) -> Self {
            let sheet = shapes::rectangle(1.0, 1.0, 5, 4);
            let corners: Vec<_> = (0..sheet.triangles().len())
                .map(|t| sheet.corners(t))
                .collect();
            let mut random = rand_pcg::Pcg64::seed_from_u64(2);
            let mut moved = |x: f64| x + random.random_range(-noise..noise);
            Self {
                triangles: sheet.triangles().to_vec(),
                rest: RestShapes::new(&corners, None),
                uv: sheet
                    .positions()
                    .iter()
                    .map(|p| [moved(p[0]), moved(p[1])])
                    .collect(),
            }
        }

        fn hessian(&self) -> Hessian {
            let mut hessian = Hessian::new(&self.triangles, self.uv.len(), |v| v != 3);
            hessian.cover(&self.triangles, &[]).unwrap();
            hessian.assemble(&self.triangles, &self.rest, &self.uv);
            hessian
        }

        fn energy(&self) -> f64 {
            Integrals::of(&self.triangles, &self.rest, &self.uv).energy()
        }
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let mut sheet = Sheet::new(0.05);
        let hessian = sheet.hessian();
        let h = 1e-6;
        for (&v, gradient) in hessian.free.iter().zip(&hessian.gradient) {
            for (k, expected) in gradient.iter().enumerate() {
                let at = sheet.uv[v as usize][k];
                let [ahead, behind] = [h, -h].map(|step| {
                    sheet.uv[v as usize][k] = at + step;
                    sheet.energy()
                });
                sheet.uv[v as usize][k] = at;
                let difference = (ahead - behind) / (2.0 * h);
                assert!((difference - expected).abs() < 1e-6 * (1.0 + expected.abs()));
            }
        }
    }

    /// Where no triangle is compressed in both directions nothing is projected: along Newton's
    /// direction the gradient changes by what it is.
    #[test]
    fn the_direction_takes_the_gradient_away() {
        let mut sheet = Sheet::new(0.005);
        for c in sheet.uv.iter_mut().flatten() {
            *c *= 1.2;
        }
        let mut hessian = sheet.hessian();
        let gradient = hessian.gradient.clone();
        let (direction, slope) = hessian.direction().unwrap();
        assert!(slope < 0.0);
        assert_eq!(direction[3], [0.0; 2]);
        let start = sheet.uv.clone();
        let mut gradient_at = |step: f64| {
            for ((q, p), d) in sheet.uv.iter_mut().zip(&start).zip(&direction) {
                *q = [p[0] + step * d[0], p[1] + step * d[1]];
            }
            sheet.hessian().gradient
        };
        let h = 1e-5;
        let (ahead, behind) = (gradient_at(h), gradient_at(-h));
        for (k, expected) in gradient.iter().enumerate() {
            for i in 0..2 {
                let change = (ahead[k][i] - behind[k][i]) / (2.0 * h);
                assert!((change + expected[i]).abs() < 1e-5 * (1.0 + expected[i].abs()));
            }
        }
    }

    /// The others go where they would if the vertices that keep both coordinates were fixed.
    #[test]
    fn coordinates_that_are_kept_do_not_change() {
        let sheet = Sheet::new(0.05);
        let mut held = vec![[false; 2]; sheet.uv.len()];
        held[3] = [true; 2];
        let fixed = sheet.hessian().direction().unwrap();
        let holding = |held: &[[bool; 2]]| {
            let mut hessian = Hessian::new(&sheet.triangles, sheet.uv.len(), |_| true);
            hessian.hold(held.to_vec());
            hessian.cover(&sheet.triangles, &[]).unwrap();
            hessian.assemble(&sheet.triangles, &sheet.rest, &sheet.uv);
            hessian.direction().unwrap()
        };
        let (direction, slope) = holding(&held);
        assert!((slope / fixed.1 - 1.0).abs() < 1e-9);
        for (one, other) in direction.iter().zip(&fixed.0) {
            assert!((0..2).all(|k| (one[k] - other[k]).abs() < 1e-9));
        }
        (held[0], held[5]) = ([true, false], [false, true]);
        let (direction, slope) = holding(&held);
        assert!(slope < 0.0 && slope > fixed.1);
        assert!(direction[0][0] == 0.0 && direction[0][1] != 0.0);
        assert!(direction[5][1] == 0.0 && direction[5][0] != 0.0);
        assert_eq!(direction[3], [0.0; 2]);
    }

    #[test]
    fn values_that_are_no_numbers_are_an_error() {
        let mut sheet = Sheet::new(0.01);
        sheet.uv[7] = [f64::NAN, 0.0];
        assert_eq!(sheet.hessian().direction(), Err(SolveError::Singular));
    }
}
