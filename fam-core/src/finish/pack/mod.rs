//! Flattened charts side by side in one UV square.
//!
//! Every chart is turned into a tight box and its true shape, enlarged by half the margin, is
//! marked in a grid of cells, in which charts are placed from the largest to the smallest,
//! each as low as it goes. The scale is the largest at which a bisection found all to fit.

mod hull;
mod mask;
mod occupancy;
mod round;
#[cfg(test)]
mod tests;

use std::f64::consts::FRAC_PI_2;

use crate::surface::SurfaceError;

pub use round::{Rounded, to_f32};

use hull::{EnclosingBox, convex_hull, tightest};
use mask::Mask;
use occupancy::{Occupancy, Shape};

/// Least space kept free at the border, as a share of the square's side: what rounding to
/// `f32` may move a point, and more.
const LEAST_BORDER: f64 = 1e-6;

/// Charts that are all smaller are not magnified, which might overflow.
const LEAST_EXTENT: f64 = 1e-300;

/// Cells along the side of the grid, at least, and per chart in a row of equal charts.
const CELLS: usize = 512;
const CELLS_PER_CHART: usize = 20;

/// So many charts are tried in more than one order.
const FEW: usize = 256;

/// By how much the square around a chart must shrink for the chart to lie aslant in it.
const SLANT_GAIN: f64 = 0.99;

/// The scale is searched to this factor, in at most so many steps.
const SCALE_ACCURACY: f64 = 1.0025;
const SCALE_STEPS: usize = 10;

/// By how much more than its free rows tell a scale may grow.
const SLACK: f64 = 1.02;

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
            let extreme = self.uvs.iter().copied().reduce(|a, b| [0, 1].map(|k| fold(a[k], b[k])));
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
pub fn pack(charts: &[Chart<'_>], margin: f64, resolution: u32) -> Packing {
    let unit = unit(charts);
    let pieces: Vec<Piece> = charts.iter().map(|chart| Piece::new(chart, unit)).collect();
    let per_row = (pieces.len() as f64).sqrt().ceil().max(1.0);
    let margin = (margin.max(0.0) / f64::from(resolution.max(1))).min(0.5 / per_row);
    let border = (0.5 * margin).max(LEAST_BORDER);
    let (scale, spots) = match &pieces[..] {
        [piece] => alone(piece, border),
        _ => Search::new(&pieces, border).run(),
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

/// A chart around the origin, and how it may be turned.
struct Piece<'a> {
    points: Vec<[f64; 2]>,
    triangles: &'a [[u32; 3]],
    area: f64,
    /// Its tightest rectangle, and the tightest square where that is clearly smaller than the
    /// square around the rectangle.
    boxes: Vec<EnclosingBox>,
}

impl<'a> Piece<'a> {
    fn new(chart: &Chart<'a>, unit: f64) -> Self {
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
    fn square(&self) -> f64 {
        let sides = self.boxes.iter().map(EnclosingBox::longer_side);
        sides.fold(f64::INFINITY, f64::min)
    }

    /// Its points, turned and scaled, and their lower left corner.
    fn oriented(&self, turn: [f64; 2], scale: f64) -> (Vec<[f64; 2]>, [[f64; 2]; 2]) {
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

/// How a piece is turned, and where its origin comes to lie.
#[derive(Clone, Copy)]
struct Spot {
    turn: [f64; 2],
    offset: [f64; 2],
}

/// The scale of a single piece, and its spot in the lower left corner.
fn alone(piece: &Piece<'_>, border: f64) -> (f64, Vec<Spot>) {
    let scale = (1.0 - 2.0 * border) / piece.square();
    let scale = if scale.is_finite() { scale } else { 1.0 };
    let angle = piece.boxes[piece.boxes.len() - 1].angle;
    let turn = [angle.cos(), -angle.sin()];
    let (_, [low, _]) = piece.oriented(turn, scale);
    let offset = low.map(|c| border - c);
    (scale, vec![Spot { turn, offset }])
}

/// Spots for all pieces, in cells, and the number of rows that they take up.
struct Fit {
    spots: Vec<Spot>,
    height: usize,
}

/// The search for the largest scale at which pieces fit.
struct Search<'a> {
    pieces: &'a [Piece<'a>],
    /// In which orders the pieces are placed, the largest first by one measure or another.
    orders: Vec<Vec<usize>>,
    /// Cells along the side of the square.
    cells: usize,
    /// Space around each piece, in cells.
    reach: f64,
}

impl<'a> Search<'a> {
    fn new(pieces: &'a [Piece<'a>], border: f64) -> Self {
        let per_row = (pieces.len() as f64).sqrt().ceil() as usize;
        let cells = CELLS.max(CELLS_PER_CHART * per_row);
        let by = |measure: fn(&EnclosingBox) -> f64| {
            let measure = |i: usize| measure(&pieces[i].boxes[0]);
            let mut order: Vec<usize> = (0..pieces.len()).collect();
            order.sort_by(|&i, &j| measure(j).total_cmp(&measure(i)));
            order
        };
        let mut orders = vec![by(|found| found.size[1])];
        if pieces.len() <= FEW {
            orders.push(by(|found| found.size[0] + found.size[1]));
        }
        Self {
            pieces,
            orders,
            cells,
            reach: border * cells as f64,
        }
    }

    /// The largest scale found and a spot for every piece, in units of the square.
    fn run(&self) -> (f64, Vec<Spot>) {
        let side = self.cells as f64;
        let most = self.most();
        if !most.is_finite() {
            let spots = self.fit(1.0).map(|fit| fit.spots);
            return (1.0, self.in_square(spots.unwrap_or_default()));
        }
        let (mut high, mut low) = (most, 0.75 * most);
        let mut best = loop {
            match self.fit(low) {
                Some(fit) => break fit,
                None => (high, low) = (low, 0.85 * low),
            }
        };
        for _ in 0..SCALE_STEPS {
            // The free rows tell how much denser it can become.
            let denser = low * SLACK * (side / best.height.max(1) as f64).sqrt();
            let middle = (low * high.min(denser)).sqrt();
            if middle <= SCALE_ACCURACY * low {
                break;
            }
            match self.fit(middle) {
                Some(fit) => (low, best) = (middle, fit),
                None => high = middle,
            }
        }
        (low / side, self.in_square(best.spots))
    }

    /// No larger scale fits, by the area of all pieces and the side of the largest.
    fn most(&self) -> f64 {
        let room = self.cells as f64 - 2.0 * self.reach;
        let area: f64 = self.pieces.iter().map(|piece| piece.area).sum();
        let longest = self.pieces.iter().map(Piece::square).fold(0.0, f64::max);
        room / area.sqrt().max(longest)
    }

    fn in_square(&self, spots: Vec<Spot>) -> Vec<Spot> {
        let side = self.cells as f64;
        let scaled = |spot: Spot| Spot {
            offset: spot.offset.map(|c| c / side),
            ..spot
        };
        spots.into_iter().map(scaled).collect()
    }

    /// A spot for every piece at a scale in cells; none if they do not all fit.
    fn fit(&self, scale: f64) -> Option<Fit> {
        self.orders
            .iter()
            .find_map(|order| self.fit_in_order(order, scale))
    }

    fn fit_in_order(&self, order: &[usize], scale: f64) -> Option<Fit> {
        let mut occupancy = Occupancy::new(self.cells);
        let nowhere = Spot {
            turn: [1.0, 0.0],
            offset: [0.0; 2],
        };
        let mut spots = vec![nowhere; self.pieces.len()];
        for &i in order {
            spots[i] = self.lowest_spot(&self.pieces[i], scale, &mut occupancy)?;
        }
        Some(Fit {
            spots,
            height: occupancy.height(),
        })
    }

    /// Places a piece so that its upper end is as low as possible.
    fn lowest_spot(
        &self,
        piece: &Piece<'_>,
        scale: f64,
        occupancy: &mut Occupancy,
    ) -> Option<Spot> {
        let mut top = self.cells;
        let mut best = None;
        for stance in piece.boxes.iter().flat_map(|b| self.stances(piece, b, scale)) {
            if let Some(at) = occupancy.room(&stance.shape, top) {
                top = at[1] + stance.shape.size()[1] - 1;
                best = Some((stance, at));
            }
        }
        let (stance, at) = best?;
        occupancy.take(&stance.shape, at);
        Some(Spot {
            turn: stance.turn,
            offset: [0, 1].map(|k| at[k] as f64 + stance.origin[k]),
        })
    }

    /// A piece in its box turned by 0 to 3 right angles.
    fn stances(&self, piece: &Piece<'_>, found: &EnclosingBox, scale: f64) -> Vec<Stance> {
        let mut turn = [found.angle.cos(), -found.angle.sin()];
        let (mut points, [low, high]) = piece.oriented(turn, scale);
        for point in &mut points {
            *point = [0, 1].map(|k| point[k] - low[k]);
        }
        let size = [0, 1].map(|k| high[k] - low[k]);
        let mut mask = Mask::new(&points, piece.triangles, size, self.reach);
        let mut origin = low.map(|c| self.reach - c);
        let mut masks: Vec<Mask> = Vec::new();
        let mut stances = Vec::new();
        for _ in 0..4 {
            if !masks.contains(&mask) {
                stances.push(Stance {
                    turn,
                    origin,
                    shape: Shape::new(&mask),
                });
                masks.push(mask.clone());
            }
            origin = [mask.size()[1] as f64 - origin[1], origin[0]];
            turn = turned(turn, [0.0, 1.0]);
            mask = mask.quarter_turned();
        }
        stances
    }
}

/// A shape for which room is sought.
struct Stance {
    turn: [f64; 2],
    /// Where the piece's origin lies in the shape's box.
    origin: [f64; 2],
    shape: Shape,
}
pub fn tight_rectangle(chart: &Chart<'_>) -> [f64; 2] {
    let unit = unit(std::slice::from_ref(chart));
    Piece::new(chart, unit).boxes[0].size.map(|c| c * unit)
}
