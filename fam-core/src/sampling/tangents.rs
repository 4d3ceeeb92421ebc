use rand::{Rng, RngExt};

use crate::neighbors::nearest_others;
use crate::surface::degenerate::{double_area, rescaled};
use crate::surface::plane::{Plane, frame};
use crate::surface::vector::{add, cross, normalize, scale, sub};
use crate::surface::{Normalization, PointCloud, Surface, TriangleMesh};

/// Neighbours of a point that its tangent plane is fitted to: noise averages out among more, and
/// fewer are on another sheet.
const FITTED: usize = 8;

/// Normalised points of a surface, and two orthonormal tangents of it at each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TangentPlanes {
    /// Points in the unit ball.
    pub points: Vec<[f32; 3]>,
    /// Along the surface at each.
    pub tangents: Vec<[[f32; 3]; 2]>,
}

/// Supplies the points at which the flattening of a surface is judged (ℓ_flat), fresh ones each
/// time.
///
/// Those of a mesh lie on its triangles, on each one as often as on any other, whatever its area:
/// whoever made the mesh has put more of them where there is more to see, and whoever measures
/// its UVs goes through the triangles. As there, those without area are left out.
#[derive(Debug, Clone)]
pub enum TangentSource {
    /// The corners of each triangle that has an area, and tangents along it.
    Triangles {
        /// Normalised.
        corners: Vec<[[f64; 3]; 3]>,
        /// Orthonormal.
        tangents: Vec<[[f32; 3]; 2]>,
    },
    /// The points of a cloud.
    Points(TangentPlanes),
}

impl TangentSource {
    /// Without `with_normals`, tangents of a cloud come from its points alone; with them, where it
    /// has none. `None` if no triangle of a mesh has an area.
    pub fn new(
        surface: &Surface,
        normalization: &Normalization,
        with_normals: bool,
    ) -> Option<Self> {
        match surface {
            Surface::Mesh(mesh) => Self::of_mesh(mesh, normalization),
            Surface::PointCloud(cloud) => {
                let planes = planes_of_cloud(cloud, normalization, with_normals);
                Some(Self::Points(planes))
            }
        }
    }

    fn of_mesh(mesh: &TriangleMesh, normalization: &Normalization) -> Option<Self> {
        let positions = rescaled(mesh.positions());
        let corners = |t: usize| mesh.triangles()[t].map(|v| positions[v as usize]);
        let with_area = (0..mesh.triangles().len())
            .filter(|&t| double_area(corners(t)) > 0.0)
            .map(|t| {
                let [a, b, c] = corners(t);
                (t, normalize(cross(sub(b, a), sub(c, a))))
            });
        let (corners, tangents): (Vec<_>, Vec<_>) = with_area
            .map(|(t, normal)| {
                let corner = |p| normalization.apply(p).map(f64::from);
                (mesh.corners(t).map(corner), along(normal))
            })
            .unzip();
        (!corners.is_empty()).then_some(Self::Triangles { corners, tangents })
    }

    /// So many points, each drawn from all.
    pub fn draw(&self, count: usize, rng: &mut impl Rng) -> TangentPlanes {
        let mut drawn = TangentPlanes::default();
        for _ in 0..count {
            let (point, tangents) = match self {
                Self::Triangles { corners, tangents } => {
                    let t = rng.random_range(0..corners.len());
                    (inside(corners[t], rng), tangents[t])
                }
                Self::Points(planes) => {
                    let p = rng.random_range(0..planes.points.len());
                    (planes.points[p], planes.tangents[p])
                }
            };
            drawn.points.push(point);
            drawn.tangents.push(tangents);
        }
        drawn
    }
}

/// A point of a triangle, each as likely as any other.
fn inside([a, b, c]: [[f64; 3]; 3], rng: &mut impl Rng) -> [f32; 3] {
    let [mut u, mut v] = [0; 2].map(|_| rng.random_range(0.0..1.0));
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let along_sides = add(scale(sub(b, a), u), scale(sub(c, a), v));
    add(a, along_sides).map(|coordinate| coordinate as f32)
}

/// Two tangents of the plane with a unit normal.
fn along(normal: [f64; 3]) -> [[f32; 3]; 2] {
    let [u, v, _] = frame(normal);
    [u, v].map(|axis| axis.map(|c| c as f32))
}

/// Orthogonal to the normals or, where none is known, of the plane that fits a point and the
/// nearest.
fn planes_of_cloud(
    cloud: &PointCloud,
    normalization: &Normalization,
    with_normals: bool,
) -> TangentPlanes {
    let points: Vec<[f32; 3]> = cloud
        .points()
        .iter()
        .map(|&p| normalization.apply(p))
        .collect();
    let normals: Vec<[f64; 3]> = match cloud.normals().filter(|_| with_normals) {
        Some(normals) => normals.iter().map(|&n| normalize(n)).collect(),
        None => vec![[0.0; 3]; points.len()],
    };
    let unknown = |n: &[f64; 3]| *n == [0.0; 3];
    let count = match normals.iter().any(unknown) {
        true => FITTED.min(points.len() - 1),
        false => 0,
    };
    let neighbors = match count {
        0 => Vec::new(),
        _ => nearest_others(&points, count),
    };
    let fitted = |p: usize| {
        let near = neighbors[p * count..(p + 1) * count].iter();
        let all = near.map(|&q| q as usize).chain([p]);
        Plane::fit(all.map(|q| (points[q].map(f64::from), 1.0))).normal
    };
    let tangents =
        |(p, normal): (usize, &[f64; 3])| along(if unknown(normal) { fitted(p) } else { *normal });
    let tangents = normals.iter().enumerate().map(tangents).collect();
    TangentPlanes { points, tangents }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes;
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    fn draw(surface: &Surface, with_normals: bool, count: usize) -> TangentPlanes {
        let normalization = Normalization::of(surface.positions()).unwrap();
        let source = TangentSource::new(surface, &normalization, with_normals).unwrap();
        source.draw(count, &mut Pcg64::seed_from_u64(1))
    }

    /// By the triangles of a mesh, by the nearest points of a cloud without or with normals of
    /// zero, and where wrong normals are to be ignored.
    #[test]
    fn tangents_are_orthonormal_and_along_the_surface() {
        let sphere = shapes::sphere(24);
        let points = sphere.positions().to_vec();
        let cloud = |normal: Option<[f64; 3]>| {
            let normals = normal.map(|n| vec![n; points.len()]);
            Surface::PointCloud(PointCloud::new(points.clone(), normals).unwrap())
        };
        let surfaces = [
            (cloud(None), true),
            (cloud(Some([0.0; 3])), true),
            (cloud(Some([0.0, 0.0, 1.0])), false),
            (Surface::Mesh(sphere), true),
        ];
        for (surface, with_normals) in surfaces {
            let planes = draw(&surface, with_normals, 300);
            assert_eq!(planes.points.len(), 300);
            for (p, [u, v]) in planes.points.iter().zip(planes.tangents) {
                let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                assert!((dot(&u, &u) - 1.0).abs() < 1e-5 && (dot(&v, &v) - 1.0).abs() < 1e-5);
                assert!(dot(&u, &v).abs() < 1e-5);
                assert!(dot(&u, p).abs() < 0.06 && dot(&v, p).abs() < 0.06);
            }
        }
    }

    #[test]
    fn normals_of_a_cloud_are_believed_where_they_are_to_be() {
        let points = (0..20).map(|i| [f64::from(i % 5), f64::from(i / 5), 0.0]);
        let normals = vec![[1.0, 0.0, 0.0]; 20];
        let cloud = PointCloud::new(points.collect(), Some(normals)).unwrap();
        let cloud = Surface::PointCloud(cloud);
        let along_x = |planes: TangentPlanes| planes.tangents[0].iter().any(|t| t[0].abs() > 0.1);
        assert!(!along_x(draw(&cloud, true, 1)));
        assert!(along_x(draw(&cloud, false, 1)));
    }

    /// A square of which one half is a single triangle and the other a hundred, with one between
    /// them that has no area.
    #[test]
    fn every_triangle_has_as_many_points() {
        let mut positions = vec![[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut triangles = vec![[0, 1, 2], [0, 1, 1]];
        positions.extend((0..=100).map(|i| {
            let t = f64::from(i) / 100.0;
            [1.0, t, 0.0]
        }));
        triangles.extend((3..103).map(|i| [0, i, i + 1]));
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        let surface = Surface::Mesh(mesh);
        let normalization = Normalization::of(surface.positions()).unwrap();
        let above = |corner: [f64; 3]| {
            let [x, y, _] = normalization.apply(corner);
            y - x
        };
        let diagonal = above([0.0; 3]);
        let planes = draw(&surface, true, 10_100);
        let length = |t: [f32; 3]| t.iter().map(|c| c * c).sum::<f32>();
        let of_unit_length = |t: [f32; 3]| (length(t) - 1.0).abs() < 1e-5;
        assert!(planes.tangents.iter().flatten().all(|&t| of_unit_length(t)));
        let points = planes.points;
        let in_large = points.iter().filter(|p| p[1] - p[0] > diagonal).count();
        // 100 of them, ± 10, and none on the line of the one without area.
        let on_diagonal = points
            .iter()
            .filter(|p| (p[1] - p[0] - diagonal).abs() < 1e-6);
        assert!(on_diagonal.count() < 3);
        assert!((50..150).contains(&in_large), "{in_large}");
        let on_x = points
            .iter()
            .filter(|p| p[0] < normalization.apply([0.5, 0.0, 0.0])[0]);
        // A quarter of the area of each triangle, but for the large one.
        let share = on_x.count() as f64 / 10_100.0;
        assert!((0.2..0.3).contains(&share), "{share}");
    }
}
