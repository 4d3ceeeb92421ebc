use super::SurfaceError;

/// Points sampled from a surface, with or without normals.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    points: Vec<[f64; 3]>,
    normals: Option<Vec<[f64; 3]>>,
}

impl PointCloud {
    /// A cloud from points `[N, 3]` and, for an oriented cloud, normals `[N, 3]` of any length.
    ///
    /// # Errors
    /// No points, a coordinate that is not finite, or normals of another number.
    pub fn new(
        points: Vec<[f64; 3]>,
        normals: Option<Vec<[f64; 3]>>,
    ) -> Result<Self, SurfaceError> {
        check_positions(&points)?;
        if let Some(normals) = &normals
            && normals.len() != points.len()
        {
            return Err(SurfaceError::LengthMismatch {
                attribute: "normals",
                expected: points.len(),
                found: normals.len(),
            });
        }
        Ok(Self { points, normals })
    }

    /// The points, in input units.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The normals of an oriented cloud.
    pub fn normals(&self) -> Option<&[[f64; 3]]> {
        self.normals.as_deref()
    }
}

pub(super) fn check_positions(positions: &[[f64; 3]]) -> Result<(), SurfaceError> {
    if positions.is_empty() {
        return Err(SurfaceError::NoVertices);
    }
    match positions
        .iter()
        .position(|p| !p.iter().all(|c| c.is_finite()))
    {
        Some(index) => Err(SurfaceError::NonFinitePosition { index }),
        None => Ok(()),
    }
}
