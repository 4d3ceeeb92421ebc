use burn::module::{Module, Param};
use burn::nn::Linear;
use burn::tensor::{Tensor, TensorData, backend::Backend};
use rand::{Rng, RngExt};

/// Slope of LeakyReLU for negative inputs (the paper's appendix).
pub(crate) const NEGATIVE_SLOPE: f32 = 0.01;

/// Stacked linear layers, ξ in the paper: LeakyReLU after every layer but the last.
#[derive(Module, Debug)]
pub struct Mlp<B: Backend> {
    /// The linear layers, first to last.
    pub layers: Vec<Linear<B>>,
}

/// The slopes of every activation at the points of one evaluation: one `[N, width]` tensor
/// of 1 and 0.01 per hidden layer. They are constants for the gradient.
pub type Slopes<B> = Vec<Tensor<B, 2>>;

impl<B: Backend> Mlp<B> {
    /// Layers of the given channels, weights and biases uniform in ±1/√fan-in.
    ///
    /// The numbers come from `rng`, not from the backend's generator, so that one seed gives
    /// the same weights on every backend.
    pub(super) fn init(channels: &[usize], device: &B::Device, rng: &mut impl Rng) -> Self {
        let layers = channels
            .windows(2)
            .map(|pair| {
                let bound = 1.0 / (pair[0] as f32).sqrt();
                let mut uniform = |n: usize| -> Vec<f32> {
                    (0..n).map(|_| rng.random_range(-bound..bound)).collect()
                };
                let weight = TensorData::new(uniform(pair[0] * pair[1]), [pair[0], pair[1]]);
                let bias = TensorData::new(uniform(pair[1]), [pair[1]]);
                Linear {
                    weight: Param::from_data(weight, device),
                    bias: Some(Param::from_data(bias, device)),
                }
            })
            .collect();
        Self { layers }
    }

    /// Channels before, between and after the layers.
    pub(crate) fn channels(&self) -> Vec<usize> {
        let inputs = self.layers[0].weight.dims()[0];
        let outputs = self.layers.iter().map(|layer| layer.weight.dims()[1]);
        std::iter::once(inputs).chain(outputs).collect()
    }

    /// Layer by layer all weights and biases, each in one row; a missing bias is zero.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = Tensor<B, 1>> {
        self.layers.iter().flat_map(|layer| {
            let weight = layer.weight.val();
            let [inputs, outputs] = weight.dims();
            let bias = match &layer.bias {
                Some(bias) => bias.val(),
                None => Tensor::zeros([outputs], &weight.device()),
            };
            [weight.reshape([inputs * outputs]), bias]
        })
    }

    /// ξ(x): `[N, in] → [N, out]`.
    pub fn forward(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        self.forward_with_slopes(x).0
    }

    /// ξ(x) and the activations' slopes there.
    pub fn forward_with_slopes(&self, mut x: Tensor<B, 2>) -> (Tensor<B, 2>, Slopes<B>) {
        let hidden = self.layers.len() - 1;
        let mut slopes = Vec::with_capacity(hidden);
        for layer in &self.layers[..hidden] {
            let before = affine(layer, x);
            let slope = activation_slope(before.clone());
            x = before * slope.clone();
            slopes.push(slope);
        }
        (affine(&self.layers[hidden], x), slopes)
    }

    /// The derivative of ξ at the points of `slopes`, applied to a tangent: `[N, in] → [N, out]`.
    ///
    /// The activation is piecewise linear, so its slope contributes no second derivative.
    pub fn push_tangent(&self, mut tangent: Tensor<B, 2>, slopes: &Slopes<B>) -> Tensor<B, 2> {
        for (i, layer) in self.layers.iter().enumerate() {
            tangent = tangent.matmul(layer.weight.val());
            if let Some(slope) = slopes.get(i) {
                tangent = tangent * slope.clone();
            }
        }
        tangent
    }
}

/// x·W + b in plain operations: the backward pass of Burn's fused `linear` is not
/// differentiable again.
fn affine<B: Backend>(layer: &Linear<B>, x: Tensor<B, 2>) -> Tensor<B, 2> {
    let product = x.matmul(layer.weight.val());
    match &layer.bias {
        Some(bias) => product + bias.val().unsqueeze(),
        None => product,
    }
}

/// 1 where the input is positive, else [`NEGATIVE_SLOPE`]; no gradient flows through it.
///
/// Two passes over floats instead of a mask and its conversion: scaled this far, every
/// input but one below 1e-30 in size lands outside the bounds.
pub(crate) fn activation_slope<B: Backend, const D: usize>(x: Tensor<B, D>) -> Tensor<B, D> {
    (x.detach() * 1e30).clamp(NEGATIVE_SLOPE, 1.0)
}
