//! Making a point cloud look like a surface: the size of its discs, and normals from depths.

use super::raster::Visibility;
use super::shading::{Seen, normalize};

/// A little less than the median distance of a point to its sixth neighbour, which closes the
/// gaps between points spread at random too.
pub(super) fn splat_radius(points: &[[f32; 3]]) -> f32 {
    const NEIGHBORS: usize = 6;
    const TRIALS: usize = 128;
    let stride = points.len().div_ceil(TRIALS).max(1);
    let mut distances: Vec<f32> = Vec::with_capacity(TRIALS);
    for p in points.iter().step_by(stride) {
        // The point itself comes first.
        let mut nearest = [f32::INFINITY; NEIGHBORS + 1];
        for q in points {
            let squared = (0..3).map(|c| (p[c] - q[c]).powi(2)).sum();
            if squared < nearest[NEIGHBORS] {
                let slot = nearest.partition_point(|&d| d <= squared);
                nearest[slot..].rotate_right(1);
                nearest[slot] = squared;
            }
        }
        distances.push(nearest[NEIGHBORS].sqrt());
    }
    distances.sort_by(f32::total_cmp);
    distances
        .get(distances.len() / 2)
        .map_or(0.0, |d| (0.85 * d).min(0.1))
}

/// The normal of the plane through the depths around a pixel.
pub(super) fn normal_of_depths(view: &Visibility, x: usize, y: usize, radius: f32) -> Option<Seen> {
    const TAPS: i32 = 3;
    let center = view.at(x, y)?.depth;
    let step = (0.7 * radius).max(1.0);
    // Sums of 1, x, y, d, xx, xy, yy, xd and yd.
    let mut s = [0.0_f32; 9];
    for (i, j) in (-TAPS..=TAPS).flat_map(|j| (-TAPS..=TAPS).map(move |i| (i, j))) {
        let [dx, dy] = [i, j].map(|k| (k as f32 * step).round());
        let (px, py) = (x as f32 + dx, y as f32 + dy);
        let side = view.side as f32;
        if px < 0.0 || py < 0.0 || px >= side || py >= side {
            continue;
        }
        let Some(neighbor) = view.at(px as usize, py as usize) else {
            continue;
        };
        let d = neighbor.depth - center;
        // Beyond a steep slope lies another part of the surface.
        if d.abs() > 2.0 * (dx.abs().max(dy.abs()) + radius) {
            continue;
        }
        let terms = [1.0, dx, dy, d, dx * dx, dx * dy, dy * dy, dx * d, dy * d];
        s = std::array::from_fn(|k| s[k] + terms[k]);
    }
    let n = s[0];
    let [xx, xy, yy] = [
        s[4] - s[1] * s[1] / n,
        s[5] - s[1] * s[2] / n,
        s[6] - s[2] * s[2] / n,
    ];
    let [xd, yd] = [s[7] - s[1] * s[3] / n, s[8] - s[2] * s[3] / n];
    let determinant = xx * yy - xy * xy;
    let [gx, gy] = if determinant > 1e-3 * xx * yy {
        [
            (xd * yy - yd * xy) / determinant,
            (yd * xx - xd * xy) / determinant,
        ]
    } else {
        [0.0; 2]
    };
    Some(Seen {
        normal: normalize([gx, -gy, 1.0]),
        back: false,
    })
}
