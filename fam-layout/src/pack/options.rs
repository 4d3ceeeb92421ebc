//! How charts are to be packed, and why they cannot be.

use thiserror::Error;

use fam_surface::SurfaceError;

use super::Chart;

/// Most tiles that charts are spread over: ten rows of ten. The coordinates of more tiles would be
/// so large that `f32` has too few digits left for a place inside of one.
pub const MOST_TILES: u32 = 100;

/// How a chart may be turned.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Turns {
    /// By any angle.
    #[default]
    Free,
    /// By right angles only, so that what is parallel to an axis stays so.
    Quarters,
    /// Not at all.
    None,
}

/// How large charts become, and how many squares (tiles) they are spread over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// As large as found possible, all at one scale.
    Largest {
        /// So many tiles, 1 to [`MOST_TILES`].
        tiles: u32,
        /// Largest scale, in UV units per unit of length; infinite if there is none.
        at_most: f64,
    },
    /// At a given texel density, in as many tiles as that takes, [`MOST_TILES`] at most.
    Tiles {
        /// Texels per unit of length.
        density: f64,
    },
    /// At a given texel density, in one square as small as found possible. Its side is
    /// [`Packing::resolution`](super::Packing::resolution).
    Side {
        /// Texels per unit of length.
        density: f64,
    },
}

/// A chart that stays where it is, for the others to be placed around.
#[derive(Debug, Clone, Copy)]
pub struct Fixed<'a> {
    /// Its coordinates are UVs in the unit square of its tile.
    pub chart: Chart<'a>,
    /// The tile in which it lies, counted from the first one.
    pub tile: u32,
}

/// How charts are to be packed.
#[derive(Debug, Clone, Copy)]
pub struct PackOptions<'a> {
    /// Empty texels between charts, and half as many at the border.
    pub margin: f64,
    /// Texels along the side of a tile; of no use with [`Size::Side`].
    pub resolution: u32,
    /// How large charts become.
    pub size: Size,
    /// Whether the lower left corner of every chart's bounding box lies on a corner of texels. The
    /// margin is rounded up to whole texels then, and so many lie between the texels that two
    /// charts touch, along one axis or the other.
    pub whole_texels: bool,
    /// What the first tile counts as in the placements: where the charts come to lie.
    pub first_tile: u32,
    /// Charts that stay where they are. With [`Size::Tiles`] those in tiles beyond the last that is
    /// needed keep their tile; with [`Size::Side`] there must be none.
    pub fixed: &'a [Fixed<'a>],
}

impl PackOptions<'_> {
    /// One square, in which charts become as large as found possible.
    pub fn new(margin: f64, resolution: u32) -> Self {
        Self {
            margin,
            resolution,
            size: Size::Largest {
                tiles: 1,
                at_most: f64::INFINITY,
            },
            whole_texels: false,
            first_tile: 0,
            fixed: &[],
        }
    }
}

/// Why charts cannot be packed as asked.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PackError {
    /// The charts themselves are invalid.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A density that is no positive number.
    #[error("a texel density must be a positive number, but it is {0}")]
    Density(f64),
    /// A number of tiles, or the tile of a fixed chart, that is out of range.
    #[error("there can be 1 to {MOST_TILES} tiles, not {0}")]
    Tiles(u32),
    /// At the given density a chart is larger than a tile.
    #[error("chart {chart} needs a tile of {needed:.0} texels, but it has {resolution}")]
    TooLarge {
        /// The first such chart.
        chart: usize,
        /// Texels along the side of a tile that has room for it.
        needed: f64,
        /// Texels along the side of a tile.
        resolution: u32,
    },
    /// At the given density the charts take more than [`MOST_TILES`] tiles, or a square of more
    /// texels to a side than a `u32` counts.
    #[error("the charts are too large or too many at this texel density")]
    TooMany,
    /// More tiles are needed than there may be.
    #[error("the charts need {needed} tiles, but there may be {tiles}")]
    MoreTiles {
        /// How many are needed.
        needed: u32,
        /// How many there may be.
        tiles: u32,
    },
    /// Charts that stay where they are leave no room for the others.
    #[error("charts that stay where they are leave no room for the others")]
    NoRoom,
    /// Charts were to stay in a square whose side was asked for.
    #[error("charts can stay where they are only in squares of a given size")]
    FixedInUnknownSquare,
}
