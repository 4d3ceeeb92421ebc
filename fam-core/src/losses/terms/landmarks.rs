use burn::tensor::{Tensor, TensorData, backend::Backend};
use serde::{Deserialize, Serialize};

use super::{Evaluated, LossTerm};
use fam_surface::vector::{dot, length, scale, sub};
use fam_surface::{Normalization, Surface};

/// Largest distance of a landmark from the surface, as a fraction of the surface's radius. Farther ones
/// are those of another component.
const REACH: f64 = 0.1;

/// Given points to given UVs: mean distance of their UVs from those that they are to have, in the frame
/// in which the UVs of the surface fill the unit square.
///
/// The frame changes with the UVs, and no gradient goes through it. A map that is mirrored as a whole
/// afterwards mirrors its landmarks, too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Landmarks {
    points: Vec<[f64; 3]>,
    uvs: Vec<[f64; 2]>,
}

impl Landmarks {
    pub(super) const NAME: &str = "landmarks";

    /// Points in the units of the surface, and as many UVs in 0 … 1: of the raw map of a component, before
    /// components are placed side by side and charts are packed.
    pub fn new(points: Vec<[f64; 3]>, uvs: Vec<[f64; 2]>) -> Self {
        Self { points, uvs }
    }

    /// What keeps them from being used, if anything.
    pub fn problem(&self) -> Option<&'static str> {
        let Self { points, uvs } = self;
        let finite = points.iter().flatten().all(|c| c.is_finite());
        if points.is_empty() || points.len() != uvs.len() {
            Some("landmarks need as many uvs as points, and at least one")
        } else if !finite || !uvs.iter().flatten().all(|c| (0.0..=1.0).contains(c)) {
            Some("points of landmarks must be finite, and their uvs lie in 0..=1")
        } else {
            None
        }
    }

    /// Those that are no farther from a surface than a tenth of its radius.
    pub fn on(&self, surface: &Surface, normalization: &Normalization) -> Self {
        let reach = REACH * normalization.radius;
        let pairs = self.points.iter().zip(&self.uvs);
        let near = pairs.filter(|(point, _)| distance(**point, surface) <= reach);
        let (points, uvs) = near.map(|(point, uv)| (*point, *uv)).unzip();
        Self { points, uvs }
    }
}

impl<B: Backend> LossTerm<B> for Landmarks {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>> {
        let q = evaluated.unwrap.as_ref()?.q.clone().detach();
        if self.points.is_empty() {
            return None;
        }
        let tensor = |values: Vec<f32>, width: usize| {
            let data = TensorData::new(values, [self.points.len(), width]);
            Tensor::<B, 2>::from_data(data, (&q.device(), q.dtype()))
        };
        let points = self.points.iter();
        let points = points.flat_map(|&p| evaluated.normalization.apply(p));
        let points = tensor(points.collect(), 3);
        let wanted = self.uvs.iter().flatten().map(|&c| c as f32);
        let wanted = tensor(wanted.collect(), 2);
        let (low, high) = (q.clone().min_dim(0), q.clone().max_dim(0));
        let side = (high - low.clone()).max_dim(1).clamp_min(f32::MIN_POSITIVE);
        // uv = (q − low) / side; compared in units of q, so that nothing is divided by but a constant.
        let difference = evaluated.q(points) - (wanted * side.clone() + low);
        let squared = (difference.clone() * difference).sum_dim(1);
        let distance = squared.clamp_min(f32::MIN_POSITIVE).sqrt();
        Some(distance.mean() * side.reshape([1]).powf_scalar(-1.0))
    }
}

/// The distance of a point from the nearest triangle, or from the nearest point of a cloud.
fn distance(point: [f64; 3], surface: &Surface) -> f64 {
    let nearest = |distances: &mut dyn Iterator<Item = f64>| {
        // A triangle without an area may have none; its neighbours have its sides.
        distances.fold(f64::INFINITY, f64::min)
    };
    match surface {
        Surface::Mesh(mesh) => nearest(&mut mesh.triangles().iter().map(|triangle| {
            let corners = triangle.map(|v| mesh.positions()[v as usize]);
            distance_to_triangle(point, corners)
        })),
        Surface::PointCloud(cloud) => {
            let points = cloud.points().iter();
            nearest(&mut points.map(|&other| length(sub(point, other))))
        }
    }
}

fn distance_to_triangle(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    // Barycentric coordinates of the foot of the perpendicular.
    let [e, f, g] = [dot(ab, ab), dot(ab, ac), dot(ac, ac)];
    let [x, y] = [dot(ab, ap), dot(ac, ap)];
    let determinant = e * g - f * f;
    let [s, t] = [(g * x - f * y) / determinant, (e * y - f * x) / determinant];
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return length(sub(sub(ap, scale(ab, s)), scale(ac, t)));
    }
    let to_side = |[a, b]: [[f64; 3]; 2]| {
        let (along, ap) = (sub(b, a), sub(p, a));
        let share = (dot(along, ap) / dot(along, along)).clamp(0.0, 1.0);
        length(sub(ap, scale(along, share)))
    };
    let sides = [[a, b], [b, c], [c, a]].map(to_side);
    sides.into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    #[test]
    fn distances_to_triangles() {
        let corners = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        for (point, expected) in [
            ([0.5, 0.5, 3.0], 3.0),
            ([1.0, -2.0, 0.0], 2.0),
            ([-3.0, -4.0, 0.0], 5.0),
            ([2.0, 2.0, 0.0], 2.0_f64.sqrt()),
        ] {
            let found = distance_to_triangle(point, corners);
            assert!((found - expected).abs() < 1e-12, "{point:?}");
        }
    }

    /// In the middle of a large triangle, far from all vertices.
    #[test]
    fn landmarks_on_a_surface_are_kept() {
        let surface = Surface::Mesh(shapes::rectangle(20.0, 20.0, 1, 1));
        let normalization = surface.normalization().unwrap();
        let points = vec![[3.0, 5.0, 0.5], [0.0, 0.0, 5.0], [-4.0, 2.0, 0.0]];
        let uvs = vec![[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]];
        let kept = Landmarks::new(points.clone(), uvs).on(&surface, &normalization);
        let expected = Landmarks::new(vec![points[0], points[2]], vec![[0.1, 0.0], [0.3, 0.0]]);
        assert_eq!(kept, expected);
    }
}
