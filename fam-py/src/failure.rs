//! Errors as the package's exceptions.

use fam::UnwrapError;
use fam_core::map::ModelFileError;
use fam_io::{ReadError, WriteError};
use fam_layout::PackError;
use fam_surface::SurfaceError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Why a job or a call has no result.
#[derive(Debug)]
pub enum Failure {
    /// The arrays or the options are to blame.
    Input(String),
    /// A file cannot be read or written.
    File(String),
    /// Training failed from the start.
    Training(String),
    /// It was cancelled.
    Cancelled,
    /// A fault of this package.
    Internal(String),
}

impl Failure {
    /// The exception for it, of the class that `flatten_anything._errors` defines.
    pub fn exception(self, py: Python<'_>) -> PyErr {
        let (class, message) = match self {
            Self::Input(message) => ("InputError", message),
            Self::File(message) => ("FileError", message),
            Self::Training(message) => ("TrainingError", message),
            Self::Cancelled => ("Cancelled", "cancelled".to_owned()),
            Self::Internal(message) => ("InternalError", message),
        };
        let found = py
            .import("flatten_anything._errors")
            .and_then(|errors| errors.getattr(class))
            .and_then(|class| Ok(class.cast_into::<PyType>()?));
        match found {
            Ok(class) => PyErr::from_type(class, (message,)),
            Err(error) => error,
        }
    }
}

impl From<fam_cli::Failure> for Failure {
    fn from(failure: fam_cli::Failure) -> Self {
        Self::Input(failure.to_string())
    }
}

impl From<UnwrapError> for Failure {
    fn from(error: UnwrapError) -> Self {
        match error {
            UnwrapError::NothingLearnt(_) | UnwrapError::Model(_) => {
                Self::Training(error.to_string())
            }
            _ => Self::Input(error.to_string()),
        }
    }
}

impl From<PackError> for Failure {
    fn from(error: PackError) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<SurfaceError> for Failure {
    fn from(error: SurfaceError) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::File(error.to_string())
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::File(error.to_string())
    }
}

impl From<ModelFileError> for Failure {
    fn from(error: ModelFileError) -> Self {
        Self::File(error.to_string())
    }
}
