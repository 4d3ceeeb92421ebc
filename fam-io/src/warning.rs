use std::fmt;

/// What a reader left out of a file that it could read; displayed as one line, without the name
/// of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Warning {
    /// Points of a cloud with a coordinate that is NaN or infinite. The surface does not have
    /// them; written again, they stay in the file, with NaN as their UVs.
    PointsLeftOut {
        /// How many were left out.
        left_out: usize,
        /// How many points the file has.
        total: usize,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PointsLeftOut { left_out, total } => write!(
                f,
                "left out {left_out} of {total} points: a coordinate is not a finite number"
            ),
        }
    }
}
