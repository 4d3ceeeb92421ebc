//! A cut of what is left, carried back to the whole surface.

use super::Simplification;
use super::collapse::{Collapse, Wing};
use crate::cut::Cut;
use fam_surface::vector::{length, sub};

impl Simplification<'_> {
    /// Carries a cut of the simpler surface to the original one, which it opens to the same pieces.
    /// `triangles` has the original triangle for every triangle of the simpler surface.
    pub fn carried(mut self, cut: &Cut, triangles: &[u32]) -> Cut {
        let mut is_cut = vec![false; self.surface.half_edges() as usize];
        for h in cut.half_edges() {
            is_cut[(3 * triangles[h as usize / 3] + h % 3) as usize] = true;
        }
        while let Some(collapse) = self.collapses.pop() {
            self.carry(&collapse, &mut is_cut);
        }
        let half_edges: Vec<u32> = (0..is_cut.len() as u32)
            .filter(|&h| is_cut[h as usize])
            .collect();
        let mut carried = Cut::none(&self.surface);
        carried.add(&self.surface, &half_edges);
        carried
    }

    /// Undoes a collapse. Of the cut's edges at the vertex some leave the one and some the
    /// other of the two that there are now; these are joined along the edge between them where
    /// they must be.
    fn carry(&mut self, collapse: &Collapse, is_cut: &mut [bool]) {
        let wings = collapse.wings(&self.surface);
        let beyond = |wing: &Wing| [wing.from.1, wing.into.1].into_iter().flatten();
        let joined: Vec<&Wing> = wings
            .iter()
            .filter(|wing| beyond(wing).any(|h| is_cut[h as usize]))
            .collect();
        self.restore(collapse);
        for h in wings.iter().flat_map(beyond) {
            is_cut[h as usize] = false;
        }
        let surface = &self.surface;
        let fan = |leaving: u32| {
            let fan = surface.fan(leaving);
            let is_inner = fan.iter().all(|&h| surface.twin(h).is_some());
            let cut = fan.iter().filter(|&&h| is_cut[h as usize]).count();
            (cut, !is_inner)
        };
        let (own, at_boundary) = fan(collapse.leaving_from(surface));
        let (other, held) = fan(collapse.leaving_into(surface));
        let is_tip = other == 0 && !held && own == 1 && joined.is_empty();
        let both = own > 0 && !at_boundary && (other > 0 || held || is_tip);
        let size = |h: u32| {
            let ends = [surface.origin(h), surface.target(h)];
            let [a, b] = ends.map(|v| self.positions[v as usize]);
            length(sub(a, b))
        };
        for wing in joined {
            let takes_own = if both {
                size(wing.from.0) < size(wing.into.0)
            } else {
                own > 0 && !at_boundary
            };
            let (h, beyond) = if takes_own { wing.from } else { wing.into };
            is_cut[h as usize] = true;
            if let Some(beyond) = beyond {
                is_cut[beyond as usize] = true;
            }
        }
        if both {
            for h in collapse.half_edges() {
                is_cut[h as usize] = true;
            }
        }
    }
}
