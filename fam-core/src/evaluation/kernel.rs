//! A sub-network over tiles of points, forward and backward, on slices of `f32`.
//!
//! *Stacked* rows are those of N points, and after them N rows for each tangent at these points.
//! A tangent's rows go through the same weights without the biases, and through the slopes that
//! the activations have at its points. Both passes are therefore products over the rows of a
//! tile, all tangents among them. Tiles, and which tile adds to which sum of weight gradients,
//! depend on the sizes alone, so that the numbers do not depend on the number of threads.
//!
//! [`pullback`] is the backward pass in a form that can be differentiated again.
//!
//! Loops over the hidden values go through `pulp`, which compiles them for the wider registers
//! that most processors turn out to have.

use std::ops::Range;
use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Arch;
use rayon::prelude::*;

use super::buffers::Buffers;
use crate::networks::NEGATIVE_SLOPE;

pub(super) mod pullback;

/// Rows of a tile. A product of 192 rows is as fast as one of thousands, and at width 64 two
/// layers of them (96 KiB) stay in a core's second-level cache.
const TILE_ROWS: usize = 192;

/// Sums of weight gradients that are kept apart, at most, and so the most threads of a backward
/// pass.
const SUMS: usize = 16;

/// Values of such sums that one task adds up: 16 KiB of each, which stay in a core's first-level
/// cache.
const SUMMED_AT_ONCE: usize = 4096;

/// What is evaluated, and at how many points.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sizes {
    /// The channels of ξ, or of ξ′ and ξ″ (which takes the inputs of ξ′ before its outputs).
    pub stacks: Vec<Vec<usize>>,
    /// Points N.
    pub points: usize,
    /// Tangents at every point.
    pub tangents: usize,
}

/// What the backward pass needs of the forward pass.
#[derive(Debug)]
pub(super) struct Saved {
    pub sizes: Sizes,
    /// Stacked inputs.
    input: Vec<f32>,
    /// Layer by layer weights `[in, out]` and biases `[out]`.
    parameters: Vec<f32>,
    /// Tile by tile, in it layer by layer, the rows that go into every layer but the first.
    between: Vec<f32>,
    /// Where `between` goes in the end.
    buffers: Arc<Buffers>,
}

/// Gradients in the layouts of [`Saved`].
pub(super) struct Gradients {
    pub input: Vec<f32>,
    pub parameters: Vec<f32>,
}

/// What goes into a layer.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    /// The inputs x.
    Input,
    /// What the layer before gave, activated.
    Activated,
    /// [x, ξ′(x)].
    Joined,
}

struct Layer<'a> {
    source: Source,
    weight: MatRef<'a, f32>,
    bias: &'a [f32],
}

impl Drop for Saved {
    fn drop(&mut self) {
        self.buffers.give_back(std::mem::take(&mut self.between));
    }
}

impl Sizes {
    /// Channels of x.
    pub(super) fn inputs(&self) -> usize {
        self.stacks[0][0]
    }

    /// Channels of the result.
    pub(super) fn outputs(&self) -> usize {
        let last = &self.stacks[self.stacks.len() - 1];
        last[last.len() - 1]
    }

    /// Rows for every point.
    fn copies(&self) -> usize {
        1 + self.tangents
    }

    /// Values of a row that go into the layers after the first.
    fn between(&self) -> usize {
        let channels = self
            .stacks
            .iter()
            .flat_map(|stack| &stack[..stack.len() - 1]);
        channels.sum::<usize>() - self.inputs()
    }

    /// The points of every tile.
    fn tiles(&self) -> Vec<Range<usize>> {
        let size = (TILE_ROWS / self.copies()).max(1);
        (0..self.points)
            .step_by(size)
            .map(|first| first..(first + size).min(self.points))
            .collect()
    }

    fn layers<'a>(&self, mut parameters: &'a [f32]) -> Vec<Layer<'a>> {
        let mut layers = Vec::new();
        for (s, stack) in self.stacks.iter().enumerate() {
            for (l, pair) in stack.windows(2).enumerate() {
                let (weight, rest) = parameters.split_at(pair[0] * pair[1]);
                let (bias, rest) = rest.split_at(pair[1]);
                parameters = rest;
                layers.push(Layer {
                    source: match (s, l) {
                        (0, 0) => Source::Input,
                        (_, 0) => Source::Joined,
                        _ => Source::Activated,
                    },
                    weight: MatRef::from_row_major_slice(weight, pair[0], pair[1]),
                    bias,
                });
            }
        }
        layers
    }
}

/// The stacked results, and what [`backward`] needs.
pub(super) fn forward(
    sizes: Sizes,
    input: Vec<f32>,
    parameters: Vec<f32>,
    buffers: Arc<Buffers>,
) -> (Vec<f32>, Saved) {
    let tiles = sizes.tiles();
    let row = sizes.copies() * sizes.between();
    let mut between = buffers.take(sizes.points * row);
    let layers = sizes.layers(&parameters);
    let results: Vec<Vec<f32>> = tiles
        .par_iter()
        .zip(pieces(&mut between, tiles.iter().cloned(), row))
        .map(|(tile, between)| {
            let rows = gather(&sizes, sizes.inputs(), &input, tile);
            forward_tile(&layers, tile.len(), &rows, between)
        })
        .collect();
    let output = scatter(&sizes, sizes.outputs(), &tiles, &results);
    let saved = Saved {
        sizes,
        input,
        parameters,
        between,
        buffers,
    };
    (output, saved)
}

/// The gradients for stacked gradients of the results; that of the inputs is left empty unless
/// it is asked for.
pub(super) fn backward(saved: &Saved, gradient: &[f32], of_input: bool) -> Gradients {
    let sizes = &saved.sizes;
    let tiles = sizes.tiles();
    let layers = sizes.layers(&saved.parameters);
    let row = sizes.copies() * sizes.between();
    let count = saved.parameters.len();
    let (parameters, of_inputs) = summed(&tiles, count, |tile, sum| {
        let pass = TilePass {
            layers: &layers,
            points: tile.len(),
            input: &gather(sizes, sizes.inputs(), &saved.input, tile),
            between: &saved.between[tile.start * row..tile.end * row],
        };
        let gradient = gather(sizes, sizes.outputs(), gradient, tile);
        pass.backward(gradient, sum, of_input)
    });
    let input = match of_input {
        true => scatter(sizes, sizes.inputs(), &tiles, &of_inputs),
        false => Vec::new(),
    };
    Gradients { input, parameters }
}

/// The pieces of a buffer that belong to tiles, each of which has as many rows as points.
fn pieces(
    mut buffer: &mut [f32],
    tiles: impl Iterator<Item = Range<usize>>,
    row: usize,
) -> Vec<&mut [f32]> {
    let piece = |tile: Range<usize>| {
        let (piece, rest) = std::mem::take(&mut buffer).split_at_mut(tile.len() * row);
        buffer = rest;
        piece
    };
    tiles.map(piece).collect()
}

/// What `pass` makes of every tile, and the sum of what it adds to `count` gradients of
/// parameters.
fn summed<T: Sync>(
    tiles: &[T],
    count: usize,
    pass: impl Fn(&T, &mut [f32]) -> Vec<f32> + Sync,
) -> (Vec<f32>, Vec<Vec<f32>>) {
    let (sums, results): (Vec<Vec<f32>>, Vec<Vec<Vec<f32>>>) = tiles
        .par_chunks(tiles.len().div_ceil(SUMS).max(1))
        .map(|tiles| {
            let mut sum = vec![0.0; count];
            let results = tiles.iter().map(|tile| pass(tile, &mut sum)).collect();
            (sum, results)
        })
        .unzip();
    let mut sums = sums.into_iter();
    let mut total = sums.next().unwrap_or_else(|| vec![0.0; count]);
    let others: Vec<Vec<f32>> = sums.collect();
    let parts = total.par_chunks_mut(SUMMED_AT_ONCE).enumerate();
    parts.for_each(|(i, part)| {
        let first = i * SUMMED_AT_ONCE;
        for other in &others {
            add_rows(part, &other[first..first + part.len()]);
        }
    });
    (total, results.concat())
}

/// The rows of a tile out of stacked rows: its points', then those of each tangent.
fn gather(sizes: &Sizes, width: usize, stacked: &[f32], tile: &Range<usize>) -> Vec<f32> {
    let mut rows = Vec::with_capacity(sizes.copies() * tile.len() * width);
    for copy in 0..sizes.copies() {
        let first = copy * sizes.points;
        rows.extend_from_slice(&stacked[(first + tile.start) * width..(first + tile.end) * width]);
    }
    rows
}

/// Stacked rows out of those of all tiles.
fn scatter(sizes: &Sizes, width: usize, tiles: &[Range<usize>], rows: &[Vec<f32>]) -> Vec<f32> {
    let mut stacked = Vec::with_capacity(sizes.copies() * sizes.points * width);
    for copy in 0..sizes.copies() {
        for (tile, rows) in tiles.iter().zip(rows) {
            let size = tile.len() * width;
            stacked.extend_from_slice(&rows[copy * size..(copy + 1) * size]);
        }
    }
    stacked
}

/// Takes a tile's rows through all layers: what goes into the second and all further ones is
/// left in `between`, and the last one's results are returned.
fn forward_tile(
    layers: &[Layer],
    points: usize,
    input: &[f32],
    mut between: &mut [f32],
) -> Vec<f32> {
    let inputs = layers[0].weight.nrows();
    let rows = input.len() / inputs;
    let mut current = input;
    for (layer, next) in layers.iter().zip(&layers[1..]) {
        let outputs = layer.weight.ncols();
        let width = next.weight.nrows();
        let (after, rest) = between.split_at_mut(rows * width);
        let offset = width - outputs;
        if next.source == Source::Joined {
            join(after, input, width, inputs);
        }
        let result = MatMut::from_row_major_slice_mut(&mut *after, rows, width);
        multiply(result.subcols_mut(offset, outputs), current, layer.weight);
        if next.source == Source::Joined {
            add_bias(&mut after[..points * width], width, layer.bias);
        } else {
            activate(after, points, layer.bias);
        }
        (current, between) = (after, rest);
    }
    let last = &layers[layers.len() - 1];
    let outputs = last.bias.len();
    let mut output = vec![0.0; rows * outputs];
    let result = MatMut::from_row_major_slice_mut(&mut output, rows, outputs);
    multiply(result, current, last.weight);
    add_bias(&mut output[..points * outputs], outputs, last.bias);
    output
}

/// Copies x into the first columns of rows of a width.
fn join(rows: &mut [f32], x: &[f32], width: usize, inputs: usize) {
    let x = x.chunks_exact(inputs);
    for (row, x) in rows.chunks_exact_mut(width).zip(x) {
        row[..inputs].copy_from_slice(x);
    }
}

fn multiply(result: MatMut<f32>, rows: &[f32], weight: MatRef<f32>) {
    let rows = MatRef::from_row_major_slice(rows, result.nrows(), weight.nrows());
    matmul(result, Accum::Replace, rows, weight, 1.0, Par::Seq);
}

/// Adds the bias to the last columns of rows of a width.
fn add_bias(rows: &mut [f32], width: usize, bias: &[f32]) {
    Arch::new().dispatch(|| {
        for row in rows.chunks_exact_mut(width) {
            let last = &mut row[width - bias.len()..];
            last.iter_mut().zip(bias).for_each(|(y, b)| *y += b);
        }
    });
}

/// Adds rows to a sum of rows, which is as wide.
fn add_rows(sum: &mut [f32], rows: &[f32]) {
    Arch::new().dispatch(|| {
        for row in rows.chunks_exact(sum.len()) {
            sum.iter_mut().zip(row).for_each(|(a, b)| *a += b);
        }
    });
}

/// Adds the bias to the points' rows and applies the activation; multiplies the tangents' rows
/// by its slopes.
fn activate(rows: &mut [f32], points: usize, bias: &[f32]) {
    let width = bias.len();
    let (of_points, of_tangents) = rows.split_at_mut(points * width);
    Arch::new().dispatch(|| {
        for row in of_points.chunks_exact_mut(width) {
            for (z, b) in row.iter_mut().zip(bias) {
                let before = *z + b;
                *z = before * slope(before);
            }
        }
    });
    for tangent in of_tangents.chunks_exact_mut(points * width) {
        times_slopes(tangent, of_points);
    }
}

/// Multiplies by the slopes of the activations, whose results (of the same signs as what they
/// were applied to) are given.
fn times_slopes(rows: &mut [f32], activated: &[f32]) {
    Arch::new().dispatch(|| {
        for (t, h) in rows.iter_mut().zip(activated) {
            *t *= slope(*h);
        }
    });
}

#[inline(always)]
fn slope(x: f32) -> f32 {
    if x > 0.0 { 1.0 } else { NEGATIVE_SLOPE }
}

/// One tile with its values.
struct TilePass<'a> {
    layers: &'a [Layer<'a>],
    points: usize,
    input: &'a [f32],
    between: &'a [f32],
}

impl TilePass<'_> {
    /// Adds to the sum of parameter gradients; returns the input's, if it is asked for.
    fn backward(&self, mut gradient: Vec<f32>, sum: &mut [f32], of_input: bool) -> Vec<f32> {
        let inputs = self.layers[0].weight.nrows();
        let rows = self.input.len() / inputs;
        let mut of_x = vec![0.0; if of_input { rows * inputs } else { 0 }];
        let mut of_source = Vec::new();
        let (mut sum_end, mut between_end) = (sum.len(), self.between.len());
        for layer in self.layers.iter().rev() {
            let (before, after) = (layer.weight.nrows(), layer.weight.ncols());
            let source = match layer.source {
                Source::Input => self.input,
                Source::Activated | Source::Joined => {
                    let end = between_end;
                    between_end -= rows * before;
                    &self.between[between_end..end]
                }
            };
            let end = sum_end;
            sum_end -= (before + 1) * after;
            let (weight, bias) = sum[sum_end..end].split_at_mut(before * after);
            let of_result = MatRef::from_row_major_slice(&gradient, rows, after);
            let source_rows = MatRef::from_row_major_slice(source, rows, before);
            let weight = MatMut::from_row_major_slice_mut(weight, before, after);
            let (add, transposed) = (Accum::Add, source_rows.transpose());
            matmul(weight, add, transposed, of_result, 1.0, Par::Seq);
            add_rows(bias, &gradient[..self.points * after]);
            if layer.source == Source::Input && !of_input {
                break;
            }
            of_source.resize(rows * before, 0.0);
            let result = MatMut::from_row_major_slice_mut(&mut of_source, rows, before);
            let (replace, weight) = (Accum::Replace, layer.weight.transpose());
            matmul(result, replace, of_result, weight, 1.0, Par::Seq);
            match layer.source {
                Source::Activated => {
                    let activated = &source[..self.points * before];
                    for copy in of_source.chunks_exact_mut(self.points * before) {
                        times_slopes(copy, activated);
                    }
                    std::mem::swap(&mut gradient, &mut of_source);
                }
                Source::Joined => {
                    gradient.clear();
                    for (r, row) in of_source.chunks_exact(before).enumerate() {
                        let (of_joined_x, of_latent) = row.split_at(inputs);
                        gradient.extend_from_slice(of_latent);
                        if of_input {
                            of_x[r * inputs..(r + 1) * inputs].copy_from_slice(of_joined_x);
                        }
                    }
                }
                Source::Input => of_x.iter_mut().zip(&of_source).for_each(|(a, b)| *a += b),
            }
        }
        of_x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More tiles than sums, and more parameters than one task adds up.
    #[test]
    fn every_tile_is_in_the_sum_of_every_parameter() {
        let (tiles, count) = (50, 2 * SUMMED_AT_ONCE + 7);
        let tiles: Vec<usize> = (0..tiles).collect();
        // Whole numbers, whose sums are exact.
        let (sum, results) = summed(&tiles, count, |&tile, sum| {
            for (i, value) in sum.iter_mut().enumerate() {
                *value += (tile * (i % 97) + i) as f32;
            }
            vec![tile as f32]
        });
        let expected = (0..count).map(|i| (49 * 50 / 2 * (i % 97) + 50 * i) as f32);
        assert_eq!(sum, expected.collect::<Vec<f32>>());
        let numbers = tiles.iter().map(|&tile| vec![tile as f32]);
        assert_eq!(results, numbers.collect::<Vec<_>>());
    }
}
