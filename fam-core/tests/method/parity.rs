//! The model and its losses against reference numbers, on ndarray. `small.safetensors` holds
//! widths of 16; a larger file with the paper's widths is used where it is present.

use std::io::Write;
use std::path::Path;

use crate::reference_numbers::{
    Reference, TOLERANCE, all_combinations, host, matches, relative_error,
};
use burn::module::AutodiffModule;
use burn_autodiff::Autodiff;
use burn_flex::Flex;
use burn_ndarray::NdArray;
use fam_core::cycles::lattice;
use fam_core::evaluation::{Plain, Tiled};
use fam_core::jacobian::JacobianMode;
use fam_core::losses::Objective;
use fam_core::map::TrainedMap;
use fam_core::networks::FlattenAnything;
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};

type Cpu = Autodiff<NdArray>;

#[test]
fn small_reference_on_ndarray() {
    all_combinations::<Cpu>(&Reference::small(), &Plain, &Default::default());
}

#[test]
fn small_reference_by_tiles() {
    let (reference, tiled) = (Reference::small(), Tiled::default());
    all_combinations::<Cpu>(&reference, &tiled, &Default::default());
    all_combinations::<Autodiff<Flex>>(&reference, &tiled, &Default::default());
}

#[test]
fn small_reference_on_flex() {
    all_combinations::<Autodiff<Flex>>(&Reference::small(), &Plain, &Default::default());
}

#[test]
fn full_reference_on_ndarray() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference/full.safetensors");
    let Ok(bytes) = std::fs::read(path) else {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: the reference at the paper's widths is not present"
        );
        return;
    };
    let reference = Reference { bytes };
    for mode in [JacobianMode::DoubleBackward, JacobianMode::ForwardTangent] {
        let device = Default::default();
        matches::<Cpu>(&reference, Objective::Paper, mode, &Plain, &device);
        matches::<Cpu>(
            &reference,
            Objective::Paper,
            mode,
            &Tiled::default(),
            &device,
        );
    }
}

#[test]
fn the_lattice_is_the_reference_grid() {
    let (expected, shape) = Reference::small().values("grid");
    let found: Vec<f32> = lattice(shape[0]).into_iter().flatten().collect();
    assert!(relative_error(&found, &expected) < 1e-6);
}

#[test]
fn seam_points_by_the_papers_rule_are_the_reference_mask() {
    let reference = Reference::small();
    let rows = |name: &str| reference.values(name).0;
    let points: Vec<[f32; 3]> = rows("points").as_chunks().0.to_vec();
    let uvs: Vec<[f32; 2]> = rows("q").as_chunks().0.to_vec();
    let threshold = SeamThreshold::of(SeamRule::Paper, &points, &uvs);
    let seams = Seams::of_points(&points, &uvs, threshold);
    let mask = rows("seam_mask");
    let expected: Vec<u32> = (0..400).filter(|&i| mask[i as usize] == 1.0).collect();
    assert_eq!(expected.len(), 381);
    assert_eq!(seams.points, expected);
}

#[test]
fn weights_of_another_value_are_noticed() {
    let reference = Reference::small();
    let device = Default::default();
    let model = FlattenAnything::<Cpu>::from_reference(&reference.bytes, &device).unwrap();
    let mut changed = model.valid();
    let bias = changed.wrap.mlp_2.layers[0].bias.take().unwrap();
    changed.wrap.mlp_2.layers[0].bias = Some(bias.map(|b| b + 1e-2));
    let changed = FlattenAnything::<Cpu>::from_inner(changed);
    let points = reference.tensor::<Cpu>("points", &device);
    let branch = changed.unwrap_branch(points, JacobianMode::ForwardTangent, true, &Plain);
    let (expected, _) = reference.values("p_cycle");
    assert!(relative_error(&host(&branch.p_cycle), &expected) > TOLERANCE);
}

/// A map of weights of the authors' program is their UVs, where no surface gives another frame.
#[test]
fn a_map_of_reference_weights_gives_the_reference_uvs() {
    let reference = Reference::small();
    let device = Default::default();
    let map = TrainedMap::<NdArray>::from_reference(&reference.bytes, None, &device).unwrap();
    let (points, _) = reference.values("points");
    let points: Vec<[f64; 3]> = points
        .as_chunks::<3>()
        .0
        .iter()
        .map(|p| p.map(f64::from))
        .collect();
    let (expected, _) = reference.values("q");
    for (found, expected) in map.uvs(&points).iter().zip(expected.as_chunks::<2>().0) {
        assert!(
            (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-4),
            "{found:?} {expected:?}"
        );
    }
}
