//! A trained map in the caller's graph.

use std::ops::ControlFlow;

use burn::tensor::{Tensor, TensorData};
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use fam_core::map::{TrainedMap, UvFrame};
use fam_core::networks::FlattenAnythingConfig;
use fam_core::training::{Ablation, Strategies, TrainingConfig, train, turn};
use fam_surface::{Surface, TriangleMesh, shapes};

use crate::reference_numbers::host;

type Cpu = Autodiff<NdArray>;

/// A map that was hardly trained, of a torus that is far from the origin and larger than the unit ball.
fn map(without: Ablation) -> (TrainedMap<Cpu>, Surface) {
    let torus = shapes::torus(3.0, 1.0, 24, 12);
    let moved = torus
        .positions()
        .iter()
        .map(|[x, y, z]| [x + 5.0, y - 2.0, *z]);
    let torus = TriangleMesh::new(moved.collect(), torus.triangles().to_vec()).unwrap();
    let surface = Surface::Mesh(torus);
    let config = TrainingConfig {
        points: 100,
        iterations: 5,
        starts: 1,
        without,
        networks: FlattenAnythingConfig::new().with_width(16).with_latent(8),
        ..TrainingConfig::fast()
    };
    let device = Default::default();
    let observe = |_: &_| ControlFlow::Continue(());
    let map = train::<Cpu>(config, &surface, &device, Strategies::plain(), observe).unwrap();
    let bytes = map.to_safetensors().unwrap();
    (
        TrainedMap::from_safetensors(&bytes, &device).unwrap(),
        surface,
    )
}

fn tensor(points: &[[f64; 3]]) -> Tensor<Cpu, 2> {
    let values: Vec<f32> = points.iter().flatten().map(|&c| c as f32).collect();
    let data = TensorData::new(values, [points.len(), 3]);
    Tensor::from_data(data, &Default::default())
}

#[test]
fn tensors_of_a_map_are_its_uvs_and_its_jacobian() {
    for without in [Ablation::None, Ablation::CutNet] {
        let (map, surface) = map(without);
        let points = surface.positions();
        let (uvs, along) = map.uv_tensor_with_jacobian(tensor(points)).unwrap();
        let alone = map.uv_tensor(tensor(points)).unwrap();
        assert!(host(&uvs) == host(&alone));
        for (found, expected) in host(&uvs).chunks(2).zip(map.uvs(points)) {
            assert!(
                (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-5),
                "{found:?} {expected:?}"
            );
        }
        let jacobian = map.jacobian(points);
        let along = along.each_ref().map(host);
        for (i, rows) in jacobian.iter().enumerate() {
            for axis in 0..3 {
                for (k, row) in rows.iter().enumerate() {
                    let (found, expected) = (along[axis][2 * i + k], row[axis]);
                    assert!((found - expected).abs() < 1e-4, "{found} {expected}");
                }
            }
        }
    }
    assert!(
        map(Ablation::UnwrapBranch)
            .0
            .uv_tensor(tensor(&[[0.0; 3]]))
            .is_none()
    );
}

/// By the points, it is the Jacobian. UVs are linear in the last layer, and so are their derivatives: by
/// Euler's theorem, gradient · weights is the linear part of a sum, and twice a sum of squares.
#[test]
fn gradients_go_through_a_map() {
    let (map, surface) = map(Ablation::None);
    let points = &surface.positions()[..50];
    let _turn = turn();
    let at = tensor(points).require_grad();
    let loss = map.uv_tensor(at.clone()).unwrap().sum();
    let sum = host(&loss)[0];
    let gradients = loss.backward();
    let found = host(&Tensor::<Cpu, 2>::from_inner(at.grad(&gradients).unwrap()));
    for (found, rows) in found.chunks(3).zip(map.jacobian(points)) {
        for axis in 0..3 {
            let expected = rows[0][axis] + rows[1][axis];
            assert!(
                (found[axis] - expected).abs() < 1e-4,
                "{} {expected}",
                found[axis]
            );
        }
    }
    let last = map.model().unwrap.mlp.layers.last().unwrap();
    let (weight, bias) = (last.weight.val(), last.bias.as_ref().unwrap().val());
    let along = |gradients: &_| {
        let of = |value: Vec<f32>, gradient: Vec<f32>| -> f32 {
            value.iter().zip(gradient).map(|(a, b)| a * b).sum()
        };
        let weight = of(host(&weight), numbers(weight.grad(gradients).unwrap()));
        let bias = bias
            .grad(gradients)
            .map_or(0.0, |gradient| of(host(&bias), numbers(gradient)));
        weight + bias
    };
    let UvFrame { corner, side, .. } = map.frame();
    let linear = sum + points.len() as f32 * (corner[0] + corner[1]) / side;
    let found = along(&gradients);
    assert!(
        (found - linear).abs() < 1e-4 * linear.abs().max(1.0),
        "{found} {linear}"
    );
    // A loss of the derivatives, too.
    let (_, derivatives) = map.uv_tensor_with_jacobian(tensor(points)).unwrap();
    let squares = derivatives.map(|d| (d.clone() * d).sum());
    let squares = squares.into_iter().reduce(|a, b| a + b).unwrap();
    let value = host(&squares)[0];
    let found = along(&squares.backward());
    assert!(
        value > 0.0 && (found - 2.0 * value).abs() < 1e-4 * value,
        "{found} {value}"
    );
}

fn numbers<const D: usize>(tensor: Tensor<NdArray, D>) -> Vec<f32> {
    tensor.into_data().to_vec().unwrap()
}
