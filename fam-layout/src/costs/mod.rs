//! What a seam along an edge costs.

pub mod creases;
pub mod tears;
