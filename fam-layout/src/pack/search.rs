//! The largest scale at which pieces fit into the square.

use std::collections::HashMap;

use super::hull::EnclosingBox;
use super::mask::Mask;
use super::occupancy::{Occupancy, Shape};
use super::piece::Piece;
use super::turned;

/// Cells along the side of the grid, at least, and per chart in a row of equal charts.
const CELLS: usize = 512;
const CELLS_PER_CHART: usize = 20;

/// So many charts are tried in more than one order.
const FEW: usize = 256;

/// The scale is searched to this factor, in at most so many steps.
const SCALE_ACCURACY: f64 = 1.0025;
const SCALE_STEPS: usize = 10;

/// By how much more than its free rows tell a scale may grow.
const SLACK: f64 = 1.02;

/// Rows of the grid in which many charts are placed, per row of the square: how far they reach
/// above the square tells which scale to try next.
const ROWS_OF_MANY: f64 = 1.5;

/// The scale of so many charts is searched in [`SCALE_STEPS`] at most; of more in fewer, since how
/// high they reach depends less on chance, but no fewer than this.
const MANY: usize = 1000;
const FEWEST_STEPS: usize = 3;

/// The factor by which a scale is smaller than the one at which charts should just fit, so that
/// they nearly always do; and where it is not known by how much they do not fit.
const NEARLY: f64 = 0.996;
const SMALLER: f64 = 0.85;

/// Shapes whose widths, heights and areas differ by less than this factor find room at about the
/// same heights.
const ALIKE: f64 = 1.1;

/// How a piece is turned, and where its origin comes to lie.
#[derive(Clone, Copy)]
pub struct Spot {
    /// Cosine and sine of the angle.
    pub turn: [f64; 2],
    /// The place of its origin.
    pub offset: [f64; 2],
}

/// The scale of a single piece, and its spot in the lower left corner.
pub fn alone(piece: &Piece<'_>, border: f64) -> (f64, Vec<Spot>) {
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
pub struct Search<'a> {
    pieces: &'a [Piece<'a>],
    /// In which orders the pieces are placed, the largest first by one measure or another.
    orders: Vec<Vec<usize>>,
    /// Cells along the side of the square.
    cells: usize,
    /// Rows of the grid, of which those above the square are there to see how much is missing.
    rows: usize,
    /// Space around each piece, in cells.
    reach: f64,
}

impl<'a> Search<'a> {
    /// A search with `border`, as a share of the square's side, around every piece.
    pub fn new(pieces: &'a [Piece<'a>], border: f64) -> Self {
        let per_row = (pieces.len() as f64).sqrt().ceil() as usize;
        let cells = CELLS.max(CELLS_PER_CHART * per_row);
        let by = |measure: fn(&EnclosingBox) -> f64| {
            let measure = |i: usize| measure(&pieces[i].boxes[0]);
            let mut order: Vec<usize> = (0..pieces.len()).collect();
            order.sort_by(|&i, &j| measure(j).total_cmp(&measure(i)));
            order
        };
        let mut orders = vec![by(|found| found.size[1])];
        let mut rows = cells;
        if pieces.len() <= FEW {
            orders.push(by(|found| found.size[0] + found.size[1]));
        } else {
            rows = (ROWS_OF_MANY * cells as f64) as usize;
        }
        Self {
            pieces,
            orders,
            cells,
            rows,
            reach: border * cells as f64,
        }
    }

    /// The largest scale found and a spot for every piece, in units of the square.
    pub fn run(&self, goes_on: &dyn Fn() -> bool) -> (f64, Vec<Spot>) {
        let side = self.cells as f64;
        let most = self.most();
        if !most.is_finite() {
            let spots = self.fit(1.0).map(|fit| fit.spots);
            return (1.0, self.in_square(spots.unwrap_or_default()));
        }
        let (mut scale, mut high) = (0.75 * most, most);
        let mut best: Option<(f64, Fit)> = None;
        let mut left = (SCALE_STEPS * MANY / self.pieces.len()).clamp(FEWEST_STEPS, SCALE_STEPS);
        loop {
            match self.fit(scale) {
                Some(fit) if fit.height <= self.cells => best = Some((scale, fit)),
                Some(fit) => {
                    high = scale;
                    scale *= NEARLY * (side / fit.height as f64).sqrt();
                }
                None => {
                    high = scale;
                    scale *= SMALLER;
                }
            }
            let Some((low, fit)) = best.take() else {
                continue;
            };
            // The free rows tell how much denser it can become.
            let denser = low * SLACK * (side / fit.height.max(1) as f64).sqrt();
            scale = (low * high.min(denser)).sqrt();
            if left == 0 || scale <= SCALE_ACCURACY * low || !goes_on() {
                return (low / side, self.in_square(fit.spots));
            }
            left -= 1;
            best = Some((low, fit));
        }
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
        let mut occupancy = Occupancy::new([self.cells, self.rows]);
        let nowhere = Spot {
            turn: [1.0, 0.0],
            offset: [0.0; 2],
        };
        let mut spots = vec![nowhere; self.pieces.len()];
        let mut bottoms = (self.pieces.len() > MANY).then(HashMap::new);
        for &i in order {
            let piece = &self.pieces[i];
            spots[i] = self.lowest_spot(piece, scale, &mut occupancy, bottoms.as_mut())?;
        }
        Some(Fit {
            spots,
            height: occupancy.height(),
        })
    }

    /// Places a piece so that its upper end is as low as possible. `bottoms`, if given, has the
    /// rows below which shapes of a kind found no room; it is not looked for there again.
    fn lowest_spot(
        &self,
        piece: &Piece<'_>,
        scale: f64,
        occupancy: &mut Occupancy,
        mut bottoms: Option<&mut HashMap<[u32; 3], usize>>,
    ) -> Option<Spot> {
        let mut top = self.rows;
        let mut best = None;
        for stance in piece
            .boxes
            .iter()
            .flat_map(|b| self.stances(piece, b, scale))
        {
            let kind = kind(&stance.shape);
            let height = stance.shape.size()[1];
            let bottom = bottoms.as_ref().and_then(|rows| rows.get(&kind).copied());
            let found = occupancy.room(&stance.shape, bottom.unwrap_or(0), top);
            if let Some(bottoms) = &mut bottoms {
                let next = found.map_or((top + 1).saturating_sub(height), |at| at[1]);
                bottoms.insert(kind, next.max(bottom.unwrap_or(0)));
            }
            if let Some(at) = found {
                top = at[1] + height - 1;
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

/// The same for shapes that are [`ALIKE`].
fn kind(shape: &Shape) -> [u32; 3] {
    let [width, height] = shape.size();
    [width, height, shape.cells()].map(|count| ((count as f64).ln() / ALIKE.ln()) as u32)
}

/// A shape for which room is sought.
struct Stance {
    turn: [f64; 2],
    /// Where the piece's origin lies in the shape's box.
    origin: [f64; 2],
    shape: Shape,
}
