use crate::vector::{dot, sub};

use super::layout::Layout;

/// The mean over all corners of `|3D angle − UV angle|`, in radians.
///
/// A corner at a UV edge of zero length has the UV angle 0.
pub(super) fn conformality(layout: &Layout) -> f64 {
    let (mut sum, mut corners) = (0.0, 0_usize);
    for t in layout.measured() {
        let p = layout.corners(t);
        let q = layout.uv_corners(t).map(|[u, v]| [u, v, 0.0]);
        for corner in 0..3 {
            let spatial = angle(p, corner, layout.double_area(t));
            let flat = angle(q, corner, layout.uv_double_area(t).abs());
            sum += (spatial - flat).abs();
        }
        corners += 3;
    }
    sum / corners as f64
}

fn angle(points: [[f64; 3]; 3], corner: usize, double_area: f64) -> f64 {
    let at = points[corner];
    let cosine = dot(
        sub(points[(corner + 1) % 3], at),
        sub(points[(corner + 2) % 3], at),
    );
    // Without this, the sign of a zero product would decide between 0 and π.
    if double_area == 0.0 && cosine == 0.0 {
        return 0.0;
    }
    double_area.atan2(cosine)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::angle;

    #[test]
    fn an_edge_of_zero_length_has_the_angle_zero() {
        let points = [[0.0; 3], [0.0; 3], [-1.0; 3]];
        for corner in 0..3 {
            assert_eq!(angle(points, corner, 0.0), 0.0);
        }
        let straight = [[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        assert_eq!(angle(straight, 0, 0.0), 0.0);
        assert_eq!(angle(straight, 1, 0.0), PI);
    }
}
