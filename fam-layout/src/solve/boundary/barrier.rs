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
        let ends = [self.vertices[edge], self.ends[edge]];
        let vertex_of = self.vertices[vertex];
        let scale = self.scales[vertex].min(self.lengths[edge]);
        (!ends.contains(&vertex_of)).then(|| Pair {
            vertices: [vertex_of, ends[0], ends[1]],
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::patch::topology::Topology;
    use fam_surface::shapes;

    const PAIR: Pair = Pair {
        vertices: [0, 1, 2],
        scale: 2.0,
        reach: 0.5,
    };

    /// An edge along the first axis, turned and moved, and a vertex at (x, y) before that.
    fn placed(x: f64, y: f64, edge: f64, angle: f64) -> [Point; 3] {
        let (sin, cos) = angle.sin_cos();
        [[x, y], [0.0, 0.0], [edge, 0.0]]
            .map(|[x, y]| [3.0 + cos * x - sin * y, sin * x + cos * y - 1.0])
    }

    /// Beyond either end of the edge, above and below it.
    fn random_places() -> Vec<[Point; 3]> {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut place = || {
            let edge = rng.random_range(0.2..1.5);
            let x = rng.random_range(-0.3..edge + 0.3);
            let y = rng.random_range(0.05..0.4) * if rng.random() { 1.0 } else { -1.0 };
            placed(x, y, edge, rng.random_range(0.0..6.3))
        };
        (0..300).map(|_| place()).collect()
    }

    /// Central differences by all six coordinates.
    fn differences<const N: usize>(
        uv: [Point; 3],
        of: impl Fn(&[Point]) -> [f64; N],
    ) -> [[f64; N]; 6] {
        std::array::from_fn(|k| {
            let at = |h: f64| {
                let mut uv = uv;
                uv[k / 2][k % 2] += h;
                of(&uv)
            };
            let (plus, minus) = (at(1e-6), at(-1e-6));
            std::array::from_fn(|i| (plus[i] - minus[i]) / 2e-6)
        })
    }

    #[test]
    fn energy_has_its_closed_form() {
        let half = placed(0.4, 0.25, 1.0, 0.7);
        let expected = 4.0 * 0.25 * 2.0_f64.ln();
        assert!((PAIR.energy(&half) - expected).abs() < 1e-14);
        let beyond_the_end = placed(-0.15, 0.2, 1.0, 0.7);
        assert!((PAIR.energy(&beyond_the_end) - expected).abs() < 1e-14);
        assert_eq!(PAIR.energy(&placed(0.4, 0.6, 1.0, 0.7)), 0.0);
        assert_eq!(PAIR.energy(&placed(0.4, 0.0, 1.0, 0.0)), f64::INFINITY);
    }

    #[test]
    fn gradient_agrees_with_differences() {
        for uv in random_places() {
            let derivatives = PAIR.derivatives(&uv);
            assert_eq!(derivatives.energy, PAIR.energy(&uv));
            let expected = differences(uv, |uv| [PAIR.energy(uv)]);
            for (g, [e]) in derivatives.gradient.iter().zip(expected) {
                assert!((g - e).abs() < 1e-6 * (1.0 + e.abs()), "{g} {e}");
            }
        }
    }

    /// The second derivatives have one negative eigenvalue (in the plane the distance curves
    /// one way), and only this is left out: the difference has rank one.
    #[test]
    fn hessian_leaves_out_the_negative_curvature_only() {
        for uv in random_places() {
            let exact = differences(uv, |uv| PAIR.derivatives(uv).gradient);
            let projected = PAIR.derivatives(&uv).hessian;
            let entry = |i: usize, j: usize| projected[i][j] - exact[i][j];
            let trace: f64 = (0..6).map(|i| entry(i, i)).sum();
            let squares: f64 = (0..36).map(|k| entry(k / 6, k % 6).powi(2)).sum();
            let size: f64 = (0..6).map(|i| projected[i][i]).sum();
            assert!(trace > -1e-6 * size, "{trace}");
            let off = (trace - squares.sqrt()).abs();
            assert!(off < 1e-5 * (1.0 + size), "{trace} {squares} {size}");
        }
    }

    #[test]
    fn nothing_jumps_where_the_nearest_point_reaches_an_end_or_the_reach_is_left() {
        let both = |a: [Point; 3], b: [Point; 3]| {
            let [a, b] = [a, b].map(|uv| PAIR.derivatives(&uv));
            assert!((a.energy - b.energy).abs() < 1e-6);
            for (g, h) in a.gradient.iter().zip(b.gradient) {
                assert!((g - h).abs() < 1e-5);
            }
        };
        for y in [0.1, 0.2, 0.45] {
            for end in [0.0, 1.0] {
                both(
                    placed(end - 1e-9, y, 1.0, 0.3),
                    placed(end + 1e-9, y, 1.0, 0.3),
                );
            }
        }
        both(
            placed(0.5, 0.5 - 1e-9, 1.0, 2.0),
            placed(0.5, 0.5 + 1e-9, 1.0, 2.0),
        );
    }

    /// The pairs of a crumpled sheet's boundary, from all vertices and all edges.
    #[test]
    fn close_pairs_agree_with_brute_force() {
        let topology = Topology::oriented(&shapes::rectangle(1.0, 1.0, 20, 10)).topology;
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let lengths: Vec<f64> = (0..topology.half_edges())
            .map(|_| rng.random_range(0.05..2.0))
            .collect();
        let boundary = Boundary::new(&topology, |h| lengths[h as usize]);
        let uv: Vec<Point> = (0..topology.vertices())
            .map(|_| [0; 2].map(|_| rng.random_range(0.0..1.0)))
            .collect();
        for reach in [0.01, 0.1, 0.5] {
            let count = boundary.vertices.len();
            let mut expected: Vec<[u32; 3]> = (0..count * count)
                .filter_map(|k| boundary.pair(k / count, k % count, reach))
                .filter(|pair| pair.energy(&uv) > 0.0)
                .map(|pair| pair.vertices)
                .collect();
            let pairs = boundary.close_pairs(&uv, reach);
            let mut found: Vec<[u32; 3]> = pairs.iter().map(|pair| pair.vertices).collect();
            expected.sort_unstable();
            found.sort_unstable();
            assert!(!expected.is_empty());
            assert_eq!(found, expected);
        }
    }
}
