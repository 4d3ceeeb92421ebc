use burn::tensor::{Tensor, TensorData};
use burn_ndarray::NdArray;
use fam_surface::Normalization;

use super::*;
use crate::cycles::UnwrapBranch;
use crate::evaluation::Plain;
use crate::jacobian::Jacobian;
use crate::networks::{FlattenAnything, FlattenAnythingConfig};

type Cpu = NdArray<f32>;

fn tensor<const D: usize>(rows: &[[f32; D]]) -> Tensor<Cpu, 2> {
    let data = TensorData::new(rows.concat(), [rows.len(), D]);
    Tensor::from_data(data, &Default::default())
}

fn model() -> FlattenAnything<Cpu> {
    let config = FlattenAnythingConfig::new().with_width(16);
    config.init(&Default::default(), 3)
}

/// A term where f has these derivatives, and the UVs of `points` are those of a model.
fn value(term: &dyn LossTerm<Cpu>, u: [f32; 3], v: [f32; 3], points: &[[f32; 3]]) -> Option<f32> {
    let model = model();
    let q = model.unwrap(tensor(points), true, &Plain);
    let evaluated = Evaluated {
        iteration: 0,
        points: tensor(points),
        normals: None,
        deform: None,
        unwrap: Some(UnwrapBranch {
            p_cut: tensor(points),
            q,
            p_cycle: tensor(points),
            p_cycle_normals: tensor(points),
            jacobian: Jacobian {
                u: tensor(&[u]),
                v: tensor(&[v]),
            },
        }),
        flattening: None,
        normalization: &Normalization {
            center: [10.0, 0.0, 0.0],
            radius: 2.0,
        },
        model: &model,
        cut_net: true,
        evaluation: &Plain,
    };
    term.loss(&evaluated).map(|loss| loss.into_scalar())
}

const POINT: [[f32; 3]; 1] = [[0.0; 3]];

#[test]
fn mips_is_two_where_angles_are_kept_and_grows_with_their_distortion() {
    let mips = |u, v| value(&Mips, u, v, &POINT).unwrap();
    for scale in [0.1, 1.0, 30.0] {
        let kept = mips(
            [0.6 * scale, 0.8 * scale, 0.0],
            [0.8 * scale, -0.6 * scale, 0.0],
        );
        assert!((kept - 2.0).abs() < 0.02, "{kept}");
        // λ¹ = 9 λ².
        let stretched = mips([0.0, 3.0 * scale, 0.0], [0.0, 0.0, scale]);
        assert!((stretched - (9.0 + 1.0 / 9.0)).abs() < 0.2, "{stretched}");
    }
    let folded = mips([1.0, 1.0, 0.0], [2.0, 2.0, 0.0]);
    assert!((folded - 998.0).abs() < 1.0, "{folded}");
    assert!(mips([0.0; 3], [0.0; 3]).is_finite());
}

#[test]
fn isometry_measures_squared_lengths() {
    let isometry = |u, v| value(&Isometry, u, v, &POINT).unwrap();
    assert!(isometry([0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]).abs() < 1e-6);
    // |4 − 1| + |0.25 − 1|.
    assert!((isometry([2.0, 0.0, 0.0], [0.0, 0.0, 0.5]) - 3.75).abs() < 1e-5);
}

#[test]
fn landmarks_measure_uvs_in_the_unit_square() {
    let points: Vec<[f32; 3]> = (0..20)
        .map(|i| i as f32)
        .map(|i| [0.04 * i, (0.7 * i).sin() * 0.5, (0.3 * i).cos() * 0.5])
        .collect();
    let q = model().unwrap(tensor(&points), true, &Plain).into_data();
    let q: Vec<f32> = q.to_vec().unwrap();
    let (q, _) = q.as_chunks::<2>();
    let extreme = |axis: usize, sign: f32| {
        let most = q.iter().map(|q| sign * q[axis]).fold(f32::MIN, f32::max);
        sign * most
    };
    let low = [0, 1].map(|axis| extreme(axis, -1.0));
    let side = (0..2)
        .map(|axis| extreme(axis, 1.0) - low[axis])
        .fold(0.0, f32::max);
    let uv = |i: usize| [0, 1].map(|axis| f64::from((q[i][axis] - low[axis]) / side));
    let input = |i: usize| {
        let [x, y, z] = points[i].map(f64::from);
        [10.0 + 2.0 * x, 2.0 * y, 2.0 * z]
    };
    let of = |given: Landmarks| value(&given, [1.0; 3], [1.0; 3], &points);
    let kept = of(Landmarks::new(vec![input(3), input(8)], vec![uv(3), uv(8)])).unwrap();
    assert!(kept < 1e-4, "{kept}");
    let moved = [uv(3)[0] + 0.3, uv(3)[1] - 0.4];
    let moved = of(Landmarks::new(vec![input(3)], vec![moved])).unwrap();
    assert!((moved - 0.5).abs() < 1e-4, "{moved}");
}

#[test]
fn terms_that_make_no_sense_are_named() {
    let landmarks = |points: usize, uv: f64| TermConfig {
        weight: 1.0,
        kind: TermKind::Landmarks(Landmarks::new(vec![[0.0; 3]; points], vec![[uv; 2]])),
    };
    assert_eq!(landmarks(1, 0.5).problem(), None);
    for bad in [
        landmarks(0, 0.5),
        landmarks(2, 0.5),
        landmarks(1, 1.5),
        landmarks(1, f64::NAN),
    ] {
        assert!(bad.problem().unwrap().contains("landmarks"));
    }
    for weight in [-1.0, f64::NAN, f64::INFINITY] {
        let kind = TermKind::Mips;
        assert!(TermConfig { weight, kind }.problem().is_some());
    }
}
