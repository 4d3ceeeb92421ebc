use crate::vector::{dot, sub};

use super::layout::Layout;

/// The mean over the surface of `σ₁² + σ₂² + 1/σ₁² + 1/σ₂²` at the uniform scale of the
/// UV map that minimises it, with the singular values `σ` of the map from a 3D triangle
/// to its UV triangle; infinite where a triangle is collapsed.
///
/// With the area integrals `D` of `σ₁² + σ₂²` and `I` of `1/σ₁² + 1/σ₂²`, the scale `s`
/// gives the energy `s²D + I/s²`, whose minimum is `2·√(D·I)`.
pub(super) fn symmetric_dirichlet(layout: &Layout) -> f64 {
    if layout.collapsed_triangles() > 0 {
        return f64::INFINITY;
    }
    let (mut area, mut dirichlet, mut inverse) = (0.0, 0.0, 0.0);
    for t in layout.measured() {
        let (double_area, uv_double_area) = (layout.double_area(t), layout.uv_double_area(t));
        let energy = dirichlet_energy(layout.corners(t), layout.uv_corners(t), double_area);
        area += 0.5 * double_area;
        dirichlet += energy;
        inverse += energy * (double_area / uv_double_area).powi(2);
    }
    2.0 * dirichlet.sqrt() * (inverse.sqrt() / area)
}

/// `σ₁² + σ₂²` of the affine map `p ↦ q`, times the area of the triangle `p`.
///
/// In the frame of the first edge, of length `l` under the height `h`, the two columns of
/// the Jacobian are `along / l` and `across / h`.
fn dirichlet_energy(p: [[f64; 3]; 3], q: [[f64; 2]; 3], double_area: f64) -> f64 {
    let base = sub(p[1], p[0]);
    let squared_length = dot(base, base);
    let foot = dot(sub(p[2], p[0]), base) / squared_length;
    let length_by_height = squared_length / double_area;
    let along = [q[1][0] - q[0][0], q[1][1] - q[0][1]];
    let across = [0, 1].map(|k| q[2][k] - q[0][k] - foot * along[k]);
    let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
    0.5 * (square(along) / length_by_height + square(across) * length_by_height)
}
