//! What one iteration asks for, at the paper's 10,000 points: the 8 nearest of each point in the
//! plane, and the nearest of each of two samples of a torus in the other. `kd_tree` is what training
//! takes on a CPU; `brute_force` compares all with all, on all cores.
//!
//! `cargo bench -p fam-core --bench neighbors`; `fam-cli/benches/pytorch/run` has the same of scipy
//! and PyTorch.

use divan::Bencher;
use fam_surface::neighbors::{nearest, nearest_others};
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const POINTS: usize = 10_000;

const OTHERS: usize = 8;

fn main() {
    divan::main();
}

/// The points of an iteration: Q, P and P̂.
struct Points {
    q: Vec<[f32; 2]>,
    p: Vec<[f32; 3]>,
    p_hat: Vec<[f32; 3]>,
}

fn points() -> Points {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(0);
    let q = (0..POINTS).map(|_| [rng.random(), rng.random()]).collect();
    let mut torus = || {
        let sample = (0..POINTS).map(|_| {
            let (around, across): (f32, f32) = (rng.random(), rng.random());
            let turn = std::f32::consts::TAU;
            let radius = 1.0 + 0.4 * (across * turn).cos();
            [
                radius * (around * turn).cos(),
                radius * (around * turn).sin(),
                0.4 * (across * turn).sin(),
            ]
        });
        sample.collect()
    };
    Points {
        p: torus(),
        p_hat: torus(),
        q,
    }
}

#[divan::bench]
fn kd_tree(bencher: Bencher) {
    let Points { q, p, p_hat } = points();
    bencher.bench(|| {
        (
            nearest_others(&q, OTHERS),
            nearest(&p, &p_hat),
            nearest(&p_hat, &p),
        )
    });
}

#[divan::bench]
fn brute_force(bencher: Bencher) {
    let Points { q, p, p_hat } = points();
    bencher.bench(|| {
        (
            all(&q, &q, OTHERS + 1),
            all(&p, &p_hat, 1),
            all(&p_hat, &p, 1),
        )
    });
}

/// For each query its `k` nearest points.
fn all<const D: usize>(points: &[[f32; D]], queries: &[[f32; D]], k: usize) -> Vec<Vec<u32>> {
    let found = |query: &[f32; D]| {
        let squared = |p: &[f32; D]| (0..D).map(|c| (p[c] - query[c]).powi(2)).sum::<f32>();
        let mut best: Vec<(f32, u32)> = vec![(f32::INFINITY, 0); k];
        for (index, distance) in points.iter().map(squared).enumerate() {
            if distance < best[k - 1].0 {
                let place = best.partition_point(|(other, _)| *other <= distance);
                best[place..].rotate_right(1);
                best[place] = (distance, index as u32);
            }
        }
        best.into_iter().map(|(_, index)| index).collect()
    };
    queries.par_iter().map(found).collect()
}
