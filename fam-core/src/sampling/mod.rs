//! The points P that training sees, and the triangles on which it judges the flattening.

mod farthest_point;
mod poisson_disk;
mod triangles;

use rand::Rng;
use rand::seq::index::{self, IndexVec};
use serde::{Deserialize, Serialize};

use fam_surface::vector::normalize;
use fam_surface::{Normalization, Surface, SurfaceError};

pub use farthest_point::farthest_points;
pub use poisson_disk::{SurfacePoint, poisson_disk};
pub use triangles::{TriangleSource, Triangles};

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

/// Normalised points `[N, 3]` with their normals, if they have any.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Points in the unit ball.
    pub points: Vec<[f32; 3]>,
    /// One normal per point, of unit length or zero where none is known.
    pub normals: Option<Vec<[f32; 3]>>,
}

/// Supplies the points of each training iteration: at most a given number of them, the same
/// ones again or a fresh choice from a larger pool.
#[derive(Debug, Clone)]
pub struct PointSource {
    pool: Sample,
    count: usize,
    /// Whether the first points of the pool lie evenly by themselves, however many.
    ordered: bool,
}

impl PointSource {
    /// A source of `count` points on a surface; a mesh is sampled as `sampling` says, a
    /// cloud is its own pool.
    ///
    /// # Errors
    /// A mesh without area.
    pub fn new(
        surface: &Surface,
        normalization: &Normalization,
        sampling: Sampling,
        count: usize,
        rng: &mut impl Rng,
    ) -> Result<Self, SurfaceError> {
        let ordered = matches!(surface, Surface::Mesh(_)) && sampling == Sampling::PoissonDisk;
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
        let unit = |n| normalize(n).map(|c| c as f32);
        let normals = normals.map(|normals| normals.into_iter().map(unit).collect());
        let pool = Sample { points, normals };
        Ok(Self {
            pool,
            count,
            ordered,
        })
    }

    /// How many points each iteration gets.
    pub fn count(&self) -> usize {
        self.count.min(self.pool.points.len())
    }

    /// Whether every iteration of `count` points gets the same ones.
    pub fn is_fixed(&self, count: usize) -> bool {
        self.ordered || self.pool.points.len() <= count
    }

    /// The points of one iteration of `count` points.
    pub fn draw(&self, count: usize, rng: &mut impl Rng) -> Sample {
        let pool = &self.pool;
        let size = pool.points.len();
        if self.is_fixed(count) {
            let few = size.min(count);
            return Sample {
                points: pool.points[..few].to_vec(),
                normals: pool.normals.as_ref().map(|normals| normals[..few].to_vec()),
            };
        }
        let chosen = index::sample(rng, size, count);
        Sample {
            points: rows(&chosen, &pool.points),
            normals: pool.normals.as_deref().map(|n| rows(&chosen, n)),
        }
    }
}

fn rows<T: Copy>(chosen: &IndexVec, of: &[T]) -> Vec<T> {
    chosen.iter().map(|i| of[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::{PointCloud, shapes};
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    fn source(surface: &Surface, sampling: Sampling, count: usize) -> PointSource {
        let normalization = Normalization::of(surface.positions()).unwrap();
        let mut rng = Pcg64::seed_from_u64(1);
        PointSource::new(surface, &normalization, sampling, count, &mut rng).unwrap()
    }

    #[test]
    fn a_mesh_gives_exactly_the_points_asked_for() {
        let mesh = Surface::Mesh(shapes::torus(2.0, 0.8, 60, 30));
        let mut rng = Pcg64::seed_from_u64(2);
        for sampling in [Sampling::PoissonDisk, Sampling::Vertices] {
            let source = source(&mesh, sampling, 500);
            let sample = source.draw(500, &mut rng);
            assert_eq!(sample.points.len(), 500);
            let length = |p: &[f32; 3]| p.iter().map(|c| c * c).sum::<f32>().sqrt();
            assert!(sample.points.iter().all(|p| length(p) < 1.0 + 1e-5));
            let normals = sample.normals.unwrap();
            assert!(normals.iter().all(|n| (length(n) - 1.0).abs() < 1e-5));
        }
    }

    #[test]
    fn the_first_of_the_points_of_a_mesh_lie_evenly() {
        let mesh = Surface::Mesh(shapes::rectangle(1.0, 1.0, 20, 20));
        let source = source(&mesh, Sampling::PoissonDisk, 500);
        let mut rng = Pcg64::seed_from_u64(2);
        let all = source.draw(500, &mut rng).points;
        let few = source.draw(125, &mut rng).points;
        assert_eq!(few, all[..125]);
        let gap = |points: &[[f32; 3]]| {
            let square =
                |p: &[f32; 3], q: &[f32; 3]| (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f32>();
            let nearest = |p| {
                points
                    .iter()
                    .map(|q| square(p, q))
                    .fold(f32::INFINITY, f32::min)
            };
            all.iter().map(nearest).fold(0.0, f32::max).sqrt()
        };
        // A quarter of even points have twice the spacing; the last quarter leaves larger gaps.
        assert!(
            gap(&few) < 0.8 * gap(&all[375..]),
            "{} {}",
            gap(&few),
            gap(&all[375..])
        );
    }

    #[test]
    fn large_pools_are_drawn_from_anew_and_without_repetition() {
        let points: Vec<_> = (0..1000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let cloud = Surface::PointCloud(PointCloud::new(points, None).unwrap());
        let source = source(&cloud, Sampling::PoissonDisk, 100);
        let mut rng = Pcg64::seed_from_u64(3);
        let (a, b) = (source.draw(100, &mut rng), source.draw(100, &mut rng));
        assert_ne!(a, b);
        let mut values: Vec<u32> = a.points.iter().map(|p| p[0].to_bits()).collect();
        values.sort_unstable();
        values.dedup();
        assert_eq!(values.len(), 100);
        assert!(a.normals.is_none());
    }
}
