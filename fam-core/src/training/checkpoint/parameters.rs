use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData, backend::Backend};

use super::{CheckpointError, Reader, Writer};
use crate::networks::{FlattenAnything, FlattenAnythingConfig};

/// Writes the parameters of a model under numbered names, each in its own shape. A model that is read
/// has them in that shape, too: the product of a matrix that is a transposed view may round otherwise.
pub(crate) struct ModelWriter<'a> {
    prefix: String,
    out: &'a mut Writer,
    number: usize,
}

impl<'a> ModelWriter<'a> {
    pub fn write<B: Backend>(prefix: String, model: &FlattenAnything<B>, out: &'a mut Writer) {
        let mut writer = Self {
            prefix,
            out,
            number: 0,
        };
        model.visit(&mut writer);
    }
}

impl<B: Backend> ModuleVisitor<B> for ModelWriter<'_> {
    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<B, D>>) {
        let data = parameter.val().into_data();
        let values: Vec<f32> = data.iter::<f32>().collect();
        let name = format!("{}.{}", self.prefix, self.number);
        self.out.put(name, data.shape.to_vec(), &values);
        self.number += 1;
    }
}

/// Reads what [`ModelWriter`] wrote.
pub(crate) struct ModelReader<'a, 'b> {
    prefix: &'a str,
    file: &'a Reader<'b>,
    number: usize,
    error: Option<CheckpointError>,
}

impl<'a, 'b> ModelReader<'a, 'b> {
    pub fn read<B: Backend>(
        prefix: &'a str,
        config: &FlattenAnythingConfig,
        file: &'a Reader<'b>,
        device: &B::Device,
    ) -> Result<FlattenAnything<B>, CheckpointError> {
        let mut reader = Self {
            prefix,
            file,
            number: 0,
            error: None,
        };
        let model = config.init::<B>(device, 0).map(&mut reader);
        match reader.error {
            Some(error) => Err(error),
            None => Ok(model),
        }
    }
}

impl<B: Backend> ModuleMapper<B> for ModelReader<'_, '_> {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
        let name = format!("{}.{}", self.prefix, self.number);
        self.number += 1;
        let (id, old, mapper) = parameter.consume();
        let new = match self.file.get(&name, &old.shape()) {
            Ok(values) => {
                let data = TensorData::new(values, old.shape());
                let new = Tensor::from_data(data, (&old.device(), old.dtype()));
                new.set_require_grad(old.is_require_grad())
            }
            Err(error) => {
                self.error.get_or_insert(error);
                old
            }
        };
        Param::from_mapped_value(id, new, mapper)
    }
}
