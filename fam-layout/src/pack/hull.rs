//! The tightest boxes around a set of points.

use std::f64::consts::{FRAC_PI_2, PI};

use robust::{Coord, orient2d};

/// A rectangle around points: turning them by `-angle` makes it axis-parallel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnclosingBox {
    /// Angle of its first side to the x axis, in radians.
    pub angle: f64,
    /// Lengths of its sides.
    pub size: [f64; 2],
}

impl EnclosingBox {
    /// The side of the square around it.
    pub fn longer_side(&self) -> f64 {
        self.size[0].max(self.size[1])
    }

    fn area(&self) -> f64 {
        self.size[0] * self.size[1]
    }
}

/// The convex hull, counter-clockwise and without the points within its edges; a single point
/// or the two ends of a line where the points span no area.
pub fn convex_hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    // Adding 0 turns -0 into 0, which the order below tells apart.
    let mut sorted: Vec<[f64; 2]> = points.iter().map(|p| p.map(|c| c + 0.0)).collect();
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull = chain(sorted.iter());
    hull.pop();
    hull.extend(chain(sorted.iter().rev()));
    hull.pop();
    hull
}

/// The part of the hull that lies right of the way from the first point to the last.
fn chain<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> Vec<[f64; 2]> {
    let mut chain: Vec<[f64; 2]> = Vec::new();
    for &p in points {
        while let [.., a, b] = chain[..]
            && orient2d(coord(a), coord(b), coord(p)) <= 0.0
        {
            chain.pop();
        }
        chain.push(p);
    }
    chain
}

fn coord([x, y]: [f64; 2]) -> Coord<f64> {
    Coord { x, y }
}

/// The rectangle of least area and the square of least side around a convex hull; both
/// without extent for a point.
///
/// The least rectangle has a side along an edge of the hull. Between two directions of edges
/// the same points touch the rectangle and its sides are concave functions of the angle, so
/// the longer one is least at an end or where both are equal.
pub fn tightest(hull: &[[f64; 2]]) -> [EnclosingBox; 2] {
    if hull.len() < 2 {
        return [EnclosingBox::default(); 2];
    }
    let angles = edge_angles(hull);
    let ends = angles[1..].iter().copied().chain([angles[0] + FRAC_PI_2]);
    let mut touching = Touching::new(hull, angles[0]);
    let mut boxes: Option<[EnclosingBox; 2]> = None;
    for (&start, end) in angles.iter().zip(ends) {
        touching.turn_to(0.5 * (start + end));
        let equal = touching
            .angle_of_equal_sides()
            .filter(|angle| (start..end).contains(angle));
        for angle in [start].into_iter().chain(equal) {
            let found = touching.enclosing_box(angle);
            let [rectangle, square] = boxes.get_or_insert([found; 2]);
            if found.area() < rectangle.area() {
                *rectangle = found;
            }
            if found.longer_side() < square.longer_side() {
                *square = found;
            }
        }
    }
    boxes.unwrap_or_default()
}

/// The directions of the edges modulo a right angle, ascending.
fn edge_angles(hull: &[[f64; 2]]) -> Vec<f64> {
    let following = hull.iter().cycle().skip(1);
    let mut angles: Vec<f64> = hull
        .iter()
        .zip(following)
        .map(|(a, b)| (b[1] - a[1]).atan2(b[0] - a[0]).rem_euclid(FRAC_PI_2))
        .collect();
    angles.sort_unstable_by(f64::total_cmp);
    angles
}

/// The points of a hull that lie farthest in the four directions of a turning cross.
struct Touching<'a> {
    hull: &'a [[f64; 2]],
    farthest: [usize; 4],
}

impl<'a> Touching<'a> {
    fn new(hull: &'a [[f64; 2]], angle: f64) -> Self {
        let farthest = directions(angle).map(|direction| {
            let reach = |&i: &usize| dot(direction, hull[i]);
            (0..hull.len())
                .max_by(|i, j| reach(i).total_cmp(&reach(j)))
                .unwrap_or(0)
        });
        Self { hull, farthest }
    }

    /// Turns the cross counter-clockwise.
    fn turn_to(&mut self, angle: f64) {
        for (index, direction) in self.farthest.iter_mut().zip(directions(angle)) {
            for _ in 0..self.hull.len() {
                let next = (*index + 1) % self.hull.len();
                if dot(direction, self.hull[next]) <= dot(direction, self.hull[*index]) {
                    break;
                }
                *index = next;
            }
        }
    }

    /// From the point that touches one side to that on the opposite one, for both pairs.
    fn spans(&self) -> [[f64; 2]; 2] {
        let [right, top, left, bottom] = self.farthest.map(|i| self.hull[i]);
        [[left, right], [bottom, top]].map(|[a, b]| [b[0] - a[0], b[1] - a[1]])
    }

    fn enclosing_box(&self, angle: f64) -> EnclosingBox {
        let [along, across] = self.spans();
        let [x, y, ..] = directions(angle);
        EnclosingBox {
            angle,
            size: [dot(x, along), dot(y, across)],
        }
    }

    fn angle_of_equal_sides(&self) -> Option<f64> {
        let [along, across] = self.spans();
        let (cos, sin) = (along[0] - across[1], along[1] + across[0]);
        (cos != 0.0 || sin != 0.0).then(|| (-cos).atan2(sin).rem_euclid(PI))
    }
}

fn directions(angle: f64) -> [[f64; 2]; 4] {
    let (sin, cos) = angle.sin_cos();
    [[cos, sin], [-sin, cos], [-cos, -sin], [sin, -cos]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    fn turned(points: &[[f64; 2]], angle: f64) -> Vec<[f64; 2]> {
        let [x, y, ..] = directions(-angle);
        points.iter().map(|&p| [dot(x, p), dot(y, p)]).collect()
    }

    fn size(points: &[[f64; 2]]) -> [f64; 2] {
        [0, 1].map(|k| {
            let values = points.iter().map(|p| p[k]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        })
    }

    #[test]
    fn hull_of_a_lattice_is_its_corners() {
        let lattice: Vec<[f64; 2]> = (0..25)
            .map(|i| [f64::from(i % 5), f64::from(i / 5)])
            .collect();
        assert_eq!(
            convex_hull(&lattice),
            [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]
        );
    }

    #[test]
    fn points_and_lines_have_a_hull_and_a_box() {
        assert_eq!(convex_hull(&[]).len(), 0);
        assert_eq!(convex_hull(&[[1.0, 2.0]; 4]), [[1.0, 2.0]]);
        assert_eq!(tightest(&[]), [EnclosingBox::default(); 2]);
        let line: Vec<[f64; 2]> = (0..9)
            .map(|i| [3.0, 4.0].map(|c| c * f64::from(i)))
            .collect();
        let hull = convex_hull(&line);
        assert_eq!(hull, [[0.0, 0.0], [24.0, 32.0]]);
        let [rectangle, square] = tightest(&hull);
        assert!(rectangle.area() < 1e-12 && (rectangle.longer_side() - 40.0).abs() < 1e-12);
        assert!((square.longer_side() - 40.0 / 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn rectangle_that_was_turned_is_turned_back() {
        let rectangle = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        for step in 0..40 {
            let angle = f64::from(step) * 0.17;
            let points = turned(&rectangle, -angle);
            for found in tightest(&convex_hull(&points)) {
                let mut sides = size(&turned(&points, -found.angle));
                sides.sort_by(f64::total_cmp);
                assert!((sides[0] - 1.0).abs() < 1e-12 && (sides[1] - 2.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn boxes_are_no_larger_than_those_of_all_angles() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        for count in [3, 4, 5, 8, 30] {
            let stretch: f64 = random.random_range(0.1..1.0);
            let points: Vec<[f64; 2]> = (0..count)
                .map(|_| {
                    [
                        random.random_range(-1.0..1.0),
                        stretch * random.random_range(-1.0..1.0),
                    ]
                })
                .collect();
            let [rectangle, square] = tightest(&convex_hull(&points));
            for found in [rectangle, square] {
                let real = size(&turned(&points, -found.angle));
                assert!((0..2).all(|k| (real[k] - found.size[k]).abs() < 1e-12));
            }
            for step in 0..2000 {
                let [w, h] = size(&turned(&points, f64::from(step) * 1e-3));
                assert!(rectangle.area() <= w * h + 1e-12);
                assert!(square.longer_side() <= w.max(h) + 1e-12);
            }
        }
    }
}
