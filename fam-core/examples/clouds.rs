//! Point clouds of surfaces whose triangles are known, but not told: what training and finishing
//! make of them, as a table. `cargo run -p fam-core --example clouds` takes some minutes.

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Instant;

use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use fam_core::training::{Strategies, TrainingConfig, train};
use fam_layout::{LayoutConfig, lay_out_cloud};
use fam_surface::metrics::Metrics;
use fam_surface::{PointCloud, Surface, SurfaceError, TriangleMesh, UvMap, shapes};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> Result<(), Box<dyn Error>> {
    let surfaces = [
        ("draped cloth", shapes::draped_cloth(100, 69)),
        ("bust", shapes::bust(0.0363)),
        ("spiral", shapes::spiral(4.0, 4.0, 280.0, 99.0, 279, 99)),
    ];
    println!("| cloud | points | training, s | finishing, s | conformality, raw map | finished |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    for (name, mesh) in surfaces {
        let points = mesh.positions().to_vec();
        let cloud = Surface::PointCloud(PointCloud::new(points.clone(), None)?);
        let before = Instant::now();
        let going = |_: &_| ControlFlow::Continue(());
        let config = TrainingConfig::fast();
        let map = train::<Autodiff<NdArray>>(
            config,
            &cloud,
            &Default::default(),
            Strategies::tiled(),
            going,
        )?;
        let training = before.elapsed().as_secs_f64();
        let raw = map.uvs(&points);
        let before = Instant::now();
        let going = &mut |_| ControlFlow::Continue(());
        let finished = lay_out_cloud(&LayoutConfig::default(), &points, &raw, going);
        let finishing = before.elapsed().as_secs_f64();
        println!(
            "| {name} | {} | {training:.0} | {finishing:.1} | {:.3} | {:.3} |",
            points.len(),
            conformality(&mesh, raw)?,
            conformality(&mesh, finished.uvs)?
        );
    }
    Ok(())
}

/// That of one UV for each point on the known triangles.
fn conformality(mesh: &TriangleMesh, uvs: Vec<[f32; 2]>) -> Result<f64, SurfaceError> {
    let map = UvMap::new(uvs, mesh.triangles().to_vec())?;
    Ok(Metrics::measure(mesh, &map)?.conformality)
}
