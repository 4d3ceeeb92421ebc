//! A grid in which pieces are placed, and how they look in it.

use super::mask::Mask;
use super::occupancy::Shape;
use super::outline::Outline;
use super::piece::Piece;
use super::{Turns, turned};

/// How the space around charts is kept free.
#[derive(Debug, Clone, Copy)]
pub enum Padding {
    /// So many cells around every chart.
    Around(f64),
    /// Whole texels, of which `per_cell` make the side of a cell: `width` around the texels that a
    /// chart touches, with its lower left corner on a corner of texels.
    Texels {
        /// Texels along the side of a cell.
        per_cell: usize,
        /// Texels of padding on each side.
        width: usize,
    },
}

impl Padding {
    /// Space at the border, in cells.
    pub fn border(self) -> f64 {
        match self {
            Self::Around(reach) => reach,
            Self::Texels { per_cell, width } => width as f64 / per_cell as f64,
        }
    }
}

/// The grid of a tile.
#[derive(Debug, Clone, Copy)]
pub struct Sheet {
    /// Cells along its side.
    pub columns: usize,
    /// Cells per unit of length.
    pub scale: f64,
    /// Space around charts.
    pub padding: Padding,
}

/// A shape for which room is sought.
pub struct Stance {
    /// Cosine and sine of the angle by which the piece is turned.
    pub turn: [f64; 2],
    /// Where the piece's origin lies in the shape's box.
    pub origin: [f64; 2],
    /// Its cells.
    pub shape: Shape,
}

impl Sheet {
    /// A piece with the sides of its boxes parallel to the axes, in each direction that it may have.
    /// Of those that look the same there is one.
    pub fn stances(&self, piece: &Piece) -> Vec<Stance> {
        let quarters = match piece.turns {
            Turns::Free | Turns::Quarters => 4,
            Turns::None => 1,
        };
        let mut stances: Vec<Stance> = Vec::new();
        for found in &piece.boxes {
            let mut turn = [found.angle.cos(), -found.angle.sin()];
            for _ in 0..quarters {
                let stance = self.stance(piece, turn);
                if !stances.iter().any(|other| other.shape == stance.shape) {
                    stances.push(stance);
                }
                turn = turned(turn, [0.0, 1.0]);
            }
        }
        stances
    }

    /// A piece turned in one way.
    pub fn stance(&self, piece: &Piece, turn: [f64; 2]) -> Stance {
        let (outline, [low, high]) = piece.oriented(turn, self.scale);
        let border = self.padding.border();
        let origin = low.map(|c| border - c);
        let size = [0, 1].map(|k| high[k] - low[k]);
        let mask = match self.padding {
            Padding::Around(reach) => {
                let mut mask = Mask::empty(size.map(|c| Mask::cells_for(c + 2.0 * reach)));
                mask.cover(&shifted(&outline, origin, 1.0), reach);
                mask
            }
            Padding::Texels { per_cell, width } => {
                let texels = per_cell as f64;
                let mut mask = Mask::empty(size.map(|c| Mask::cells_for(c * texels)));
                mask.cover(&shifted(&outline, low.map(|c| -c), texels), 0.0);
                mask.padded(width).coarser(per_cell)
            }
        };
        Stance {
            turn,
            origin,
            shape: Shape::new(&mask),
        }
    }

    /// The cells that outlines with UVs as coordinates take up in a tile.
    pub fn fixed<'a>(&self, outlines: impl Iterator<Item = &'a Outline>) -> Shape {
        let none = [0.0; 2];
        let mask = match self.padding {
            Padding::Around(reach) => {
                let mut mask = Mask::empty([self.columns; 2]);
                for outline in outlines {
                    mask.cover(&shifted(outline, none, self.columns as f64), reach);
                }
                mask
            }
            Padding::Texels { per_cell, width } => {
                let texels = self.columns * per_cell;
                // What lies beyond the border keeps its distance as well.
                let mut mask = Mask::empty([texels + 2 * width; 2]);
                let border = [width as f64 / texels as f64; 2];
                for outline in outlines {
                    mask.cover(&shifted(outline, border, texels as f64), 0.0);
                }
                mask.padded(width).inner(2 * width).coarser(per_cell)
            }
        };
        Shape::new(&mask)
    }
}

/// An outline moved, then scaled.
fn shifted(outline: &Outline, by: [f64; 2], scale: f64) -> Outline {
    outline.mapped(|p| [0, 1].map(|k| scale * (p[k] + by[k])))
}
