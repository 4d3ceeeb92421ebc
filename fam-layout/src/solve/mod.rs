//! Flattening of a chart: an injective start, then as little distortion as its boundary allows.

pub(crate) mod blocks;
pub(crate) mod boundary;
pub(crate) mod energy;
mod hessian;
pub(crate) mod layout;
pub(crate) mod newton;
pub(crate) mod orientation;
pub(crate) mod rest;
mod sparse;
pub(crate) mod stretch;
mod symmetric_dirichlet;
#[cfg(test)]
mod tests;
pub(crate) mod tutte;

/// Why a chart was not flattened.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum SolveError {
    /// An argument has another number of entries than there are triangles or vertices.
    #[error("{what}: expected {expected} entries, found {found}")]
    LengthMismatch {
        /// The argument.
        what: &'static str,
        /// How many entries it should have.
        expected: usize,
        /// How many it has.
        found: usize,
    },
    /// The chart is no disk with holes.
    #[error("its Euler characteristic and boundary are not those of a disk with holes")]
    NotADisk,
    /// The outer boundary has two edges: its triangles cannot all be straight.
    #[error("its boundary has fewer than three edges")]
    ShortBoundary,
    /// The map that was to be improved has a triangle that is not counter-clockwise.
    #[error("triangle {triangle} of the map to start from is flipped or collapsed")]
    Flipped {
        /// The first such triangle.
        triangle: usize,
    },
    /// Parts of the boundary touch each other in the map that was to be improved.
    #[error("the boundary of the map to start from is not simple")]
    NotSimple,
    /// No positions of double precision were found at which all triangles are counter-clockwise.
    #[error("no injective start was found: triangle {triangle} stays collapsed")]
    Collapsed {
        /// The first such triangle: it lies on a limb that has to be cut.
        triangle: usize,
    },
    /// There is a layout, but one of so much distortion that cutting further leads nowhere.
    #[error("its distortion is out of all bounds")]
    Unbounded,
    /// A linear system could not be set up or solved.
    #[error("a sparse system could not be solved")]
    Singular,
}
