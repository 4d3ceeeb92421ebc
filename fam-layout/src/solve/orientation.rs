//! Which triangles are flipped, and when moving ones come to be.

use robust::{Coord, orient2d};

/// The first triangle that is not strictly counter-clockwise, decided exactly.
pub(crate) fn first_flipped(triangles: &[[u32; 3]], uv: &[[f64; 2]]) -> Option<usize> {
    triangles.iter().position(|t| is_flipped(t, uv))
}

/// How many triangles are not strictly counter-clockwise.
pub(crate) fn count_flipped(triangles: &[[u32; 3]], uv: &[[f64; 2]]) -> usize {
    triangles.iter().filter(|t| is_flipped(t, uv)).count()
}

fn is_flipped(triangle: &[u32; 3], uv: &[[f64; 2]]) -> bool {
    let [a, b, c] = triangle.map(|v| {
        let [x, y] = uv[v as usize];
        Coord { x, y }
    });
    let area = orient2d(a, b, c);
    area <= 0.0 || area.is_nan()
}

/// How far all vertices can move in their direction until the first triangle collapses;
/// infinite if none does.
pub(crate) fn longest_step(triangles: &[[u32; 3]], uv: &[[f64; 2]], direction: &[[f64; 2]]) -> f64 {
    triangles
        .iter()
        .map(|t| first_collapse(t.map(|v| uv[v as usize]), t.map(|v| direction[v as usize])))
        .fold(f64::INFINITY, f64::min)
}

/// The first positive time at which a counter-clockwise triangle that moves steadily has no
/// area: a root of a square polynomial. Infinite if there is none.
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn triangles_collapse_when_they_should() {
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let still = [0.0; 2];
        let moving = |apex: [f64; 2]| first_collapse(triangle, [still, still, apex]);
        assert_eq!(moving([0.0, -0.5]), 2.0);
        assert_eq!(moving([3.0, 0.0]), f64::INFINITY);
        assert_eq!(moving([3.0, 1.0]), f64::INFINITY);
        let shrinking = first_collapse(triangle, [still, [-0.25, 0.0], [0.0, -0.25]]);
        assert_eq!(shrinking, 4.0);
        assert_eq!(first_collapse(triangle, [still; 3]), f64::INFINITY);
    }

    /// Triangles are positive before that time, and right after it they are not.
    #[test]
    fn no_triangle_collapses_earlier() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut corners = || [[0.0; 2]; 3].map(|c| c.map(|_| random.random_range(-1.0..1.0)));
        let at = |p: [[f64; 2]; 3], v: [[f64; 2]; 3], t: f64| -> Vec<[f64; 2]> {
            std::iter::zip(p, v)
                .map(|(p, v)| [p[0] + t * v[0], p[1] + t * v[1]])
                .collect()
        };
        let mut collapsed = 0;
        for _ in 0..2000 {
            let (p, v) = (corners(), corners());
            if count_flipped(&[[0, 1, 2]], &p) > 0 {
                continue;
            }
            let time = first_collapse(p, v);
            let last = if time.is_finite() { time } else { 100.0 };
            for k in 0..20 {
                let early = at(p, v, last * (1.0 - 1e-6) * f64::from(k) / 19.0);
                assert_eq!(first_flipped(&[[0, 1, 2]], &early), None);
            }
            if time.is_finite() {
                collapsed += 1;
                let late = at(p, v, time * (1.0 + 1e-6));
                assert_eq!(first_flipped(&[[0, 1, 2]], &late), Some(0));
            }
        }
        assert!(collapsed > 100);
    }

    #[test]
    fn no_number_is_no_area() {
        let uv = [[0.0, 0.0], [1.0, f64::NAN], [0.0, 1.0]];
        assert_eq!(first_flipped(&[[0, 1, 2]], &uv), Some(0));
    }
}
