//! A part that does not lie flat in one piece, divided: in two, or by its shape into many.

pub mod by_shape;
pub mod min_cut;
pub mod overlap;
pub mod split;
