//! Tiles and blocks against plain operations.

use std::sync::Arc;

use super::kernel::{Sizes, pullback};
use super::*;
use crate::networks::{FlattenAnything, FlattenAnythingConfig, WrapNet};
use crate::training::turn;
use burn::module::Module;
use burn::tensor::{FloatDType, TensorData};
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use rand::{RngExt, SeedableRng};

type Cpu = Autodiff<NdArray>;

fn values(count: usize, seed: u64) -> Vec<f32> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn tensor(rows: usize, columns: usize, seed: u64) -> Tensor<Cpu, 2> {
    let data = TensorData::new(values(rows * columns, seed), [rows, columns]);
    Tensor::from_data(data, &Default::default())
}

fn host<const D: usize>(tensor: Tensor<impl Backend, D>) -> Vec<f32> {
    tensor.into_data().to_vec().unwrap()
}

fn model() -> FlattenAnything<Cpu> {
    let config = FlattenAnythingConfig::new().with_width(21).with_latent(5);
    config.init(&Default::default(), 3)
}

/// Results at `points` points, and the gradients of a weighted sum of them with respect to
/// everything that goes in.
fn evaluate(evaluation: &dyn Evaluation<Cpu>, points: usize, tangents: usize) -> Vec<Vec<f32>> {
    let model = model();
    let x = tensor(points, 2, 1).require_grad();
    let directions: Vec<_> = (0..tangents)
        .map(|k| tensor(points, 2, 10 + k as u64).require_grad())
        .collect();
    let xi = [&model.wrap.mlp_1, &model.wrap.mlp_2];
    let _turn = turn();
    let (y, pushed) = evaluation.twofold(xi[0], xi[1], x.clone(), directions.clone());
    let p = tensor(points, 3, 2).require_grad();
    let q = evaluation.single(&model.unwrap.mlp, p.clone());
    let results: Vec<_> = [y, q].into_iter().chain(pushed).collect();
    let sum = |(seed, result): (usize, &Tensor<Cpu, 2>)| {
        let [rows, columns] = result.dims();
        (result.clone() * tensor(rows, columns, 20 + seed as u64)).sum()
    };
    let sums = results.iter().enumerate().map(sum);
    let gradients = sums.reduce(|a, b| a + b).unwrap().backward();
    let inputs = [x, p].into_iter().chain(directions);
    let of_inputs = inputs.map(|x| host(x.grad(&gradients).unwrap()));
    let layers = xi
        .into_iter()
        .chain([&model.unwrap.mlp])
        .flat_map(|xi| &xi.layers);
    let of_layers = layers.flat_map(|layer| {
        let bias = layer.bias.as_ref().unwrap();
        [
            host(layer.weight.grad(&gradients).unwrap()),
            host(bias.grad(&gradients).unwrap()),
        ]
    });
    let gradients: Vec<_> = of_inputs.chain(of_layers).collect();
    results.into_iter().map(host).chain(gradients).collect()
}

/// Wrap-Net at `points` points; gradients there of a weighted sum of its results at `copies` copies
/// by the copies, from a backward pass on a layer above; and the gradients of a loss made of all
/// that with respect to the points, the weights of the sum and all layers.
fn evaluate_above(
    evaluation: &dyn Evaluation<Cpu>,
    wrap: &WrapNet<Cpu>,
    points: usize,
    copies: usize,
) -> Vec<Option<Vec<f32>>> {
    let x = tensor(points, 2, 1).require_grad();
    let weights = tensor(copies * points, 6, 2).require_grad();
    let _turn = turn();
    let stack = Tensor::stack::<3>(vec![x.clone(); copies], 0);
    let stack = Tensor::<Autodiff<Cpu>, 3>::from_inner(stack).require_grad();
    let xi = [&wrap.mlp_1, &wrap.mlp_2];
    let (y, above) = evaluation.twofold_above(xi[0], xi[1], x.clone(), stack.clone());
    let results = [host(y.clone()), host(above.clone())];
    let sum = above * Tensor::from_inner(weights.clone().reshape([copies, points, 6]));
    let rows = stack.grad(&sum.sum().backward()).unwrap();
    let rows = rows.reshape([copies * points, 2]);
    let pulled = host(rows.clone());
    let loss = (rows.clone() * rows * tensor(copies * points, 2, 3)).sum();
    let gradients = (loss + (y * tensor(points, 6, 4)).sum()).backward();
    let of_inputs = [&x, &weights].map(|input| input.grad(&gradients).map(host));
    let of_layers = xi.into_iter().flat_map(|xi| &xi.layers).flat_map(|layer| {
        let bias = layer.bias.as_ref().unwrap();
        [
            layer.weight.grad(&gradients).map(host),
            bias.grad(&gradients).map(host),
        ]
    });
    let gradients = of_inputs.into_iter().chain(of_layers);
    let results = results.into_iter().chain([pulled]).map(Some);
    results.chain(gradients).collect()
}

/// Whether the difference is small beside what is expected, in the Euclidean norm.
fn close(found: &[f32], expected: &[f32]) -> bool {
    let norm = |values: &mut dyn Iterator<Item = f32>| -> f64 {
        values
            .map(|v| f64::from(v) * f64::from(v))
            .sum::<f64>()
            .sqrt()
    };
    let difference = norm(&mut found.iter().zip(expected).map(|(a, b)| a - b));
    found.len() == expected.len() && difference < 1e-5 * norm(&mut expected.iter().copied())
}

#[test]
fn tiles_are_the_plain_operations() {
    let tiled = Tiled::default();
    let sizes = [
        // One point, less than a tile, a tile, and tiles that do not divide the points.
        (1, 0),
        (1, 2),
        (63, 2),
        (64, 2),
        (130, 2),
        (192, 0),
        (500, 1),
        // Several tiles for each sum of weight gradients.
        (3_000, 2),
        (4_000, 0),
    ];
    for (points, tangents) in sizes {
        let plain = evaluate(&Plain, points, tangents);
        // Twice: the second time in the first one's buffers.
        for _ in 0..2 {
            let found = evaluate(&tiled, points, tangents);
            for (i, (a, b)) in found.iter().zip(&plain).enumerate() {
                assert!(close(a, b), "{points} points, {tangents} tangents: {i}");
            }
        }
    }
}

#[test]
fn blocks_are_the_plain_operations() {
    // One point, less than a block, a block, one more, several blocks.
    for (points, tangents) in [(1, 2), (60, 0), (512, 2), (513, 1), (4_000, 0), (3_000, 2)] {
        let plain = evaluate(&Plain, points, tangents);
        let found = evaluate(&Blocked, points, tangents);
        for (i, (a, b)) in found.iter().zip(&plain).enumerate() {
            assert!(close(a, b), "{points} points, {tangents} tangents: {i}");
        }
    }
}

#[test]
fn gradients_of_gradients_are_those_of_plain_operations() {
    let (tiled, wrap) = (Tiled::default(), model().wrap);
    // One point, less than a tile, a tile, one more, and several tiles for each sum of gradients.
    for (points, copies) in [(1, 1), (63, 3), (192, 3), (193, 2), (500, 3), (4_001, 2)] {
        let plain = evaluate_above(&Plain, &wrap, points, copies);
        for other in [&tiled as &dyn Evaluation<Cpu>, &Blocked] {
            let found = evaluate_above(other, &wrap, points, copies);
            assert_eq!(found.len(), 5 + 4 * 4);
            for (i, (a, b)) in found.iter().zip(&plain).enumerate() {
                let [a, b] = [a, b].map(|values| values.as_ref().unwrap());
                assert!(close(a, b), "{points} points, {copies} copies: {i}");
            }
        }
    }
}

#[test]
fn gradients_of_gradients_by_constants_are_left_out() {
    let wrap = model().wrap;
    let tracked = evaluate_above(&Tiled::default(), &wrap, 100, 3);
    let constant = evaluate_above(&Tiled::default(), &wrap.no_grad(), 100, 3);
    let (inputs, layers) = constant.split_at(5);
    assert_eq!(inputs, &tracked[..5]);
    assert!(layers.iter().all(Option::is_none));
}

#[test]
fn an_mlp_of_one_layer_without_bias_is_linear() {
    let mut xi = model().unwrap.mlp;
    xi.layers.truncate(1);
    xi.layers[0].bias = None;
    let x = tensor(300, 3, 4);
    let plain = host(Plain.single(&xi, x.clone()));
    for other in [&Tiled::default() as &dyn Evaluation<Cpu>, &Blocked] {
        assert!(close(&host(other.single(&xi, x.clone())), &plain));
    }
}

/// Inputs or weights that are constants have no gradient, and the others that of before.
#[test]
fn constants_have_no_gradient() {
    let tiled = Tiled::default();
    let xi = model().unwrap.mlp;
    let of = |xi: &Mlp<Cpu>, x: Tensor<Cpu, 2>| {
        let _turn = turn();
        let gradients = tiled.single(xi, x.clone()).sum().backward();
        let weight = xi.layers[0].weight.grad(&gradients).map(host);
        (x.grad(&gradients).map(host), weight)
    };
    let (of_x, of_weight) = of(&xi, tensor(100, 3, 6).require_grad());
    assert!(of_x.is_some() && of_weight.is_some());
    assert_eq!(of(&xi, tensor(100, 3, 6)), (None, of_weight));
    let constant = xi.no_grad();
    let x = tensor(100, 3, 6).require_grad();
    assert_eq!(of(&constant, x), (of_x, None));
}

#[test]
fn tiles_give_the_same_bits_on_any_number_of_threads() {
    let sizes = Sizes {
        stacks: vec![vec![2, 21, 5], vec![7, 21, 6]],
        points: 3_000,
        tangents: 2,
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let parameters = values(3 * 21 + 22 * 5 + 8 * 21 + 22 * 6, 7);
            let input = values(9_000 * 2, 8);
            let buffers = Default::default();
            let (output, saved) = kernel::forward(sizes.clone(), input, parameters, buffers);
            let gradients = kernel::backward(&saved, &values(9_000 * 6, 9), true);
            let saved = Arc::new(saved);
            let (pulled, kept) = pullback::pull_back(saved, 3, values(9_000 * 6, 10));
            let again = pullback::backward(&kept, &values(9_000 * 2, 11), true);
            [
                output,
                gradients.input,
                gradients.parameters,
                pulled,
                again.upstream,
                again.parameters,
            ]
        })
    };
    assert_eq!(on(1), on(3));
}

#[test]
#[should_panic(expected = "inputs of an MLP")]
fn inputs_of_another_width_are_refused() {
    Tiled::default().single(&model().unwrap.mlp, tensor(10, 2, 1));
}

#[test]
fn other_numbers_than_f32_are_evaluated_as_they_are() {
    let x = tensor(10, 3, 5).cast(FloatDType::F64);
    let xi = &model().unwrap.mlp;
    let double = Mlp {
        layers: xi.layers.iter().cloned().map(to_double).collect(),
    };
    let values = |y: Tensor<Cpu, 2>| y.into_data().to_vec::<f64>().unwrap();
    let y = values(Tiled::default().single(&double, x.clone()));
    assert_eq!(y, values(Plain.single(&double, x)));
}

fn to_double(layer: burn::nn::Linear<Cpu>) -> burn::nn::Linear<Cpu> {
    burn::nn::Linear {
        weight: layer.weight.map(|weight| weight.cast(FloatDType::F64)),
        bias: layer
            .bias
            .map(|bias| bias.map(|bias| bias.cast(FloatDType::F64))),
    }
}
