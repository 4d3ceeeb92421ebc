//! The points P that training sees.

mod farthest_point;
mod poisson_disk;

use rand::Rng;
use rand::seq::index::{self, IndexVec};
use serde::{Deserialize, Serialize};

use crate::neighbors::nearest_others;
use crate::surface::plane::{Plane, frame};
use crate::surface::vector::normalize;
use crate::surface::{Normalization, Surface, SurfaceError};

pub use farthest_point::farthest_points;
pub use poisson_disk::{SurfacePoint, poisson_disk};

/// Neighbours of a point that its tangent plane is fitted to: noise averages out among more, and
/// fewer are on another sheet.
const FITTED: usize = 8;

/// Where the training points of a mesh come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// Evenly spread points on the triangles, drawn once.
    PoissonDisk,
    /// A uniform choice among the vertices, drawn anew for each iteration, as in the paper's
    /// comparison with mesh methods.
    Vertices,
}

/// What tells the tangents of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TangentsFrom {
    /// Its normals, where it has any.
    Normals,
    /// Its points alone.
    Points,
}

/// Normalised points `[N, 3]` with their normals, if they have any.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Points in the unit ball.
    pub points: Vec<[f32; 3]>,
    /// One normal per point, of unit length or zero where none is known.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Two orthonormal tangents per point, if they were asked for: orthogonal to the normal or,
    /// where none is known, along the plane that fits the nearest points.
    pub tangents: Option<Vec<[[f32; 3]; 2]>>,
}

/// Supplies the points of each training iteration: at most a given number of them, the same
/// ones again or a fresh choice from a larger pool.
#[derive(Debug, Clone)]
pub struct PointSource {
    pool: Sample,
    count: usize,
}

impl PointSource {
    /// A source of `count` points on a surface; a mesh is sampled as `sampling` says, a
    /// cloud is its own pool. Tangents only if it is said where from.
    ///
    /// # Errors
    /// A mesh without area.
    pub fn new(
        surface: &Surface,
        normalization: &Normalization,
        sampling: Sampling,
        count: usize,
        tangents_from: Option<TangentsFrom>,
        rng: &mut impl Rng,
    ) -> Result<Self, SurfaceError> {
        let (points, normals) = match surface {
            Surface::PointCloud(cloud) => {
                (cloud.points().to_vec(), cloud.normals().map(<[_]>::to_vec))
            }
            Surface::Mesh(mesh) => match sampling {
                Sampling::Vertices => {
                    let used = mesh.used_vertices();
                    let normals = mesh.vertex_normals();
                    (
                        used.iter().map(|&v| mesh.positions()[v as usize]).collect(),
                        Some(used.iter().map(|&v| normals[v as usize]).collect()),
                    )
                }
                Sampling::PoissonDisk => {
                    let candidates = poisson_disk(mesh, count, rng)?;
                    let positions: Vec<_> = candidates.iter().map(|p| p.position).collect();
                    let chosen = farthest_points(&positions, count);
                    (
                        chosen.iter().map(|&i| positions[i]).collect(),
                        Some(chosen.iter().map(|&i| candidates[i].normal).collect()),
                    )
                }
            },
        };
        let points: Vec<[f32; 3]> = points.iter().map(|&p| normalization.apply(p)).collect();
        let normals: Option<Vec<[f64; 3]>> =
            normals.map(|normals| normals.into_iter().map(normalize).collect());
        let tangents = tangents_from.map(|from| match (from, &normals) {
            (TangentsFrom::Normals, Some(normals)) => along(&points, normals),
            _ => along(&points, &vec![[0.0; 3]; points.len()]),
        });
        let single = |n: [f64; 3]| n.map(|c| c as f32);
        let pool = Sample {
            points,
            normals: normals.map(|normals| normals.into_iter().map(single).collect()),
            tangents,
        };
        Ok(Self { pool, count })
    }

    /// How many points each iteration gets.
    pub fn count(&self) -> usize {
        self.count.min(self.pool.points.len())
    }

    /// Whether every iteration gets the same points.
    pub fn is_fixed(&self) -> bool {
        self.pool.points.len() <= self.count
    }

    /// The points of one iteration.
    pub fn draw(&self, rng: &mut impl Rng) -> Sample {
        if self.is_fixed() {
            return self.pool.clone();
        }
        let chosen = index::sample(rng, self.pool.points.len(), self.count);
        Sample {
            points: rows(&chosen, &self.pool.points),
            normals: self.pool.normals.as_deref().map(|n| rows(&chosen, n)),
            tangents: self.pool.tangents.as_deref().map(|t| rows(&chosen, t)),
        }
    }
}

fn rows<T: Copy>(chosen: &IndexVec, of: &[T]) -> Vec<T> {
    chosen.iter().map(|i| of[i]).collect()
}

/// Two tangents for each point; where the normal is zero, of the plane that fits it and the
/// nearest.
fn along(points: &[[f32; 3]], normals: &[[f64; 3]]) -> Vec<[[f32; 3]; 2]> {
    let unknown = |n: &[f64; 3]| *n == [0.0; 3];
    let count = match normals.iter().any(unknown) {
        true => FITTED.min(points.len() - 1),
        false => 0,
    };
    let neighbors = match count {
        0 => Vec::new(),
        _ => nearest_others(points, count),
    };
    let fitted = |p: usize| {
        let near = neighbors[p * count..(p + 1) * count].iter();
        let all = near.map(|&q| q as usize).chain([p]);
        Plane::fit(all.map(|q| (points[q].map(f64::from), 1.0))).normal
    };
    let tangents = |(p, normal): (usize, &[f64; 3])| {
        let [u, v, _] = frame(if unknown(normal) { fitted(p) } else { *normal });
        [u, v].map(|axis| axis.map(|c| c as f32))
    };
    normals.iter().enumerate().map(tangents).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{PointCloud, shapes};
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    fn source(surface: &Surface, sampling: Sampling, count: usize) -> PointSource {
        let normalization = Normalization::of(surface.positions()).unwrap();
        let mut rng = Pcg64::seed_from_u64(1);
        let from = Some(TangentsFrom::Normals);
        PointSource::new(surface, &normalization, sampling, count, from, &mut rng).unwrap()
    }

    #[test]
    fn a_mesh_gives_exactly_the_points_asked_for() {
        let mesh = Surface::Mesh(shapes::torus(2.0, 0.8, 60, 30));
        let mut rng = Pcg64::seed_from_u64(2);
        for sampling in [Sampling::PoissonDisk, Sampling::Vertices] {
            let source = source(&mesh, sampling, 500);
            let sample = source.draw(&mut rng);
            assert_eq!(sample.points.len(), 500);
            let length = |p: &[f32; 3]| p.iter().map(|c| c * c).sum::<f32>().sqrt();
            assert!(sample.points.iter().all(|p| length(p) < 1.0 + 1e-5));
            let normals = sample.normals.unwrap();
            assert!(normals.iter().all(|n| (length(n) - 1.0).abs() < 1e-5));
        }
    }

    #[test]
    fn large_pools_are_drawn_from_anew_and_without_repetition() {
        let points: Vec<_> = (0..1000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let cloud = Surface::PointCloud(PointCloud::new(points, None).unwrap());
        let source = source(&cloud, Sampling::PoissonDisk, 100);
        let mut rng = Pcg64::seed_from_u64(3);
        let (a, b) = (source.draw(&mut rng), source.draw(&mut rng));
        assert_ne!(a, b);
        let mut values: Vec<u32> = a.points.iter().map(|p| p[0].to_bits()).collect();
        values.sort_unstable();
        values.dedup();
        assert_eq!(values.len(), 100);
        assert!(a.normals.is_none());
    }

    /// By the normals of a mesh, by the nearest points of a cloud without or with normals of zero,
    /// and where wrong normals are to be ignored.
    #[test]
    fn tangents_are_orthonormal_and_along_the_surface() {
        let sphere = shapes::sphere(24);
        let points = sphere.positions().to_vec();
        let cloud = |normal: Option<[f64; 3]>| {
            let normals = normal.map(|n| vec![n; points.len()]);
            Surface::PointCloud(PointCloud::new(points.clone(), normals).unwrap())
        };
        let surfaces = [
            (cloud(None), TangentsFrom::Normals),
            (cloud(Some([0.0; 3])), TangentsFrom::Normals),
            (cloud(Some([0.0, 0.0, 1.0])), TangentsFrom::Points),
            (Surface::Mesh(sphere), TangentsFrom::Normals),
        ];
        for (surface, from) in surfaces {
            let normalization = Normalization::of(surface.positions()).unwrap();
            let mut rng = Pcg64::seed_from_u64(1);
            let kind = Sampling::PoissonDisk;
            let source =
                PointSource::new(&surface, &normalization, kind, 300, Some(from), &mut rng);
            let sample = source.unwrap().draw(&mut rng);
            for (p, [u, v]) in sample.points.iter().zip(sample.tangents.unwrap()) {
                let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                assert!((dot(&u, &u) - 1.0).abs() < 1e-5 && (dot(&v, &v) - 1.0).abs() < 1e-5);
                assert!(dot(&u, &v).abs() < 1e-5);
                assert!(dot(&u, p).abs() < 0.06 && dot(&v, p).abs() < 0.06);
            }
        }
    }
}
