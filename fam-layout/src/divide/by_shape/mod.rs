//! A surface divided into many charts by its shape, where no single layout is within the bound.
//!
//! The surface falls into regions that are nearly flat, which are projected into their planes. A
//! region that has no layout of its own is divided further, down to single triangles, so every
//! surface gets charts within the bound. Then their number is lowered step by step, as long as no
//! chart overlaps itself or exceeds the bound:
//!
//! 1. `join`: charts that share a border are laid side by side, those with the longest first:
//!    sides of a box unfold.
//! 2. `absorb`: small ones are flattened anew together with a neighbour.
//! 3. What is still small is taken apart into triangles, which are joined to what is around.

mod absorb;
mod facets;
mod flat;
mod grid;
mod join;
pub mod rough;

use rayon::prelude::*;

use crate::patch::Patch;
use crate::solve::layout::Layout;
use crate::watch::Watch;
use absorb::absorbed;
use facets::Facets;
use join::joined;

/// Some triangles of a patch, laid out.
#[derive(Clone)]
pub struct Piece {
    /// The triangles, ascending.
    pub triangles: Vec<u32>,
    /// Of the patch that they are by themselves.
    pub layout: Layout,
}

/// Charts of at most this many triangles are taken apart in the end.
const SMALL: usize = 32;

/// The charts of a patch, each with a mean energy within `bound`, or above it where
/// it would take cuts along forbidden edges. `None` if there is no valid layout without those.
pub fn divided(patch: &Patch, bound: f64, watch: &Watch) -> Option<Vec<Piece>> {
    let goes_on = || watch.goes_on();
    let pieces = regions(patch, bound, &goes_on)?;
    let merged = |pieces| {
        absorbed(
            patch,
            joined(patch, pieces, bound, &goes_on),
            bound,
            &goes_on,
        )
    };
    let pieces = merged(pieces);
    let taken_apart = |piece: &Piece| match piece.triangles.len() <= SMALL {
        true => {
            let triangles = piece.triangles.iter();
            triangles.map(|&t| flat::lone_triangle(patch, t)).collect()
        }
        false => vec![piece.clone()],
    };
    let is_free = !patch.forbidden.contains(&true);
    if pieces.len() == 1 || !is_free || !goes_on() {
        return Some(pieces);
    }
    let other = merged(pieces.iter().flat_map(taken_apart).collect());
    Some(if other.len() < pieces.len() {
        other
    } else {
        pieces
    })
}

/// Regions of a patch laid out, as large as possible. `None` if one would have to be divided along a
/// forbidden edge.
fn regions(patch: &Patch, bound: f64, goes_on: &(dyn Fn() -> bool + Sync)) -> Option<Vec<Piece>> {
    let facets = Facets::of(patch);
    let mut pieces = Vec::new();
    let mut open = facets.roots.clone();
    while !open.is_empty() {
        let laid_out: Vec<Option<Piece>> = open
            .par_iter()
            .map(|&facet| flat::laid_out(patch, &facets, facet, bound, goes_on))
            .collect();
        let mut parts = Vec::new();
        for (&facet, piece) in open.iter().zip(laid_out) {
            match piece {
                Some(piece) => pieces.push(piece),
                None if facets.get(facet).is_forced => return None,
                // There always are some: a single triangle is laid out.
                None => parts.extend(facets.parts(facet)),
            }
        }
        open = parts;
    }
    Some(pieces)
}

#[cfg(test)]
mod tests;
