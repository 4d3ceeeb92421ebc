//! SOAP, an optimiser of small networks.

mod moments;

use std::collections::HashMap;
use std::mem;

use burn::module::{AutodiffModule, Module, ModuleMapper, ModuleVisitor, Param, ParamId};
use burn::optim::GradientsParams;
use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::{Tensor, TensorData, Transaction};
use rayon::prelude::*;

use super::checkpoint::{CheckpointError, Reader, Writer};
use moments::Moments;

/// SOAP (Vyas et al., *Improving and Stabilizing Shampoo using Adam*, 2024): Adam, for matrices in
/// the eigenbases of the running means of G·Gᵀ and Gᵀ·G of their gradients G.
///
/// A step in that basis is a step of Adam in which the directions do not compete. Parameters that
/// are no matrices take plain steps of Adam. The first gradient of a matrix only gives its bases.
///
/// The host computes it, parameter beside parameter on its cores: for a small model these are a
/// thousand operations on matrices that stay in a core's cache, and a device would have to be told
/// of each. A model on another device is read in every step.
#[derive(Debug, Clone)]
pub struct Soap {
    weight_decay: f32,
    moments: HashMap<ParamId, Moments>,
}

impl Soap {
    /// An optimiser before its first step. The weight decay is decoupled, as in AdamW.
    pub fn new(weight_decay: f32) -> Self {
        Self {
            weight_decay,
            moments: HashMap::new(),
        }
    }

    /// One step of all parameters of `model` that have a gradient.
    pub fn step<B: AutodiffBackend, M: AutodiffModule<B>>(
        &mut self,
        rate: f64,
        model: M,
        gradients: GradientsParams,
    ) -> M {
        let mut read = Read::<B> {
            gradients,
            ids: Vec::new(),
            data: Transaction::default(),
        };
        model.visit(&mut read);
        let data = read.data.execute();
        let (data, _) = data.as_chunks::<2>();
        let parameters: Vec<_> = read
            .ids
            .into_iter()
            .zip(data)
            .map(|(id, data)| (id, data, self.moments.remove(&id)))
            .collect();
        let rate = rate as f32;
        let decay = 1.0 - rate * self.weight_decay;
        let stepped: Vec<_> = parameters
            .into_par_iter()
            .with_max_len(1)
            .map(|(id, [parameter, gradient], moments)| {
                let mut moments = moments.unwrap_or_else(|| Moments::new(&gradient.shape));
                let update = moments.step(on_host(gradient));
                let mut values = on_host(parameter);
                for (value, update) in values.iter_mut().zip(update) {
                    *value = *value * decay - update * rate;
                }
                (id, values, moments)
            })
            .collect();
        let mut write = Write {
            values: HashMap::new(),
        };
        for (id, values, moments) in stepped {
            self.moments.insert(id, moments);
            write.values.insert(id, values);
        }
        model.map(&mut write)
    }
}

impl Soap {
    /// Writes the state of every parameter of a model, under `prefix` and its number.
    pub(super) fn write<B: Backend, M: Module<B>>(
        &self,
        model: &M,
        prefix: &str,
        out: &mut Writer,
    ) {
        for (number, (id, _)) in parameters(model).into_iter().enumerate() {
            if let Some(moments) = self.moments.get(&id) {
                moments.write(&format!("{prefix}.{number}"), out);
            }
        }
    }

    /// This optimiser with the states of the parameters of a model that were written.
    pub(super) fn with_states<B: Backend, M: Module<B>>(
        mut self,
        model: &M,
        prefix: &str,
        file: &Reader,
    ) -> Result<Self, CheckpointError> {
        for (number, (id, shape)) in parameters(model).into_iter().enumerate() {
            let moments = Moments::read(&format!("{prefix}.{number}"), &shape, file)?;
            self.moments.extend(moments.map(|moments| (id, moments)));
        }
        Ok(self)
    }
}

/// The parameters of a model, in its order, with their shapes.
fn parameters<B: Backend, M: Module<B>>(model: &M) -> Vec<(ParamId, Vec<usize>)> {
    struct List(Vec<(ParamId, Vec<usize>)>);
    impl<B: Backend> ModuleVisitor<B> for List {
        fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<B, D>>) {
            self.0.push((parameter.id, parameter.shape().to_vec()));
        }
    }
    let mut list = List(Vec::new());
    model.visit(&mut list);
    list.0
}

fn on_host(data: &TensorData) -> Vec<f32> {
    data.iter::<f32>().collect()
}

/// Reads parameters that have a gradient, each followed by it.
struct Read<B: AutodiffBackend> {
    gradients: GradientsParams,
    ids: Vec<ParamId>,
    data: Transaction<B::InnerBackend>,
}

impl<B: AutodiffBackend> ModuleVisitor<B> for Read<B> {
    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<B, D>>) {
        let Some(gradient) = self.gradients.remove::<B::InnerBackend, D>(parameter.id) else {
            return;
        };
        self.ids.push(parameter.id);
        self.data = mem::take(&mut self.data)
            .register(parameter.val().inner())
            .register(gradient);
    }
}

/// Gives parameters new values.
struct Write {
    values: HashMap<ParamId, Vec<f32>>,
}

impl<B: AutodiffBackend> ModuleMapper<B> for Write {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
        let Some(values) = self.values.remove(&parameter.id) else {
            return parameter;
        };
        let (id, old, mapper) = parameter.consume();
        let data = TensorData::new(values, old.shape());
        let new = Tensor::from_data(data, (&old.device(), old.dtype()));
        let new = new.set_require_grad(old.is_require_grad());
        Param::from_mapped_value(id, new, mapper)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::nn::{LayerNorm, LayerNormConfig};
    use burn::optim::{AdamWConfig, Optimizer};
    use burn::tensor::Tolerance;
    use burn_autodiff::Autodiff;
    use burn_ndarray::NdArray;

    type B = Autodiff<NdArray>;

    /// γ and β of a normalisation, after some steps on a sum of squares.
    fn trained(
        mut step: impl FnMut(LayerNorm<B>, GradientsParams) -> LayerNorm<B>,
    ) -> [TensorData; 2] {
        let device = Default::default();
        let mut model = LayerNormConfig::new(3).init::<B>(&device);
        let x = Tensor::<B, 2>::from_floats([[0.5, -1.0, 2.0], [1.0, 0.3, -0.7]], &device);
        let target = Tensor::from_floats([[1.0, 2.0, 0.0], [-1.0, 0.5, 3.0]], &device);
        for _ in 0..5 {
            let loss = (model.forward(x.clone()) - target.clone()).powf_scalar(2.0);
            let gradients = GradientsParams::from_grads(loss.sum().backward(), &model);
            model = step(model, gradients);
        }
        let beta = model.beta.expect("it has one");
        [model.gamma.val().into_data(), beta.val().into_data()]
    }

    /// All of a model's parameters that are no matrices.
    #[test]
    fn vectors_take_the_steps_of_adam() {
        let mut soap = Soap::new(0.1);
        let mut adam = AdamWConfig::new()
            .with_beta_1(moments::BETA)
            .with_beta_2(moments::BETA)
            .with_epsilon(moments::EPSILON)
            .with_weight_decay(0.1)
            .init::<B, LayerNorm<B>>();
        let by_soap = trained(|model, gradients| soap.step::<B, _>(0.1, model, gradients));
        let by_adam = trained(|model, gradients| adam.step(0.1, model, gradients));
        for (soap, adam) in by_soap.iter().zip(&by_adam) {
            soap.assert_approx_eq(adam, Tolerance::<f32>::absolute(1e-5));
        }
    }
}
