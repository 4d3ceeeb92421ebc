//! The symmetric Dirichlet energy of one triangle and its derivatives.
//!
//! With the singular values `σ` of the Jacobian `J` of a map, it is
//! `σ₁² + σ₂² + 1/σ₁² + 1/σ₂²`, so at least 4, which isometries have; it grows without bound
//! towards a collapse. As a sum of `f(σ) = σ² + 1/σ²` over both, its Hessian in `J` has four
//! known eigenvectors `(u₁v₁ᵀ, u₂v₂ᵀ, (u₂v₁ᵀ ∓ u₁v₂ᵀ)/√2)`.

/// The Jacobian `J[i][j] = ∂uᵢ/∂xⱼ` of a map of the plane.
pub(super) type Jacobian = [[f64; 2]; 2];

/// `|J|²`, the sum of the squared singular values.
pub(super) fn squared_norm(j: &Jacobian) -> f64 {
    j[0][0] * j[0][0] + j[0][1] * j[0][1] + j[1][0] * j[1][0] + j[1][1] * j[1][1]
}

/// `det J`.
pub(super) fn determinant(j: &Jacobian) -> f64 {
    j[0][0] * j[1][1] - j[0][1] * j[1][0]
}

/// Gradient and Hessian at a Jacobian, as they are summed up.
pub(super) struct Derivatives {
    /// `∂E/∂J`.
    pub(super) gradient: Jacobian,
    /// The Hessian as `Σ λ M Mᵀ` over orthonormal matrices `M`; `λ` is never negative: the
    /// one that can be is raised to 0.
    pub(super) modes: [(f64, Jacobian); 4],
}

/// The derivatives of the energy at a Jacobian of positive determinant.
pub(super) fn derivatives(j: &Jacobian) -> Derivatives {
    let Decomposition {
        left: [u1, u2],
        right: [v1, v2],
        values: [s1, s2],
    } = Decomposition::of(j);
    let outer = |u: [f64; 2], v: [f64; 2]| [[u[0] * v[0], u[0] * v[1]], [u[1] * v[0], u[1] * v[1]]];
    let combine = |a: f64, m: Jacobian, b: f64, n: Jacobian| {
        [0, 1].map(|i| [0, 1].map(|k| a * m[i][k] + b * n[i][k]))
    };
    let slope = |s: f64| 2.0 * (s - s.powi(-3));
    let curvature = |s: f64| 2.0 + 6.0 * s.powi(-4);
    let (first, second) = (outer(u1, v1), outer(u2, v2));
    let (lower, upper) = (outer(u2, v1), outer(u1, v2));
    let cubed = (s1 * s2).powi(3);
    let (squares, product) = (s1 * s1 + s2 * s2, s1 * s2);
    let twist = 2.0 - 2.0 * (squares - product) / cubed;
    let flip = 2.0 + 2.0 * (squares + product) / cubed;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    Derivatives {
        gradient: combine(slope(s1), first, slope(s2), second),
        modes: [
            (curvature(s1), first),
            (curvature(s2), second),
            (twist.max(0.0), combine(half, lower, -half, upper)),
            (flip, combine(half, lower, half, upper)),
        ],
    }
}

/// `J = U diag(σ) Vᵀ` with rotations `U` and `V`, by their columns.
struct Decomposition {
    left: [[f64; 2]; 2],
    right: [[f64; 2]; 2],
    /// The larger first.
    values: [f64; 2],
}

impl Decomposition {
    /// Of a Jacobian of positive determinant: the sum of a rotation by `turn` and a reflection,
    /// each times a factor.
    fn of(j: &Jacobian) -> Self {
        let rotation = [0.5 * (j[0][0] + j[1][1]), 0.5 * (j[1][0] - j[0][1])];
        let reflection = [0.5 * (j[0][0] - j[1][1]), 0.5 * (j[1][0] + j[0][1])];
        let (turn, turning) = unit(rotation);
        let (mirror, mirroring) = unit(reflection);
        let left = half_angle(product(turn, mirror));
        let right = product(left, [turn[0], -turn[1]]);
        let largest = turning + mirroring;
        Self {
            left: [left, [-left[1], left[0]]],
            right: [right, [-right[1], right[0]]],
            values: [largest, determinant(j) / largest],
        }
    }
}

/// The direction of a vector and its length; along the first axis if it has none.
fn unit([x, y]: [f64; 2]) -> ([f64; 2], f64) {
    let length = (x * x + y * y).sqrt();
    if length > 0.0 {
        ([x / length, y / length], length)
    } else {
        ([1.0, 0.0], 0.0)
    }
}

/// The unit vector at the sum of the angles of two.
fn product(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// The unit vector at half the angle of one, of the sum with the first axis or, if they are
/// nearly opposite, of that with the second.
fn half_angle([x, y]: [f64; 2]) -> [f64; 2] {
    let sum = if x > -0.5 { [1.0 + x, y] } else { [y, 1.0 - x] };
    unit(sum).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn energy(j: &Jacobian) -> f64 {
        squared_norm(j) * (1.0 + determinant(j).powi(-2))
    }

    fn gradient(j: &Jacobian) -> Jacobian {
        derivatives(j).gradient
    }

    /// Jacobians of all shapes and orientations, singular values between 0.05 and 3.
    fn jacobians() -> Vec<Jacobian> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut next = || random.random_range(-1.0..1.0);
        let mut found = vec![[[1.0, 0.0], [0.0, 1.0]], [[2.0, 0.0], [0.0, 0.1]]];
        while found.len() < 200 {
            let j = [[2.0 * next(), next()], [next(), 2.0 * next()]];
            if determinant(&j) > 0.05 {
                found.push(j);
            }
        }
        found
    }

    fn moved(j: &Jacobian, by: f64, towards: &Jacobian) -> Jacobian {
        [0, 1].map(|i| [0, 1].map(|k| j[i][k] + by * towards[i][k]))
    }

    fn product(a: &Jacobian, b: &Jacobian) -> f64 {
        (0..4).map(|i| a[i / 2][i % 2] * b[i / 2][i % 2]).sum()
    }

    #[test]
    fn the_decomposition_gives_the_matrix_back() {
        for j in jacobians() {
            let d = Decomposition::of(&j);
            for entry in 0..4 {
                let (i, k) = (entry / 2, entry % 2);
                let product = |m: usize| d.left[m][i] * d.values[m] * d.right[m][k];
                assert!((product(0) + product(1) - j[i][k]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        for j in jacobians() {
            let gradient = gradient(&j);
            for i in 0..4 {
                let mut unit = [[0.0; 2]; 2];
                unit[i / 2][i % 2] = 1.0;
                let h = 1e-6;
                let difference =
                    (energy(&moved(&j, h, &unit)) - energy(&moved(&j, -h, &unit))) / (2.0 * h);
                let error = (difference - gradient[i / 2][i % 2]).abs();
                assert!(error < 1e-6 * (1.0 + energy(&j).powi(2)), "{j:?}: {error}");
            }
        }
    }

    /// The modes are the eigenvectors of the Hessian: along each, the gradient changes by the
    /// eigenvalue times the mode, but for the twist where it is negative.
    #[test]
    fn the_modes_are_those_of_finite_differences() {
        let mut clamped = 0;
        for j in jacobians() {
            let scale = energy(&j).powi(2);
            for (eigenvalue, mode) in derivatives(&j).modes {
                assert!((product(&mode, &mode) - 1.0).abs() < 1e-12);
                let h = 1e-6;
                let (ahead, behind) = (
                    gradient(&moved(&j, h, &mode)),
                    gradient(&moved(&j, -h, &mode)),
                );
                let change = moved(&ahead, -1.0, &behind).map(|row| row.map(|c| c / (2.0 * h)));
                if eigenvalue == 0.0 {
                    clamped += 1;
                    assert!(product(&change, &mode) < 1e-6 * scale);
                    continue;
                }
                let error = moved(&change, -eigenvalue, &mode);
                assert!(product(&error, &error).sqrt() < 1e-6 * scale, "{j:?}");
            }
        }
        assert!(clamped > 10);
    }

    #[test]
    fn isometries_are_minima() {
        let (sin, cos) = 0.7_f64.sin_cos();
        let j = [[cos, -sin], [sin, cos]];
        assert!((energy(&j) - 4.0).abs() < 1e-14);
        assert!(gradient(&j).iter().flatten().all(|g| g.abs() < 1e-14));
    }
}
