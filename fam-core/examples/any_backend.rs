//! Trains on a point cloud, on a backend that the crate does not know, and compares it with another: any
//! that Burn has will do, by [`Strategies::plain`]. `cargo run --release -p fam-core --example any_backend`.

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Instant;

use burn::tensor::backend::AutodiffBackend;
use burn_autodiff::Autodiff;
use burn_flex::Flex;
use burn_ndarray::NdArray;
use fam_core::training::{OptimizerKind, Strategies, TrainingConfig, TrainingError, train};
use fam_surface::{PointCloud, Surface, shapes};

/// UVs of the points of a cloud. Nothing here depends on what `B` is.
fn uvs<B: AutodiffBackend>(
    name: &str,
    cloud: &Surface,
    strategies: Strategies<B>,
) -> Result<Vec<[f32; 2]>, TrainingError> {
    // So few and small steps that what backends round apart does not grow.
    let config = TrainingConfig {
        points: 300,
        iterations: 10,
        starts: 1,
        optimizer: OptimizerKind::AdamW,
        learning_rate: 1e-3,
        ..TrainingConfig::fast()
    };
    let before = Instant::now();
    let device = Default::default();
    let observe = |_: &_| ControlFlow::Continue(());
    let map = train::<B>(config, cloud, &device, strategies, observe)?;
    println!("{name}: {:.2} s", before.elapsed().as_secs_f64());
    Ok(map.uvs(cloud.positions()))
}

fn main() -> Result<(), Box<dyn Error>> {
    let points = shapes::bust(0.1).positions().to_vec();
    let cloud = Surface::PointCloud(PointCloud::new(points, None)?);
    let ndarray = uvs::<Autodiff<NdArray>>("ndarray, plain", &cloud, Strategies::plain())?;
    let flex = uvs::<Autodiff<Flex>>("flex, in tiles", &cloud, Strategies::tiled())?;
    let apart = flex.iter().zip(&ndarray);
    let apart = apart.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
    let apart = apart.fold(0.0, f32::max);
    println!("largest distance of two UVs: {apart:.6}");
    match apart < 0.01 {
        true => Ok(()),
        false => Err("the backends disagree".into()),
    }
}
