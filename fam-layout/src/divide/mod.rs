//! A part that does not lie flat in one piece, divided in two.

pub mod min_cut;
pub mod overlap;
pub mod split;
