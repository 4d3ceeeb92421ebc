//! Trains a map on a mesh and measures it: `cargo run --release -p fam-core --example train_mesh`.

use std::error::Error;
use std::ops::ControlFlow;

use burn_autodiff::Autodiff;
use burn_flex::Flex;
use fam_core::training::{Strategies, TrainingConfig, train};
use fam_surface::metrics::Metrics;
use fam_surface::{Surface, UvMap, shapes};

fn main() -> Result<(), Box<dyn Error>> {
    let mesh = shapes::open_cylinder(0.5, 1.5, 40, 20);
    let surface = Surface::Mesh(mesh.clone());
    let config = TrainingConfig {
        iterations: 200,
        ..TrainingConfig::fast()
    };
    let device = Default::default();
    let map = train::<Autodiff<Flex>>(config, &surface, &device, Strategies::tiled(), |step| {
        if step.before.is_multiple_of(50) {
            println!("{:4}  loss {:.4}", step.before, step.total);
        }
        ControlFlow::Continue(())
    })?;
    let uvs = UvMap::new(map.uvs(mesh.positions()), mesh.triangles().to_vec())?;
    let metrics = Metrics::measure(&mesh, &uvs)?;
    println!("conformality {:.3}", metrics.conformality);
    // The map and all that it takes to evaluate it.
    println!("{} bytes of model.safetensors", map.to_safetensors()?.len());
    Ok(())
}
