//! Clouds as scanners and photogrammetry make them, laid out as a whole.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{doubled_area, overlaps};
use crate::{CloudLayout, LayoutConfig, lay_out_cloud};
use fam_surface::shapes;

/// Lays out a cloud on 1, 2 and 8 threads: the results are the same and valid, and the distortion is
/// within the bound.
fn laid_out(points: &[[f64; 3]]) -> CloudLayout {
    let config = LayoutConfig::default();
    let raw = vec![[0.0; 2]; points.len()];
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let going = &mut |_| ControlFlow::Continue(());
        pool.unwrap()
            .install(|| lay_out_cloud(&config, points, &raw, going).unwrap())
    };
    let alone = on(1);
    for threads in [2, 8] {
        let other = on(threads);
        assert!(alone.uvs == other.uvs && alone.atlas == other.atlas);
    }
    let inside = |q: &[f32; 2]| q.iter().all(|c| (0.0..=1.0).contains(c));
    assert!(alone.uvs.iter().all(inside));
    for component in &alone.atlas.components {
        let uvs = &component.uvs;
        let areas = (0..uvs.triangles().len()).map(|t| doubled_area(uvs.corners(t)));
        assert!(areas.into_iter().all(|area| area != 0.0));
        assert_eq!(overlaps(uvs), 0);
        let energy = component.distortion.energy;
        assert!(energy <= config.distortion_bound, "{energy}");
    }
    alone
}

/// Rows of a scanner on a tripod: dense near it, sparse far from it, on hills and on a wall behind
/// which nothing is seen, far from the origin, with points in the air.
#[test]
fn rows_of_a_laser_scan_are_laid_out() {
    let mut rng = Pcg64::seed_from_u64(3);
    let height = |x: f64, y: f64| 0.4 * (0.5 * x).sin() * (0.7 * y).cos();
    let mut points = Vec::new();
    for ring in 0..44 {
        let radius = 1.5 * 1.045_f64.powi(ring);
        for step in 0..110 {
            let turn = TAU / 4.0 * f64::from(step) / 110.0;
            let range = radius * (1.0 + 0.004 * rng.random_range(-1.0..1.0));
            let [x, y] = [range * turn.cos(), range * turn.sin()];
            if x < 5.0 || y < 3.0 {
                points.push([x, y, height(x, y)]);
            }
        }
    }
    let ground = points.len();
    // The wall stands at x = 5.2, apart from the ground in front of it.
    for row in 0..18 {
        for column in 0..40 {
            let [y, z] = [3.0 + 0.08 * f64::from(column), 0.8 + 0.08 * f64::from(row)];
            points.push([5.2 + 0.01 * rng.random_range(-1.0..1.0), y, z]);
        }
    }
    let of_surface = points.len();
    for _ in 0..25 {
        let [x, y] = [0, 1].map(|_| rng.random_range(0.0..8.0));
        points.push([x, y, rng.random_range(4.0..9.0)]);
    }
    let far = [451_230.0, 5_411_870.0, 310.0];
    let points: Vec<[f64; 3]> = points
        .iter()
        .map(|p| [0, 1, 2].map(|axis| p[axis] + far[axis]))
        .collect();
    let cloud = laid_out(&points);
    let left = cloud.unreached;
    assert!(left <= points.len() - of_surface + ground / 100, "{left}");
    assert!(cloud.atlas.components.len() >= 2, "the wall stands apart");
}

/// A statue on a floor from photographs: points several times, noise, and floaters around.
#[test]
fn points_of_photogrammetry_are_laid_out() {
    let mut rng = Pcg64::seed_from_u64(4);
    let mut jitter = |amount: f64| amount * rng.random_range(-1.0..1.0);
    let bust = shapes::bust(0.12);
    let mut points = bust.positions().to_vec();
    let floor = shapes::rectangle(6.0, 6.0, 40, 40);
    let under = |p: &[f64; 3]| [p[0], p[1], p[2] - 3.0];
    points.extend(floor.positions().iter().map(under));
    for p in &mut points {
        *p = p.map(|c| c + jitter(0.008));
    }
    let repeated: Vec<[f64; 3]> = points.iter().step_by(3).copied().collect();
    points.extend(repeated);
    let of_surface = points.len();
    let floaters = of_surface / 50;
    points.extend((0..floaters).map(|_| [0; 3].map(|_| jitter(4.0))));
    let cloud = laid_out(&points);
    let left = cloud.unreached;
    assert!(left <= floaters + of_surface / 100, "{left}");
}
