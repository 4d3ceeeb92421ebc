//! Surfaces of several components.

use std::ops::ControlFlow;

use burn_autodiff::Autodiff;
use burn_ndarray::NdArray;
use fam_core::atlas::{Atlas, Division, Flattened, Progress, Start, flatten};
use fam_core::training::{Strategies, TrainingConfig};
use fam_surface::metrics::Metrics;
use fam_surface::seams::SeamRule;
use fam_surface::{PointCloud, Surface, TriangleMesh, UvMap, shapes};

type Backend = NdArray;

fn config() -> TrainingConfig {
    TrainingConfig {
        points: 160,
        iterations: 5,
        ..TrainingConfig::fast()
    }
}

/// Meshes in one, each moved along x.
fn joined(parts: &[TriangleMesh]) -> TriangleMesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        let first = positions.len() as u32;
        let apart = |p: &[f64; 3]| [p[0] + 10.0 * i as f64, p[1], p[2]];
        positions.extend(part.positions().iter().map(apart));
        triangles.extend(part.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    TriangleMesh::new(positions, triangles).unwrap()
}

/// Two curved parts, one of them three times as large, and two flat ones.
fn four() -> TriangleMesh {
    joined(&[
        shapes::torus(1.0, 0.4, 16, 10),
        shapes::rectangle(2.0, 1.0, 3, 2),
        shapes::torus(3.0, 1.2, 16, 10),
        shapes::rectangle(0.5, 0.5, 1, 1),
    ])
}

fn run(
    mesh: &TriangleMesh,
    division: Division,
    observe: impl FnMut(Progress) -> ControlFlow<()>,
) -> Flattened<Backend> {
    let surface = Surface::Mesh(mesh.clone());
    flatten::<Autodiff<Backend>>(
        Start::Fresh(&config()),
        &surface,
        division,
        &Default::default(),
        Strategies::tiled(),
        observe,
    )
    .unwrap()
}

fn uv_map(flattened: &Flattened<Backend>) -> UvMap {
    let components = flattened.components.as_ref().unwrap();
    let maps = components.vertex_maps(&flattened.uvs).unwrap();
    components.uv_map(&maps).unwrap()
}

/// Lower left and upper right corner.
fn bounds(uvs: &[[f32; 2]]) -> [[f32; 2]; 2] {
    let fold = |start: f32, pick: fn(f32, f32) -> f32| {
        [0, 1].map(|axis| uvs.iter().map(|uv| uv[axis]).fold(start, pick))
    };
    [
        fold(f32::INFINITY, f32::min),
        fold(f32::NEG_INFINITY, f32::max),
    ]
}

fn overlap([a_low, a_high]: [[f32; 2]; 2], [b_low, b_high]: [[f32; 2]; 2]) -> bool {
    (0..2).all(|axis| a_low[axis] < b_high[axis] && b_low[axis] < a_high[axis])
}

#[test]
fn components_share_the_square_without_overlap_and_the_points_by_area() {
    let mesh = four();
    let mut components = Vec::new();
    let flattened = run(&mesh, Division::default(), |now| {
        components.push((now.component, now.components));
        ControlFlow::Continue(())
    });
    let steps = config().steps();
    let expected: Vec<_> = [0, 1]
        .into_iter()
        .flat_map(|c| std::iter::repeat_n((c, 2), steps))
        .collect();
    assert_eq!(components, expected);
    let points: Vec<usize> = flattened.parts.iter().map(|part| part.points).collect();
    // A ninth of the area is fewer than the least number of points.
    assert_eq!(points, [64, 0, 144, 0]);

    let boxes: Vec<_> = flattened.uvs.iter().map(|uvs| bounds(uvs)).collect();
    for (i, a) in boxes.iter().enumerate() {
        assert!(a.iter().flatten().all(|c| (0.0..=1.0).contains(c)), "{a:?}");
        assert!(boxes[..i].iter().all(|b| !overlap(*a, *b)));
    }
    // The flat parts are isometric, at one scale.
    let map = uv_map(&flattened);
    let side = |part: usize| boxes[part][1][1] - boxes[part][0][1];
    assert!((side(1) / side(3) - 2.0).abs() < 1e-4);
    let components = flattened.components.as_ref().unwrap();
    let flat = &components.list[1];
    let layout = UvMap::new(flattened.uvs[1].clone(), flat.mesh.triangles().to_vec()).unwrap();
    assert!(
        Metrics::measure(&flat.mesh, &layout)
            .unwrap()
            .symmetric_dirichlet
            < 4.0001
    );
    assert_eq!(map.triangles().len(), mesh.triangles().len());
}

#[test]
fn squares_are_filled_each_on_its_own() {
    let mesh = four();
    let of_part = [320, 12, 320, 2];
    let labels: Vec<u32> = of_part
        .iter()
        .zip([0, 1, 2, 1])
        .flat_map(|(&count, label)| std::iter::repeat_n(label, count))
        .collect();
    let division = Division {
        labels: &labels,
        squares: &[0, 1, 0],
        ..Division::default()
    };
    let flattened = run(&mesh, division, |_| ControlFlow::Continue(()));
    let boxes: Vec<_> = flattened.uvs.iter().map(|uvs| bounds(uvs)).collect();
    assert!(!overlap(boxes[0], boxes[2]));
    assert!(!overlap(boxes[1], boxes[3]));
    for square in [[0, 2], [1, 3]] {
        let reached = square.map(|i| boxes[i][1]);
        let side = reached.iter().flatten().copied().fold(0.0, f32::max);
        assert!((0.95..=1.0).contains(&side), "{side}");
    }
}

#[test]
fn after_a_break_the_rest_gets_one_step_each() {
    let flattened = run(&four(), Division::default(), |_| ControlFlow::Break(()));
    let steps: Vec<Option<usize>> = flattened
        .parts
        .iter()
        .map(|part| part.last.as_ref().map(|step| step.iteration))
        .collect();
    assert_eq!(steps, [Some(0), None, Some(0), None]);
}

#[test]
fn a_saved_atlas_maps_the_same_mesh_to_the_same_uvs() {
    let mesh = four();
    let flattened = run(&mesh, Division::default(), |_| ControlFlow::Continue(()));
    let bytes = flattened.atlas.to_safetensors().unwrap();
    let loaded = Atlas::<Backend>::from_safetensors(&bytes, &Default::default()).unwrap();
    assert_eq!(loaded.to_safetensors().unwrap().len(), bytes.len());
    assert_eq!(loaded.uv_map(&mesh, &[]).unwrap(), uv_map(&flattened));
    // Single points go to the component that they are on.
    let components = flattened.components.as_ref().unwrap();
    for (component, uvs) in components.list.iter().zip(&flattened.uvs) {
        assert_eq!(&loaded.uvs(component.mesh.positions()), uvs);
    }
    assert!(
        Atlas::<Backend>::from_safetensors(&bytes[..bytes.len() / 2], &Default::default()).is_err()
    );
}

#[test]
fn seams_are_those_of_the_trained_components_by_the_vertices_of_the_whole() {
    let mesh = four();
    let flattened = run(&mesh, Division::default(), |_| ControlFlow::Continue(()));
    let surface = Surface::Mesh(mesh);
    let (seams, thresholds) = flattened.seams(&surface, SeamRule::Spacing).unwrap();
    let found: Vec<bool> = thresholds.iter().map(Option::is_some).collect();
    assert_eq!(found, [true, false, true, false]);
    // A torus cannot be flat without being torn.
    let torus = 16 * 10;
    let on_first = |&[a, b]: &[u32; 2]| a < torus && b < torus;
    assert!(seams.edges.iter().any(on_first));
    let flat = torus..torus + 12;
    assert!(seams.points.iter().all(|v| !flat.contains(v)));
    // Spacing is in units of the input: the second torus is three times as large, with
    // 144 points instead of 64.
    let spacing = |i: usize| thresholds[i].unwrap().spacing.unwrap();
    let ratio = spacing(2) / spacing(0);
    assert!((1.5..2.6).contains(&ratio), "{ratio}");
}

/// Against central differences, on flat and on trained components, which have other scales. The
/// networks have kinks, so a difference across one says nothing: four of five agree at
/// least.
#[test]
fn the_jacobian_is_that_of_the_uvs() {
    let mesh = four();
    let flattened = run(&mesh, Division::default(), |_| ControlFlow::Continue(()));
    let step = 2e-3;
    for component in &flattened.components.as_ref().unwrap().list {
        let points = component.mesh.positions();
        let found = flattened.atlas.jacobian(points);
        let mut errors = Vec::new();
        for axis in 0..3 {
            let moved = |side: f64| {
                let of =
                    |p: &[f64; 3]| [0, 1, 2].map(|a| p[a] + if a == axis { side } else { 0.0 });
                flattened
                    .atlas
                    .uvs(&points.iter().map(of).collect::<Vec<_>>())
            };
            for ((rows, high), low) in found.iter().zip(moved(step)).zip(moved(-step)) {
                for k in 0..2 {
                    let quotient = f64::from(high[k] - low[k]) / (2.0 * step);
                    errors.push((f64::from(rows[k][axis]) - quotient).abs());
                }
            }
        }
        let wrong = errors.iter().filter(|error| **error > 2e-3).count();
        assert!(wrong * 5 <= errors.len(), "{wrong} of {}", errors.len());
    }
}

#[test]
fn a_cloud_is_one_component() {
    let points = shapes::torus(1.0, 0.4, 16, 10).positions().to_vec();
    let surface = Surface::PointCloud(PointCloud::new(points, None).unwrap());
    let flattened = flatten::<Autodiff<Backend>>(
        Start::Fresh(&config()),
        &surface,
        Division::default(),
        &Default::default(),
        Strategies::tiled(),
        |_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert!(flattened.components.is_none());
    assert_eq!(flattened.uvs[0].len(), 160);
    assert_eq!(flattened.atlas.uvs(surface.positions()), flattened.uvs[0]);
}

#[test]
fn small_components_are_trained_together_and_share_one_map() {
    let torus = shapes::torus(1.0, 0.4, 16, 10);
    let mesh = joined(&vec![torus.clone(); 5]);
    let mut trainings = Vec::new();
    let flattened = run(&mesh, Division::default(), |now| {
        trainings.push((now.component, now.components));
        ControlFlow::Continue(())
    });
    trainings.dedup();
    assert_eq!(trainings, [(0, 1)]);
    let boxes: Vec<_> = flattened.uvs.iter().map(|uvs| bounds(uvs)).collect();
    for (i, a) in boxes.iter().enumerate() {
        assert!(boxes[..i].iter().all(|b| !overlap(*a, *b)));
    }
    let bytes = flattened.atlas.to_safetensors().unwrap();
    let one = run(&torus, Division::default(), |_| ControlFlow::Continue(()));
    let of_one = one.atlas.to_safetensors().unwrap();
    assert!(
        bytes.len() < 2 * of_one.len(),
        "the weights are written once"
    );
    let loaded = Atlas::<Backend>::from_safetensors(&bytes, &Default::default()).unwrap();
    assert_eq!(loaded.uv_map(&mesh, &[]).unwrap(), uv_map(&flattened));
}
