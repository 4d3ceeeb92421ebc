//! Spots for pieces: one after the other, each as low as it goes.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::Turns;
use super::occupancy::{Occupancy, Shape};
use super::piece::Piece;
use super::sheet::{Sheet, Stance};

/// Rows of the last grid, per row of its tile: how far charts reach above the tile tells which
/// scale to try next.
const ROWS: f64 = 1.5;

/// Angles of a full turn at which a piece is tried.
const ANGLES: usize = 48;

/// How many stages are kept on the way to a fit.
const STAGES: usize = 8;

/// Of so many charts it is noted where there was no room for others like them.
const MANY: usize = 1000;

/// Shapes whose widths, heights and areas differ by less than this factor find room at about the
/// same heights.
const ALIKE: f64 = 1.1;

/// How a piece is turned, and where its origin comes to lie.
#[derive(Debug, Clone, Copy)]
pub struct Spot {
    /// Cosine and sine of the angle.
    pub turn: [f64; 2],
    /// The place of its origin, in cells.
    pub offset: [f64; 2],
    /// The tile in which that is.
    pub tile: usize,
}

/// Spots for all pieces.
#[derive(Clone)]
pub struct Fit {
    /// One for each piece.
    pub spots: Vec<Spot>,
    /// The number of rows that they take up in all tiles, those of full tiles counted whole.
    pub height: usize,
    /// The sum of the heights of all cells that are taken: the lower, the denser.
    pub weight: usize,
    /// The piece that is highest.
    pub highest: usize,
}

impl Fit {
    /// What is to be as small as possible.
    pub fn score(&self) -> (usize, usize) {
        (self.height, self.weight)
    }
}

/// In which order pieces are placed, and how.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The pieces, the first first.
    pub order: Vec<usize>,
    /// For each piece the number of the only angle that is tried, [`ANGLES`] of which are a full
    /// turn from its tightest box on; the directions of its boxes are where there is none.
    pub angles: Vec<Option<usize>>,
}

/// Pieces in the cells of tiles, ready to be placed.
pub struct Board<'a> {
    pieces: &'a [Piece],
    sheet: Sheet,
    columns: usize,
    tiles: usize,
    /// For every piece the directions of its boxes.
    stances: Vec<Vec<Stance>>,
    /// For every piece that may be turned by any the angles of a full turn, each once it is asked for.
    turned: Vec<Vec<OnceLock<Stance>>>,
    /// What is taken in each tile from the start; nothing in those beyond.
    taken: &'a [Shape],
}

/// Where the rows of each tile are that shapes of a kind found no room below.
type Bottoms = HashMap<([u32; 3], usize), usize>;

impl<'a> Board<'a> {
    /// Pieces for `tiles` tiles, where something is taken from the start.
    pub fn new(pieces: &'a [Piece], sheet: Sheet, tiles: usize, taken: &'a [Shape]) -> Self {
        let turned = |piece: &Piece| match piece.turns {
            Turns::Free => (0..ANGLES).map(|_| OnceLock::new()).collect(),
            Turns::Quarters | Turns::None => Vec::new(),
        };
        Self {
            pieces,
            sheet,
            columns: sheet.columns,
            tiles,
            stances: pieces
                .par_iter()
                .map(|piece| sheet.stances(piece))
                .collect(),
            turned: pieces.iter().map(turned).collect(),
            taken,
        }
    }

    /// Rows of all tiles.
    pub fn rows(&self) -> usize {
        self.tiles * self.columns
    }

    /// At how many angles a piece may lie besides the directions of its boxes.
    pub fn angles(&self, piece: usize) -> usize {
        self.turned[piece].len()
    }

    /// The ways in which a piece is to be tried.
    fn tried(&self, piece: usize, angle: Option<usize>) -> &[Stance] {
        let Some(angle) = angle else {
            return &self.stances[piece];
        };
        let stance = self.turned[piece][angle].get_or_init(|| {
            let piece = &self.pieces[piece];
            let turn = TAU * angle as f64 / ANGLES as f64 - piece.boxes[0].angle;
            self.sheet.stance(piece, [turn.cos(), turn.sin()])
        });
        std::slice::from_ref(stance)
    }

    /// A spot for every piece in the tiles, of which the last may be overfull; none if they are
    /// too many even so.
    pub fn fit(&self, plan: &Plan) -> Option<Fit> {
        let mut stage = Stage::new(self.stances.len());
        self.place(&mut stage, plan, plan.order.len(), usize::MAX)?;
        stage.fit()
    }

    /// The same, with some stages on the way to it, from which it can be gone on otherwise.
    pub fn stages(&self, plan: &Plan) -> Option<Stages> {
        let count = plan.order.len();
        let step = count.div_ceil(STAGES).max(1);
        let mut stage = Stage::new(count);
        let mut stages = Vec::new();
        for next in (step..count).step_by(step) {
            stages.push(stage.clone());
            self.place(&mut stage, plan, next, usize::MAX)?;
        }
        self.place(&mut stage, plan, count, usize::MAX)?;
        Some(Stages {
            plan: plan.clone(),
            fit: stage.fit()?,
            stages,
        })
    }

    /// A fit that is no higher than another, by a plan that differs from the other's.
    pub fn other(&self, than: &Stages, plan: &Plan) -> Option<Fit> {
        let is_same = |rank: usize| {
            let piece = plan.order[rank];
            piece == than.plan.order[rank] && plan.angles[piece] == than.plan.angles[piece]
        };
        let same = (0..plan.order.len()).position(|rank| !is_same(rank))?;
        let from = than.stages.iter().rfind(|stage| stage.placed <= same);
        let mut stage = from.map_or_else(|| Stage::new(plan.order.len()), Stage::clone);
        self.place(&mut stage, plan, plan.order.len(), than.fit.height)?;
        stage.fit()
    }

    /// Places the pieces of a plan from where a stage is up to a rank, none of them above `limit` rows.
    fn place(&self, stage: &mut Stage, plan: &Plan, to: usize, limit: usize) -> Option<()> {
        let mut bottoms = (self.stances.len() > MANY).then(HashMap::new);
        for &i in &plan.order[stage.placed..to] {
            let stances = self.tried(i, plan.angles[i]);
            for tile in 0..self.tiles {
                if tile == stage.grids.len() {
                    stage.grids.push(self.grid(tile));
                }
                let grid = &mut stage.grids[tile];
                let below = limit.saturating_sub(tile * self.columns);
                let top = grid.size()[1].min(below);
                if let Some((stance, at)) = lowest(stances, grid, tile, top, bottoms.as_mut()) {
                    grid.take(&stance.shape, at);
                    let [_, rows] = stance.shape.size();
                    let first = tile * self.columns + at[1];
                    stage.weight += stance.shape.cells() * (2 * first + rows);
                    if first + rows > stage.height {
                        (stage.height, stage.highest) = (first + rows, i);
                    }
                    stage.spots[i] = Some(Spot {
                        turn: stance.turn,
                        offset: [0, 1].map(|k| at[k] as f64 + stance.origin[k]),
                        tile,
                    });
                    break;
                }
            }
            stage.spots[i]?;
        }
        stage.placed = to;
        Some(())
    }

    /// A tile as it is from the start.
    fn grid(&self, tile: usize) -> Occupancy {
        let rows = match tile + 1 == self.tiles {
            true => (ROWS * self.columns as f64) as usize,
            false => self.columns,
        };
        let mut grid = Occupancy::new([self.columns, rows]);
        if let Some(taken) = self.taken.get(tile) {
            grid.take(taken, [0, 0]);
        }
        grid
    }
}

/// Some of the pieces of a plan, placed.
#[derive(Clone)]
struct Stage {
    /// How many.
    placed: usize,
    grids: Vec<Occupancy>,
    spots: Vec<Option<Spot>>,
    height: usize,
    weight: usize,
    highest: usize,
}

impl Stage {
    fn new(count: usize) -> Self {
        Self {
            placed: 0,
            grids: Vec::new(),
            spots: vec![None; count],
            height: 0,
            weight: 0,
            highest: 0,
        }
    }

    /// How all pieces lie, if all are placed.
    fn fit(self) -> Option<Fit> {
        Some(Fit {
            spots: self.spots.into_iter().collect::<Option<_>>()?,
            height: self.height,
            weight: self.weight,
            highest: self.highest,
        })
    }
}

/// A plan, how pieces lie by it, and stages on the way to that.
pub struct Stages {
    /// The plan.
    pub plan: Plan,
    /// How pieces lie by it.
    pub fit: Fit,
    stages: Vec<Stage>,
}

/// The stance and the place at which a piece's upper end is as low as possible, and below row `top`. `bottoms`, if
/// given, has the rows below which shapes of a kind found no room; it is not looked for there again.
fn lowest<'a>(
    stances: &'a [Stance],
    grid: &Occupancy,
    tile: usize,
    mut top: usize,
    mut bottoms: Option<&mut Bottoms>,
) -> Option<(&'a Stance, [usize; 2])> {
    let mut best = None;
    for stance in stances {
        let kind = (kind(&stance.shape), tile);
        let height = stance.shape.size()[1];
        let bottom = bottoms.as_ref().and_then(|rows| rows.get(&kind).copied());
        let found = grid.room(&stance.shape, bottom.unwrap_or(0), top);
        if let Some(bottoms) = &mut bottoms {
            let next = found.map_or((top + 1).saturating_sub(height), |at| at[1]);
            bottoms.insert(kind, next.max(bottom.unwrap_or(0)));
        }
        if let Some(at) = found {
            top = at[1] + height - 1;
            best = Some((stance, at));
        }
    }
    best
}

/// The same for shapes that are [`ALIKE`].
fn kind(shape: &Shape) -> [u32; 3] {
    let [width, height] = shape.size();
    [width, height, shape.cells()].map(|count| ((count as f64).ln() / ALIKE.ln()) as u32)
}
