use burn::nn::Linear;
use burn::tensor::{FloatDType, Tensor, TensorData, backend::Backend};

use super::Evaluation;
use crate::networks::{Mlp, activation_slope};

/// Burn's operations on points and tangents in one tensor, for graphics devices.
///
/// A layer is one product of a batch of blocks, instead of one for the points and one for each
/// tangent. Gradients of weights and biases are sums over rows, which such devices add up one
/// after the other: now those of a block, and then those of all blocks.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stacked;

/// Rows of a block at most: at the paper's 10,000 points, 48 blocks of 625 rows keep all
/// multiprocessors of a large GPU busy with the gradient of a weight matrix.
const BLOCK: usize = 1_000;

/// Blocks with fewer rows than this are too many.
const SMALLEST_BLOCK: usize = 100;

impl<B: Backend> Evaluation<B> for Stacked {
    fn single(
        &self,
        xi: &Mlp<B>,
        x: Tensor<B, 2>,
        tangents: Vec<Tensor<B, 2>>,
    ) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let stack = Stack::new(x, tangents);
        stack.through(xi).apart()
    }

    fn twofold(
        &self,
        xi_1: &Mlp<B>,
        xi_2: &Mlp<B>,
        x: Tensor<B, 2>,
        tangents: Vec<Tensor<B, 2>>,
    ) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let stack = Stack::new(x, tangents);
        let latent = stack.clone().through(xi_1);
        let rows = Tensor::cat(vec![stack.rows, latent.rows], 2);
        Stack { rows, ..latent }.through(xi_2).apart()
    }
}

/// Points, and tangents at them.
#[derive(Clone)]
struct Stack<B: Backend> {
    /// `[blocks, N / blocks of the points, width]`: the blocks of the points, then those of each
    /// tangent.
    rows: Tensor<B, 3>,
    /// 1 for the points, and 1 for each tangent.
    parts: usize,
}

impl<B: Backend> Stack<B> {
    fn new(x: Tensor<B, 2>, tangents: Vec<Tensor<B, 2>>) -> Self {
        let [n, width] = x.dims();
        let parts = 1 + tangents.len();
        let rows = match parts {
            1 => x,
            _ => Tensor::cat(std::iter::once(x).chain(tangents).collect(), 0),
        };
        let block = block(n);
        Self {
            rows: rows.reshape([parts * (n / block), block, width]),
            parts,
        }
    }

    /// ξ at the points, and its derivative there applied to the tangents.
    fn through(mut self, xi: &Mlp<B>) -> Self {
        let hidden = xi.layers.len() - 1;
        for layer in &xi.layers[..hidden] {
            self = self.affine(layer);
            let [blocks, block, width] = self.rows.dims();
            let of_points = self.rows.clone().narrow(0, 0, blocks / self.parts);
            let slope = activation_slope(of_points).unsqueeze::<4>();
            let split = [self.parts, blocks / self.parts, block, width];
            self.rows = (self.rows.reshape(split) * slope).reshape([blocks, block, width]);
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

    /// 1 for each block of the points, 0 for those of tangents: `[blocks, 1, 1]`.
    fn of_points(&self) -> Tensor<B, 3> {
        let blocks = self.rows.dims()[0];
        let mut values = vec![0.0f32; blocks];
        values[..blocks / self.parts].fill(1.0);
        let values = TensorData::new(values, [blocks, 1, 1]);
        let values = Tensor::<B, 3>::from_data(values, &self.rows.device());
        values.cast(FloatDType::from(self.rows.dtype()))
    }

    /// The points and the tangents, each `[N, width]`.
    fn apart(self) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let [blocks, block, width] = self.rows.dims();
        let n = blocks * block / self.parts;
        let rows = self.rows.reshape([blocks * block, width]);
        let part = |part: usize| rows.clone().narrow(0, part * n, n);
        (part(0), (1..self.parts).map(part).collect())
    }
}

/// Rows of the blocks that N points are divided into: the greatest divisor of N that is not too
/// large, or N if that is too small.
fn block(n: usize) -> usize {
    let sizes = (SMALLEST_BLOCK..=BLOCK.min(n)).rev();
    sizes
        .into_iter()
        .find(|size| n.is_multiple_of(*size))
        .unwrap_or(n)
}
