//! What [`flatten`](super::flatten) needs to go on in another process.

use std::fmt;
use std::sync::Arc;

use burn::tensor::backend::{AutodiffBackend, Backend};
use serde::{Deserialize, Serialize};

use super::Part;
use crate::map::{Metadata, ModelFileError, TrainedMap};
use crate::training::checkpoint::{
    ErrorRecord, ModelReader, ModelWriter, Reader, StepRecord, Writer,
};
use crate::training::{CheckpointError, Trainer, TrainerRecord, TrainingConfig};

/// Networks that are trained, and how.
pub(super) type Trained<B> = (Arc<TrainedMap<B>>, Part);

/// Makes the bytes of a checkpoint.
#[derive(Clone, Copy)]
pub struct Checkpointer<'a>(pub(super) &'a dyn Fn(&str) -> Result<Vec<u8>, ModelFileError>);

impl Checkpointer<'_> {
    /// The bytes from which a [`Checkpoint`] is read, as of the last step. `label` is the caller's, and
    /// says what the training is of.
    ///
    /// # Errors
    /// The container refuses a tensor.
    pub fn bytes(&self, label: &str) -> Result<Vec<u8>, ModelFileError> {
        (self.0)(label)
    }
}

impl fmt::Debug for Checkpointer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Checkpointer")
    }
}

/// Where training starts.
#[derive(Debug, Clone, Copy)]
pub enum Start<'a> {
    /// With fresh weights.
    Fresh(&'a TrainingConfig),
    /// Where an earlier training left off, with its configuration.
    Checkpoint(&'a Checkpoint),
}

impl<'a> Start<'a> {
    /// How the surface is trained on.
    pub fn config(self) -> &'a TrainingConfig {
        match self {
            Self::Fresh(config) => config,
            Self::Checkpoint(checkpoint) => &checkpoint.config,
        }
    }
}

/// A training to go on with.
#[derive(Clone)]
pub struct Checkpoint {
    bytes: Arc<[u8]>,
    label: String,
    config: TrainingConfig,
}

impl fmt::Debug for Checkpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Checkpoint")
            .field("label", &self.label)
            .finish_non_exhaustive()
    }
}

impl Checkpoint {
    /// The checkpoint that a [`Checkpointer`] made.
    ///
    /// # Errors
    /// It is none, or of another version.
    pub fn read(bytes: Vec<u8>) -> Result<Self, CheckpointError> {
        let file = Reader::new(&bytes)?;
        let Record { label, config, .. } = file.record()?;
        Ok(Self {
            bytes: bytes.into(),
            label,
            config,
        })
    }

    /// What its caller said that it is of.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// The configuration of the training, as it was planned for a time budget.
    pub fn config(&self) -> &TrainingConfig {
        &self.config
    }

    /// The networks that are trained, and the trainer of the next where it left off.
    pub(super) fn restored<B: AutodiffBackend>(
        &self,
        device: &B::Device,
    ) -> Result<Restored<'_, B>, CheckpointError> {
        let file = Reader::new(&self.bytes)?;
        let record: Record = file.record()?;
        let mut finished = Vec::new();
        for (i, part) in record.finished.into_iter().enumerate() {
            finished.push(part.read(&format!("{i}"), &self.config, &file, device)?);
        }
        Ok(Restored {
            finished,
            trainer: Some(record.trainer),
            file,
        })
    }
}

/// What a checkpoint holds.
pub(super) struct Restored<'a, B: AutodiffBackend> {
    pub finished: Vec<Trained<B::InnerBackend>>,
    trainer: Option<TrainerRecord>,
    file: Reader<'a>,
}

impl<B: AutodiffBackend> Restored<'_, B> {
    /// A fresh trainer where that of the checkpoint left off; the second one is left as it is.
    pub fn resumed(&mut self, trainer: Trainer<B>) -> Result<Trainer<B>, CheckpointError> {
        match self.trainer.take() {
            Some(record) => trainer.restored(record, TRAINER, &self.file),
            None => Ok(trainer),
        }
    }
}

/// Begins the names of the tensors of the trainer.
const TRAINER: &str = "trainer.";

/// All of a checkpoint that is no tensor.
#[derive(Serialize, Deserialize)]
struct Record {
    label: String,
    config: TrainingConfig,
    finished: Vec<PartRecord>,
    trainer: TrainerRecord,
}

#[derive(Serialize, Deserialize)]
struct PartRecord {
    map: Metadata,
    points: usize,
    last: Option<StepRecord>,
    error: Option<ErrorRecord>,
}

/// The bytes of a checkpoint.
pub(super) fn write<B: AutodiffBackend>(
    label: &str,
    config: &TrainingConfig,
    finished: &[Trained<B::InnerBackend>],
    trainer: &Trainer<B>,
) -> Result<Vec<u8>, ModelFileError> {
    let mut out = Writer::default();
    let part = |(i, (map, part)): (usize, &Trained<B::InnerBackend>)| {
        ModelWriter::write(format!("{i}.model"), map.model(), &mut out);
        let sample = part.sample.as_flattened();
        out.put(format!("{i}.sample"), vec![sample.len()], sample);
        PartRecord {
            map: map.metadata(),
            points: part.points,
            last: part.last.as_ref().map(StepRecord::of),
            error: part.error.as_ref().and_then(ErrorRecord::of),
        }
    };
    let record = Record {
        label: label.to_owned(),
        config: config.clone(),
        finished: finished.iter().enumerate().map(part).collect(),
        trainer: trainer.write(TRAINER, &mut out),
    };
    out.finish(&record)
}

impl PartRecord {
    fn read<B: Backend>(
        self,
        name: &str,
        config: &TrainingConfig,
        file: &Reader,
        device: &B::Device,
    ) -> Result<Trained<B>, CheckpointError> {
        let model = format!("{name}.model");
        let model = ModelReader::read(&model, &config.networks, file, device)?;
        let sample = file.all(&format!("{name}.sample"))?;
        let part = Part {
            points: self.points,
            last: self.last.map(|step| step.step(&config.added_terms())),
            error: self.error.and_then(|error| error.error(config)),
            sample: sample.as_chunks().0.into(),
        };
        Ok((Arc::new(TrainedMap::of(model, self.map, device)?), part))
    }
}
