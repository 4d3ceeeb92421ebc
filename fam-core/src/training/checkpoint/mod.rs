//! What training needs to go on in another process, as the bytes of a safetensors file: weights, the
//! state of the optimiser, the schedule, random numbers, and the starts that are compared.
//!
//! On a backend that computes alike each time, training that goes on from a checkpoint ends in the same
//! bits as training that was never interrupted.

mod parameters;
mod record;

use safetensors::tensor::{Dtype, SafeTensors};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::map::{ModelFileError, model_file, read_metadata};
use crate::weights::{self, NamedTensor, WeightsError};

pub(crate) use parameters::{ModelReader, ModelWriter};
pub(crate) use record::{ErrorRecord, StepRecord};

/// Why training cannot go on from a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// It is something else, or says what cannot be.
    #[error("it is no checkpoint")]
    NotACheckpoint,
    /// It is damaged.
    #[error(transparent)]
    File(#[from] ModelFileError),
    /// Another version of this crate wrote it, which may compute otherwise.
    #[error("version {0} wrote the checkpoint, and this is {version}", version = env!("CARGO_PKG_VERSION"))]
    Version(String),
    /// It is of another surface.
    #[error("the checkpoint is of another surface")]
    Surface,
    /// It is of another configuration.
    #[error("the checkpoint is of another configuration")]
    Config,
}

impl From<WeightsError> for CheckpointError {
    fn from(error: WeightsError) -> Self {
        Self::File(error.into())
    }
}

/// All of a checkpoint that is no tensor.
#[derive(Serialize)]
struct Written<'a, R> {
    version: &'a str,
    record: &'a R,
}

/// What says whether the rest of it can be read.
#[derive(Deserialize)]
struct Version {
    version: String,
}

/// The rest.
#[derive(Deserialize)]
struct Record<R> {
    record: R,
}

/// The tensors of a checkpoint that is being written.
#[derive(Default)]
pub(crate) struct Writer {
    tensors: Vec<NamedTensor>,
}

impl Writer {
    /// Adds values, row by row.
    pub fn put(&mut self, name: String, shape: Vec<usize>, values: &[f32]) {
        let bytes = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.tensors.push((name, shape, bytes));
    }

    /// The bytes of the file, with all that is no tensor.
    pub fn finish(&self, record: &impl Serialize) -> Result<Vec<u8>, ModelFileError> {
        let version = env!("CARGO_PKG_VERSION");
        model_file(&self.tensors, &Written { version, record })
    }
}

/// A checkpoint that is being read.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    file: SafeTensors<'a>,
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Result<Self, CheckpointError> {
        let file = SafeTensors::deserialize(bytes).map_err(WeightsError::from)?;
        Ok(Self { bytes, file })
    }

    /// All that is no tensor, if this version wrote it.
    pub fn record<R: DeserializeOwned>(&self) -> Result<R, CheckpointError> {
        let version: Result<Version, _> = read_metadata(self.bytes);
        let Version { version } = version.map_err(|_| CheckpointError::NotACheckpoint)?;
        match version == env!("CARGO_PKG_VERSION") {
            true => Ok(read_metadata::<Record<R>>(self.bytes)?.record),
            false => Err(CheckpointError::Version(version)),
        }
    }

    /// The values of a tensor of a known shape.
    pub fn get(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, CheckpointError> {
        let view = weights::find(&self.file, name)?;
        if view.shape() != shape || view.dtype() != Dtype::F32 {
            return Err(CheckpointError::NotACheckpoint);
        }
        Ok(values(view.data()))
    }

    /// The values of a tensor of any shape.
    pub fn all(&self, name: &str) -> Result<Vec<f32>, CheckpointError> {
        let view = weights::find(&self.file, name)?;
        match view.dtype() {
            Dtype::F32 => Ok(values(view.data())),
            _ => Err(CheckpointError::NotACheckpoint),
        }
    }

    /// Whether there is a tensor of a name.
    pub fn has(&self, name: &str) -> bool {
        self.file.tensor(name).is_ok()
    }
}

/// The bits of numbers, which need not be finite: training may break down after a checkpoint.
fn values(bytes: &[u8]) -> Vec<f32> {
    let (values, _) = bytes.as_chunks::<4>();
    values
        .iter()
        .map(|bytes| f32::from_le_bytes(*bytes))
        .collect()
}
