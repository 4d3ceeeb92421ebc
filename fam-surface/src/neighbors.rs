//! Nearest neighbours by a k-d tree.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// For each query the index of its nearest point, `[M]`.
///
/// Rows with a coordinate that is not finite (or beyond 1e18) get some index; nothing panics on them.
/// `points` must not be empty.
pub fn nearest<const D: usize>(points: &[[f32; D]], queries: &[[f32; D]]) -> Vec<u32> {
    let mut indices = vec![0; queries.len()];
    if let Some(tree) = build(points) {
        let results = tree
            .query_batch(&finite(queries))
            .nearest_one::<SquaredEuclidean<f32>>()
            .execute();
        for (index, result) in indices.iter_mut().zip(results) {
            *index = result.item;
        }
    }
    indices
}

/// For each point the indices of its `k` nearest other points, nearest first, row by row
/// `[N · k]`; coinciding points are each other's neighbours.
///
/// # Panics
/// If there are not more than `k` points.
pub fn nearest_others<const D: usize>(points: &[[f32; D]], k: usize) -> Vec<u32> {
    assert!(k < points.len(), "{k} neighbours among {}", points.len());
    let mut indices = Vec::with_capacity(points.len() * k);
    if let Some(tree) = build(points) {
        let count = NonZero::new(k + 1).expect("k + 1 is positive");
        let results = tree
            .query_batch(&finite(points))
            .nearest_n::<SquaredEuclidean<f32>>(count)
            .execute();
        for (i, found) in results.into_iter().enumerate() {
            let others = found.iter().map(|n| n.item).filter(|&j| j as usize != i);
            // Among more than k coinciding points the point itself may not be found.
            indices.extend(others.take(k));
        }
    }
    indices
}

fn build<const D: usize>(points: &[[f32; D]]) -> Option<ImmutableKdTree<f32, D>> {
    if points.is_empty() {
        return None;
    }
    let tree = ImmutableKdTree::new_from_slice(&finite(points));
    Some(tree.expect("fewer than 2^32 points"))
}

/// Coordinates beyond this size have squares that overflow.
const LARGEST: f32 = 1e18;

/// The points with every coordinate set to zero that is not finite or too large to square.
fn finite<const D: usize>(points: &[[f32; D]]) -> Vec<[f32; D]> {
    points
        .iter()
        .map(|p| p.map(|c| if c.abs() < LARGEST { c } else { 0.0 }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn distance<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
        (0..D).map(|c| (a[c] - b[c]).powi(2)).sum()
    }

    fn cloud<const D: usize>(n: usize, seed: u64) -> Vec<[f32; D]> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n)
            .map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0)))
            .collect()
    }

    #[test]
    fn agrees_with_brute_force() {
        let (points, queries) = (cloud::<3>(700, 1), cloud::<3>(300, 2));
        for (query, found) in queries.iter().zip(nearest(&points, &queries)) {
            let best = points
                .iter()
                .map(|p| distance(p, query))
                .fold(f32::INFINITY, f32::min);
            assert_eq!(distance(&points[found as usize], query), best);
        }
        let points = cloud::<2>(500, 3);
        for (i, found) in nearest_others(&points, 8).chunks(8).enumerate() {
            let mut all: Vec<f32> = (0..points.len())
                .filter(|&j| j != i)
                .map(|j| distance(&points[j], &points[i]))
                .collect();
            all.sort_by(f32::total_cmp);
            let found: Vec<f32> = found
                .iter()
                .map(|&j| distance(&points[j as usize], &points[i]))
                .collect();
            assert_eq!(found, all[..8]);
        }
    }

    #[test]
    fn lattices_duplicates_and_nans_do_not_panic() {
        let lattice: Vec<[f32; 2]> = (0..10_000)
            .map(|i| [(i / 100) as f32, (i % 100) as f32])
            .collect();
        assert_eq!(nearest_others(&lattice, 8).len(), 80_000);
        let same = vec![[0.5f32; 3]; 5_000];
        let others = nearest_others(&same, 3);
        assert_eq!(others.len(), 15_000);
        assert!(
            others
                .chunks(3)
                .enumerate()
                .all(|(i, row)| !row.contains(&(i as u32)))
        );
        let broken = vec![[f32::NAN; 2]; 100];
        assert_eq!(nearest(&broken, &broken).len(), 100);
        assert_eq!(nearest_others(&broken, 8).len(), 800);
    }
}
