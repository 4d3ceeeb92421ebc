//! What is packed: charts around the origin, in a common unit.

use std::f64::consts::FRAC_PI_2;

use super::hull::{EnclosingBox, convex_hull, tightest};
use super::outline::Outline;
use super::{Chart, Turns, center, turned};

/// By how much the square around a chart must shrink for the chart to lie aslant in it.
const SLANT_GAIN: f64 = 0.99;

/// A chart around the origin, and how it may be turned.
pub struct Piece {
    outline: Outline,
    /// The sum of the areas of its triangles, in squares of the unit.
    pub area: f64,
    /// How it may be turned.
    pub turns: Turns,
    /// Its tightest rectangle with the longer side first, and the tightest square where that is
    /// clearly smaller than the square around the rectangle. Of a chart that is not turned by any
    /// angle, the rectangle as it lies.
    pub boxes: Vec<EnclosingBox>,
}

impl Piece {
    /// A chart in a unit of length that is about its size or that of a larger chart.
    pub fn new(chart: &Chart<'_>, unit: f64) -> Self {
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
        let outline = Outline::new(&points, chart.triangles);
        let boxes = match chart.turns {
            Turns::Free => {
                let [rectangle, square] = tightest(&convex_hull(&points)).map(lying);
                let is_slanted = square.longer_side() < SLANT_GAIN * rectangle.longer_side();
                [rectangle]
                    .into_iter()
                    .chain(is_slanted.then_some(square))
                    .collect()
            }
            Turns::Quarters | Turns::None => {
                let [low, high] = chart.bounds();
                let size = [0, 1].map(|k| high[k] / unit - low[k] / unit);
                vec![EnclosingBox { angle: 0.0, size }]
            }
        };
        Self {
            outline,
            area,
            turns: chart.turns,
            boxes,
        }
    }

    /// The side of the smallest square around it.
    pub fn square(&self) -> f64 {
        let sides = self.boxes.iter().map(EnclosingBox::longer_side);
        sides.fold(f64::INFINITY, f64::min)
    }

    /// Its outline, turned and scaled, and the least and largest coordinates of that.
    pub fn oriented(&self, turn: [f64; 2], scale: f64) -> (Outline, [[f64; 2]; 2]) {
        let outline = self.outline.mapped(|p| turned(p, turn).map(|c| scale * c));
        let bounds = outline.bounds();
        (outline, bounds)
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
