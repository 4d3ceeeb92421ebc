//! On wgpu: the model and its losses against reference numbers, neighbours against the k-d tree's,
//! training without a word from the device.

#[path = "../reference_numbers/mod.rs"]
mod reference_numbers;

use std::io::Write;
use std::sync::Arc;

use burn::tensor::{Int, Tensor};
use burn_autodiff::Autodiff;
use burn_wgpu::graphics::{AutoGraphicsApi, GraphicsApi};
use burn_wgpu::{Wgpu, WgpuDevice};
use fam_core::evaluation::{Blocked, Evaluation, Plain};
use fam_core::neighbors::{BruteForce, KdTree, NeighborSearch};
use fam_core::training::{OptimizerKind, Strategies, Trainer, TrainingConfig};
use fam_surface::{Surface, shapes};
use rand::{RngExt, SeedableRng};
use reference_numbers::{Reference, all_combinations};

/// A wgpu adapter, software ones included.
///
/// Without one the test is skipped aloud, except where `FAM_REQUIRE_WGPU` is set: there a
/// missing adapter is a failure.
fn adapter() -> Option<WgpuDevice> {
    let api = AutoGraphicsApi::backend();
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: api.into(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let found = burn::tensor::try_read_sync(instance.enumerate_adapters(api.into()));
    if found.is_some_and(|adapters| !adapters.is_empty()) {
        return Some(WgpuDevice::DefaultDevice);
    }
    assert!(
        std::env::var_os("FAM_REQUIRE_WGPU").is_none(),
        "no wgpu adapter, and FAM_REQUIRE_WGPU is set"
    );
    // Not by `eprintln`, which a passing test keeps to itself.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: no wgpu adapter on this machine"
    );
    None
}

#[test]
fn small_reference_on_wgpu() {
    if let Some(device) = adapter() {
        let reference = Reference::small();
        all_combinations::<Autodiff<Wgpu>>(&reference, &Plain, &device);
        all_combinations::<Autodiff<Wgpu>>(&reference, &Blocked, &device);
    }
}

type Gpu = Autodiff<Wgpu>;

fn cloud<const D: usize>(n: usize, seed: u64, device: &WgpuDevice) -> Tensor<Gpu, 2> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let values: Vec<f32> = (0..n * D).map(|_| rng.random_range(-1.0..1.0)).collect();
    Tensor::<Gpu, 1>::from_floats(values.as_slice(), device).reshape([n, D])
}

fn indices(found: Tensor<Gpu, 1, Int>) -> Vec<i32> {
    found.into_data().iter::<i32>().collect()
}

/// More points than a workgroup has, one more than full ones, and fewer than one.
#[test]
fn neighbours_on_the_device_are_those_of_the_tree() {
    let Some(device) = adapter() else { return };
    for (points, queries) in [(700, 300), (513, 256), (20, 30)] {
        let points = cloud::<3>(points, 1, &device);
        let queries = cloud::<3>(queries, 2, &device);
        let tree = KdTree.nearest(points.clone(), queries.clone());
        let brute = BruteForce.nearest(points, queries);
        assert_eq!(indices(brute), indices(tree));
    }
    for (n, k) in [(500, 8), (257, 1), (9, 8)] {
        let points = cloud::<2>(n, 3, &device);
        let tree = KdTree.nearest_others(points.clone(), k);
        let brute = BruteForce.nearest_others(points, k);
        assert_eq!(indices(brute), indices(tree), "{n} points, {k} neighbours");
    }
}

/// Views with other strides are read as what they show, coinciding points are each other's
/// neighbours, and what is not finite is nobody's.
#[test]
fn neighbours_of_odd_points_are_found_on_the_device() {
    let Some(device) = adapter() else { return };
    let nan = f32::NAN;
    let columns = Tensor::<Gpu, 2>::from_floats(
        [[0.0, 1.0, 1.0, nan, 5.0], [0.0, 0.0, 0.0, 0.0, 0.0]],
        &device,
    );
    let found = BruteForce.nearest_others(columns.transpose(), 2);
    assert_eq!(indices(found), [1, 2, 2, 0, 1, 0, 0, 0, 1, 2]);
}

/// Rows that are gathered several times, once and never, by more indices than a workgroup has.
#[test]
fn gradients_of_gathered_neighbours_are_those_of_burn() {
    let Some(device) = adapter() else { return };
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    for (n, count) in [(300, 700), (64, 64), (5, 129), (200, 1)] {
        let indices: Vec<i32> = (0..count).map(|_| rng.random_range(0..n as i32)).collect();
        let indices = Tensor::<Gpu, 1, Int>::from_ints(indices.as_slice(), &device);
        let points = cloud::<3>(n, 6, &device).require_grad();
        let factors = cloud::<3>(count, 7, &device);
        let of = |search: &dyn NeighborSearch<Gpu>| -> [Vec<f32>; 2] {
            let gathered = search.gather(points.clone(), indices.clone());
            let gradients = (gathered.clone() * factors.clone()).sum().backward();
            let gradient = points.grad(&gradients).unwrap();
            [gathered.inner(), gradient].map(|tensor| tensor.into_data().iter().collect())
        };
        let ([rows, sums], [expected_rows, expected]) = (of(&BruteForce), of(&KdTree));
        assert_eq!(rows, expected_rows);
        assert_eq!((sums.len(), expected.len()), (3 * n, 3 * n));
        for (a, b) in sums.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-4, "{a} instead of {b}: {count} of {n}");
        }
    }
}

/// One step on the device is one on the host, and steps that are not read are steps.
#[test]
fn training_on_the_device_is_training() {
    // The bases of SOAP make too much of the rounding of another order of sums.
    device_trains_as_host(OptimizerKind::Soap, Arc::new(Plain));
    device_trains_as_host(OptimizerKind::AdamW, Arc::new(Blocked));
}

fn device_trains_as_host(optimizer: OptimizerKind, evaluation: Arc<dyn Evaluation<Gpu>>) {
    let Some(device) = adapter() else { return };
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let mut config = TrainingConfig {
        points: 100,
        iterations: 4,
        starts: 1,
        optimizer,
        ..TrainingConfig::fast()
    };
    config.networks.width = 16;
    let trainer = |strategies: Strategies<Gpu>| {
        Trainer::with_strategies(config.clone(), &surface, &device, strategies).unwrap()
    };
    let mut host = trainer(Strategies::plain());
    let mut unread = trainer(Strategies {
        evaluation,
        ..Strategies::on_device()
    });
    let mut seen = Vec::new();
    let mut steps = Vec::new();
    unread
        .run(|step| {
            seen.push(step.clone());
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();
    host.run(|step| {
        steps.push(step.clone());
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(steps.len(), 4);
    assert_eq!(seen.len(), 1);
    let (a, b) = (seen[0].total, steps[3].total);
    assert_eq!(seen[0].iteration, 3);
    assert!((a - b).abs() < 1e-5, "{a} {b}");
    assert!((b - steps[0].total).abs() > 1e-4, "nothing was learnt");
}

/// As the preset trains, with the bases of its optimiser turned once.
#[test]
fn steps_that_are_not_read_are_those_that_are() {
    let Some(device) = adapter() else { return };
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let mut config = TrainingConfig {
        points: 100,
        iterations: 12,
        starts: 1,
        ..TrainingConfig::fast()
    };
    config.networks.width = 16;
    let last = |read_every: usize| {
        let strategies = Strategies {
            read_every,
            ..Strategies::<Gpu>::on_device()
        };
        let mut trainer =
            Trainer::with_strategies(config.clone(), &surface, &device, strategies).unwrap();
        let mut seen = Vec::new();
        trainer
            .run(|step| {
                seen.push(step.clone());
                std::ops::ControlFlow::Continue(())
            })
            .unwrap();
        (seen.len(), seen.last().unwrap().total)
    };
    let ((all, a), (few, b)) = (last(1), last(5));
    assert_eq!((all, few), (12, 3));
    assert!((a - b).abs() < 1e-5, "{a} {b}");
}
