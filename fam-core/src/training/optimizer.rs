use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::adaptor::OptimizerAdaptor;
use burn::optim::record::AdaptorRecord;
use burn::optim::{
    AdamW, AdamWConfig, AdamWState, AdaptiveMomentumState, GradientsParams, Optimizer as _,
};
use burn::tensor::backend::AutodiffBackend;
use burn::tensor::{Tensor, TensorData};
use serde::{Deserialize, Serialize};

use super::checkpoint::{CheckpointError, Reader, Writer};
use super::soap::Soap;
use crate::networks::FlattenAnything;

/// What makes steps of gradients.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OptimizerKind {
    /// AdamW, as in the paper.
    #[default]
    AdamW,
    /// [`Soap`]: Adam in a basis that turns with the gradients of each matrix, on the host.
    Soap,
}

/// An optimiser of the whole model with its state.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "a trainer has a single one")]
pub(super) enum Optimizer<B: AutodiffBackend> {
    AdamW(OptimizerAdaptor<AdamW, FlattenAnything<B>, B>),
    Soap(Soap),
}

impl<B: AutodiffBackend> Optimizer<B> {
    pub fn new(kind: OptimizerKind, weight_decay: f32) -> Self {
        match kind {
            OptimizerKind::AdamW => {
                let config = AdamWConfig::new()
                    .with_weight_decay(weight_decay)
                    .with_epsilon(1e-8);
                Self::AdamW(config.init())
            }
            OptimizerKind::Soap => Self::Soap(Soap::new(weight_decay)),
        }
    }

    pub fn step(
        &mut self,
        rate: f64,
        model: FlattenAnything<B>,
        gradients: GradientsParams,
    ) -> FlattenAnything<B> {
        match self {
            Self::AdamW(optimizer) => optimizer.step(rate, model, gradients),
            Self::Soap(optimizer) => optimizer.step(rate, model, gradients),
        }
    }

    /// Writes the state of every parameter of a model, under `prefix` and its number.
    pub fn write(&self, model: &FlattenAnything<B>, prefix: &str, out: &mut Writer) {
        match self {
            Self::AdamW(optimizer) => model.visit(&mut WriteAdamW::<B> {
                records: optimizer.to_record(),
                prefix,
                out,
                number: 0,
            }),
            Self::Soap(optimizer) => optimizer.write(model, prefix, out),
        }
    }

    /// This optimiser with the states of the parameters of a model that [`write`](Self::write) wrote.
    pub fn with_states(
        self,
        model: &FlattenAnything<B>,
        prefix: &str,
        file: &Reader,
    ) -> Result<Self, CheckpointError> {
        match self {
            Self::AdamW(optimizer) => {
                let mut read = ReadAdamW::<B> {
                    records: Default::default(),
                    prefix,
                    file,
                    number: 0,
                    error: None,
                };
                model.visit(&mut read);
                match read.error {
                    Some(error) => Err(error),
                    None => Ok(Self::AdamW(optimizer.load_record(read.records))),
                }
            }
            Self::Soap(optimizer) => Ok(Self::Soap(optimizer.with_states(model, prefix, file)?)),
        }
    }
}

type Record<B> = AdaptorRecord<AdamW, B>;

/// The states of all parameters.
type Records<B> = <OptimizerAdaptor<AdamW, FlattenAnything<B>, B> as burn::optim::Optimizer<
    FlattenAnything<B>,
    B,
>>::Record;

struct WriteAdamW<'a, B: AutodiffBackend> {
    records: Records<B>,
    prefix: &'a str,
    out: &'a mut Writer,
    number: usize,
}

impl<B: AutodiffBackend> ModuleVisitor<B> for WriteAdamW<'_, B> {
    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<B, D>>) {
        let name = |what: &str| format!("{}.{}.{what}", self.prefix, self.number);
        let names = [name("time"), name("mean"), name("square")];
        self.number += 1;
        let Some(record) = self.records.remove(&parameter.id) else {
            return;
        };
        let AdamWState { momentum } = record.into_state::<D>();
        let [time, mean, square] = names;
        // Whole numbers of training are exact in 32 bits.
        self.out.put(time, vec![1], &[momentum.time as f32]);
        for (name, moment) in [(mean, momentum.moment_1), (square, momentum.moment_2)] {
            let data = moment.into_data();
            let values: Vec<f32> = data.iter::<f32>().collect();
            self.out.put(name, data.shape.to_vec(), &values);
        }
    }
}

struct ReadAdamW<'a, 'b, B: AutodiffBackend> {
    records: Records<B>,
    prefix: &'a str,
    file: &'a Reader<'b>,
    number: usize,
    error: Option<CheckpointError>,
}

impl<B: AutodiffBackend> ReadAdamW<'_, '_, B> {
    fn state<const D: usize>(
        &self,
        number: usize,
        parameter: &Tensor<B, D>,
    ) -> Result<Option<Record<B>>, CheckpointError> {
        let name = |what: &str| format!("{}.{number}.{what}", self.prefix);
        if !self.file.has(&name("time")) {
            return Ok(None);
        }
        let moment = |what: &str| -> Result<Tensor<B::InnerBackend, D>, CheckpointError> {
            let values = self.file.get(&name(what), &parameter.shape())?;
            let data = TensorData::new(values, parameter.shape());
            Ok(Tensor::from_data(
                data,
                (&parameter.device(), parameter.dtype()),
            ))
        };
        let time = self.file.get(&name("time"), &[1])?[0] as usize;
        let momentum = AdaptiveMomentumState::new(time, moment("mean")?, moment("square")?);
        Ok(Some(AdaptorRecord::from_state::<D>(AdamWState::new(
            momentum,
        ))))
    }
}

impl<B: AutodiffBackend> ModuleVisitor<B> for ReadAdamW<'_, '_, B> {
    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<B, D>>) {
        let number = self.number;
        self.number += 1;
        match self.state(number, &parameter.val()) {
            Ok(Some(record)) => {
                self.records.insert(parameter.id, record);
            }
            Ok(None) => {}
            Err(error) => {
                self.error.get_or_insert(error);
            }
        }
    }
}
