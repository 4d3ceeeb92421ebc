//! Flattened charts side by side in one UV square.
//!
//! Every chart is turned into a tight box and its true shape, enlarged by half the margin, is
//! marked in a grid of cells, in which charts are placed from the largest to the smallest,
//! each as low as it goes. The scale is the largest at which a bisection found all to fit; by how
//! much many charts reach beyond the square tells where it begins.

mod hull;
mod mask;
mod occupancy;
mod piece;
pub mod repack;
mod round;
mod search;
#[cfg(test)]
mod tests;

use fam_surface::SurfaceError;

pub use round::to_f32;

use piece::Piece;
use search::{Search, alone};

/// Least space kept free at the border, as a share of the square's side: what rounding to
/// `f32` may move a point, and more.
const LEAST_BORDER: f64 = 1e-6;

/// Charts that are all smaller are not magnified, which might overflow.
const LEAST_EXTENT: f64 = 1e-300;

/// A flattened piece of surface: coordinates `[V, 2]` in units of length on the surface, and
/// triangles `[T, 3]` into them.
#[derive(Debug, Clone, Copy)]
pub struct Chart<'a> {
    uvs: &'a [[f64; 2]],
    triangles: &'a [[u32; 3]],
}

impl<'a> Chart<'a> {
    /// A chart; it may be a line, a point or empty.
    ///
    /// # Errors
    /// A coordinate that is not finite, or an index out of range.
    pub fn new(uvs: &'a [[f64; 2]], triangles: &'a [[u32; 3]]) -> Result<Self, SurfaceError> {
        if let Some(index) = uvs.iter().position(|q| !q.iter().all(|c| c.is_finite())) {
            return Err(SurfaceError::NonFiniteUv { index });
        }
        let count = uvs.len();
        for (face, triangle) in triangles.iter().enumerate() {
            if let Some(&index) = triangle.iter().find(|&&v| v as usize >= count) {
                return Err(SurfaceError::IndexOutOfRange { face, index, count });
            }
        }
        Ok(Self { uvs, triangles })
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        let fold = |fold: fn(f64, f64) -> f64| {
            let extreme = self
                .uvs
                .iter()
                .copied()
                .reduce(|a, b| [0, 1].map(|k| fold(a[k], b[k])));
            extreme.unwrap_or_default()
        };
        [fold(f64::min), fold(f64::max)]
    }
}

/// Where a chart lies in the square: q ↦ scale · R (q − pivot) + offset, R a rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The point that the chart is turned around.
    pub pivot: [f64; 2],
    /// Cosine and sine of the angle by which it is turned counter-clockwise.
    pub turn: [f64; 2],
    /// Factor of lengths: UV units per unit of length on the surface.
    pub scale: f64,
    /// Where the pivot comes to lie.
    pub offset: [f64; 2],
}

impl Placement {
    /// The place of a point of the chart.
    pub fn place(&self, q: [f64; 2]) -> [f64; 2] {
        let [x, y] = turned([0, 1].map(|k| q[k] - self.pivot[k]), self.turn);
        [
            self.scale * x + self.offset[0],
            self.scale * y + self.offset[1],
        ]
    }
}

/// Charts side by side in the unit square.
#[derive(Debug, Clone, PartialEq)]
pub struct Packing {
    /// Where each chart lies; all have the same scale.
    pub placements: Vec<Placement>,
    /// Share of the square that the charts' triangles cover.
    pub coverage: f64,
    /// The margin that was kept, in texels.
    pub margin: f64,
}

/// Packs charts into the unit square, all at the largest scale found at which they fit.
///
/// `margin` is in texels, of which `resolution` make a side of the square. At least so many
/// lie between two charts and at least half as many between a chart and the border (as much
/// as between charts where the square is repeated). A margin that would leave `n` charts less
/// than half of the side of a ⌈√n⌉ × ⌈√n⌉ board is reduced to that; one that is not a
/// positive number counts as 0. Charts are turned but never mirrored. A single chart lies in
/// the lower left corner, in the direction in which the square around it is smallest.
///
/// Several squares, as for several materials, are packed by one call each and have a scale
/// each. Charts without any extent lie somewhere, at scale 1 if all are such.
///
/// Once `goes_on` says no, the first scale found at which all charts fit is taken.
pub fn pack(
    charts: &[Chart<'_>],
    margin: f64,
    resolution: u32,
    goes_on: &dyn Fn() -> bool,
) -> Packing {
    let unit = unit(charts);
    let pieces: Vec<Piece> = charts.iter().map(|chart| Piece::new(chart, unit)).collect();
    let per_row = (pieces.len() as f64).sqrt().ceil().max(1.0);
    let resolution = f64::from(resolution.max(1));
    let kept = margin.max(0.0).min(0.5 / per_row * resolution);
    let margin = kept / resolution;
    let border = (0.5 * margin).max(LEAST_BORDER);
    let (scale, spots) = match &pieces[..] {
        [piece] => alone(piece, border),
        _ => Search::new(&pieces, border).run(goes_on),
    };
    let placements = charts
        .iter()
        .zip(&spots)
        .map(|(chart, spot)| Placement {
            pivot: center(chart.bounds()),
            turn: spot.turn,
            scale: scale / unit,
            offset: spot.offset,
        })
        .collect();
    let area: f64 = pieces.iter().map(|piece| piece.area).sum();
    Packing {
        placements,
        coverage: area * scale * scale,
        margin: kept,
    }
}

/// A power of two near the largest extent of a chart, so that no product overflows.
fn unit(charts: &[Chart<'_>]) -> f64 {
    let largest = charts
        .iter()
        .map(|chart| {
            let [low, high] = chart.bounds();
            (0..2).fold(0.0, |m: f64, k| m.max(0.5 * high[k] - 0.5 * low[k]))
        })
        .fold(0.0, f64::max);
    if largest > LEAST_EXTENT {
        largest.log2().floor().exp2()
    } else {
        1.0
    }
}

fn center([low, high]: [[f64; 2]; 2]) -> [f64; 2] {
    [0, 1].map(|k| 0.5 * low[k] + 0.5 * high[k])
}

fn turned([x, y]: [f64; 2], [cos, sin]: [f64; 2]) -> [f64; 2] {
    [cos * x - sin * y, sin * x + cos * y]
}
