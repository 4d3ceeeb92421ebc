use std::ops::ControlFlow;

use super::Boundary;
use super::candidates::Bounds;
use super::plane::{Point, along, dot, length, minus};

/// A boundary vertex and a boundary edge that it is not an end of, close to each other.
///
/// Their energy is s² · b(d / ε), where d is their distance, s the least of the rest lengths
/// of the edge and of the two edges at the vertex, ε the reach times s, and
/// b(x) = −(x − 1)² ln x for x < 1 and 0 beyond (Li et al. 2020, "Incremental Potential
/// Contact"). It is twice continuously differentiable in d. The factor s² gives it the
/// dimension of an area, so that it weighs the same against an energy density however fine
/// the mesh is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    /// The vertex, then the start and the end of the edge.
    pub vertices: [u32; 3],
    scale: f64,
    reach: f64,
}

/// The energy of a pair and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Derivatives {
    /// Infinite where vertex and edge touch; the derivatives are then 0.
    pub energy: f64,
    /// By the coordinates of the three vertices, in their order: u, v of the first, …
    pub gradient: [f64; 6],
    /// Positive semi-definite: the second derivatives with the negative curvature of the
    /// distance left out.
    pub hessian: [[f64; 6]; 6],
}

impl Boundary {
    /// The pairs nearer to each other than ε, which is `reach` times their scale; the order
    /// is always the same for the same UVs.
    pub fn close_pairs(&self, uv: &[Point], reach: f64) -> Vec<Pair> {
        let mut pairs = Vec::new();
        let tree = self.tree(reach, |i| Bounds::of(self.ends(uv, i)));
        let _: ControlFlow<()> = tree.for_each_pair(|i, j| {
            pairs.extend(self.pair(i, j, reach).filter(|pair| pair.is_close(uv)));
            pairs.extend(self.pair(j, i, reach).filter(|pair| pair.is_close(uv)));
            ControlFlow::Continue(())
        });
        pairs
    }

    /// Vertex `vertex` with edge `edge`, if it is not an end of it.
    pub(super) fn pair(&self, vertex: usize, edge: usize, reach: f64) -> Option<Pair> {
        let end = self.next(edge);
        let scale = self.scales[vertex].min(self.lengths[edge]);
        (vertex != edge && vertex != end).then(|| Pair {
            vertices: [vertex, edge, end].map(|i| self.vertices[i]),
            scale,
            reach: reach * scale,
        })
    }
}

impl Pair {
    /// The energy, infinite where vertex and edge touch.
    pub fn energy(&self, uv: &[Point]) -> f64 {
        let x = self.nearest(uv).distance / self.reach;
        self.scale * self.scale * barrier(x)[0]
    }

    /// The energy, its gradient and its Hessian.
    pub fn derivatives(&self, uv: &[Point]) -> Derivatives {
        let Nearest {
            fraction,
            distance,
            normal,
        } = self.nearest(uv);
        let [value, slope, curvature] = barrier(distance / self.reach);
        let area = self.scale * self.scale;
        let mut derivatives = Derivatives {
            energy: area * value,
            gradient: [0.0; 6],
            hessian: [[0.0; 6]; 6],
        };
        if distance == 0.0 || distance >= self.reach {
            return derivatives;
        }
        let slope = area * slope / self.reach;
        let curvature = area * curvature / (self.reach * self.reach);
        let weights = [1.0, fraction - 1.0, -fraction];
        let along_normal = spread(weights, normal);
        derivatives.gradient = along_normal.map(|g| slope * g);
        derivatives.add_square(curvature, along_normal);
        if 0.0 < fraction && fraction < 1.0 {
            let edge = self.edge(uv);
            derivatives.add_turning(weights, normal, edge, distance, -slope);
        }
        derivatives
    }

    fn is_close(&self, uv: &[Point]) -> bool {
        self.nearest(uv).distance < self.reach
    }

    fn edge(&self, uv: &[Point]) -> Point {
        let [_, a, b] = self.vertices.map(|v| uv[v as usize]);
        minus(b, a)
    }

    fn nearest(&self, uv: &[Point]) -> Nearest {
        let [p, a, b] = self.vertices.map(|v| uv[v as usize]);
        let edge = minus(b, a);
        let squared = dot(edge, edge);
        let fraction = match squared > 0.0 {
            true => (dot(minus(p, a), edge) / squared).clamp(0.0, 1.0),
            false => 0.0,
        };
        let from = minus(p, along(a, fraction, edge));
        let distance = length(from);
        Nearest {
            fraction,
            distance,
            normal: from.map(|x| x / distance),
        }
    }
}

impl Derivatives {
    /// Adds the curvature of the distance from the line of the edge, times −`force`, as far
    /// as it is positive.
    ///
    /// With ω the angle that the edge turns by and τ the way that the vertex slides along it,
    /// the second derivative of the distance d is −2 ω τ − d ω², and ω and τ are orthogonal
    /// as functions of the six coordinates. `weights` are those of the vertices in the
    /// distance vector.
    fn add_turning(
        &mut self,
        weights: [f64; 3],
        normal: Point,
        edge: Point,
        distance: f64,
        force: f64,
    ) {
        let edge_length = length(edge);
        let tangent = edge.map(|x| x / edge_length);
        let slide_norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        let turn_norm = std::f64::consts::SQRT_2 / edge_length;
        let mixed = force * slide_norm * turn_norm;
        let pure = force * distance * turn_norm * turn_norm;
        let positive = 0.5 * (pure + (pure * pure + 4.0 * mixed * mixed).sqrt());
        let norm = mixed.hypot(positive);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let slide = spread(weights.map(|w| w / slide_norm), tangent);
        let turn = spread([0.0, -half, half], normal);
        let eigenvector: [f64; 6] =
            std::array::from_fn(|k| (mixed * slide[k] + positive * turn[k]) / norm);
        if norm > 0.0 {
            self.add_square(positive, eigenvector);
        }
    }

    fn add_square(&mut self, factor: f64, vector: [f64; 6]) {
        for (row, a) in self.hessian.iter_mut().zip(vector) {
            for (entry, b) in row.iter_mut().zip(vector) {
                *entry += factor * a * b;
            }
        }
    }
}

/// The point of an edge nearest to a vertex.
struct Nearest {
    /// Where on the edge: 0 at the start, 1 at the end.
    fraction: f64,
    distance: f64,
    /// From there to the vertex.
    normal: Point,
}

fn spread(weights: [f64; 3], direction: Point) -> [f64; 6] {
    std::array::from_fn(|k| weights[k / 2] * direction[k % 2])
}

/// −(x − 1)² ln x and its first two derivatives; 0 from 1 on.
fn barrier(x: f64) -> [f64; 3] {
    if x >= 1.0 {
        return [0.0; 3];
    }
    let (log, off) = (x.ln(), x - 1.0);
    [
        -off * off * log,
        -2.0 * off * log - off * off / x,
        -2.0 * log - 4.0 * off / x + off * off / (x * x),
    ]
}
