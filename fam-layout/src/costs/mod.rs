//! What a seam along an edge costs.

pub mod creases;
pub mod rates;
pub mod tears;
