//! A trained map at arbitrary points, with its Jacobian: on the host, and in a graph of one's own, where
//! a texture is fitted through it. `cargo run --release -p fam-core --example trained_map`.

use std::error::Error;
use std::ops::ControlFlow;

use burn::tensor::{Tensor, TensorData};
use burn_autodiff::Autodiff;
use burn_flex::Flex;
use fam_core::map::TrainedMap;
use fam_core::training::{Strategies, TrainingConfig, train};
use fam_surface::{Surface, shapes};

type B = Autodiff<Flex>;

fn main() -> Result<(), Box<dyn Error>> {
    let surface = Surface::Mesh(shapes::open_cylinder(0.5, 1.5, 40, 20));
    let config = TrainingConfig {
        iterations: 300,
        ..TrainingConfig::fast()
    };
    let device = Default::default();
    let observe = |_: &_| ControlFlow::Continue(());
    let map = train::<B>(config, &surface, &device, Strategies::tiled(), observe)?;

    // None of the mesh's vertices: halfway between two of them.
    let [a, b] = [surface.positions()[0], surface.positions()[1]];
    let point = [0, 1, 2].map(|axis| (a[axis] + b[axis]) / 2.0);
    let (uv, jacobian) = (map.uvs(&[point])[0], map.jacobian(&[point])[0]);
    println!("{point:.3?} -> {uv:.3?}, with the derivatives {jacobian:.3?}");

    // The same map on a backend that tracks gradients: a linear texture, color = a · u + b · v + c, is
    // fitted to colors that are given on the surface, here the height.
    let map = TrainedMap::<B>::from_safetensors(&map.to_safetensors()?, &device)?;
    let positions = surface.positions();
    let values: Vec<f32> = positions.iter().flatten().map(|&c| c as f32).collect();
    let points = Tensor::<B, 2>::from_data(TensorData::new(values, [positions.len(), 3]), &device);
    let color = points.clone().narrow(1, 2, 1);
    let mut texture = Tensor::<B, 2>::zeros([3, 1], &device).require_grad();
    let mut errors = Vec::new();
    for _ in 0..300 {
        let uvs = map
            .uv_tensor(points.clone())
            .ok_or("the map has no network")?;
        let ones = Tensor::ones([positions.len(), 1], &device);
        let difference = Tensor::cat(vec![uvs, ones], 1).matmul(texture.clone()) - color.clone();
        let loss = (difference.clone() * difference).mean();
        errors.push(loss.clone().into_scalar());
        let gradient = texture
            .grad(&loss.backward())
            .ok_or("the loss has no gradient")?;
        texture = Tensor::from_inner(texture.inner() - gradient * 0.5).require_grad();
    }
    println!(
        "fitted texture: error {:.4} -> {:.4}",
        errors[0], errors[299]
    );
    Ok(())
}
