//! One training step, per backend and Jacobian mode: `cargo bench -p fam-core`.
//!
//! The paper's configuration takes many seconds a step on a CPU and minutes on a software
//! graphics adapter; name a part of a benchmark to run only that, for example
//! `cargo bench -p fam-core -- fast`.

use burn::tensor::backend::AutodiffBackend;
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use burn_wgpu::Wgpu;
use divan::Bencher;
use fam_core::jacobian::JacobianMode;
use fam_core::surface::{Surface, shapes};
use fam_core::training::{Trainer, TrainingConfig};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const MODES: [JacobianMode; 2] = [JacobianMode::DoubleBackward, JacobianMode::ForwardTangent];

fn main() {
    divan::main();
}

#[divan::bench(types = [NdArray, Wgpu], args = MODES, sample_count = 10, sample_size = 1)]
fn fast<B: burn::tensor::backend::Backend>(bencher: Bencher, mode: JacobianMode) {
    step::<Autodiff<B>>(bencher, TrainingConfig::fast(), mode);
}

#[divan::bench(types = [NdArray, Wgpu], args = MODES, sample_count = 3, sample_size = 1)]
fn paper<B: burn::tensor::backend::Backend>(bencher: Bencher, mode: JacobianMode) {
    step::<Autodiff<B>>(bencher, TrainingConfig::paper(), mode);
}

fn step<B: AutodiffBackend>(bencher: Bencher, config: TrainingConfig, mode: JacobianMode) {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 96, 48));
    let config = TrainingConfig {
        jacobian: mode,
        ..config
    };
    let device = Default::default();
    let mut trainer =
        Trainer::<B>::new(config, &surface, &device).expect("a torus can be trained on");
    // The first step allocates, and on a graphics adapter compiles.
    trainer.step().expect("the first step is finite");
    bencher.bench_local(|| trainer.step().expect("a step is finite"));
}
