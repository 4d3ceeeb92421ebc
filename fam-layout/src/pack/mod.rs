//! Flattened charts side by side in one UV square.
//!
//! Every chart's true shape, enlarged by half the margin, is marked in a grid of cells, in which charts
//! are placed from the largest to the smallest, each as low as it goes. The scale is the largest found at
//! which all fit, first in a coarse grid, then in a fine one; by how much charts reach beyond the square
//! tells where the search begins.
//! Then the order and the turns of a few charts are changed again and again, at scales that are a
//! little too large, until all fit.

mod hull;
mod improve;
mod mask;
mod mirrored;
mod occupancy;
pub mod options;
mod outline;
mod piece;
pub mod repack;
mod round;
mod search;
mod sheet;
mod sizing;
#[cfg(test)]
mod tests;

use fam_surface::SurfaceError;
use rayon::prelude::*;

pub use hull::EnclosingBox;
pub use mirrored::Reflection;
pub use options::{PackError, PackOptions, Turns};
pub use round::to_f32;

use hull::{convex_hull, tightest};
use piece::Piece;
use sizing::Sizing;

/// Charts that are all smaller are not magnified, which might overflow.
const LEAST_EXTENT: f64 = 1e-300;

/// A flattened piece of surface: coordinates `[V, 2]` in units of length on the surface, and
/// triangles `[T, 3]` into them.
#[derive(Debug, Clone, Copy)]
pub struct Chart<'a> {
    uvs: &'a [[f64; 2]],
    triangles: &'a [[u32; 3]],
    turns: Turns,
}

impl<'a> Chart<'a> {
    /// A chart that may be turned by any angle; it may be a line, a point or empty.
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
        Ok(Self {
            uvs,
            triangles,
            turns: Turns::Free,
        })
    }

    /// The same chart, turned only so.
    pub fn with_turns(self, turns: Turns) -> Self {
        Self { turns, ..self }
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        bounds(self.uvs)
    }
}

/// Where a chart lies in its tile: q ↦ scale · R (q − pivot) + offset, R a rotation.
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
    /// The tile, counted from 0.
    pub tile: u32,
}

impl Placement {
    /// The place of a point of the chart in the unit square of its tile.
    pub fn place(&self, q: [f64; 2]) -> [f64; 2] {
        let [x, y] = turned([0, 1].map(|k| q[k] - self.pivot[k]), self.turn);
        [
            self.scale * x + self.offset[0],
            self.scale * y + self.offset[1],
        ]
    }
}

/// The lower left corner of a tile, as UDIM has it: ten tiles to a row.
pub fn corner_of_tile(tile: u32) -> [f64; 2] {
    [f64::from(tile % 10), f64::from(tile / 10)]
}

/// Charts side by side in one or several unit squares, the tiles.
#[derive(Debug, Clone, PartialEq)]
pub struct Packing {
    /// Where each chart lies; all have the same scale.
    pub placements: Vec<Placement>,
    /// Share of all tiles that the charts' triangles cover, without the charts that stay.
    pub coverage: f64,
    /// The margin that was kept, in texels.
    pub margin: f64,
    /// How many tiles there are.
    pub tiles: u32,
    /// Texels along the side of a tile.
    pub resolution: u32,
}

/// Packs charts into unit squares, all at one scale.
///
/// At least the margin lies between two charts and at least half of it between a chart and the
/// border (as much as between charts where the square is repeated). Charts are turned as far as
/// they may be but never mirrored. A single chart lies in the lower left corner, in the direction
/// in which the square around it is smallest.
///
/// Where charts become as large as possible, a margin that would leave `n` charts less than half of
/// the side of a ⌈√n⌉ × ⌈√n⌉ board is reduced to that; one that is not a positive number counts as
/// 0. At a given density it is never reduced.
///
/// Several squares with a scale each, as for several materials, are packed by one call each. Charts
/// without any extent lie somewhere, at scale 1 if all are such.
///
/// Once `goes_on` says no, the first scale found at which all charts fit is taken.
///
/// # Errors
/// What is asked for is impossible; never with [`PackOptions::new`].
pub fn pack(
    charts: &[Chart<'_>],
    options: &PackOptions<'_>,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Result<Packing, PackError> {
    let unit = unit(charts);
    let pieces: Vec<Piece> = charts
        .par_iter()
        .map(|chart| Piece::new(chart, unit))
        .collect();
    let layout = Sizing::new(&pieces, unit, options)?.run(goes_on)?;
    let placements: Vec<Placement> = charts
        .iter()
        .zip(&layout.spots)
        .map(|(chart, spot)| Placement {
            pivot: center(chart.bounds()),
            turn: spot.turn,
            scale: layout.scale / unit,
            offset: spot.offset,
            tile: options.first_tile + spot.tile as u32,
        })
        .collect();
    let area: f64 = pieces.iter().map(|piece| piece.area).sum();
    Ok(Packing {
        placements,
        coverage: area * layout.scale * layout.scale / f64::from(layout.tiles),
        margin: layout.margin,
        tiles: layout.tiles,
        resolution: layout.resolution,
    })
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

/// The rectangle of least area around points.
pub fn rectangle_around(points: &[[f64; 2]]) -> EnclosingBox {
    tightest(&convex_hull(points))[0]
}

/// The side of the smallest square around points.
pub fn square_around(points: &[[f64; 2]]) -> f64 {
    tightest(&convex_hull(points))[1].longer_side()
}

/// The least and the largest coordinates; zeros if there is no point.
pub fn bounds(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let fold = |fold: fn(f64, f64) -> f64| {
        let extreme = points
            .iter()
            .copied()
            .reduce(|a, b| [0, 1].map(|k| fold(a[k], b[k])));
        extreme.unwrap_or_default()
    };
    [fold(f64::min), fold(f64::max)]
}

fn center([low, high]: [[f64; 2]; 2]) -> [f64; 2] {
    [0, 1].map(|k| 0.5 * low[k] + 0.5 * high[k])
}

fn turned([x, y]: [f64; 2], [cos, sin]: [f64; 2]) -> [f64; 2] {
    [cos * x - sin * y, sin * x + cos * y]
}
