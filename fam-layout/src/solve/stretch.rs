//! The linear part of a map's distortion.

use super::energy::jacobian;
use super::orientation::first_flipped;
use super::rest::RestShapes;

/// Maps the plane linearly so that a map stretches alike in all directions on average, and by
/// 1: what is long and thin need not become so in many small steps. Orientation is kept.
///
/// That is by `S^(−1/2)`, with the area mean `S` of `J Jᵀ`. Nothing is moved where `S` is
/// singular, or where a triangle would flip by rounding.
pub(crate) fn even_out(triangles: &[[u32; 3]], rest: &RestShapes, uv: &mut [[f64; 2]]) {
    let (mut a, mut b, mut d) = (0.0, 0.0, 0.0);
    let total = rest.total_area();
    for (t, corners) in triangles.iter().enumerate() {
        let [u, v] = jacobian(rest, t, corners.map(|v| uv[v as usize]));
        let area = rest.area(t) / total;
        a += area * (u[0] * u[0] + u[1] * u[1]);
        b += area * (u[0] * v[0] + u[1] * v[1]);
        d += area * (v[0] * v[0] + v[1] * v[1]);
    }
    // √S = (S + √det S) / √(tr S + 2 √det S), whose inverse is its adjugate over √det S.
    let root = (a * d - b * b).max(0.0).sqrt();
    let factor = 1.0 / (root * (a + d + 2.0 * root).sqrt());
    let map = [[d + root, -b], [-b, a + root]].map(|row| row.map(|c| c * factor));
    if map.iter().flatten().all(|c| c.is_finite()) {
        let even: Vec<[f64; 2]> = uv
            .iter()
            .map(|q| map.map(|row| row[0] * q[0] + row[1] * q[1]))
            .collect();
        if first_flipped(triangles, &even).is_none() {
            uv.copy_from_slice(&even);
        }
    }
}

/// Stretches a map along both axes by the factors at which its symmetric Dirichlet energy is least.
///
/// With the rows `u` and `v` of `J`, `‖J‖² = |u|² + |v|²` and `‖J⁻¹‖² = (|u|² + |v|²) / det² J`. So the
/// energy is a sum of `α² P + R / α²` and `β² Q + S / β²` for factors `α` and `β`. Nothing is moved where
/// these are no numbers, or where a triangle would flip by rounding.
pub(crate) fn even_out_axes(triangles: &[[u32; 3]], rest: &RestShapes, uv: &mut [[f64; 2]]) {
    let (mut along, mut inverse) = ([0.0; 2], [0.0; 2]);
    for (t, corners) in triangles.iter().enumerate() {
        let [u, v] = jacobian(rest, t, corners.map(|v| uv[v as usize]));
        let determinant = u[0] * v[1] - u[1] * v[0];
        let squares = [u, v].map(|row| rest.area(t) * (row[0] * row[0] + row[1] * row[1]));
        for k in 0..2 {
            along[k] += squares[k];
            inverse[k] += squares[1 - k] / (determinant * determinant);
        }
    }
    let factors = [0, 1].map(|k| (inverse[k] / along[k]).sqrt().sqrt());
    if factors.iter().all(|f| f.is_finite() && *f > 0.0) {
        let even: Vec<[f64; 2]> = uv
            .iter()
            .map(|q| [0, 1].map(|k| factors[k] * q[k]))
            .collect();
        if first_flipped(triangles, &even).is_none() {
            uv.copy_from_slice(&even);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn a_linear_map_becomes_an_isometry() {
        let sheet = shapes::rectangle(2.0, 0.5, 5, 3);
        let corners: Vec<_> = (0..30).map(|t| sheet.corners(t)).collect();
        let rest = RestShapes::new(&corners, None);
        for map in [
            [[1.0, 0.0], [0.0, 1.0]],
            [[3.0, 1.0], [-0.5, 40.0]],
            [[1e-3, -7.0], [2.0, 1.0]],
        ] {
            let mut uv: Vec<[f64; 2]> = sheet
                .positions()
                .iter()
                .map(|p| map.map(|row: [f64; 2]| row[0] * p[0] + row[1] * p[1]))
                .collect();
            even_out(sheet.triangles(), &rest, &mut uv);
            for t in 0..30 {
                let [a, b] = jacobian(&rest, t, sheet.triangles()[t].map(|v| uv[v as usize]));
                let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
                for (found, expected) in [(dot(a, a), 1.0), (dot(b, b), 1.0), (dot(a, b), 0.0)] {
                    assert!((found - expected).abs() < 1e-9, "{found}");
                }
                assert!(a[0] * b[1] - a[1] * b[0] > 0.0);
            }
        }
    }

    #[test]
    fn what_has_no_extent_stays_where_it_is() {
        let sheet = shapes::rectangle(1.0, 1.0, 1, 1);
        let corners: Vec<_> = (0..2).map(|t| sheet.corners(t)).collect();
        let rest = RestShapes::new(&corners, None);
        let mut uv = vec![[0.5; 2]; 4];
        even_out(sheet.triangles(), &rest, &mut uv);
        assert_eq!(uv, [[0.5; 2]; 4]);
    }
}
