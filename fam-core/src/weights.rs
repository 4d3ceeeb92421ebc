//! Network weights as named safetensors, in PyTorch's layout.
//!
//! A stack's layer `i` is `<stack>.<i>.weight` `[out, in]` and `<stack>.<i>.bias` `[out]`, where
//! `<stack>` is `deform.mlp_1`, `deform.mlp_2`, `wrap.mlp_1`, `wrap.mlp_2`, `cut.mlp_1`,
//! `cut.mlp_2` or `unwrap.mlp`. Weights of the authors' program are read by its own names.

use std::collections::HashMap;

use burn::module::Param;
use burn::nn::Linear;
use burn::tensor::{Tensor, TensorData, backend::Backend};
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};

use crate::networks::{FlattenAnything, FlattenAnythingConfig, Mlp};

/// Why weights could not be read.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The bytes are no safetensors file.
    #[error("it is no valid safetensors file: {0}")]
    Container(#[from] SafeTensorError),
    /// A weight is missing.
    #[error("the tensor {0} is missing")]
    Missing(String),
    /// A weight has another shape than the configuration asks for.
    #[error("the tensor {name} has the shape {found:?}, expected {expected:?}")]
    Shape {
        /// Name of the tensor.
        name: String,
        /// Shape in the file.
        found: Vec<usize>,
        /// Shape of the configured network.
        expected: Vec<usize>,
    },
    /// The weights ask for networks that are empty or wider than any that are trained.
    #[error("its networks are not between 1 and 8192 wide")]
    Widths,
    /// A weight is not stored in 32-bit floats.
    #[error("the tensor {0} is not of 32-bit floats")]
    ElementType(String),
    /// A weight is NaN or infinite.
    #[error("the tensor {0} holds a value that is not a finite number")]
    NonFinite(String),
}

/// How a file names its tensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Naming<'a> {
    Own {
        /// In front of every name.
        prefix: &'a str,
    },
    Reference,
}

/// The name, the shape and the bytes (little-endian, row by row) of a tensor of 32-bit floats.
pub type NamedTensor = (String, Vec<usize>, Vec<u8>);

impl<B: Backend> FlattenAnything<B> {
    /// The model from weights that the authors' program trained, saved as safetensors under
    /// that program's parameter names (`grid_deforming.mlp_1.0.conv.weight` …), with or
    /// without a `param.` in front. Widths are taken from the tensors.
    ///
    /// # Errors
    /// See [`WeightsError`].
    pub fn from_reference(bytes: &[u8], device: &B::Device) -> Result<Self, WeightsError> {
        let file = SafeTensors::deserialize(bytes)?;
        let rows = |stack: &str, layer: usize| -> Result<usize, WeightsError> {
            let name = Naming::Reference.tensor(stack, layer, "weight");
            Ok(find(&file, &name)?.shape().first().copied().unwrap_or(0))
        };
        let width = rows("deform.mlp_1", 0)?;
        let config = FlattenAnythingConfig::new()
            .with_width(width)
            .with_unwrap_factor(Some(rows("unwrap.mlp", 0)? / width.max(1)))
            .with_latent(rows("deform.mlp_1", 3)?);
        match config.is_possible() {
            true => read(&file, &config, Naming::Reference, device),
            false => Err(WeightsError::Widths),
        }
    }

    /// The weights under the parameter names and in the shapes of the authors' program.
    pub fn to_reference(&self) -> Vec<NamedTensor> {
        let mut tensors = named(self, Naming::Reference);
        for (_, shape, _) in &mut tensors {
            // Its layers are convolutions of width 1.
            if shape.len() == 2 {
                shape.push(1);
            }
        }
        tensors
    }

    /// The stacks of linear layers by name.
    pub(crate) fn stacks(&self) -> [(&'static str, &Mlp<B>); 7] {
        [
            ("deform.mlp_1", &self.deform.mlp_1),
            ("deform.mlp_2", &self.deform.mlp_2),
            ("wrap.mlp_1", &self.wrap.mlp_1),
            ("wrap.mlp_2", &self.wrap.mlp_2),
            ("cut.mlp_1", &self.cut.mlp_1),
            ("cut.mlp_2", &self.cut.mlp_2),
            ("unwrap.mlp", &self.unwrap.mlp),
        ]
    }

    fn stacks_mut(&mut self) -> [(&'static str, &mut Mlp<B>); 7] {
        [
            ("deform.mlp_1", &mut self.deform.mlp_1),
            ("deform.mlp_2", &mut self.deform.mlp_2),
            ("wrap.mlp_1", &mut self.wrap.mlp_1),
            ("wrap.mlp_2", &mut self.wrap.mlp_2),
            ("cut.mlp_1", &mut self.cut.mlp_1),
            ("cut.mlp_2", &mut self.cut.mlp_2),
            ("unwrap.mlp", &mut self.unwrap.mlp),
        ]
    }
}

impl Naming<'_> {
    fn tensor(self, stack: &str, layer: usize, parameter: &str) -> String {
        match self {
            Naming::Own { prefix } => format!("{prefix}{stack}.{layer}.{parameter}"),
            Naming::Reference => {
                let (network, mlp) = stack.split_once('.').expect("stacks have two parts");
                let network = match network {
                    "deform" => "grid_deforming",
                    "wrap" => "wrapping",
                    "cut" => "unwrapping.cut",
                    _ => "unwrapping",
                };
                format!("{network}.{mlp}.{layer}.conv.{parameter}")
            }
        }
    }
}

/// The model of a configuration with the weights of a file.
pub(crate) fn read<B: Backend>(
    file: &SafeTensors<'_>,
    config: &FlattenAnythingConfig,
    naming: Naming<'_>,
    device: &B::Device,
) -> Result<FlattenAnything<B>, WeightsError> {
    let mut model = config.init::<B>(device, 0);
    for (stack, mlp) in model.stacks_mut() {
        for (i, layer) in mlp.layers.iter_mut().enumerate() {
            let [inputs, outputs] = layer.weight.dims();
            let name = naming.tensor(stack, i, "weight");
            let weight = floats(&find(file, &name)?, &name, &[outputs, inputs])?;
            let weight = TensorData::new(weight, [outputs, inputs]);
            let name = naming.tensor(stack, i, "bias");
            let bias = floats(&find(file, &name)?, &name, &[outputs])?;
            *layer = Linear {
                weight: Param::from_tensor(
                    Tensor::<B, 2>::from_data(weight, device)
                        .transpose()
                        .detach(),
                ),
                bias: Some(Param::from_data(TensorData::new(bias, [outputs]), device)),
            };
        }
    }
    Ok(model)
}

/// All weights, for a safetensors file, with `prefix` in front of their names.
pub(crate) fn tensors<B: Backend>(model: &FlattenAnything<B>, prefix: &str) -> Vec<NamedTensor> {
    named(model, Naming::Own { prefix })
}

/// The bytes of a safetensors file with tensors.
///
/// # Errors
/// A tensor has another number of bytes than its shape asks for.
pub fn safetensors(tensors: &[NamedTensor]) -> Result<Vec<u8>, WeightsError> {
    safetensors_with(tensors, None)
}

/// [`safetensors`] with metadata.
pub(crate) fn safetensors_with(
    tensors: &[NamedTensor],
    metadata: Option<HashMap<String, String>>,
) -> Result<Vec<u8>, WeightsError> {
    let views = tensors
        .iter()
        .map(|(name, shape, bytes)| {
            let view = TensorView::new(Dtype::F32, shape.clone(), bytes)?;
            Ok((name.as_str(), view))
        })
        .collect::<Result<Vec<_>, WeightsError>>()?;
    Ok(safetensors::serialize(views, metadata)?)
}

fn named<B: Backend>(model: &FlattenAnything<B>, naming: Naming<'_>) -> Vec<NamedTensor> {
    let bytes = |data: TensorData| -> Vec<u8> {
        let data = data.convert::<f32>();
        data.iter::<f32>().flat_map(f32::to_le_bytes).collect()
    };
    let mut tensors = Vec::new();
    for (stack, mlp) in model.stacks() {
        for (i, layer) in mlp.layers.iter().enumerate() {
            let [inputs, outputs] = layer.weight.dims();
            let weight = layer.weight.val().transpose().into_data();
            let name = naming.tensor(stack, i, "weight");
            tensors.push((name, vec![outputs, inputs], bytes(weight)));
            if let Some(bias) = &layer.bias {
                let name = naming.tensor(stack, i, "bias");
                tensors.push((name, vec![outputs], bytes(bias.val().into_data())));
            }
        }
    }
    tensors
}

pub(crate) fn find<'a>(file: &SafeTensors<'a>, name: &str) -> Result<TensorView<'a>, WeightsError> {
    file.tensor(name)
        .or_else(|_| file.tensor(&format!("param.{name}")))
        .map_err(|_| WeightsError::Missing(name.to_string()))
}

/// The values of a tensor; a trailing dimension of 1 (a convolution of width 1) is ignored.
pub(crate) fn floats(
    view: &TensorView<'_>,
    name: &str,
    expected: &[usize],
) -> Result<Vec<f32>, WeightsError> {
    let shape = view.shape();
    let squeezed = match shape {
        [out, input, 1] => &[*out, *input][..],
        _ => shape,
    };
    if squeezed != expected {
        return Err(WeightsError::Shape {
            name: name.to_string(),
            found: shape.to_vec(),
            expected: expected.to_vec(),
        });
    }
    if view.dtype() != Dtype::F32 {
        return Err(WeightsError::ElementType(name.to_string()));
    }
    let (chunks, _) = view.data().as_chunks::<4>();
    let values: Vec<f32> = chunks.iter().map(|b| f32::from_le_bytes(*b)).collect();
    if !values.iter().all(|v| v.is_finite()) {
        return Err(WeightsError::NonFinite(name.to_string()));
    }
    Ok(values)
}
