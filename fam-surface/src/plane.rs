//! Planes that fit points, and axes along them.

use super::vector::{add, cross, normalize, scale, sub};

/// A plane in space.
pub struct Plane {
    /// A point on it.
    pub centre: [f64; 3],
    /// Its unit normal.
    pub normal: [f64; 3],
}

impl Plane {
    /// The plane with the least sum of weighted squared distances.
    pub fn fit(weighted: impl Iterator<Item = ([f64; 3], f64)> + Clone) -> Self {
        let total: f64 = weighted.clone().map(|(_, w)| w).sum();
        let sum = weighted
            .clone()
            .fold([0.0; 3], |sum, (p, w)| add(sum, scale(p, w)));
        let centre = scale(sum, 1.0 / total);
        let mut moments = [[0.0; 3]; 3];
        for (p, w) in weighted {
            let d = sub(p, centre);
            for i in 0..3 {
                moments[i] = add(moments[i], scale(d, w * d[i]));
            }
        }
        Self {
            centre,
            normal: least_axis(moments),
        }
    }
}

/// A unit eigenvector of the least eigenvalue of a symmetric matrix.
pub(crate) fn least_axis(m: [[f64; 3]; 3]) -> [f64; 3] {
    let (axes, values) = eigenvectors(m);
    let least = (0..3).fold(0, |i, k| if values[k] < values[i] { k } else { i });
    axes[least]
}

/// Unit eigenvectors of a symmetric matrix.
pub(crate) fn axes(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    eigenvectors(m).0
}

/// Unit eigenvectors of a symmetric matrix and their eigenvalues, by Jacobi's rotations.
fn eigenvectors(mut m: [[f64; 3]; 3]) -> ([[f64; 3]; 3], [f64; 3]) {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..5 {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            if m[i][j] == 0.0 {
                continue;
            }
            let cotangent = (m[j][j] - m[i][i]) / (2.0 * m[i][j]);
            let tangent = cotangent.signum() / (cotangent.abs() + (cotangent.powi(2) + 1.0).sqrt());
            let c = 1.0 / (tangent * tangent + 1.0).sqrt();
            let s = tangent * c;
            for row in &mut m {
                (row[i], row[j]) = (c * row[i] - s * row[j], s * row[i] + c * row[j]);
            }
            let (a, b) = (m[i], m[j]);
            m[i] = sub(scale(a, c), scale(b, s));
            m[j] = add(scale(a, s), scale(b, c));
            let (a, b) = (axes[i], axes[j]);
            axes[i] = sub(scale(a, c), scale(b, s));
            axes[j] = add(scale(a, s), scale(b, c));
        }
    }
    (axes.map(normalize), [0, 1, 2].map(|k| m[k][k]))
}

/// Two axes for a unit normal, and the normal; only zeros for a normal of zero.
pub fn frame(normal: [f64; 3]) -> [[f64; 3]; 3] {
    let least = (0..3).fold(0, |i, k| {
        if normal[k].abs() < normal[i].abs() {
            k
        } else {
            i
        }
    });
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let first = normalize(cross(axis, normal));
    [first, cross(normal, first), normal]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::dot;

    /// A matrix with the eigenvalues 1, 2 and 5 along a rotated frame.
    #[test]
    fn the_least_axis_is_the_eigenvector_of_the_least_eigenvalue() {
        let least = normalize([1.0, -2.0, 0.5]);
        let [a, b, _] = frame(least);
        let m = [0, 1, 2].map(|i| {
            [0, 1, 2].map(|j| least[i] * least[j] + 2.0 * a[i] * a[j] + 5.0 * b[i] * b[j])
        });
        assert!(dot(least_axis(m), least).abs() > 1.0 - 1e-12);
    }
}
