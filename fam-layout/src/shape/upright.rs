//! Charts turned so that one direction of the surface is up in all of them.

use std::f64::consts::FRAC_PI_2;

use fam_surface::TriangleMesh;
use fam_surface::vector::{cross, dot, length, normalize, sub};

use crate::component::FlatChart;
use crate::pack::rectangle_around;

/// The least mean slope against the horizontal, as the sine of its angle (about 3°), from which on a
/// chart has an up: what is flatter lies along its box.
const LEAST_SLOPE: f64 = 0.05;

/// A chart of a mesh turned so that its surface's `up` is up in the plane: the mean over its area of
/// what is left of `up` in the surface. A straightened chart is turned by right angles only. One that
/// is horizontal has no such direction; its box lies along the axes.
pub fn turned_upright(mesh: &TriangleMesh, up: [f64; 3], chart: FlatChart) -> FlatChart {
    // Scaled first, so that no square of a length is out of range.
    let largest = up.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let [x, y] = mean_up(mesh, normalize(up.map(|c| c / largest)), &chart);
    let angle = match x.hypot(y) > LEAST_SLOPE {
        true => FRAC_PI_2 - y.atan2(x),
        false => -rectangle_around(&chart.uvs).angle,
    };
    let quarters = (angle / FRAC_PI_2).round();
    match chart.is_straight {
        true => by_quarters(chart, quarters as i64),
        false => by_angle(chart, angle),
    }
}

/// The mean over the area of a chart of the projection of a unit vector onto the surface, as the chart
/// maps directions. Lengths count as they are on the surface.
fn mean_up(mesh: &TriangleMesh, up: [f64; 3], chart: &FlatChart) -> [f64; 2] {
    let (mut sum, mut total) = ([0.0; 2], 0.0);
    for (corners, &t) in chart.triangles.iter().zip(&chart.source) {
        let [a, b, c] = mesh.corners(t as usize);
        let (along, across) = (sub(b, a), sub(c, a));
        let normal = cross(along, across);
        let doubled_area = length(normal);
        if doubled_area <= 0.0 {
            continue;
        }
        // The shares of both sides in the projection of `up`, times the doubled area.
        let normal = normalize(normal);
        let share = |side: [f64; 3]| dot(cross(side, normal), up);
        let (first, second) = (share(across), -share(along));
        let [p, q, r] = corners.map(|v| chart.uvs[v as usize]);
        let image = [0, 1].map(|k| first * (q[k] - p[k]) + second * (r[k] - p[k]));
        // Of the length that the projection has on the surface.
        let level = dot(normal, up);
        let size = doubled_area * (1.0 - level * level).max(0.0).sqrt();
        let stretched = image[0].hypot(image[1]);
        if stretched > 0.0 {
            sum = [0, 1].map(|k| sum[k] + size * (image[k] / stretched));
        }
        total += doubled_area;
    }
    match total > 0.0 {
        true => sum.map(|c| c / total),
        false => sum,
    }
}

fn by_angle(mut chart: FlatChart, angle: f64) -> FlatChart {
    let (sin, cos) = angle.sin_cos();
    for [x, y] in &mut chart.uvs {
        [*x, *y] = [cos * *x - sin * *y, sin * *x + cos * *y];
    }
    chart
}

/// A chart whose tightest rectangle lies along the axes, to stay so.
pub fn lying(chart: &FlatChart) -> FlatChart {
    let chart = chart.clone();
    let angle = match chart.is_straight {
        true => 0.0,
        false => -rectangle_around(&chart.uvs).angle,
    };
    FlatChart {
        is_straight: true,
        ..by_angle(chart, angle)
    }
}

/// Exactly.
fn by_quarters(mut chart: FlatChart, quarters: i64) -> FlatChart {
    for q in &mut chart.uvs {
        for _ in 0..quarters.rem_euclid(4) {
            *q = [-q[1], q[0]];
        }
    }
    chart
}
