//! Training from end to end on generated surfaces, small and short.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use burn::tensor::{Int, Tensor, backend::Backend};
use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use fam_core::losses::{LossWeights, Objective, Term};
use fam_core::map::TrainedMap;
use fam_core::neighbors::{KdTree, NeighborSearch};
use fam_core::networks::FlattenAnythingConfig;
use fam_core::sampling::Sampling;
use fam_core::training::{
    Ablation, OptimizerKind, Step, Strategies, Trainer, TrainingConfig, TrainingError, train,
};
use fam_surface::metrics::Metrics;
use fam_surface::neighbors::nearest_others;
use fam_surface::{PointCloud, Surface, TriangleMesh, UvMap, shapes};

pub type Cpu = Autodiff<NdArray>;

pub fn small(iterations: usize) -> TrainingConfig {
    TrainingConfig {
        points: 400,
        iterations,
        networks: FlattenAnythingConfig::new().with_width(64).with_latent(16),
        learning_rate: 5e-3,
        // With the starts and the opening of the preset, the torus folds at so few points.
        starts: 4,
        opening: 0.15,
        ..TrainingConfig::fast()
    }
}

fn run(config: TrainingConfig, surface: &Surface) -> (TrainedMap<NdArray>, Step) {
    let mut last = None;
    let map = train::<Cpu>(
        config,
        surface,
        &Default::default(),
        Strategies::tiled(),
        |step| {
            last = Some(step.clone());
            ControlFlow::Continue(())
        },
    )
    .unwrap();
    (map, last.unwrap())
}

fn measure(map: &TrainedMap<NdArray>, mesh: &TriangleMesh) -> Metrics {
    let uvs = map.uvs(mesh.positions());
    let uvs = UvMap::new(uvs, mesh.triangles().to_vec()).unwrap();
    Metrics::measure(mesh, &uvs).unwrap()
}

pub fn term(step: &Step, wanted: Term) -> f32 {
    step.terms
        .iter()
        .find(|(term, _)| *term == wanted)
        .unwrap()
        .1
}

/// Trains on a mesh and asserts the conformality of its vertices' map and the wrapping error.
fn reaches(mesh: TriangleMesh, iterations: usize, conformality: f64, wrap: f32) {
    let surface = Surface::Mesh(mesh.clone());
    let (map, last) = run(small(iterations), &surface);
    let metrics = measure(&map, &mesh);
    let wrapped = term(&last, Term::Wrap);
    println!("conformality {}, wrap {wrapped}", metrics.conformality);
    assert!(
        metrics.conformality < conformality,
        "conformality {}",
        metrics.conformality
    );
    assert!(wrapped < wrap, "wrapping error {wrapped}");
}

#[test]
fn torus() {
    reaches(shapes::torus(1.0, 0.4, 60, 30), 700, 0.38, 0.055);
}

#[test]
fn open_cylinder() {
    reaches(shapes::open_cylinder(0.5, 1.5, 50, 24), 400, 0.2, 0.055);
}

#[test]
fn moebius_strip() {
    reaches(shapes::moebius_strip(0.8, 80, 12), 400, 0.28, 0.045);
}

/// An unoriented cloud of a gently curved sheet; the sheet's triangles, which training does not
/// see, tell how conformal the map is.
#[test]
fn point_cloud() {
    let flat = shapes::rectangle(2.0, 1.5, 24, 18);
    let positions: Vec<_> = flat
        .positions()
        .iter()
        .map(|[x, y, _]| [*x, *y, 0.25 * (1.5 * x).sin()])
        .collect();
    let sheet = TriangleMesh::new(positions.clone(), flat.triangles().to_vec()).unwrap();
    let cloud = Surface::PointCloud(PointCloud::new(positions, None).unwrap());
    let (map, last) = run(small(300), &cloud);
    let metrics = measure(&map, &sheet);
    let wrapped = term(&last, Term::Wrap);
    println!("conformality {}, wrap {wrapped}", metrics.conformality);
    assert!(
        metrics.conformality < 0.1,
        "conformality {}",
        metrics.conformality
    );
    assert!(wrapped < 0.03, "wrapping error {wrapped}");
    assert!(
        last.terms
            .iter()
            .all(|(term, _)| *term != Term::CycleNormals)
    );
}

#[test]
fn one_seed_gives_one_result_and_another_gives_another() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let bytes = |seed| {
        let config = TrainingConfig { seed, ..small(5) };
        run(config, &surface).0.to_safetensors().unwrap()
    };
    assert_eq!(bytes(7), bytes(7));
    assert_ne!(bytes(7), bytes(8));
}

#[test]
fn a_saved_map_gives_the_same_uvs() {
    let mesh = shapes::torus(1.0, 0.4, 30, 16);
    let surface = Surface::Mesh(mesh.clone());
    for without in [Ablation::None, Ablation::UnwrapBranch, Ablation::CutNet] {
        let networks = FlattenAnythingConfig::new().with_width(24).with_latent(8);
        let config = TrainingConfig {
            without,
            networks: networks.with_unwrap_factor(Some(2)),
            ..small(5)
        };
        let (map, _) = run(config, &surface);
        let bytes = map.to_safetensors().unwrap();
        let loaded = TrainedMap::<NdArray>::from_safetensors(&bytes, &Default::default()).unwrap();
        let uvs = map.uvs(mesh.positions());
        assert_eq!(loaded.uvs(mesh.positions()), uvs);
        assert_eq!(loaded.config(), map.config());
        let longest = |axis: usize| uvs.iter().map(|q| q[axis]).fold(0.0f32, f32::max);
        assert!(uvs.iter().flatten().all(|c| (0.0..=1.0 + 1e-6).contains(c)));
        assert!((longest(0).max(longest(1)) - 1.0).abs() < 1e-6);
    }
}

/// Fewer points than any configuration may ask for, and in the nearest-point ablation a lattice
/// as small as the one that was trained.
#[test]
fn the_map_of_a_surface_with_few_points_is_saved_and_loaded() {
    let corners: Vec<_> = (0..8)
        .map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from))
        .collect();
    let cloud = Surface::PointCloud(PointCloud::new(corners.clone(), None).unwrap());
    for without in [Ablation::None, Ablation::UnwrapBranch] {
        let (map, _) = run(
            TrainingConfig {
                without,
                ..small(2)
            },
            &cloud,
        );
        let bytes = map.to_safetensors().unwrap();
        let loaded = TrainedMap::<NdArray>::from_safetensors(&bytes, &Default::default()).unwrap();
        assert_eq!(loaded.uvs(&corners), map.uvs(&corners));
        if without == Ablation::UnwrapBranch {
            // 8 points are wrapped from a lattice of 3 by 3.
            let many: Vec<_> = (0..400).map(|i| [f64::from(i) / 400.0, 0.3, 0.6]).collect();
            let mut distinct: Vec<_> = map.uvs(&many).iter().map(|q| q.map(f32::to_bits)).collect();
            distinct.sort_unstable();
            distinct.dedup();
            assert!(distinct.len() <= 9, "{}", distinct.len());
        }
    }
}

#[test]
fn damaged_model_files_are_errors() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let bytes = run(small(1), &surface).0.to_safetensors().unwrap();
    let load = |bytes: &[u8]| TrainedMap::<NdArray>::from_safetensors(bytes, &Default::default());
    assert!(load(&bytes).is_ok());
    for end in [0, 7, 8, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(load(&bytes[..end]).is_err(), "cut at {end}");
    }
    let text = String::from_utf8_lossy(&bytes);
    let at = text.find("cut.mlp_1.0.weight").unwrap();
    let mut renamed = bytes.clone();
    renamed[at..at + 3].copy_from_slice(b"gut");
    assert!(
        load(&renamed)
            .unwrap_err()
            .to_string()
            .contains("cut.mlp_1.0.weight")
    );
}

#[test]
fn flattening_is_a_term_where_it_has_a_weight() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let has_it = |config| {
        let (_, last) = run(config, &surface);
        last.terms.iter().any(|(term, _)| *term == Term::Flattening)
    };
    assert!(has_it(small(1)));
    assert!(!has_it(TrainingConfig {
        weights: LossWeights::default(),
        ..small(1)
    }));
}

/// Fresh weights hardly bend a surface, so that half of a torus lies the other side up. The triangles
/// of a mesh tell; points do not.
#[test]
fn the_flattening_of_a_mesh_has_one_side_up() {
    let mesh = shapes::torus(1.0, 0.4, 30, 16);
    let cloud = PointCloud::new(mesh.positions().to_vec(), None).unwrap();
    let [of_mesh, of_cloud] = [Surface::Mesh(mesh), Surface::PointCloud(cloud)].map(|surface| {
        let device = Default::default();
        let mut trainer = Trainer::<Cpu>::new(small(1), &surface, &device).unwrap();
        term(&trainer.step().unwrap(), Term::Flattening)
    });
    assert!(of_mesh > of_cloud + 0.1, "{of_mesh} {of_cloud}");
}

/// Files from before there was a weight of ℓ_flat.
#[test]
fn weights_that_a_model_file_leaves_out_are_the_papers() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let mut bytes = run(small(1), &surface).0.to_safetensors().unwrap();
    let entry = br#",\"flattening\":0.02"#;
    let at = bytes.windows(entry.len()).position(|w| w == entry).unwrap();
    bytes[at..at + entry.len()].fill(b' ');
    let map = TrainedMap::<NdArray>::from_safetensors(&bytes, &Default::default()).unwrap();
    assert_eq!(map.config().weights, LossWeights::default());
}

#[test]
fn a_loss_that_is_not_finite_stops_at_the_last_good_weights() {
    let mesh = shapes::torus(1.0, 0.4, 30, 16);
    let surface = Surface::Mesh(mesh.clone());
    let config = TrainingConfig {
        // Steps so large that the weights run away within a few.
        learning_rate: 1.0,
        final_learning_rate: 1.0,
        ..small(100)
    };
    let mut trainer = Trainer::<Cpu>::new(config, &surface, &Default::default()).unwrap();
    let stopped = (0..100).find_map(|i| trainer.step().err().map(|error| (i, error)));
    match stopped {
        Some((i, TrainingError::NonFiniteLoss { iteration, .. })) => assert_eq!(iteration, i),
        other => panic!("{other:?}"),
    }
    let (map, last_step) = trainer.finish(&surface);
    assert_eq!(last_step, Ok(()), "it is back at good weights");
    assert!(
        map.uvs(mesh.positions())
            .iter()
            .flatten()
            .all(|c| c.is_finite())
    );
}

#[test]
fn every_variant_trains() {
    let surface = Surface::Mesh(shapes::open_sphere(0.6, 30, 16));
    let base = small(3);
    let variants = [
        TrainingConfig {
            objective: Objective::Reference,
            ..base.clone()
        },
        TrainingConfig {
            without: Ablation::DeformBranch,
            ..base.clone()
        },
        TrainingConfig {
            without: Ablation::UnwrapBranch,
            ..base.clone()
        },
        TrainingConfig {
            without: Ablation::CutNet,
            ..base.clone()
        },
        TrainingConfig {
            sampling: Sampling::Vertices,
            points: 100,
            ..base.clone()
        },
        TrainingConfig {
            normals: false,
            ..base.clone()
        },
        // More points asked for than there are.
        TrainingConfig {
            sampling: Sampling::Vertices,
            points: 5_000,
            ..base
        },
    ];
    for config in variants {
        let (map, last) = run(config.clone(), &surface);
        assert!(last.total.is_finite(), "{config:?}");
        let has = |wanted| last.terms.iter().any(|(term, _)| *term == wanted);
        assert_eq!(has(Term::Wrap), config.without != Ablation::DeformBranch);
        assert_eq!(has(Term::Unwrap), config.without != Ablation::UnwrapBranch);
        let with_normals = config.normals && config.without != Ablation::UnwrapBranch;
        assert_eq!(has(Term::CycleNormals), with_normals);
        let on_g = config.objective == Objective::Paper && config.without != Ablation::DeformBranch;
        assert_eq!(has(Term::ConformalityG), on_g);
        assert!(
            map.uvs(surface.positions())
                .iter()
                .flatten()
                .all(|c| c.is_finite())
        );
    }
}

#[test]
fn surfaces_that_cannot_be_trained_on_are_errors() {
    let device = Default::default();
    let error = |surface: Surface| Trainer::<Cpu>::new(small(1), &surface, &device).err();
    let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangle = TriangleMesh::new(corners, vec![[0, 1, 2]]).unwrap();
    assert!(matches!(
        error(Surface::Mesh(triangle)),
        Some(TrainingError::Surface(_))
    ));
    let line = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    let flat = TriangleMesh::new(line, vec![[0, 1, 2], [1, 2, 3]]).unwrap();
    let vertices = TrainingConfig {
        sampling: Sampling::Vertices,
        ..small(1)
    };
    assert!(matches!(
        Trainer::<Cpu>::new(vertices, &Surface::Mesh(flat), &device).err(),
        Some(TrainingError::Surface(_))
    ));
    let same = PointCloud::new(vec![[1.0; 3]; 50], None).unwrap();
    assert!(matches!(
        error(Surface::PointCloud(same)),
        Some(TrainingError::Surface(_))
    ));
    let two = PointCloud::new(vec![[0.0; 3], [1.0; 3]], None).unwrap();
    assert!(matches!(
        error(Surface::PointCloud(two)),
        Some(TrainingError::Surface(_))
    ));
    let good = Surface::Mesh(shapes::torus(1.0, 0.4, 8, 8));
    let config = TrainingConfig {
        points: 0,
        ..small(1)
    };
    assert!(matches!(
        Trainer::<Cpu>::new(config, &good, &device).err(),
        Some(TrainingError::Config(_))
    ));
}

/// Neighbours by distances between all pairs, in tensor operations on the device.
struct BruteForce;

impl<B: Backend> NeighborSearch<B> for BruteForce {
    fn nearest(&self, points: Tensor<B, 2>, queries: Tensor<B, 2>) -> Tensor<B, 1, Int> {
        distances(queries, points).argmin(1).squeeze_dim(1)
    }

    fn nearest_others(&self, points: Tensor<B, 2>, k: usize) -> Tensor<B, 1, Int> {
        let n = points.dims()[0];
        let device = points.device();
        let to_self = Tensor::<B, 2>::eye(n, &device) * 1e9;
        let order = (distances(points.clone(), points) + to_self).argsort(1);
        order.narrow(1, 0, k).reshape([n * k])
    }
}

fn distances<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 2> {
    let difference = a.unsqueeze_dim::<3>(1) - b.unsqueeze_dim::<3>(0);
    (difference.clone() * difference).sum_dim(2).squeeze_dim(2)
}

#[test]
fn other_strategies_can_take_the_place_of_the_default() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let config = TrainingConfig {
        points: 100,
        // The bases of SOAP make more of rounding.
        optimizer: OptimizerKind::AdamW,
        ..small(3)
    };
    let device = Default::default();
    let mut tree = Trainer::<Cpu>::new(config.clone(), &surface, &device).unwrap();
    let mut brute = Trainer::<Cpu>::with_strategies(
        config,
        &surface,
        &device,
        Strategies {
            search: Arc::new(BruteForce),
            ..Strategies::tiled()
        },
    )
    .unwrap();
    for _ in 0..3 {
        let (a, b) = (tree.step().unwrap(), brute.step().unwrap());
        assert!((a.total - b.total).abs() < 1e-5, "{} {}", a.total, b.total);
    }
    assert_eq!(
        nearest_others(&[[0.0f32, 0.0], [1.0, 0.0], [5.0, 0.0]], 1),
        [1, 0, 1]
    );
}

/// Notes how many points each search is among.
#[derive(Default)]
struct Noting(Mutex<Vec<usize>>);

impl<B: Backend> NeighborSearch<B> for Noting {
    fn nearest(&self, points: Tensor<B, 2>, queries: Tensor<B, 2>) -> Tensor<B, 1, Int> {
        self.0.lock().unwrap().push(points.dims()[0]);
        KdTree.nearest(points, queries)
    }

    fn nearest_others(&self, points: Tensor<B, 2>, k: usize) -> Tensor<B, 1, Int> {
        self.0.lock().unwrap().push(points.dims()[0]);
        KdTree.nearest_others(points, k)
    }
}

/// P and the lattice are smaller in the opening, which has no ℓ_flat.
#[test]
fn a_surface_is_opened_with_fewer_points_and_without_flattening() {
    let mesh = shapes::torus(1.0, 0.4, 30, 16);
    let cloud = PointCloud::new(mesh.positions().to_vec(), None).unwrap();
    // Points that are always the same, and points that are drawn anew.
    for surface in [Surface::Mesh(mesh.clone()), Surface::PointCloud(cloud)] {
        let config = TrainingConfig {
            points: 400,
            starts: 1,
            opening: 0.5,
            ..small(6)
        };
        let noting = Arc::new(Noting::default());
        let strategies = Strategies {
            search: noting.clone(),
            ..Strategies::tiled()
        };
        let device = Default::default();
        let mut trainer =
            Trainer::<Cpu>::with_strategies(config, &surface, &device, strategies).unwrap();
        let mut flattened = Vec::new();
        let observe = |step: &Step| {
            flattened.push(step.terms.iter().any(|(t, _)| *t == Term::Flattening));
            ControlFlow::Continue(())
        };
        trainer.run(observe).unwrap();
        // Three searches of each step.
        let expected = [[256; 9], [400; 9]].concat();
        assert_eq!(*noting.0.lock().unwrap(), expected);
        assert_eq!(flattened, [false, false, false, true, true, true]);
    }
}

/// Every start opens, the two with the smallest losses go on a little, and then the better one; and
/// a single start is the first of several.
#[test]
fn the_start_with_the_smallest_loss_goes_on() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let config = |starts: usize, seed: u64| TrainingConfig {
        points: 64,
        starts,
        opening: 0.5,
        seed,
        // With 0.03 of ℓ_wrap, this term decides.
        weights: LossWeights {
            cycle: 0.1,
            ..TrainingConfig::fast().weights
        },
        ..small(20)
    };
    let steps = |config: TrainingConfig| {
        let mut all = Vec::new();
        let mut trainer = Trainer::<Cpu>::new(config, &surface, &Default::default()).unwrap();
        let observe = |step: &Step| {
            all.push(step.clone());
            ControlFlow::Continue(())
        };
        trainer.run(observe).unwrap();
        all
    };
    let terms = |steps: &[Step]| -> Vec<_> { steps.iter().map(|s| s.terms.clone()).collect() };
    let mut places_of_first = [0; 3];
    let mut wins_of_first = 0;
    let mut judged_otherwise = 0;
    for seed in 1000..1010 {
        let (one, three) = (steps(config(1, seed)), steps(config(3, seed)));
        let expected: Vec<usize> = [0..10, 0..10, 0..10, 10..13, 10..13, 13..20]
            .into_iter()
            .flatten()
            .collect();
        let iterations: Vec<usize> = three.iter().map(|step| step.iteration).collect();
        assert_eq!(iterations, expected);
        assert!(three.iter().enumerate().all(|(i, step)| step.before == i));
        assert_eq!(terms(&one[..9]), terms(&three[..9]));

        let mut order = [0, 1, 2];
        let opened = |start: usize| three[10 * start + 9].total;
        order.sort_by(|&a, &b| opened(a).total_cmp(&opened(b)));
        let place = order.iter().position(|&start| start == 0).unwrap();
        places_of_first[place] += 1;
        let finalists = [&three[30..33], &three[33..36]];
        for (at, finalist) in finalists.iter().enumerate() {
            assert_eq!(terms(finalist) == terms(&one[10..13]), at == place);
        }
        let last_weights = config(3, seed).weights_at(20);
        let [a, b] = finalists.map(|steps| last_weights.sum(&steps[2].terms));
        let [c, d] = finalists.map(|steps| steps[2].total);
        judged_otherwise += usize::from((b < a) != (d < c));
        let first_wins = place == usize::from(b < a);
        assert_eq!(terms(&three[36..]) == terms(&one[13..]), first_wins);
        wins_of_first += usize::from(first_wins);
    }
    assert!(
        places_of_first.iter().all(|&n| n > 0),
        "{places_of_first:?}"
    );
    assert!((1..9).contains(&wins_of_first), "{wins_of_first}");
    assert!(judged_otherwise > 0);
}

/// Broken off while a later start opens, the best of those before is kept.
#[test]
fn a_start_that_is_broken_off_does_not_take_the_place_of_a_better_one() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 30, 16));
    let config = TrainingConfig {
        points: 64,
        starts: 3,
        opening: 0.5,
        ..small(60)
    };
    let until = |last: usize| {
        let mut trainer =
            Trainer::<Cpu>::new(config.clone(), &surface, &Default::default()).unwrap();
        let observe = |step: &Step| match step.before == last {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        trainer.run(observe).unwrap();
        let (map, outcome) = trainer.finish(&surface);
        outcome.unwrap();
        map.uvs(surface.positions())
    };
    // The first start to its end, and the second as it begins.
    assert_eq!(until(29), until(31));
}
