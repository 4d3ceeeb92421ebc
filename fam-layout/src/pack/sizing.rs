//! How large charts become, in how many tiles of which side.

use super::improve::{Task, plans};
use super::mask::Mask;
use super::occupancy::Shape;
use super::options::{MOST_TILES, PackError, PackOptions, Size};
use super::outline::Outline;
use super::piece::Piece;
use super::search::Spot;
use super::sheet::{Padding, Sheet};

/// Least space kept free at the border, as a share of the square's side: what rounding to
/// `f32` may move a point, and more.
const LEAST_BORDER: f64 = 1e-6;

/// Cells along the side of a grid, at least.
const LEAST_CELLS: usize = 1024;

/// Cells along the side of a grid per chart in a row of equal charts, as far as that makes a grid of
/// no more than [`MANY_CELLS`]; and in larger grids, where finer cells would take too long.
const CELLS_PER_CHART: usize = 64;
const MANY_CELLS: usize = 4096;
const LEAST_PER_CHART: usize = 32;

/// The search begins in a grid of half as many cells to a side: a fit is found there in a third of
/// the time. In how many steps the scale is searched in the coarse grid, and then in the fine one.
const COARSE_STEPS: usize = 4;
const FINE_STEPS: usize = 1;

/// By which factor charts mostly become larger in the fine grid, whose cells waste less.
const FINER: f64 = 1.015;

/// The share of tiles that charts are expected to cover, where a grid is chosen by it.
const EXPECTED: f64 = 0.7;

/// Rounds of local search, per chart in inverse proportion, since a round takes about as much longer as
/// there are more charts; of few charts no more than so many.
const ROUNDS_TIMES_CHARTS: usize = 4000;
const MOST_ROUNDS: usize = 24;

/// There is no local search for more charts than so many: it would take longer than all else and bring
/// less than a hundredth.
const LOTS: usize = 500;

/// The plan for so many charts is searched in the coarse grid already, in so many rounds.
const FEW: usize = 64;
const ROUNDS_OF_FEW: usize = 100;

/// Where charts lie, in units of tiles.
pub struct Layout {
    /// Tiles' sides per unit of length.
    pub scale: f64,
    /// One for each piece.
    pub spots: Vec<Spot>,
    /// How many tiles there are.
    pub tiles: u32,
    /// Texels along the side of a tile.
    pub resolution: u32,
    /// Texels that stay free between charts.
    pub margin: f64,
}

/// Pieces and how large they are to become.
pub struct Sizing<'a> {
    pieces: &'a [Piece],
    /// What stays in each tile.
    fixed: Vec<Vec<Outline>>,
    size: Size,
    resolution: u32,
    /// Texels between charts.
    margin: f64,
    whole_texels: bool,
}

impl<'a> Sizing<'a> {
    /// Pieces in a unit of length other than that of the options.
    ///
    /// # Errors
    /// The options are invalid.
    pub fn new(
        pieces: &'a [Piece],
        unit: f64,
        options: &PackOptions<'_>,
    ) -> Result<Self, PackError> {
        let in_unit = |density: f64| match density.is_finite() && density > 0.0 {
            true => Ok(density * unit),
            false => Err(PackError::Density(density)),
        };
        let resolution = options.resolution.max(1);
        let mut margin = options.margin.max(0.0);
        if options.whole_texels {
            margin = 2.0 * (0.5 * margin).ceil();
        }
        let size = match options.size {
            Size::Largest { tiles, at_most } => {
                check_tiles(tiles)?;
                let per_row = (pieces.len() as f64 / f64::from(tiles))
                    .sqrt()
                    .ceil()
                    .max(1.0);
                let most = 0.5 / per_row * f64::from(resolution);
                margin = margin.min(match options.whole_texels {
                    true => 2.0 * (0.5 * most).floor(),
                    false => most,
                });
                let at_most = match at_most == f64::INFINITY {
                    true => at_most,
                    false => in_unit(at_most)?,
                };
                Size::Largest { tiles, at_most }
            }
            Size::Tiles { density } => Size::Tiles {
                density: in_unit(density)?,
            },
            Size::Side { density } => Size::Side {
                density: in_unit(density)?,
            },
        };
        let mut fixed: Vec<Vec<Outline>> = Vec::new();
        for one in options.fixed {
            check_tiles(one.tile.saturating_add(1))?;
            if matches!(size, Size::Side { .. }) {
                return Err(PackError::FixedInUnknownSquare);
            }
            if one.tile as usize >= fixed.len() {
                fixed.resize_with(one.tile as usize + 1, Vec::new);
            }
            fixed[one.tile as usize].push(Outline::new(one.chart.uvs, one.chart.triangles));
        }
        Ok(Self {
            pieces,
            fixed,
            size,
            resolution,
            margin,
            whole_texels: options.whole_texels,
        })
    }

    /// Sizes and places the pieces.
    ///
    /// # Errors
    /// They do not fit.
    pub fn run(&self, goes_on: &(dyn Fn() -> bool + Sync)) -> Result<Layout, PackError> {
        if let ([piece], []) = (self.pieces, &self.fixed[..]) {
            return self.alone(piece);
        }
        match self.size {
            Size::Largest { tiles, at_most } => self.largest(tiles as usize, at_most, goes_on),
            Size::Tiles { density } => self.tiles(density),
            Size::Side { density } => self.side(density, goes_on),
        }
    }

    /// A single piece in the lower left corner.
    fn alone(&self, piece: &Piece) -> Result<Layout, PackError> {
        let mut side = f64::from(self.resolution);
        let border = (0.5 * self.margin).max(LEAST_BORDER * side);
        let density = match self.size {
            Size::Largest { at_most, .. } => {
                let density = (side - 2.0 * border) / piece.square();
                density.min(at_most * side)
            }
            Size::Tiles { density } => {
                self.check_sizes(density)?;
                density
            }
            Size::Side { density } => {
                side = self.needed(piece, density).ceil();
                density
            }
        };
        let density = if density.is_finite() { density } else { side };
        let angle = -piece.boxes[piece.boxes.len() - 1].angle;
        let turn = [angle.cos(), angle.sin()];
        let (_, [low, _]) = piece.oriented(turn, density);
        let border = match self.whole_texels {
            true => 0.5 * self.margin,
            false => border.max(LEAST_BORDER * side),
        };
        let spot = Spot {
            turn,
            offset: low.map(|c| (border - c) / side),
            tile: 0,
        };
        Ok(Layout {
            scale: density / side,
            spots: vec![spot],
            tiles: self.tiles_of(1),
            resolution: texels(side)?,
            margin: self.margin,
        })
    }

    /// The largest scale found at which all fit into so many tiles, but no larger than `at_most`.
    fn largest(
        &self,
        tiles: usize,
        at_most: f64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Layout, PackError> {
        let mut plans = plans(self.pieces);
        let mut start = None;
        let cells = self.cells(tiles);
        let coarse_rounds = match self.pieces.len() <= FEW {
            true => ROUNDS_OF_FEW,
            false => 0,
        };
        let grids = [
            (cells / 2, COARSE_STEPS, coarse_rounds),
            (cells, FINE_STEPS, self.rounds()),
        ];
        let mut found: Option<(f64, Vec<Spot>)> = None;
        for (cells, steps, rounds) in grids {
            let columns = match self.whole_texels {
                true => self.resolution as usize / self.texels_per_cell(cells) as usize,
                false => cells,
            };
            let padding = self.padding(f64::from(self.resolution) / columns as f64);
            let sheet = |scale: f64| Sheet {
                columns,
                scale: scale * columns as f64,
                padding,
            };
            let task = Task {
                pieces: self.pieces,
                tiles,
                taken: self.taken(&sheet(1.0)),
                sheet,
                steps,
                rounds,
            };
            let room = 1.0 - 2.0 * padding.border() / columns as f64;
            let most = (room / self.longest())
                .min(room * (tiles as f64).sqrt() / self.area().sqrt())
                .min(at_most);
            if !most.is_finite() {
                let best = task.best_of(1.0, &plans).map(|(_, fit)| fit);
                let best = best.filter(|fit| fit.height <= tiles * columns);
                let spots = best.ok_or(PackError::NoRoom)?.spots;
                found = Some((1.0, in_tiles(spots, 1.0 / columns as f64)));
                continue;
            }
            let best = task.run(&plans, start.unwrap_or(0.75 * most), most, goes_on)?;
            start = Some(FINER * best.scale);
            plans = vec![best.plan];
            // Now and then a plan is less good in finer cells.
            if found.as_ref().is_none_or(|(scale, _)| *scale < best.scale) {
                let spots = in_tiles(best.fit.spots, 1.0 / columns as f64);
                found = Some((best.scale, spots));
            }
        }
        let (scale, spots) = found.ok_or(PackError::NoRoom)?;
        Ok(Layout {
            scale,
            spots,
            tiles: tiles as u32,
            resolution: self.resolution,
            margin: self.margin,
        })
    }

    /// At a density, in as many tiles as it takes.
    fn tiles(&self, density: f64) -> Result<Layout, PackError> {
        self.check_sizes(density)?;
        let side = f64::from(self.resolution);
        let estimate = self.area() * (density / side).powi(2) / EXPECTED;
        if estimate > f64::from(MOST_TILES) / EXPECTED {
            return Err(PackError::TooMany);
        }
        let cells = self.cells((estimate as usize).max(1));
        let columns = match self.whole_texels {
            true => self.resolution as usize / self.texels_per_cell(cells) as usize,
            false => cells,
        };
        let cell = side / columns as f64;
        let sheet = Sheet {
            columns,
            scale: density / cell,
            padding: self.padding(cell),
        };
        let most = MOST_TILES as usize;
        let task = Task {
            pieces: self.pieces,
            tiles: most,
            taken: self.taken(&sheet),
            sheet: |_| sheet,
            steps: 0,
            rounds: 0,
        };
        let best = task.best_of(1.0, &plans(self.pieces)).map(|(_, fit)| fit);
        let best = best.filter(|fit| fit.height <= most * columns);
        let spots = best.ok_or(PackError::TooMany)?.spots;
        let tiles = spots.iter().map(|spot| spot.tile + 1).max().unwrap_or(1);
        Ok(Layout {
            scale: density / side,
            spots: in_tiles(spots, 1.0 / columns as f64),
            tiles: self.tiles_of(tiles),
            resolution: self.resolution,
            margin: self.margin,
        })
    }

    /// At a density, in a square as small as found possible.
    fn side(&self, density: f64, goes_on: &(dyn Fn() -> bool + Sync)) -> Result<Layout, PackError> {
        let around = self.pieces.len() as f64 * self.margin * self.margin;
        let expected = (self.area() * density * density / EXPECTED + around).sqrt();
        let longest = self.longest() * density + self.margin;
        let expected = expected.max(longest).max(1.0);
        let cell = expected / self.cells(1) as f64;
        let cell = if self.whole_texels {
            cell.floor().max(1.0)
        } else {
            cell
        };
        let padding = self.padding(cell);
        let scale = density / cell;
        let least = self.area().sqrt().max(self.longest()) * scale + 2.0 * padding.border();
        // So much smaller than the smallest square that it might be is the one looked for.
        let sheet = |share: f64| Sheet {
            columns: ((least / share).ceil() as usize).max(1),
            scale,
            padding,
        };
        let task = Task {
            pieces: self.pieces,
            tiles: 1,
            taken: Vec::new(),
            sheet,
            steps: COARSE_STEPS,
            rounds: self.rounds(),
        };
        let best = task.run(&plans(self.pieces), 0.75, 1.0, goes_on)?;
        let side = (sheet(best.scale).columns as f64 * cell).ceil();
        Ok(Layout {
            scale: density / side,
            spots: in_tiles(best.fit.spots, cell / side),
            tiles: 1,
            resolution: texels(side)?,
            margin: self.margin,
        })
    }

    fn tiles_of(&self, used: usize) -> u32 {
        match self.size {
            Size::Largest { tiles, .. } => tiles,
            _ => used.max(self.fixed.len()) as u32,
        }
    }

    /// Rounds of local search in a fine grid.
    fn rounds(&self) -> usize {
        match self.pieces.len() {
            count if count > LOTS => 0,
            count => (ROUNDS_TIMES_CHARTS / count.max(1)).min(MOST_ROUNDS),
        }
    }

    /// Cells along the side of a tile, for so many tiles.
    fn cells(&self, tiles: usize) -> usize {
        let per_row = (self.pieces.len() as f64 / tiles as f64).sqrt().ceil() as usize;
        (CELLS_PER_CHART * per_row)
            .min(MANY_CELLS)
            .max(LEAST_PER_CHART * per_row)
            .max(LEAST_CELLS)
    }

    /// Whole texels along the side of a cell so that there are at least so many cells.
    fn texels_per_cell(&self, cells: usize) -> u32 {
        let most = (self.resolution / cells as u32).max(1);
        let divides = |by: &u32| self.resolution.is_multiple_of(*by);
        (1..=most).rev().find(divides).unwrap_or(1)
    }

    /// The space around charts in cells of so many texels.
    fn padding(&self, cell: f64) -> Padding {
        match self.whole_texels {
            true => Padding::Texels {
                per_cell: cell as usize,
                width: (0.5 * self.margin) as usize,
            },
            false => Padding::Around(
                (0.5 * self.margin).max(LEAST_BORDER * f64::from(self.resolution)) / cell,
            ),
        }
    }

    fn taken(&self, sheet: &Sheet) -> Vec<Shape> {
        let taken = self.fixed.iter().map(|own| sheet.fixed(own.iter()));
        taken.collect()
    }

    fn area(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.area).sum()
    }

    /// The side of the largest square that a piece needs.
    fn longest(&self) -> f64 {
        self.pieces.iter().map(Piece::square).fold(0.0, f64::max)
    }

    /// Texels along the side of a tile that has room for a piece.
    fn needed(&self, piece: &Piece, density: f64) -> f64 {
        let side = piece.square() * density;
        match self.whole_texels {
            true => Mask::cells_for(side) as f64 + self.margin,
            false => (side + self.margin) * (1.0 + 2.0 * LEAST_BORDER),
        }
    }

    fn check_sizes(&self, density: f64) -> Result<(), PackError> {
        let needed = self.pieces.iter().map(|piece| self.needed(piece, density));
        let resolution = self.resolution;
        let mut large = needed.enumerate();
        match large.find(|(_, needed)| *needed > f64::from(resolution)) {
            Some((chart, needed)) => Err(PackError::TooLarge {
                chart,
                needed,
                resolution,
            }),
            None => Ok(()),
        }
    }
}

fn check_tiles(tiles: u32) -> Result<(), PackError> {
    match (1..=MOST_TILES).contains(&tiles) {
        true => Ok(()),
        false => Err(PackError::Tiles(tiles)),
    }
}

fn texels(side: f64) -> Result<u32, PackError> {
    match side.ceil() <= f64::from(u32::MAX) {
        true => Ok(side.ceil() as u32),
        false => Err(PackError::TooMany),
    }
}

fn in_tiles(spots: Vec<Spot>, cell: f64) -> Vec<Spot> {
    let scaled = |spot: Spot| Spot {
        offset: spot.offset.map(|c| c * cell),
        ..spot
    };
    spots.into_iter().map(scaled).collect()
}
