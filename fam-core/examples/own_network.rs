//! The conformality term in a network of one's own: a small network that bends a square learns to keep
//! angles. `cargo run --release -p fam-core --example own_network`.

use std::error::Error;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::optim::{AdamWConfig, GradientsParams, Optimizer};
use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::{Tensor, TensorData};
use burn_autodiff::Autodiff;
use burn_flex::Flex;
use fam_core::cycles::lattice;
use fam_core::jacobian::Jacobian;
use fam_core::losses::conformality_loss;

/// From the plane to space, with a hidden layer of tanh.
#[derive(Module, Debug)]
struct Bend<B: Backend> {
    hidden: Linear<B>,
    out: Linear<B>,
}

impl<B: Backend> Bend<B> {
    /// Points of space, and the derivative there, from points of the plane.
    fn forward(&self, q: Tensor<B, 2>) -> (Tensor<B, 2>, Jacobian<B>) {
        let y = self.hidden.forward(q).tanh();
        let slope = y.clone() * y.clone() * -1.0 + 1.0;
        let along = |axis: usize| {
            let weight = self.hidden.weight.val().narrow(0, axis, 1);
            (slope.clone() * weight).matmul(self.out.weight.val())
        };
        let jacobian = Jacobian {
            u: along(0),
            v: along(1),
        };
        (self.out.forward(y), jacobian)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    run::<Autodiff<Flex>>(&Default::default())
}

fn run<B: AutodiffBackend>(device: &B::Device) -> Result<(), Box<dyn Error>> {
    let mut net = Bend::<B> {
        hidden: LinearConfig::new(2, 32).init(device),
        out: LinearConfig::new(32, 3).init(device),
    };
    let mut optimizer = AdamWConfig::new().init::<B, Bend<B>>();
    let q = lattice(400).into_flattened();
    let q = Tensor::<B, 2>::from_data(TensorData::new(q, [400, 2]), device);
    let mut first = None;
    for step in 0..=300 {
        let (points, jacobian) = net.forward(q.clone());
        let conformality = conformality_loss(jacobian);
        // It is to stay as large as the square, or it would shrink to a point.
        let size = (points.clone() * points).sum_dim(1).mean() - 0.7;
        let loss = conformality.clone() + size.clone() * size;
        let value = conformality.into_data().iter::<f32>().sum::<f32>();
        let first = *first.get_or_insert(value);
        if step % 100 == 0 {
            println!("{step:3}  conformality {value:.4}");
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &net);
        net = optimizer.step(5e-3, net, gradients);
        if step == 300 && value > 0.5 * first {
            return Err("it did not learn to keep angles".into());
        }
    }
    Ok(())
}
