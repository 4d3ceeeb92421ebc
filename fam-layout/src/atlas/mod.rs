//! A surface laid out as an atlas of many charts, by its shape: where there is no one layout that
//! is within the bound.
//!
//! The surface falls into regions that are nearly flat, which are laid into their planes. Then
//! charts that share a border are joined along it, those with the longest first, where they do
//! not overlap and stay within the bound: sides of a box unfold. The regions of a region are
//! tried where it has no layout of its own, down to single triangles, so that every surface has
//! an atlas within the bound.

mod facets;
mod flat;
mod grid;
mod join;

use crate::patch::Patch;
use crate::solve::layout::Layout;
use crate::watch::Watch;
use facets::Facets;
use join::joined;

/// Some triangles of a patch, laid out.
pub struct Piece {
    /// The triangles, ascending.
    pub triangles: Vec<u32>,
    /// Of the patch that they are by themselves.
    pub layout: Layout,
}

/// The pieces of an atlas of a patch, each with a mean energy within `bound`, or above it where
/// it would take cuts along forbidden edges. `None` if there is no valid layout without those.
pub fn by_shape(patch: &Patch, bound: f64, watch: &Watch) -> Option<Vec<Piece>> {
    let goes_on = || watch.goes_on();
    let facets = Facets::of(patch);
    let mut pieces = Vec::new();
    let mut open = facets.roots.clone();
    while let Some(facet) = open.pop() {
        match flat::laid_out(patch, &facets, facet, bound, &goes_on) {
            Some(piece) => pieces.push(piece),
            None if facets.get(facet).is_forced => return None,
            // There are always halves: a single triangle is laid out.
            None => open.extend(facets.get(facet).halves.into_iter().flatten()),
        }
    }
    Some(joined(patch, pieces, bound, &goes_on))
}

#[cfg(test)]
mod tests;
