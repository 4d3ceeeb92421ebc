//! Regions that are nearly flat, laid into their planes.

use super::Piece;
use super::facets::Facets;
use crate::cut::Cut;
use crate::cut::disk::cut_to_disk;
use crate::patch::Patch;
use crate::refine::problem::{Effort, Problem};
use crate::solve::boundary::open_contacts;
use crate::solve::layout::Layout;
use crate::solve::orientation::first_flipped;
use crate::solve::rest::RestShapes;
use fam_surface::vector::dot;

/// Above this energy a projection is relaxed: below it there is nothing to be had.
pub(super) const NEXT_TO_ISOMETRIC: f64 = 4.001;

/// A projection this many times as far above an isometry as the bound is not relaxed: steps in it
/// stand upright, and no relaxing flattens them.
const HOPELESS: f64 = 10.0;

/// Regions of more triangles are not laid out where their projection is not valid, but divided:
/// that is quicker, and seldom takes more charts in the end.
const FEW: usize = 500;

/// The solve of a region.
pub(super) const EFFORT: Effort = Effort {
    iterations: 10,
    decrease: 1e-3,
};

/// A region laid out, if that is possible within the bound. If it would have to be divided along a
/// forbidden edge otherwise, any valid layout will do.
pub(super) fn laid_out(
    patch: &Patch,
    facets: &Facets,
    facet: u32,
    bound: f64,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Option<Piece> {
    let triangles = facets.triangles(facet);
    if triangles.len() == 1 {
        return Some(lone_triangle(patch, facet));
    }
    let is_forced = facets.get(facet).is_forced;
    let is_upright = facets.is_upright(facet, &triangles);
    if triangles.len() > FEW && !is_forced && !is_upright {
        return None;
    }
    let own = patch.subset(&triangles);
    let cost = own.without_forbidden(own.prices.clone());
    let mut problem = Problem::new(&own, cost, &goes_on);
    problem.injective = true;
    let plane = facets.get(facet).plane();
    let projected = projected(&problem, plane).and_then(|mut layout| {
        problem.measure(&mut layout);
        if layout.energy - 4.0 > HOPELESS * (bound - 4.0) && !is_forced {
            return None;
        }
        if layout.energy > NEXT_TO_ISOMETRIC {
            // What was reached stays valid when a step fails.
            let _ = problem.relax(&mut layout, EFFORT);
            problem.measure(&mut layout);
        }
        (layout.energy <= bound).then_some(layout)
    });
    let laid_out = projected.or_else(|| {
        if triangles.len() > FEW && !is_forced {
            return None;
        }
        let layout = problem.flattened(whole_or_disk(&problem), EFFORT).ok()?;
        let is_finite = layout.uv.iter().flatten().all(|c| c.is_finite());
        (is_finite && (is_forced || layout.energy <= bound)).then_some(layout)
    });
    let layout = laid_out?;
    Some(Piece { triangles, layout })
}

/// A region as it is seen in its plane, if nothing lies over anything there.
fn projected(problem: &Problem, [u, v]: [[f64; 3]; 2]) -> Option<Layout> {
    let patch = problem.patch;
    let whole = Cut::none(&patch.topology);
    let opened = whole.open(&patch.topology);
    let place = |&source: &u32| {
        let p = patch.positions[source as usize];
        [dot(u, p), dot(v, p)]
    };
    let uv = opened.source.iter().map(place).collect();
    let mut layout = Layout::new(whole, opened, uv);
    let topology = &layout.opened.topology;
    if first_flipped(topology.triangles(), &layout.uv).is_some() {
        return None;
    }
    let boundary = problem.boundary(&layout);
    if !boundary.is_simple(&layout.uv) {
        open_contacts(topology, &boundary, &mut layout.uv).ok()?;
    }
    Some(layout)
}

/// No cut if a region is a disk with holes, else one that makes it a disk.
pub(super) fn whole_or_disk(problem: &Problem) -> Cut {
    let topology = &problem.patch.topology;
    let loops = topology.boundary_loops().len() as i64;
    match loops > 0 && topology.euler_characteristic() == 2 - loops {
        true => Cut::none(topology),
        false => cut_to_disk(topology, &problem.cost, &[]),
    }
}

/// A triangle as it is.
pub(super) fn lone_triangle(patch: &Patch, triangle: u32) -> Piece {
    let own = patch.subset(&[triangle]);
    let corners = own.topology.triangles()[0].map(|v| own.positions[v as usize]);
    let flat = RestShapes::new(&[corners], Some(1.0)).corners(0);
    let mut layout = Layout::of(&own.topology, Cut::none(&own.topology), &flat);
    layout.energy = 4.0;
    layout.area_distortion = 1.0;
    layout.conformality = 0.0;
    Piece {
        triangles: vec![triangle],
        layout,
    }
}
