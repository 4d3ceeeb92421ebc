use serde::{Deserialize, Serialize};

use super::{SurfaceError, vector};

/// Maps input coordinates to the unit ball that the networks are trained on:
/// `x ↦ (x − center) / radius`, where `center` is the centre of the bounding box and
/// `radius` the largest distance of a point from it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Normalization {
    /// Centre of the axis-aligned bounding box, in input units.
    pub center: [f64; 3],
    /// Largest distance of a point from `center`, in input units; positive.
    pub radius: f64,
}

impl Normalization {
    /// The normalisation of a set of points.
    ///
    /// # Errors
    /// No points, or all of them coincide (to the precision of their coordinates).
    pub fn of(points: &[[f64; 3]]) -> Result<Self, SurfaceError> {
        let first = *points.first().ok_or(SurfaceError::NoVertices)?;
        let (mut low, mut high) = (first, first);
        for p in points {
            for axis in 0..3 {
                low[axis] = low[axis].min(p[axis]);
                high[axis] = high[axis].max(p[axis]);
            }
        }
        let center = vector::add(vector::scale(low, 0.5), vector::scale(high, 0.5));
        let radius = points
            .iter()
            .map(|&p| vector::length(vector::sub(p, center)))
            .fold(0.0, f64::max);
        let magnitude = low
            .iter()
            .chain(&high)
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        if !radius.is_finite() || radius <= 4.0 * f64::EPSILON * magnitude {
            return Err(SurfaceError::SinglePoint);
        }
        Ok(Self { center, radius })
    }

    /// A point in input units, in the unit ball.
    pub fn apply(&self, p: [f64; 3]) -> [f32; 3] {
        vector::sub(p, self.center).map(|c| (c / self.radius) as f32)
    }

    /// A point of the unit ball, in input units.
    pub fn invert(&self, p: [f32; 3]) -> [f64; 3] {
        vector::add(p.map(|c| f64::from(c) * self.radius), self.center)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_the_unit_ball_and_map_back() {
        let points = [[10.0, 0.0, 5.0], [14.0, 2.0, 5.0], [12.0, 1.0, 9.0]];
        let normalization = Normalization::of(&points).unwrap();
        let largest = points
            .iter()
            .map(|&p| {
                let q = normalization.apply(p).map(f64::from);
                vector::length(q)
            })
            .fold(0.0, f64::max);
        assert!((largest - 1.0).abs() < 1e-6);
        for p in points {
            let back = normalization.invert(normalization.apply(p));
            assert!(vector::length(vector::sub(p, back)) < 1e-5);
        }
    }

    #[test]
    fn coinciding_points_are_an_error() {
        let far = [665187.5, 5648349.9, 241.8];
        assert_eq!(
            Normalization::of(&[far, far]),
            Err(SurfaceError::SinglePoint)
        );
        assert_eq!(Normalization::of(&[]), Err(SurfaceError::NoVertices));
    }
}
