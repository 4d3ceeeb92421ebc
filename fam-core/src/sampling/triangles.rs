use rand::seq::index;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use fam_surface::degenerate::{double_area, rescaled};
use fam_surface::neighbors::nearest_others;
use fam_surface::orientation::{across, agree, turned};
use fam_surface::plane::frame;
use fam_surface::vector::{add, cross, dot, length, normalize, scale, sub};
use fam_surface::{Normalization, PointCloud, Surface, TriangleMesh};

/// Neighbours of a point of a cloud among which two make a triangle with it. Where most points have
/// none among the first number, as where a scanner's lines are far apart, it is the next.
const NEAR: [usize; 3] = [8, 32, 128];

/// Points of a cloud that triangles are made of, at most. Those of closer ones would be as small as
/// what points scatter by, and as the rounding of UVs.
const MOST_POINTS: usize = 200_000;

/// Twice the area of such a triangle over its longest edge squared; 0.87 if all edges are alike. A
/// flatter one says little about one of its two directions.
const LEAST_AREA: f64 = 0.3;

/// Height of a triangle, in radii of the surface, below which the rounding of UV coordinates (1e-7
/// of them, and more inside the networks) would show in its derivatives.
const LEAST_HEIGHT: f64 = 1e-3;

/// Normalised triangles along a surface, and what makes the derivative of a map of its values at
/// their corners.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Triangles {
    /// The first corner of each, the second, and the third; points in the unit ball.
    pub corners: [Vec<[f32; 3]>; 3],
    /// Of each the gradient of the function that is 1 at its second corner, 0 at the others, and
    /// linear between them; and of that for the third corner. They are given along two orthonormal
    /// directions of its plane, counter-clockwise as its corners are.
    pub gradients: [Vec<[f32; 2]>; 2],
}

/// Supplies the triangles on which the flattening of a surface is judged (ℓ_flat), fresh ones each
/// time.
///
/// Those of a mesh are its own, each as often as any other, whatever its area: whoever made the mesh
/// has put more of them where there is more to see, and whoever measures its UVs goes through the
/// triangles. As there, those without area are left out. Those of a cloud are made of a point and two
/// of those near it.
#[derive(Debug, Clone)]
pub enum TriangleSource {
    /// All that have an area.
    Mesh {
        /// In each part that edges hold together, most keep the orientation that they have.
        triangles: Vec<Triangle>,
        /// Whether neighbours are oriented alike.
        oriented: bool,
    },
    /// A cloud.
    Cloud(NearPoints),
}

/// A triangle of [`Triangles`].
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    corners: [[f32; 3]; 3],
    gradients: [[f32; 2]; 2],
}

/// The points of a cloud and those near each.
#[derive(Debug, Clone)]
pub struct NearPoints {
    points: Vec<[f32; 3]>,
    /// So many for each.
    count: usize,
    /// From near to far, point after point.
    near: Vec<u32>,
    /// Those that have a triangle.
    usable: Vec<u32>,
}

impl TriangleSource {
    /// `None` if no triangle of a mesh has an area, or no points of a cloud make one.
    pub fn new(surface: &Surface, normalization: &Normalization) -> Option<Self> {
        match surface {
            Surface::Mesh(mesh) => Self::of_mesh(mesh, normalization),
            Surface::PointCloud(cloud) => NearPoints::new(cloud, normalization).map(Self::Cloud),
        }
    }

    /// Whether neighbouring triangles are oriented alike: not those of clouds, nor of a Möbius strip.
    pub fn is_oriented(&self) -> bool {
        matches!(self, Self::Mesh { oriented: true, .. })
    }

    /// So many triangles, each drawn from all.
    pub fn draw(&self, count: usize, rng: &mut impl Rng) -> Triangles {
        let mut drawn = Triangles::default();
        for _ in 0..count {
            let triangle = match self {
                Self::Mesh { triangles, .. } => triangles[rng.random_range(0..triangles.len())],
                Self::Cloud(points) => points.triangle(rng),
            };
            for (all, corner) in drawn.corners.iter_mut().zip(triangle.corners) {
                all.push(corner);
            }
            for (all, gradient) in drawn.gradients.iter_mut().zip(triangle.gradients) {
                all.push(gradient);
            }
        }
        drawn
    }

    fn of_mesh(mesh: &TriangleMesh, normalization: &Normalization) -> Option<Self> {
        let positions = rescaled(mesh.positions());
        let triangles = mesh.triangles();
        let across = across(triangles);
        let turned = turned(triangles, &across);
        let oriented = agree(triangles, &across, &turned);
        let triangles: Vec<_> = triangles
            .iter()
            .zip(turned)
            .map(|(&[a, b, c], turned)| if turned { [a, c, b] } else { [a, b, c] })
            .filter_map(|corners| {
                let precise = corners.map(|v| positions[v as usize]);
                let [a, b, c] = precise;
                let corner = |v: u32| normalization.apply(mesh.positions()[v as usize]);
                (double_area(precise) > 0.0)
                    .then(|| Triangle::new(corners.map(corner), cross(sub(b, a), sub(c, a))))
            })
            .collect();
        (!triangles.is_empty()).then_some(Self::Mesh {
            triangles,
            oriented,
        })
    }
}

impl Triangle {
    /// With these corners and a normal of any length. A triangle too thin to be judged at its corners
    /// is judged in a small square in its middle.
    fn new(corners: [[f32; 3]; 3], normal: [f64; 3]) -> Self {
        let [a, b, c] = corners.map(|p| p.map(f64::from));
        let (ab, ac) = (sub(b, a), sub(c, a));
        let doubled = length(cross(ab, ac));
        let longest = [ab, ac, sub(c, b)]
            .map(length)
            .into_iter()
            .fold(0.0, f64::max);
        if doubled > LEAST_HEIGHT * longest {
            // a lies at the origin, and b on the first axis.
            let base = length(ab);
            let (along, height) = (dot(ac, ab) / base, doubled / base);
            return Self {
                corners,
                gradients: [[1.0 / base, -along / (base * height)], [0.0, 1.0 / height]]
                    .map(|g| g.map(|c| c as f32)),
            };
        }
        let middle = scale(add(add(a, b), c), 1.0 / 3.0);
        let [x, y, _] = frame(normalize(normal));
        let corner = |axis| add(middle, scale(axis, LEAST_HEIGHT)).map(|c| c as f32);
        let step = (1.0 / LEAST_HEIGHT) as f32;
        Self {
            corners: [corner([0.0; 3]), corner(x), corner(y)],
            gradients: [[step, 0.0], [0.0, step]],
        }
    }
}

impl NearPoints {
    /// `None` if none makes a triangle with those near it.
    fn new(cloud: &PointCloud, normalization: &Normalization) -> Option<Self> {
        let normalized = |&p| normalization.apply(p);
        let mut points: Vec<[f32; 3]> = cloud.points().iter().map(normalized).collect();
        // Equal ones would be each other's nearest.
        points.sort_unstable_by_key(|p| p.map(f32::to_bits));
        points.dedup();
        if points.len() > MOST_POINTS {
            let mut rng = Pcg64::seed_from_u64(0);
            let chosen = index::sample(&mut rng, points.len(), MOST_POINTS);
            points = chosen.iter().map(|i| points[i]).collect();
        }
        let others = points.len().saturating_sub(1);
        let mut found = None;
        for count in NEAR {
            let near = Self::among(&points, count.min(others));
            let enough = 2 * near.usable.len() >= points.len();
            found = Some(near).filter(|near| !near.usable.is_empty()).or(found);
            if enough || count >= others {
                break;
            }
        }
        found
    }

    fn among(points: &[[f32; 3]], count: usize) -> Self {
        let mut near = Self {
            near: match count {
                0 => Vec::new(),
                _ => nearest_others(points, count),
            },
            points: points.to_vec(),
            count,
            usable: Vec::new(),
        };
        let all = (0..points.len() as u32).into_par_iter();
        near.usable = all
            .filter(|&p| near.around(p).iter().any(|&q| near.with(p, q).is_some()))
            .collect();
        near
    }

    fn around(&self, p: u32) -> &[u32] {
        &self.near[p as usize * self.count..][..self.count]
    }

    /// Points p and q and the nearest to p that makes a good triangle with them.
    fn with(&self, p: u32, q: u32) -> Option<[u32; 3]> {
        let area = |r: u32| {
            let [p, q, r] = [p, q, r].map(|i| self.points[i as usize].map(f64::from));
            let edges = [sub(q, p), sub(r, p), sub(r, q)];
            let longest = edges.map(|e| dot(e, e)).into_iter().fold(0.0, f64::max);
            length(cross(edges[0], edges[1])) / longest.max(f64::MIN_POSITIVE)
        };
        let around = self.around(p).iter();
        around
            .copied()
            .find(|&r| area(r) >= LEAST_AREA)
            .map(|r| [p, q, r])
    }

    /// A point, one near it, and the one that fits these.
    fn triangle(&self, rng: &mut impl Rng) -> Triangle {
        let p = self.usable[rng.random_range(0..self.usable.len())];
        let around = self.around(p);
        let first = rng.random_range(0..around.len());
        let [a, b, c] = (0..around.len())
            .find_map(|i| self.with(p, around[(first + i) % around.len()]))
            .expect("usable points have a triangle")
            .map(|i| self.points[i as usize]);
        let [p, q, r] = [a, b, c].map(|p| p.map(f64::from));
        Triangle::new([a, b, c], cross(sub(q, p), sub(r, p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    fn normalization(surface: &Surface) -> Normalization {
        Normalization::of(surface.positions()).unwrap()
    }

    fn draw(surface: &Surface, count: usize) -> Triangles {
        let source = TriangleSource::new(surface, &normalization(surface)).unwrap();
        source.draw(count, &mut Pcg64::seed_from_u64(1))
    }

    /// The derivatives of a linear function of the corners' coordinates along the two directions of
    /// each triangle.
    fn derivatives(triangles: &Triangles, of: impl Fn([f64; 3]) -> f64) -> Vec<[f64; 2]> {
        let value = |corner: usize, t: usize| of(triangles.corners[corner][t].map(f64::from));
        let [second, third] = &triangles.gradients;
        let along = |t: usize| {
            [0, 1].map(|axis| {
                f64::from(second[t][axis]) * (value(1, t) - value(0, t))
                    + f64::from(third[t][axis]) * (value(2, t) - value(0, t))
            })
        };
        (0..second.len()).map(along).collect()
    }

    /// A linear function's derivatives along two orthonormal directions of a plane have the length of
    /// its gradient's part in it, and those of another at a right angle in it are turned against
    /// them by a right angle.
    #[test]
    fn gradients_are_those_along_orthonormal_directions() {
        let sphere = shapes::sphere(24);
        let cloud = PointCloud::new(sphere.positions().to_vec(), None).unwrap();
        for surface in [Surface::Mesh(sphere), Surface::PointCloud(cloud)] {
            let triangles = draw(&surface, 300);
            assert_eq!(triangles.gradients[1].len(), 300);
            for t in 0..300 {
                let [a, b, c] = [0, 1, 2].map(|k| triangles.corners[k][t].map(f64::from));
                let normal = normalize(cross(sub(b, a), sub(c, a)));
                let one = normalize(sub(c, b));
                let other = cross(normal, one);
                let [one, other] =
                    [one, other].map(|axis| derivatives(&triangles, |p| dot(p, axis))[t]);
                assert!((one[0].hypot(one[1]) - 1.0).abs() < 1e-3, "{one:?}");
                assert!((other[0] + one[1]).abs() < 1e-3 && (other[1] - one[0]).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn triangles_of_a_mesh_are_oriented_alike() {
        let sheet = shapes::rectangle(1.0, 1.0, 6, 5);
        let wound = |(t, &[a, b, c]): (usize, &[u32; 3])| match t % 7 {
            3 => [a, c, b],
            _ => [a, b, c],
        };
        let mixed = sheet.triangles().iter().enumerate().map(wound).collect();
        let mixed = TriangleMesh::new(sheet.positions().to_vec(), mixed).unwrap();
        let mixed = Surface::Mesh(mixed);
        let triangles = draw(&mixed, 300);
        for t in 0..300 {
            let [a, b, c] = [0, 1, 2].map(|k| triangles.corners[k][t].map(f64::from));
            assert!(cross(sub(b, a), sub(c, a))[2] > 0.0);
        }
        let is_oriented = |surface: &Surface| {
            TriangleSource::new(surface, &normalization(surface))
                .unwrap()
                .is_oriented()
        };
        assert!(is_oriented(&mixed));
        assert!(!is_oriented(&Surface::Mesh(shapes::moebius_strip(
            0.5, 40, 4
        ))));
        let cloud = PointCloud::new(mixed.positions().to_vec(), None).unwrap();
        assert!(!is_oriented(&Surface::PointCloud(cloud)));
    }

    /// Lines of points three of which fit between one line and the next, which the 8 nearest of a point
    /// do not reach, each point nine times, and a line far from all that makes no triangles.
    #[test]
    fn clouds_of_lines_and_of_equal_points_have_triangles() {
        let lines = (0..900).map(|i| [f64::from(i % 60), f64::from(i / 60) * 6.0, 0.0]);
        let alone = (0..200).map(|i| [f64::from(i) * 0.01, 500.0, 0.0]);
        let points: Vec<_> = lines.chain(alone).flat_map(|p| [p; 9]).collect();
        let cloud = Surface::PointCloud(PointCloud::new(points, None).unwrap());
        let triangles = draw(&cloud, 500);
        let far = normalization(&cloud).apply([0.0, 500.0, 0.0])[1];
        let mut seconds = triangles.corners[1].clone();
        seconds.sort_unstable_by_key(|p| p.map(f32::to_bits));
        seconds.dedup();
        assert!(seconds.len() > 200, "{} of 500", seconds.len());
        assert!(triangles.corners[0].iter().all(|p| p[1] < far - 0.1));
    }

    #[test]
    fn corners_of_a_cloud_are_near_points_of_it() {
        // A lattice, and each point more often than neighbours are looked at.
        let lattice = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]);
        let points: Vec<_> = lattice.flat_map(|p| [p; 130]).collect();
        let cloud = Surface::PointCloud(PointCloud::new(points.clone(), None).unwrap());
        let unit = normalization(&cloud);
        let different = points.iter().step_by(130);
        let normalized: Vec<_> = different.map(|&p| unit.apply(p)).collect();
        let triangles = draw(&cloud, 200);
        let spacing = 1.0 / unit.radius;
        for t in 0..200 {
            let corners = [0, 1, 2].map(|k| triangles.corners[k][t]);
            assert!(corners.iter().all(|p| normalized.contains(p)));
            let [a, b, c] = corners.map(|p| p.map(f64::from));
            assert!(length(sub(b, a)) < 2.1 * spacing && length(sub(c, a)) < 2.1 * spacing);
            assert!(length(cross(sub(b, a), sub(c, a))) > 0.9 * spacing * spacing);
        }
        // All of the 8 around a point are its second corner.
        let steps: std::collections::HashSet<[i32; 2]> = (0..200)
            .map(|t| {
                let [a, b] = [0, 1].map(|k| triangles.corners[k][t].map(f64::from));
                let step = sub(b, a).map(|c| (c / spacing).round() as i32);
                [step[0], step[1]]
            })
            .collect();
        assert!(steps.len() >= 8, "{steps:?}");
    }

    #[test]
    fn points_of_a_line_have_no_triangle() {
        let line = |i: u32| [f64::from(i), 0.0, 0.0];
        for points in [vec![line(0)], (0..50).map(line).collect()] {
            let cloud = PointCloud::new(points, None).unwrap();
            let normalization = Normalization {
                center: [0.0; 3],
                radius: 50.0,
            };
            assert!(TriangleSource::new(&Surface::PointCloud(cloud), &normalization).is_none());
        }
    }

    /// A square of which one half is a single triangle and the other a hundred, with one between
    /// them that has no area.
    #[test]
    fn every_triangle_of_a_mesh_is_as_likely() {
        let mut positions = vec![[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut triangles = vec![[0, 1, 2], [0, 1, 1]];
        positions.extend((0..=100).map(|i| [1.0, f64::from(i) / 100.0, 0.0]));
        triangles.extend((3..103).map(|i| [0, i, i + 1]));
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        let surface = Surface::Mesh(mesh);
        let drawn = draw(&surface, 10_100);
        let third = normalization(&surface).apply([0.0, 1.0, 0.0]);
        let large = drawn.corners[2].iter().filter(|&&c| c == third).count();
        // 100 of them, ± 10.
        assert!((50..150).contains(&large), "{large}");
    }

    /// Triangles too thin for 32 bits, as well: around their middle.
    #[test]
    fn thin_triangles_are_judged_in_their_middle() {
        let thin = TriangleMesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1e-6, 1e-6]],
            vec![[0, 1, 2]],
        )
        .unwrap();
        let surface = Surface::Mesh(thin);
        let triangles = draw(&surface, 1);
        let middle = normalization(&surface).apply([1.0 / 3.0, 0.0, 0.0]);
        for corner in &triangles.corners {
            let apart = sub(corner[0].map(f64::from), middle.map(f64::from));
            assert!(length(apart) < 2.0 * LEAST_HEIGHT);
        }
        for (axis, expected) in [([1.0, 0.0, 0.0], 1.0), ([0.0, -1.0, 1.0], 0.0)] {
            let [u, v] = derivatives(&triangles, |p| dot(p, axis))[0];
            assert!((u.hypot(v) - expected).abs() < 1e-3, "{u} {v}");
        }
        let [a, b, c] = [0, 1, 2].map(|k| triangles.corners[k][0].map(f64::from));
        let normal = normalize(cross(sub(b, a), sub(c, a)));
        assert!(dot(normal, normalize([0.0, -1.0, 1.0])) > 0.99);
    }
}
