//! The points of a cloud that are part of its surface: those with finite coordinates.

use crate::error::ReadFault;
use crate::warning::Warning;

/// The UV of a point that is left out: it has none, but the columns of the file go on.
pub(crate) const NO_UV: [f32; 2] = [f32::NAN; 2];

/// Which points of a file are left out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    total: usize,
    /// In ascending order.
    left_out: Vec<usize>,
}

impl Kept {
    /// The points with finite coordinates.
    pub fn of(positions: &[[f64; 3]]) -> Self {
        let is_finite = |&at: &usize| positions[at].iter().all(|c| c.is_finite());
        Self {
            total: positions.len(),
            left_out: (0..positions.len()).filter(|at| !is_finite(at)).collect(),
        }
    }

    /// The points that are left out, counting from 0.
    pub fn left_out(&self) -> &[usize] {
        &self.left_out
    }

    /// What the kept points have, of what all points have.
    pub fn only<T>(&self, mut of_all: Vec<T>) -> Vec<T> {
        let (mut at, mut left_out) = (0, self.left_out.iter().peekable());
        of_all.retain(|_| {
            let is_kept = left_out.next_if_eq(&&at).is_none();
            at += 1;
            is_kept
        });
        of_all
    }

    /// The UVs of all points, of those that the kept ones have.
    pub fn uvs_of_all(&self, uvs: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let (mut uvs, mut left_out) = (uvs.iter(), self.left_out.iter().peekable());
        let uv = |at: usize| match left_out.next_if_eq(&&at) {
            Some(_) => NO_UV,
            None => uvs.next().copied().unwrap_or(NO_UV),
        };
        (0..self.total).map(uv).collect()
    }

    /// What the user should know.
    ///
    /// # Errors
    /// There are points, but none is kept.
    pub fn warnings(&self) -> Result<Vec<Warning>, ReadFault> {
        warnings(self.left_out.len(), self.total)
    }
}

/// The warnings about a cloud of so many points; an error if it has some, but keeps none.
pub(crate) fn warnings(left_out: usize, total: usize) -> Result<Vec<Warning>, ReadFault> {
    match left_out {
        0 => Ok(Vec::new()),
        _ if left_out == total => Err(ReadFault::Malformed(format!(
            "none of its {total} points has finite coordinates"
        ))),
        _ => Ok(vec![Warning::PointsLeftOut { left_out, total }]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_finite_coordinates_are_left_out() {
        let broken = [f64::NAN, 0.0, 0.0];
        let infinite = [0.0, 0.0, f64::INFINITY];
        let kept = Kept::of(&[broken, [0.0; 3], [1.0; 3], infinite, [2.0; 3]]);
        assert_eq!(kept.left_out(), [0, 3]);
        assert_eq!(kept.only(vec![0, 1, 2, 3, 4]), [1, 2, 4]);
        let uvs = kept.uvs_of_all(&[[1.0; 2], [2.0; 2], [4.0; 2]]);
        let numbers: Vec<_> = uvs
            .iter()
            .map(|[u, _]| (!u.is_nan()).then_some(*u))
            .collect();
        assert_eq!(numbers, [None, Some(1.0), Some(2.0), None, Some(4.0)]);
        let warning = &kept.warnings().unwrap()[0];
        let expected = "left out 2 of 5 points: a coordinate is not a finite number";
        assert_eq!(warning.to_string(), expected);
        assert!(Kept::of(&[[0.0; 3]]).warnings().unwrap().is_empty());
        let fault = Kept::of(&[broken]).warnings().unwrap_err();
        let expected = "none of its 1 points has finite coordinates";
        assert_eq!(fault.to_string(), expected);
    }
}
