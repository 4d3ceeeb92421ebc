//! Cuts where the distortion is, until it is within its bound.

use super::cut::cheapest_path;
use super::diffusion::Diffusion;
use super::layout::Layout;
use super::patch::Patch;
use super::peaks::peaks;
use super::solve::boundary::Boundary;
use super::solve::newton::{Flattening, Stop};
use super::solve::rest::RestShapes;

/// The distortion is spread over this length, in units of the square root of the area, before
/// its peaks are looked for.
const SPREAD: f64 = 0.06;

/// A patch, the state of its cut, and how far it was solved.
pub struct Refinement<'a> {
    pub patch: &'a Patch,
    pub cost: Vec<f64>,
    rest: RestShapes,
    diffusion: Diffusion,
    pub layout: Layout,
    pub energy: f64,
}

impl<'a> Refinement<'a> {
    pub fn seam_length(&self) -> f64 {
        let lengths = &self.patch.lengths;
        let edges = self.patch.topology.edges();
        edges
            .filter(|&h| self.layout.cut[h as usize])
            .map(|h| lengths[h as usize])
            .sum()
    }
}
