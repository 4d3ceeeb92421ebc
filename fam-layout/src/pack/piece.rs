//! What is packed: charts around the origin, in a common unit.

use std::f64::consts::FRAC_PI_2;

use super::hull::{EnclosingBox, convex_hull, tightest};
use super::{Chart, center, turned};

/// By how much the square around a chart must shrink for the chart to lie aslant in it.
const SLANT_GAIN: f64 = 0.99;

/// A chart around the origin, and how it may be turned.
pub struct Piece<'a> {
    points: Vec<[f64; 2]>,
    /// Its triangles.
    pub triangles: &'a [[u32; 3]],
    /// The sum of the areas of its triangles, in squares of the unit.
    pub area: f64,
    /// Its tightest rectangle, and the tightest square where that is clearly smaller than the
    /// square around the rectangle.
    pub boxes: Vec<EnclosingBox>,
}

impl<'a> Piece<'a> {
    /// A chart in a unit of length that is about its size or that of a larger chart.
    pub fn new(chart: &Chart<'a>, unit: f64) -> Self {
        let pivot = center(chart.bounds());
        let points: Vec<[f64; 2]> = chart
            .uvs
            .iter()
            .map(|q| [0, 1].map(|k| (q[k] - pivot[k]) / unit))
            .collect();
        let area = chart
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| points[v as usize]);
                0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
            })
            .sum();
        let [rectangle, square] = tightest(&convex_hull(&points)).map(lying);
        let mut boxes = vec![rectangle];
        if square.longer_side() < SLANT_GAIN * rectangle.longer_side() {
            boxes.push(square);
        }
        Self {
            points,
            triangles: chart.triangles,
            area,
            boxes,
        }
    }

    /// The side of the smallest square around it.
    pub fn square(&self) -> f64 {
        let sides = self.boxes.iter().map(EnclosingBox::longer_side);
        sides.fold(f64::INFINITY, f64::min)
    }

    /// Its points, turned and scaled, and their least and largest coordinates.
    pub fn oriented(&self, turn: [f64; 2], scale: f64) -> (Vec<[f64; 2]>, [[f64; 2]; 2]) {
        let points: Vec<[f64; 2]> = self
            .points
            .iter()
            .map(|&p| turned(p, turn).map(|c| scale * c))
            .collect();
        let bounds = Chart {
            uvs: &points,
            triangles: &[],
        }
        .bounds();
        (points, bounds)
    }
}

/// The same box with the longer side first.
fn lying(found: EnclosingBox) -> EnclosingBox {
    let [width, height] = found.size;
    if width >= height {
        return found;
    }
    EnclosingBox {
        angle: found.angle + FRAC_PI_2,
        size: [height, width],
    }
}
