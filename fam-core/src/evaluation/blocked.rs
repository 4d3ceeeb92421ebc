use burn::nn::Linear;
use burn::tensor::{FloatDType, Tensor, TensorData, backend::Backend};

use super::Evaluation;
use crate::networks::{Mlp, activation_slope};

/// Burn's operations on points and tangents in one tensor of blocks, for graphics devices.
///
/// A layer is one product of a batch of blocks, instead of one for the points and one for each
/// tangent. Gradients of weights and biases are sums over rows, which such devices add up one
/// after the other: over the rows of a block and over the blocks these are much shorter.
#[derive(Debug, Clone, Copy, Default)]
pub struct Blocked;

/// Rows of a block: at the paper's 10,000 points with two tangents there are 60 blocks, enough to
/// keep a large GPU busy with the gradient of a weight matrix.
const BLOCK: usize = 512;

impl<B: Backend> Evaluation<B> for Blocked {
    fn single(&self, xi: &Mlp<B>, x: Tensor<B, 2>) -> Tensor<B, 2> {
        Blocks::new(x, Vec::new()).through(xi).apart().0
    }

    fn twofold(
        &self,
        xi_1: &Mlp<B>,
        xi_2: &Mlp<B>,
        x: Tensor<B, 2>,
        tangents: Vec<Tensor<B, 2>>,
    ) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let blocks = Blocks::new(x, tangents);
        let latent = blocks.clone().through(xi_1);
        let rows = Tensor::cat(vec![blocks.rows, latent.rows], 2);
        Blocks { rows, ..latent }.through(xi_2).apart()
    }
}

/// Points, and tangents at them.
#[derive(Clone)]
struct Blocks<B: Backend> {
    /// `[parts · blocks, rows of a block, width]`: the blocks of the points, then those of each
    /// tangent. The last block of each is filled up with zeros.
    rows: Tensor<B, 3>,
    /// N.
    points: usize,
    /// 1 for the points, and 1 for each tangent.
    parts: usize,
}

impl<B: Backend> Blocks<B> {
    fn new(x: Tensor<B, 2>, tangents: Vec<Tensor<B, 2>>) -> Self {
        let [points, width] = x.dims();
        let parts = 1 + tangents.len();
        let block = BLOCK.min(points);
        let blocks = points.div_ceil(block);
        let missing = blocks * block - points;
        let zeros = (missing > 0).then(|| {
            let zeros = Tensor::<B, 2>::zeros([missing, width], &x.device());
            zeros.cast(FloatDType::from(x.dtype()))
        });
        let each = std::iter::once(x).chain(tangents);
        let rows = each.flat_map(|part| [Some(part), zeros.clone()]).flatten();
        let rows = Tensor::cat(rows.collect(), 0);
        Self {
            rows: rows.reshape([parts * blocks, block, width]),
            points,
            parts,
        }
    }

    /// ξ at the points, and its derivative there applied to the tangents.
    fn through(mut self, xi: &Mlp<B>) -> Self {
        let hidden = xi.layers.len() - 1;
        for layer in &xi.layers[..hidden] {
            self = self.affine(layer);
            let [all, block, width] = self.rows.dims();
            let of_points = self.rows.clone().narrow(0, 0, all / self.parts);
            let slope = activation_slope(of_points).unsqueeze::<4>();
            let split = [self.parts, all / self.parts, block, width];
            self.rows = (self.rows.reshape(split) * slope).reshape([all, block, width]);
        }
        self.affine(&xi.layers[hidden])
    }

    /// x·W + b at the points, x·W for the tangents.
    fn affine(mut self, layer: &Linear<B>) -> Self {
        self.rows = self.rows.matmul(layer.weight.val().unsqueeze());
        if let Some(bias) = &layer.bias {
            let mut bias = bias.val().unsqueeze::<3>();
            if self.parts > 1 {
                bias = bias * self.of_points();
            }
            self.rows = self.rows + bias;
        }
        self
    }

    /// 1 for each block of the points, 0 for those of tangents: `[parts · blocks, 1, 1]`.
    fn of_points(&self) -> Tensor<B, 3> {
        let all = self.rows.dims()[0];
        let mut values = vec![0.0f32; all];
        values[..all / self.parts].fill(1.0);
        let values = TensorData::new(values, [all, 1, 1]);
        let values = Tensor::<B, 3>::from_data(values, &self.rows.device());
        values.cast(FloatDType::from(self.rows.dtype()))
    }

    /// The points and the tangents, each `[N, width]`.
    fn apart(self) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let [all, block, width] = self.rows.dims();
        let filled = all * block / self.parts;
        let rows = self.rows.reshape([all * block, width]);
        let part = |part: usize| rows.clone().narrow(0, part * filled, self.points);
        (part(0), (1..self.parts).map(part).collect())
    }
}
