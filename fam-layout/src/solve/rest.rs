//! The shape and size that every triangle would have without distortion.

use fam_surface::vector::{cross, dot, length, scale, sub};

/// Heights below this share of the longest edge are raised to it.
const LEAST_HEIGHT: f64 = 1e-5;

/// Triangles whose longest edge is below this share of the side of a square of unit area
/// become equilateral, with such an edge.
const LEAST_EDGE: f64 = 1e-7;

/// Triangles laid flat one by one, at a scale at which a given area is 1.
///
/// Every one has a positive area: slivers and collapsed triangles are made as thick as can
/// still be told from nothing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RestShapes {
    /// Per triangle the gradients of the barycentric coordinates of its corners 1 and 2.
    gradients: Vec<[[f64; 2]; 2]>,
    areas: Vec<f64>,
}

impl RestShapes {
    /// From the 3D corners of the triangles, which must be finite. `unit` is the area (in
    /// squared units of the input) that counts as 1: that of all of them if there is none.
    pub(crate) fn new(corners: &[[[f64; 3]; 3]], unit: Option<f64>) -> Self {
        let extent = corners
            .iter()
            .flat_map(|&[a, b, c]| [sub(b, a), sub(c, a)])
            .flatten()
            .fold(0.0, |extent: f64, side| extent.max(side.abs()));
        let extent = if extent > 0.0 { extent } else { 1.0 };
        let sides: Vec<Sides> = corners.iter().map(|&c| Sides::of(c, extent)).collect();
        let total: f64 = sides.iter().map(|s| 0.5 * s.base * s.height).sum();
        let unit = unit.map_or(total, |unit| unit / extent / extent);
        let scale = if unit > 0.0 && unit.is_finite() {
            unit.sqrt().recip()
        } else {
            1.0
        };
        let (gradients, areas) = sides.iter().map(|s| s.rest(scale)).unzip();
        Self { gradients, areas }
    }

    /// The shapes of some of the triangles, in the order of their numbers in `triangles`.
    pub(crate) fn subset(&self, triangles: &[u32]) -> Self {
        let chosen = triangles.iter().map(|&t| t as usize);
        Self {
            gradients: chosen.clone().map(|t| self.gradients[t]).collect(),
            areas: chosen.map(|t| self.areas[t]).collect(),
        }
    }

    /// The same shapes in other sizes, every triangle by a factor of its own. The energy of each
    /// counts alike, as if it had the mean area.
    pub(crate) fn resized(&self, factors: &[f64]) -> Self {
        let gradients = self.gradients.iter().zip(factors);
        let gradients = gradients.map(|(pair, factor)| pair.map(|g| g.map(|c| c / factor)));
        Self {
            gradients: gradients.collect(),
            areas: vec![self.total_area() / self.areas.len() as f64; self.areas.len()],
        }
    }

    /// How many triangles there are.
    pub(crate) fn len(&self) -> usize {
        self.areas.len()
    }

    /// The area of triangle `t`.
    pub(crate) fn area(&self, t: usize) -> f64 {
        self.areas[t]
    }

    /// The sum of all areas.
    pub(crate) fn total_area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// The gradients of the barycentric coordinates of the three corners of triangle `t`.
    pub(crate) fn gradients(&self, t: usize) -> [[f64; 2]; 3] {
        let [g1, g2] = self.gradients[t];
        [[-g1[0] - g2[0], -g1[1] - g2[1]], g1, g2]
    }

    /// The corners of triangle `t` by itself in the plane, counter-clockwise, the first at the
    /// origin.
    pub(crate) fn corners(&self, t: usize) -> [[f64; 2]; 3] {
        // The sides are to the gradients as a matrix to its inverse.
        let [p, q] = self.gradients[t];
        let doubled_area = 2.0 * self.areas[t];
        let side = |s: [f64; 2]| s.map(|c| c * doubled_area);
        [[0.0; 2], side([q[1], -q[0]]), side([-p[1], p[0]])]
    }

    /// The length of the edge of triangle `t` from corner `c` to the next.
    pub(crate) fn edge_length(&self, t: usize, c: usize) -> f64 {
        // The gradient of the third corner is orthogonal to the edge, and of length
        // 1 / height.
        let [x, y] = self.gradients(t)[(c + 2) % 3];
        2.0 * self.areas[t] * x.hypot(y)
    }

    /// Half the cotangents of the angles of triangle `t` at its corners.
    pub(crate) fn half_cotangents(&self, t: usize) -> [f64; 3] {
        let g = self.gradients(t);
        [0, 1, 2].map(|c| {
            let (one, other) = (g[(c + 1) % 3], g[(c + 2) % 3]);
            -self.areas[t] * (one[0] * other[0] + one[1] * other[1])
        })
    }
}

/// A triangle over its longest edge.
struct Sides {
    /// The corner at which the longest edge begins.
    first: usize,
    base: f64,
    foot: f64,
    height: f64,
}

impl Sides {
    fn of(p: [[f64; 3]; 3], unit: f64) -> Self {
        let edge = |c: usize| scale(sub(p[(c + 1) % 3], p[c]), unit.recip());
        let lengths = [0, 1, 2].map(|c| length(edge(c)));
        let first = (0..3).fold(
            0,
            |best, c| if lengths[c] > lengths[best] { c } else { best },
        );
        let (base, along) = (lengths[first], edge(first));
        let across = scale(edge((first + 2) % 3), -1.0);
        let over = |value: f64| if base > 0.0 { value / base } else { 0.0 };
        Self {
            first,
            base,
            foot: over(dot(along, across)),
            height: over(length(cross(along, across))),
        }
    }

    /// The gradients of the coordinates of corners 1 and 2, and the area.
    fn rest(&self, scale: f64) -> ([[f64; 2]; 2], f64) {
        let (mut base, mut foot, mut height) =
            (self.base * scale, self.foot * scale, self.height * scale);
        if base < LEAST_EDGE {
            base = LEAST_EDGE;
            foot = 0.5 * base;
            height = 0.75_f64.sqrt() * base;
        }
        height = height.max(LEAST_HEIGHT * base);
        let end = [base.recip(), -foot / base / height];
        let apex = [0.0, height.recip()];
        let start = [-end[0], -end[1] - apex[1]];
        let mut gradients = [start, end, apex];
        gradients.rotate_right(self.first);
        ([gradients[1], gradients[2]], 0.5 * base * height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: [[f64; 3]; 3] = [[1.0, 2.0, 3.0], [1.0, 2.0, 7.0], [1.0, 5.0, 3.0]];

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12 * (1.0 + b.abs())
    }

    #[test]
    fn lengths_areas_and_angles_are_those_in_space() {
        for turn in 0..3 {
            let mut corners = RIGHT;
            corners.rotate_left(turn);
            let rest = RestShapes::new(&[corners], Some(1.0));
            assert!(close(rest.area(0), 6.0));
            for c in 0..3 {
                let of = (c + turn) % 3;
                assert!(close(rest.edge_length(0, c), [4.0, 5.0, 3.0][of]));
                let expected = 0.5 * [0.0, 4.0 / 3.0, 0.75][of];
                assert!(close(rest.half_cotangents(0)[c], expected));
            }
            let sum: [f64; 2] = [0, 1].map(|k| rest.gradients(0).iter().map(|g| g[k]).sum());
            assert!(sum[0].abs() < 1e-15 && sum[1].abs() < 1e-15);
        }
    }

    #[test]
    fn the_unit_is_the_whole_or_a_given_area() {
        let two = [RIGHT, RIGHT.map(|p| p.map(|x| 2.0 * x))];
        let whole = RestShapes::new(&two, None);
        assert!(close(whole.total_area(), 1.0));
        assert!(close(whole.area(0), 0.2));
        let part = RestShapes::new(&two, Some(60.0));
        assert!(close(part.total_area(), 0.5));
        assert_eq!(part.subset(&[1, 0, 1]).len(), 3);
        assert!(close(part.subset(&[1]).total_area(), 0.4));
    }

    #[test]
    fn a_resized_triangle_is_the_same_in_another_size() {
        let rest = RestShapes::new(&[RIGHT, RIGHT.map(|p| p.map(|x| 2.0 * x))], Some(1.0));
        let resized = rest.resized(&[3.0, 0.5]);
        for (t, factor) in [3.0, 0.5].into_iter().enumerate() {
            // Gradients are inverse to lengths.
            for (new, old) in resized.gradients(t).into_iter().zip(rest.gradients(t)) {
                assert!([0, 1].iter().all(|&k| close(factor * new[k], old[k])));
            }
            assert!(close(resized.area(t), 0.5 * rest.total_area()));
        }
    }

    #[test]
    fn every_triangle_has_a_positive_area_at_any_magnitude() {
        let shapes = [
            RIGHT,
            [RIGHT[0]; 3],
            [RIGHT[0], RIGHT[0], RIGHT[1]],
            [RIGHT[0], RIGHT[1], [1.0, 2.0, 4.0]],
            [RIGHT[0], RIGHT[1], [1.0, 2.0 + 1e-12, 4.0]],
        ];
        for magnitude in [1e-30, 1.0, 1e30, 1e150] {
            let corners: Vec<_> = shapes
                .iter()
                .map(|t| t.map(|p| p.map(|x| magnitude * x)))
                .collect();
            let rest = RestShapes::new(&corners, None);
            for t in 0..rest.len() {
                let lengths = [0, 1, 2].map(|c| rest.edge_length(t, c));
                let longest = lengths.iter().fold(0.0, |m: f64, l| m.max(*l));
                assert!(longest > 0.99 * LEAST_EDGE && longest.is_finite());
                let height = 2.0 * rest.area(t) / longest;
                assert!(height > 0.99 * LEAST_HEIGHT * longest, "{magnitude} {t}");
            }
        }
        let nothing = RestShapes::new(&[[[5.0; 3]; 3]], None);
        assert!(nothing.area(0) > 0.0);
        assert_eq!(RestShapes::new(&[], None).len(), 0);
    }
}
