//! The backward pass of a sub-network down to its inputs, and the gradient of that pass.
//!
//! *Pulling back* takes gradients of the results through every layer's weights, transposed, and
//! through the slopes that the activations have at the points. Slopes are constants, so this is
//! linear in the gradients and in the weights of each layer, and biases have no part in it. Its
//! own gradient goes the other way: it pushes a gradient of what was pulled back forward, as
//! tangents are, and on the way multiplies it by what the pull left at each layer.

use super::*;

/// What the gradient of [`pull_back`] needs.
#[derive(Debug)]
pub(in crate::evaluation) struct Pulled {
    saved: Arc<Saved>,
    /// K copies.
    copies: usize,
    /// `[K, N, out]`.
    upstream: Vec<f32>,
    /// Copy by copy, tile by tile, in it from the last layer but one to the first, the gradients
    /// of every layer's results before the activation.
    between: Vec<f32>,
}

/// Gradients of [`pull_back`].
pub(in crate::evaluation) struct PulledGradients {
    pub upstream: Vec<f32>,
    pub parameters: Vec<f32>,
}

impl Pulled {
    /// Of the upstream gradients: `[K, N, out]`.
    pub(in crate::evaluation) fn shape(&self) -> [usize; 3] {
        let sizes = &self.saved.sizes;
        [self.copies, sizes.points, sizes.outputs()]
    }
}

impl Drop for Pulled {
    fn drop(&mut self) {
        let between = std::mem::take(&mut self.between);
        self.saved.buffers.give_back(between);
    }
}

impl Saved {
    /// The tiles of every copy.
    fn tiles_of_copies(&self, copies: usize) -> Vec<TileOfCopy> {
        let tiles = self.sizes.tiles();
        let of_copy = |copy| {
            tiles
                .iter()
                .map(move |tile| (copy * self.sizes.points, tile))
        };
        let all = (0..copies).flat_map(of_copy);
        all.map(|(first, points)| TileOfCopy {
            points: points.clone(),
            rows: first + points.start..first + points.end,
        })
        .collect()
    }

    /// One tile without its gradients.
    fn pullback<'a>(&'a self, layers: &'a [Layer<'a>], points: &Range<usize>) -> TilePullback<'a> {
        let row = self.sizes.copies() * self.sizes.between();
        TilePullback {
            layers,
            points: points.len(),
            copies: self.sizes.copies(),
            forward: &self.between[points.start * row..points.end * row],
        }
    }

    /// Values of a row in [`Pulled::between`].
    fn pulled(&self) -> usize {
        let sizes = &self.sizes;
        sizes.between() - (sizes.stacks.len() - 1) * sizes.inputs()
    }
}

/// The gradients `[K, N, in]` of the points' inputs for gradients `[K, N, out]` of the results at
/// these points, and what differentiates them again.
pub(in crate::evaluation) fn pull_back(
    saved: Arc<Saved>,
    copies: usize,
    upstream: Vec<f32>,
) -> (Vec<f32>, Pulled) {
    let outputs = saved.sizes.outputs();
    let tiles = saved.tiles_of_copies(copies);
    let row = saved.pulled();
    let mut between = saved.buffers.take(copies * saved.sizes.points * row);
    let layers = saved.sizes.layers(&saved.parameters);
    let rows = tiles.iter().map(|tile| tile.rows.clone());
    let pulled: Vec<Vec<f32>> = tiles
        .par_iter()
        .zip(pieces(&mut between, rows, row))
        .map(|(tile, between)| {
            let pullback = saved.pullback(&layers, &tile.points);
            pullback.pull(tile.values(&upstream, outputs), between)
        })
        .collect();
    let kept = Pulled {
        copies,
        upstream,
        between,
        saved,
    };
    (pulled.concat(), kept)
}

/// The gradients for a gradient `[K, N, in]` of what was pulled back; that of the upstream
/// gradients is left empty unless it is asked for.
pub(in crate::evaluation) fn backward(
    pulled: &Pulled,
    gradient: &[f32],
    of_upstream: bool,
) -> PulledGradients {
    let saved = &pulled.saved;
    let (inputs, outputs) = (saved.sizes.inputs(), saved.sizes.outputs());
    let layers = saved.sizes.layers(&saved.parameters);
    let tiles = saved.tiles_of_copies(pulled.copies);
    let (parameters, of_upstream) = summed(&tiles, saved.parameters.len(), |tile, sum| {
        let pullback = saved.pullback(&layers, &tile.points);
        let left = TileLeft {
            upstream: tile.values(&pulled.upstream, outputs),
            between: tile.values(&pulled.between, saved.pulled()),
        };
        pullback.push(tile.values(gradient, inputs), left, sum, of_upstream)
    });
    PulledGradients {
        upstream: of_upstream.concat(),
        parameters,
    }
}

/// A tile of the points, in one of the copies.
struct TileOfCopy {
    points: Range<usize>,
    /// Of the rows of all copies.
    rows: Range<usize>,
}

impl TileOfCopy {
    /// Out of rows of a width, those of the tile.
    fn values<'a>(&self, all: &'a [f32], width: usize) -> &'a [f32] {
        &all[self.rows.start * width..self.rows.end * width]
    }
}

/// One tile with what its forward pass left.
struct TilePullback<'a> {
    layers: &'a [Layer<'a>],
    points: usize,
    /// Of the points in the forward pass: these, and tangents.
    copies: usize,
    /// Layer by layer, the rows that went into every layer but the first.
    forward: &'a [f32],
}

/// What pulling a tile back left.
struct TileLeft<'a> {
    upstream: &'a [f32],
    between: &'a [f32],
}

impl TilePullback<'_> {
    /// From gradients of results to gradients of inputs. What is on the way is left in `between`.
    fn pull(&self, upstream: &[f32], mut between: &mut [f32]) -> Vec<f32> {
        let rows = self.points;
        let inputs = self.layers[0].weight.nrows();
        let mut of_x = vec![0.0; rows * inputs];
        let mut gradient = upstream;
        let mut forward = self.forward;
        for layer in self.layers.iter().rev() {
            let (before, after) = (layer.weight.nrows(), layer.weight.ncols());
            let of_result = MatRef::from_row_major_slice(gradient, rows, after);
            // Of the layer's inputs the first that is not of x.
            let mut first = 0;
            if layer.source != Source::Activated {
                first = inputs;
                let result = MatMut::from_row_major_slice_mut(&mut of_x, rows, inputs);
                let weight = layer.weight.subrows(0, inputs).transpose();
                matmul(result, Accum::Add, of_result, weight, 1.0, Par::Seq);
            }
            if layer.source == Source::Input {
                break;
            }
            let channels = before - first;
            let (of_source, rest) = between.split_at_mut(rows * channels);
            let result = MatMut::from_row_major_slice_mut(of_source, rows, channels);
            let weight = layer.weight.subrows(first, channels).transpose();
            matmul(result, Accum::Replace, of_result, weight, 1.0, Par::Seq);
            let source;
            (forward, source) = forward.split_at(forward.len() - self.copies * rows * before);
            if layer.source == Source::Activated {
                times_slopes(of_source, source);
            }
            (gradient, between) = (of_source, rest);
        }
        of_x
    }

    /// Adds to the sum of parameter gradients; returns the gradient of the upstream gradients, if
    /// it is asked for. `gradient` is that of what was pulled back.
    fn push(
        &self,
        gradient: &[f32],
        left: TileLeft,
        mut sum: &mut [f32],
        of_upstream: bool,
    ) -> Vec<f32> {
        let rows = self.points;
        let inputs = self.layers[0].weight.nrows();
        let mut pushed = gradient.to_vec();
        let mut next = Vec::new();
        let (mut between, mut forward) = (left.between, self.forward);
        for (l, layer) in self.layers.iter().enumerate() {
            let (before, after) = (layer.weight.nrows(), layer.weight.ncols());
            let following = self.layers.get(l + 1);
            let mut of_result = left.upstream;
            if following.is_some() {
                (between, of_result) = between.split_at(between.len() - rows * after);
            }
            let of_result = MatRef::from_row_major_slice(of_result, rows, after);
            let (of_layer, rest) = sum.split_at_mut((before + 1) * after);
            sum = rest;
            // What is left of it are biases.
            let weight = &mut of_layer[..before * after];
            let weight = MatMut::from_row_major_slice_mut(weight, before, after);
            let source = MatRef::from_row_major_slice(&pushed, rows, before).transpose();
            matmul(weight, Accum::Add, source, of_result, 1.0, Par::Seq);
            if following.is_none() && !of_upstream {
                return Vec::new();
            }
            let width = following.map_or(after, |following| following.weight.nrows());
            next.resize(rows * width, 0.0);
            let result = MatMut::from_row_major_slice_mut(&mut next, rows, width);
            let columns = result.subcols_mut(width - after, after);
            multiply(columns, &pushed, layer.weight);
            if let Some(following) = following {
                let source;
                (source, forward) = forward.split_at(self.copies * rows * width);
                match following.source {
                    Source::Activated => times_slopes(&mut next, source),
                    _ => join(&mut next, gradient, width, inputs),
                }
            }
            std::mem::swap(&mut pushed, &mut next);
        }
        pushed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const COPIES: usize = 2;

    /// Results, pulled back, weighted and summed up, are linear in every weight and in every
    /// upstream gradient while slopes stay as they are: differences are derivatives, however far
    /// apart.
    #[test]
    fn gradients_are_differences() {
        let sizes = Sizes {
            stacks: vec![vec![2, 5, 4], vec![6, 5, 3]],
            // One tile, and some of another.
            points: 201,
            tangents: 0,
        };
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let mut values = |count: usize| -> Vec<f32> {
            (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
        };
        let parameters = values(3 * 5 + 6 * 4 + 7 * 5 + 6 * 3);
        let upstream = values(COPIES * sizes.points * 3);
        let weights = values(COPIES * sizes.points * 2);
        let input = values(sizes.points * 2);
        let (_, saved) = forward(sizes, input, parameters.clone(), Default::default());
        let at = |parameters: &[f32], upstream: &[f32]| {
            // With the slopes of before.
            let moved = Saved {
                sizes: saved.sizes.clone(),
                input: saved.input.clone(),
                parameters: parameters.to_vec(),
                between: saved.between.clone(),
                buffers: Default::default(),
            };
            let (rows, pulled) = pull_back(Arc::new(moved), COPIES, upstream.to_vec());
            let products = rows.iter().zip(&weights);
            let sum: f64 = products.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            (sum, pulled)
        };
        let (sum, pulled) = at(&parameters, &upstream);
        let found = backward(&pulled, &weights, true);
        let close = |gradient: &[f32], moved: &dyn Fn(usize) -> f64| {
            let largest = gradient.iter().fold(0.0f32, |a, b| a.max(b.abs()));
            for (i, gradient) in gradient.iter().enumerate() {
                let difference = moved(i) - sum;
                let error = (f64::from(*gradient) - difference).abs();
                assert!(
                    error < 1e-5 * f64::from(largest),
                    "{i}: {gradient} {difference}"
                );
            }
        };
        let further = |values: &[f32], i: usize| {
            let mut values = values.to_vec();
            values[i] += 1.0;
            values
        };
        close(&found.parameters, &|i| {
            at(&further(&parameters, i), &upstream).0
        });
        close(&found.upstream, &|i| {
            at(&parameters, &further(&upstream, i)).0
        });
        assert_eq!(found.parameters.len(), parameters.len());
        assert_eq!(found.upstream.len(), upstream.len());
    }
}
