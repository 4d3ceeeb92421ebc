//! The energy of a map of many triangles.

use super::rest::RestShapes;
use super::symmetric_dirichlet::{Jacobian, determinant, squared_norm};

/// The integrals that make up the energy of a map: of `σ₁² + σ₂²`, and of `1/σ₁² + 1/σ₂²`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Integrals {
    dirichlet: f64,
    inverse: f64,
}

impl Integrals {
    /// Of a map given by the UVs of the vertices; the second is infinite where a triangle is
    /// flipped or collapsed.
    pub(super) fn of(triangles: &[[u32; 3]], rest: &RestShapes, uv: &[[f64; 2]]) -> Self {
        let mut sum = Self {
            dirichlet: 0.0,
            inverse: 0.0,
        };
        for (t, corners) in triangles.iter().enumerate() {
            let jacobian = jacobian(rest, t, corners.map(|v| uv[v as usize]));
            let determinant = determinant(&jacobian);
            let dirichlet = rest.area(t) * squared_norm(&jacobian);
            sum.dirichlet += dirichlet;
            sum.inverse += if determinant > 0.0 {
                dirichlet / (determinant * determinant)
            } else {
                f64::INFINITY
            };
        }
        sum
    }

    /// The energy at the scale that the map has.
    pub(super) fn energy(&self) -> f64 {
        self.dirichlet + self.inverse
    }

    /// The mean energy over an area at the best scale `s`: the minimum of `s² D + I / s²`.
    pub(super) fn mean(&self, area: f64) -> f64 {
        2.0 * self.dirichlet.sqrt() * (self.inverse.sqrt() / area)
    }

    /// The scale by which the map has the least energy.
    pub(super) fn best_scale(&self) -> f64 {
        (self.inverse / self.dirichlet).sqrt().sqrt()
    }
}

/// The Jacobian of the map of triangle `t` from its rest shape to given corners.
pub(super) fn jacobian(rest: &RestShapes, t: usize, [a, b, c]: [[f64; 2]; 3]) -> Jacobian {
    let [_, g1, g2] = rest.gradients(t);
    [0, 1].map(|i| {
        let (e1, e2) = (b[i] - a[i], c[i] - a[i]);
        [0, 1].map(|k| e1 * g1[k] + e2 * g2[k])
    })
}

/// The mean symmetric Dirichlet energy of a map at its best uniform scale; infinite where a
/// triangle is flipped or collapsed. `uv` must reach as far as the vertices.
pub(crate) fn mean_energy(triangles: &[[u32; 3]], rest: &RestShapes, uv: &[[f64; 2]]) -> f64 {
    Integrals::of(triangles, rest, uv).mean(rest.total_area())
}

/// The energy of triangle `t` mapped to given corners, times its area; infinite where it is
/// flipped or collapsed.
pub(crate) fn energy_of(rest: &RestShapes, t: usize, corners: [[f64; 2]; 3]) -> f64 {
    let jacobian = jacobian(rest, t, corners);
    let determinant = determinant(&jacobian);
    if determinant > 0.0 {
        rest.area(t) * squared_norm(&jacobian) * (1.0 + 1.0 / (determinant * determinant))
    } else {
        f64::INFINITY
    }
}
