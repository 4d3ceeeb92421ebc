//! Squared distances from planes.

use fam_surface::vector::{cross, dot, length, scale, sub};

/// A sum of squared distances from planes, each times an area.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Quadric {
    /// The products of normals: `xx`, `xy`, `xz`, `yy`, `yz`, `zz`.
    square: [f64; 6],
    linear: [f64; 3],
    constant: f64,
}

impl Quadric {
    /// From the plane of a triangle, with its area.
    pub(super) fn of_triangle([a, b, c]: [[f64; 3]; 3]) -> (Self, f64) {
        let normal = cross(sub(b, a), sub(c, a));
        let doubled = length(normal);
        if doubled > 0.0 {
            let unit = scale(normal, doubled.recip());
            (Self::of_plane(unit, a, 0.5 * doubled), 0.5 * doubled)
        } else {
            (Self::default(), 0.0)
        }
    }

    /// From two planes through the line of an edge, whichever they are, together the distance
    /// from that line.
    pub(super) fn of_side([a, b]: [[f64; 3]; 2], weight: f64) -> Self {
        let side = sub(b, a);
        let size = length(side);
        let mut sum = Self::default();
        if size > 0.0 {
            let along = scale(side, size.recip());
            let least = (0..3).min_by(|&i, &k| along[i].abs().total_cmp(&along[k].abs()));
            let mut axis = [0.0; 3];
            axis[least.unwrap_or(0)] = 1.0;
            let across = cross(along, axis);
            let one = scale(across, length(across).recip());
            for normal in [one, cross(along, one)] {
                sum.add(&Self::of_plane(normal, a, weight * size * size));
            }
        }
        sum
    }

    fn of_plane(normal: [f64; 3], point: [f64; 3], weight: f64) -> Self {
        let [x, y, z] = normal;
        let offset = dot(normal, point);
        Self {
            square: [x * x, x * y, x * z, y * y, y * z, z * z].map(|c| weight * c),
            linear: scale(normal, -weight * offset),
            constant: weight * offset * offset,
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (a, b) in self.square.iter_mut().zip(other.square) {
            *a += b;
        }
        for (a, b) in self.linear.iter_mut().zip(other.linear) {
            *a += b;
        }
        self.constant += other.constant;
    }

    /// The sum for a point.
    pub(super) fn at(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.square;
        let squares = x * x * xx + y * y * yy + z * z * zz;
        let products = x * y * xy + x * z * xz + y * z * yz;
        squares + 2.0 * (products + dot(self.linear, [x, y, z])) + self.constant
    }
}
