//! Which parts of a surface are seen, and which are hidden: ambient occlusion.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};

use crate::TriangleMesh;
use crate::vector::{add, cross, dot, normalize, scale, sub};

/// Directions in one octant. With their mirror images they are 64, half of them on either side of
/// a surface, and a mirrored surface is seen in mirrored directions.
const IN_OCTANT: usize = 8;

/// How far before the surface rays start, in units of the longest side of what stands in the way:
/// more than the rounding of the input's positions (6e-8 where they are of 32 bits), so that a sheet
/// is not hidden by another at the same place.
const AWAY: f64 = 1e-6;

/// Components of normals are multiples of this, so that they do not depend on the order in which
/// triangles are summed up: normals of mirrored vertices are mirror images to the last bit.
const STEP: f64 = 1.0 / (1_u64 << 20) as f64;

/// The weight of a direction along the normal.
const WEIGHT: f64 = (1_u64 << 40) as f64;

/// What stands in the way of light: the triangles of meshes in one space.
pub struct Occluders {
    triangles: RTree<Occluder>,
    frame: Frame,
}

/// The corners of a triangle.
struct Occluder([[f64; 3]; 3]);

/// The frame in which rays are traced: the longest side of the bounding box is 1, its centre the
/// origin.
struct Frame {
    center: [f64; 3],
    half_unit: f64,
}

impl Occluders {
    /// All triangles of meshes. None hide nothing.
    pub fn of<'a>(meshes: impl IntoIterator<Item = &'a TriangleMesh>) -> Self {
        let meshes: Vec<&TriangleMesh> = meshes.into_iter().collect();
        let frame = Frame::of(&meshes);
        let corners = meshes
            .iter()
            .flat_map(|mesh| (0..mesh.triangles().len()).map(|t| mesh.corners(t)));
        let triangles = corners
            .map(|corners| Occluder(corners.map(|p| frame.place(p))))
            .collect();
        Self {
            triangles: RTree::bulk_load(triangles),
            frame,
        }
    }

    /// How visible every vertex of a mesh is, from 0 (hidden) to 1 (nothing in the way): the light that
    /// reaches it, as in an ambient occlusion map.
    ///
    /// Light comes from all directions alike, or with `up` (of any length) from those above the horizon
    /// only. It counts by the cosine of its angle to the normal, as a share of what would arrive from
    /// all sides if nothing were in the way. Of the two sides of the surface the one in more light counts, so that the
    /// orientation of triangles does not matter. Vertices of no triangle with an area have 0.
    ///
    /// The result is the same on every run and number of threads. A surface that is mirrored at a plane
    /// of the axes is as visible to the last bit. `goes_on` is asked for every vertex; where it says no,
    /// the result is `None`.
    pub fn visibility(
        &self,
        mesh: &TriangleMesh,
        up: Option<[f64; 3]>,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<f64>> {
        let directions = directions();
        // Only its direction counts, and no product overflows.
        let up = up.map(unit);
        let normals = normals(mesh, self.frame.half_unit);
        normals
            .par_iter()
            .zip(mesh.positions())
            .map(|(&normal, &at)| {
                let at = self.frame.place(at);
                goes_on().then(|| self.visibility_at(at, normal, &directions, up))
            })
            .collect()
    }

    fn visibility_at(
        &self,
        at: [f64; 3],
        normal: [f64; 3],
        directions: &[[f64; 3]],
        up: Option<[f64; 3]>,
    ) -> f64 {
        if normal == [0.0; 3] {
            return 0.0;
        }
        let sides = [AWAY, -AWAY].map(|away| add(at, scale(normal, away)));
        let (mut arrives, mut all) = ([0_u64; 2], [0_u64; 2]);
        for &direction in directions {
            let cosine = dot(normal, direction);
            let side = usize::from(cosine < 0.0);
            // Whole numbers, whose sum is the same in any order: that of a mirrored surface is another.
            let weight = (cosine.abs() * WEIGHT).round() as u64;
            all[side] += weight;
            let is_below = up.is_some_and(|up| dot(direction, up) <= 0.0);
            if !is_below && self.is_free(sides[side], direction) {
                arrives[side] += weight;
            }
        }
        let share = |side: usize| arrives[side] as f64 / all[side].max(1) as f64;
        share(0).max(share(1))
    }

    /// Whether nothing is hit from a point on.
    fn is_free(&self, from: [f64; 3], direction: [f64; 3]) -> bool {
        let ray = Ray { from, direction };
        let mut hits = self.triangles.locate_with_selection_function(ray);
        hits.next().is_none()
    }
}

impl RTreeObject for Occluder {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.0)
    }
}

/// A ray. No component of its direction is 0.
struct Ray {
    from: [f64; 3],
    direction: [f64; 3],
}

impl SelectionFunction<Occluder> for Ray {
    /// Whether it meets a box: the stretches that it has between the planes of opposite sides have a
    /// point in common.
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 3]>) -> bool {
        let (low, high) = (envelope.lower(), envelope.upper());
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let at = |plane: f64| (plane - self.from[k]) / self.direction[k];
            let (one, other) = (at(low[k]), at(high[k]));
            enters = enters.max(one.min(other));
            leaves = leaves.min(one.max(other));
        }
        enters <= leaves
    }

    /// Whether it meets a triangle (Möller and Trumbore, 1997).
    fn should_unpack_leaf(&self, Occluder([a, b, c]): &Occluder) -> bool {
        let (one, other) = (sub(*b, *a), sub(*c, *a));
        let across = cross(self.direction, other);
        let determinant = dot(one, across);
        let away = sub(self.from, *a);
        let u = dot(away, across) / determinant;
        let beside = cross(away, one);
        let v = dot(self.direction, beside) / determinant;
        // A triangle without area, or one that the ray lies in, gives NaN or infinity.
        let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        is_inside && dot(other, beside) / determinant > 0.0
    }
}

impl Frame {
    fn of(meshes: &[&TriangleMesh]) -> Self {
        let fold = |k: usize, f: fn(f64, f64) -> f64, start: f64| {
            let positions = meshes.iter().flat_map(|mesh| mesh.positions());
            positions.map(|p| p[k]).fold(start, f)
        };
        let low = [0, 1, 2].map(|k| 0.5 * fold(k, f64::min, f64::INFINITY));
        let high = [0, 1, 2].map(|k| 0.5 * fold(k, f64::max, f64::NEG_INFINITY));
        // Halves, so that no sum overflows.
        let half_unit = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        Self {
            center: add(low, high),
            half_unit: if half_unit > 0.0 { half_unit } else { 1.0 },
        }
    }

    fn place(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| (0.5 * p[k] - 0.5 * self.center[k]) / self.half_unit)
    }
}

/// A unit normal for every vertex, by the areas of its triangles; each is turned to the side of the
/// largest one. Zero where no triangle has an area.
fn normals(mesh: &TriangleMesh, half_unit: f64) -> Vec<[f64; 3]> {
    let half = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| (0.5 * q[k] - 0.5 * p[k]) / half_unit);
    let area_vectors: Vec<[f64; 3]> = (0..mesh.triangles().len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            cross(half(a, b), half(a, c))
        })
        .collect();
    // Of two as large one is chosen in the same way whichever comes first.
    let rank = |area: [f64; 3]| {
        let [x, y, z] = area.map(f64::abs);
        (dot(area, area), x, y, z)
    };
    let mut largest = vec![[0.0; 3]; mesh.positions().len()];
    let of_vertices = || mesh.triangles().iter().zip(&area_vectors);
    for (triangle, &area) in of_vertices() {
        for &v in triangle {
            let largest = &mut largest[v as usize];
            if rank(area) > rank(*largest) {
                *largest = area;
            }
        }
    }
    let mut sums = vec![[0.0; 3]; mesh.positions().len()];
    for (triangle, &area) in of_vertices() {
        for &v in triangle {
            let sum = &mut sums[v as usize];
            *sum = match dot(area, largest[v as usize]) < 0.0 {
                true => sub(*sum, area),
                false => add(*sum, area),
            };
        }
    }
    let rounded = |normal: [f64; 3]| normal.map(|c| (c / STEP).round() * STEP);
    sums.into_iter().map(|sum| rounded(unit(sum))).collect()
}

/// A vector of any length, even one whose square is out of range, as one of length 1; zero stays.
fn unit(vector: [f64; 3]) -> [f64; 3] {
    let greatest = vector.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    match greatest > 0.0 {
        true => normalize(vector.map(|c| c / greatest)),
        false => vector,
    }
}

/// Unit vectors, evenly over the sphere.
fn directions() -> Vec<[f64; 3]> {
    /// Turns by this share of the way round leave no gap for long.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let in_octant = |i: usize| {
        let z = (i as f64 + 0.5) / IN_OCTANT as f64;
        let angle = ((i as f64 + 0.5) * GOLDEN).fract() * FRAC_PI_2;
        let r = (1.0 - z * z).sqrt();
        [r * angle.cos(), r * angle.sin(), z]
    };
    let signs = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { 1.0 } else { -1.0 });
    (0..8)
        .flat_map(|octant| {
            (0..IN_OCTANT).map(move |i| {
                let (direction, signs) = (in_octant(i), signs(octant));
                [0, 1, 2].map(|k| signs[k] * direction[k])
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use crate::vector::length;

    fn visibility(mesh: &TriangleMesh, up: Option<[f64; 3]>) -> Vec<f64> {
        of(&Occluders::of([mesh]), mesh, up)
    }

    fn of(occluders: &Occluders, mesh: &TriangleMesh, up: Option<[f64; 3]>) -> Vec<f64> {
        occluders.visibility(mesh, up, &|| true).unwrap()
    }

    #[test]
    fn a_convex_surface_is_in_full_light_whichever_way_it_is_turned() {
        for mesh in [shapes::sphere(8), shapes::cube(3)] {
            assert!(visibility(&mesh, None).iter().all(|&l| l == 1.0));
            let inside_out = mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]);
            let turned = TriangleMesh::new(mesh.positions().to_vec(), inside_out.collect());
            assert!(visibility(&turned.unwrap(), None).iter().all(|&l| l == 1.0));
        }
    }

    /// At the middle of the ground of a pit with vertical walls, of half its width h and its depth d,
    /// light of the cosine law arrives from the directions that clear the rim.
    #[test]
    fn the_ground_of_a_pit_is_as_dark_as_its_walls_are_high() {
        let ground = |depth: f64| {
            // A long trench: two walls, and a ground whose middle line has vertices.
            let (half, long) = (1.0, 400.0);
            let mut positions = Vec::new();
            for x in [-half, 0.0, half] {
                positions.extend([[x, -long, 0.0], [x, 0.0, 0.0], [x, long, 0.0]]);
            }
            for x in [-half, half] {
                positions.extend([[x, -long, depth], [x, long, depth]]);
            }
            let mut triangles = Vec::new();
            for column in 0..2 {
                for row in 0..2 {
                    let a = 3 * column + row;
                    triangles.extend([[a, a + 3, a + 4], [a, a + 4, a + 1]]);
                }
            }
            triangles.extend([[0, 2, 10], [0, 10, 9], [6, 8, 12], [6, 12, 11]]);
            let mesh = TriangleMesh::new(positions, triangles).unwrap();
            // From below all is open; so only what is above is to count.
            visibility(&mesh, Some([0.0, 0.0, 1.0]))[4]
        };
        // Between two endless walls the share is the sine of the angle from the normal to the rim.
        for depth in [0.5, 1.0, 3.0] {
            let expected = 1.0 / 1.0_f64.hypot(depth);
            let found = ground(depth);
            assert!(
                (found - expected).abs() < 0.1,
                "{depth}: {found} {expected}"
            );
        }
        assert!(ground(3.0) < ground(1.0) && ground(1.0) < ground(0.5));
    }

    #[test]
    fn undersides_are_dark_where_light_comes_from_above() {
        let cube = shapes::cube(4);
        let up = [0.0, 0.0, 5.0];
        let (low, high) = cube
            .positions()
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                (low.min(p[2]), high.max(p[2]))
            });
        for (p, l) in cube.positions().iter().zip(visibility(&cube, Some(up))) {
            let is_inner = p[..2].iter().all(|c| *c > low && *c < high);
            if is_inner && p[2] == low {
                assert_eq!(l, 0.0);
            } else if is_inner && p[2] == high {
                assert_eq!(l, 1.0);
            } else if p[2] > low && p[2] < high {
                // Of a wall the upper half of the directions.
                assert!(l > 0.3 && l < 0.8, "{l}");
            }
        }
    }

    #[test]
    fn mirror_images_are_lit_alike_to_the_last_bit() {
        let mesh = shapes::double_torus(0.1);
        let mirrored = |axis: usize| {
            let positions = mesh.positions().iter().map(|&p| {
                let mut p = p;
                p[axis] = -p[axis];
                p
            });
            TriangleMesh::new(positions.collect(), mesh.triangles().to_vec()).unwrap()
        };
        let own = visibility(&mesh, None);
        assert!(own.iter().any(|&l| l < 0.7) && own.iter().any(|&l| l > 0.9));
        for axis in 0..3 {
            assert!(visibility(&mirrored(axis), None) == own, "{axis}");
        }
    }

    #[test]
    fn other_meshes_stand_in_the_way() {
        let sheet = shapes::rectangle(1.0, 1.0, 4, 4);
        let lid = |z: f64| {
            let place = |p: &[f64; 3]| [20.0 * p[0], 20.0 * p[1], z];
            let positions = sheet.positions().iter().map(place).collect();
            TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap()
        };
        let both = Occluders::of([&sheet, &lid(0.1), &lid(-0.1)]);
        assert!(of(&both, &sheet, None).iter().all(|&l| l < 0.1));
        let one = Occluders::of([&sheet, &lid(0.1)]);
        assert!(of(&one, &sheet, None).iter().all(|&l| l == 1.0));
        let none: [&TriangleMesh; 0] = [];
        assert!(
            of(&Occluders::of(none), &sheet, None)
                .iter()
                .all(|&l| l == 1.0)
        );
    }

    #[test]
    fn any_size_and_any_triangles_will_do() {
        let ball = shapes::sphere(4);
        for unit in [1e-200, 1e200, 1e308] {
            let place = |p: &[f64; 3]| p.map(|c| unit * c);
            let positions = ball.positions().iter().map(place).collect();
            let mesh = TriangleMesh::new(positions, ball.triangles().to_vec()).unwrap();
            assert!(visibility(&mesh, None).iter().all(|&l| l == 1.0), "{unit}");
        }
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let line = TriangleMesh::new(points, vec![[0, 1, 2]; 5_000]).unwrap();
        assert_eq!(visibility(&line, None), [0.0; 3]);
        let points = vec![[3.0; 3], [3.0; 3], [3.0; 3]];
        let point = TriangleMesh::new(points, vec![[0, 1, 2]]).unwrap();
        assert_eq!(visibility(&point, None), [0.0; 3]);
    }

    /// Boxes in boxes, each half as large, down to what rounds to nothing.
    #[test]
    fn surfaces_may_be_nested_deeply() {
        let cube = shapes::cube(1);
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for level in 0..200 {
            let first = positions.len() as u32;
            let place = |p: &[f64; 3]| p.map(|c| c * 0.5_f64.powi(level));
            positions.extend(cube.positions().iter().map(place));
            triangles.extend(cube.triangles().iter().map(|t| t.map(|v| first + v)));
        }
        let nested = TriangleMesh::new(positions, triangles).unwrap();
        assert!(
            visibility(&nested, None)
                .iter()
                .all(|l| (0.0..=1.0).contains(l))
        );
    }

    #[test]
    fn directions_are_even() {
        let directions = directions();
        assert_eq!(directions.len(), 64);
        assert!(directions.iter().all(|&d| (length(d) - 1.0).abs() < 1e-12));
        // Of every direction in space the nearest is near.
        let nearest = |to: [f64; 3]| directions.iter().map(|&d| dot(d, to)).fold(-1.0, f64::max);
        for p in shapes::sphere(12).positions() {
            assert!(nearest(normalize(*p)) > 0.88, "{p:?}");
        }
    }
}
