use std::collections::HashMap;

use rand::{Rng, RngExt};

use fam_surface::vector::{add, dot, normalize, scale, sub};
use fam_surface::{SurfaceError, TriangleMesh};

/// A point on a triangle with the normal interpolated there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position in input units.
    pub position: [f64; 3],
    /// Unit normal, or zero where the corners define none.
    pub normal: [f64; 3],
    /// The triangle that it lies on.
    pub triangle: usize,
    /// Its barycentric coordinates there: weights of the corners, 1 in all.
    pub weights: [f64; 3],
}

/// Uniform candidates per point asked for: enough that few gaps of a disk's size remain.
const CANDIDATES_PER_POINT: usize = 12;

/// Each failed try at a radius is followed by one at this fraction of it.
const SHRINK: f64 = 0.9;

/// After as many tries the radius is a hundredth of the first. Only where most candidates
/// coincide (a mesh at the limit of its coordinates' precision) are they too few even then, and
/// all are kept.
const MAX_TRIES: usize = 44;

/// Smallest radius, as a fraction of the largest coordinate: a sliver narrower than that is a
/// line to the precision of its coordinates.
const SMALLEST_RADIUS: f64 = 1e-13;

/// Blue-noise points on a mesh by dart throwing: uniform in area, no two closer than a radius
/// that leaves room for at least `count` of them. Between `count` and about 1.3 · `count` points.
///
/// # Errors
/// [`SurfaceError::TooSmall`] for a mesh without area.
pub fn poisson_disk(
    mesh: &TriangleMesh,
    count: usize,
    rng: &mut impl Rng,
) -> Result<Vec<SurfacePoint>, SurfaceError> {
    let candidates = uniform(mesh, count * CANDIDATES_PER_POINT, rng)?;
    let area: f64 = mesh.triangle_areas().iter().sum();
    // Densest packing of disks of diameter r: one point in r²·√3/2.
    let mut radius = (area / (count as f64 * 3f64.sqrt() / 2.0)).sqrt();
    let magnitude = mesh
        .positions()
        .iter()
        .flatten()
        .fold(0.0, |m: f64, c| m.max(c.abs()));
    if radius <= SMALLEST_RADIUS * magnitude {
        return Err(SurfaceError::TooSmall("its triangles have no area"));
    }
    for _ in 0..MAX_TRIES {
        let accepted = throw_darts(&candidates, radius);
        if accepted.len() >= count {
            return Ok(accepted);
        }
        radius *= SHRINK;
    }
    Ok(candidates)
}

/// Points distributed uniformly over the area of a mesh.
fn uniform(
    mesh: &TriangleMesh,
    count: usize,
    rng: &mut impl Rng,
) -> Result<Vec<SurfacePoint>, SurfaceError> {
    let mut total = 0.0;
    let cumulative: Vec<f64> = mesh
        .triangle_areas()
        .iter()
        .map(|area| {
            total += area;
            total
        })
        .collect();
    if total <= 0.0 || !total.is_finite() {
        return Err(SurfaceError::TooSmall("its triangles have no area"));
    }
    let normals = mesh.vertex_normals();
    let draw = |_| {
        let at = rng.random_range(0.0..total);
        let t = cumulative
            .partition_point(|&c| c <= at)
            .min(cumulative.len() - 1);
        let (mut s, mut r): (f64, f64) = (rng.random(), rng.random());
        if s + r > 1.0 {
            (s, r) = (1.0 - s, 1.0 - r);
        }
        let blend = |corners: [[f64; 3]; 3]| {
            let weighted = scale(corners[0], 1.0 - s - r);
            add(add(weighted, scale(corners[1], s)), scale(corners[2], r))
        };
        SurfacePoint {
            position: blend(mesh.corners(t)),
            normal: normalize(blend(mesh.triangles()[t].map(|v| normals[v as usize]))),
            triangle: t,
            weights: [1.0 - s - r, s, r],
        }
    };
    Ok((0..count).map(draw).collect())
}

/// Keeps the candidates, in order, that are no closer than `radius` to one kept before.
fn throw_darts(candidates: &[SurfacePoint], radius: f64) -> Vec<SurfacePoint> {
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    let mut kept: Vec<SurfacePoint> = Vec::new();
    for candidate in candidates {
        let cell = candidate.position.map(|c| (c / radius).floor() as i64);
        let crowded = neighborhood(cell).any(|near| {
            cells.get(&near).is_some_and(|indices| {
                indices.iter().any(|&i| {
                    let offset = sub(kept[i].position, candidate.position);
                    dot(offset, offset) < radius * radius
                })
            })
        });
        if !crowded {
            cells.entry(cell).or_default().push(kept.len());
            kept.push(*candidate);
        }
    }
    kept
}

fn neighborhood([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;
    use fam_surface::vector::length;
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    #[test]
    fn points_lie_where_their_weights_say() {
        let mesh = shapes::torus(2.0, 0.5, 40, 20);
        let points = poisson_disk(&mesh, 300, &mut Pcg64::seed_from_u64(4)).unwrap();
        for point in points {
            let [a, b, c] = mesh.corners(point.triangle);
            let [u, v, w] = point.weights;
            assert!(u.min(v).min(w) > -1e-12 && (u + v + w - 1.0).abs() < 1e-12);
            let place = add(add(scale(a, u), scale(b, v)), scale(c, w));
            assert!(length(sub(place, point.position)) < 1e-12, "{point:?}");
        }
    }

    fn spacings(points: &[SurfacePoint]) -> Vec<f64> {
        let nearest = |i: usize| {
            (0..points.len())
                .filter(|&j| j != i)
                .map(|j| length(sub(points[i].position, points[j].position)))
                .fold(f64::INFINITY, f64::min)
        };
        (0..points.len()).map(nearest).collect()
    }

    #[test]
    fn points_keep_their_distance_and_cover_the_surface() {
        let mesh = shapes::rectangle(2.0, 1.0, 3, 1);
        let mut rng = Pcg64::seed_from_u64(5);
        let points = poisson_disk(&mesh, 400, &mut rng).unwrap();
        assert!((400..600).contains(&points.len()), "{}", points.len());
        let closest = spacings(&points).into_iter().fold(f64::INFINITY, f64::min);
        // Uniform random points of that number have pairs at a hundredth of this.
        let ideal = (2.0 / (points.len() as f64 * 0.866)).sqrt();
        assert!(closest > 0.6 * ideal, "{closest} against {ideal}");
        for i in 0..20 {
            for j in 0..10 {
                let at = [-0.95 + 0.1 * f64::from(i), -0.45 + 0.1 * f64::from(j), 0.0];
                let gap = points
                    .iter()
                    .map(|p| length(sub(p.position, at)))
                    .fold(f64::INFINITY, f64::min);
                assert!(gap < 2.0 * ideal, "a gap of {gap} at {at:?}");
            }
        }
    }

    #[test]
    fn points_lie_on_the_surface_with_its_normals() {
        let mesh = shapes::open_cylinder(1.0, 2.0, 90, 20);
        let mut rng = Pcg64::seed_from_u64(6);
        for point in poisson_disk(&mesh, 300, &mut rng).unwrap() {
            let [x, y, _] = point.position;
            let radial = normalize([x, y, 0.0]);
            assert!((x.hypot(y) - 1.0).abs() < 1e-3);
            assert!(dot(radial, point.normal).abs() > 0.999);
        }
    }

    #[test]
    fn a_mesh_without_area_is_an_error() {
        let line = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let mesh = TriangleMesh::new(line, vec![[0, 1, 2]]).unwrap();
        let mut rng = Pcg64::seed_from_u64(7);
        assert!(poisson_disk(&mesh, 10, &mut rng).is_err());
        let sliver = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [2.0, 1e-40, 0.0],
            [1.0, -1e-40, 0.0],
        ];
        let mesh = TriangleMesh::new(sliver, vec![[0, 1, 2], [0, 3, 2]]).unwrap();
        assert!(poisson_disk(&mesh, 10, &mut rng).is_err());
    }
}
