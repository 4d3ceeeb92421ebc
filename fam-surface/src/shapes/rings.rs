//! Surfaces in rings of vertices around an axis.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::TriangleMesh;
use crate::vector::{length, sub};

/// A surface around an axis in rings of vertices about `spacing` apart, from a point at the
/// top down: `place(w, angle)` with w from 0 to 1.
pub(super) fn rings(spacing: f64, place: impl Fn(f64, f64) -> [f64; 3]) -> TriangleMesh {
    const STEPS: u32 = 200;
    let around = |w: f64| {
        let corner = |i: u32| place(w, TAU * f64::from(i) / f64::from(STEPS));
        (0..STEPS)
            .map(|i| length(sub(corner(i + 1), corner(i))))
            .sum::<f64>()
    };
    // Heights at which the mean way down since the last ring is the spacing.
    let down = |w: f64| {
        let next = w + 1e-3;
        let way = |i: u32| {
            let a = TAU * f64::from(i) / 12.0;
            length(sub(place(next.min(1.0), a), place(w, a)))
        };
        (0..12).map(way).sum::<f64>() / 12.0
    };
    let mut ways = vec![0.0];
    for i in 0..1000 {
        ways.push(ways[i] + down(i as f64 * 1e-3));
    }
    let count = (ways[1000] / (spacing * 0.75_f64.sqrt())).round().max(1.0);
    let mut positions = vec![place(0.0, 0.0)];
    let mut triangles = Vec::new();
    let mut above = 0..1;
    for ring in 1..=count as u32 {
        let way = ways[1000] * f64::from(ring) / count;
        let after = ways.partition_point(|&x| x < way).clamp(1, 1000);
        let share = (way - ways[after - 1]) / (ways[after] - ways[after - 1]);
        let w = ((after as f64 - 1.0 + share) * 1e-3).min(1.0);
        let corners = (around(w) / spacing).round().max(3.0) as u32;
        let below = above.end..above.end + corners;
        for i in 0..corners {
            positions.push(place(w, TAU * f64::from(i) / f64::from(corners)));
        }
        join(&above, &below, &mut triangles);
        above = below;
    }
    TriangleMesh::new(positions, triangles).expect("rings are a valid mesh")
}

/// Triangles between two rings of vertices that start at the same angle.
fn join(above: &Range<u32>, below: &Range<u32>, triangles: &mut Vec<[u32; 3]>) {
    let (m, n) = (above.len() as u32, below.len() as u32);
    let upper = |i: u32| above.start + i % m;
    let lower = |j: u32| below.start + j % n;
    let (mut i, mut j) = (0, 0);
    while i < m || j < n {
        let next_upper = (f64::from(i) + 0.5) / f64::from(m);
        let next_lower = (f64::from(j) + 0.5) / f64::from(n);
        if j < n && (i == m || next_lower <= next_upper) {
            triangles.push([upper(i), lower(j), lower(j + 1)]);
            j += 1;
        } else {
            if m > 1 {
                triangles.push([upper(i), lower(j), upper(i + 1)]);
            }
            i += 1;
        }
    }
}
