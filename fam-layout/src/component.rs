//! One component, cut into charts and flattened.

use crate::LayoutConfig;
use crate::costs::creases::crease_costs;
use crate::costs::tears::tear_costs;
use crate::cut::Cut;
use crate::distortion::Distortion;
use crate::divide::by_shape::rough::is_rough;
use crate::divide::by_shape::{self, Piece};
use crate::divide::overlap::divided_where_overlapping;
use crate::divide::split::split;
use crate::flat::flat_chart;
use crate::marks::ComponentMarks;
use crate::marks::opening::opened;
use crate::parallel::largest_first;
use crate::part::{Part, halves};
use crate::patch::Patch;
use crate::refine::{
    Goal, MOST_STEPS, Start, refined, with_better_angles, without_regard_to_overlaps,
};
use crate::solve::SolveError;
use crate::solve::layout::Layout;
use crate::solve::rest::RestShapes;
use crate::watch::Watch;
use fam_surface::TriangleMesh;

/// Components of fewer triangles get the Newton steps of one of this many: they are quick.
const SMALL: u64 = 5_000;

/// The halves of a part of at least this many triangles are cut anew on simpler surfaces. Those of
/// smaller parts start from the layout of the whole.
const LARGE: usize = 20_000;

/// How far the default bound is above the energy of an isometry.
const USUAL_EXCESS: f64 = 0.1;

/// A part is divided in two if its energy is at most this many times as far above 4 as the bound:
/// few charts are enough then. Other parts are divided by their shape, unless the number of charts is
/// bounded.
const NEAR: f64 = 5.0;

/// Parts of fewer triangles are divided by their shape, unless the number of charts is bounded: that
/// is quicker.
const FEW: usize = 100;

/// Newton steps over all its triangles that a part gets at least. Most parts start from a layout, and
/// need few.
const RESERVE: u64 = 100;

/// A part with at least this many holes and handles, and fewer than `FINE` triangles for each, is a
/// web: the search for cuts takes seconds and seldom ends with one chart.
const MANY_HOLES: usize = 64;
const FINE: usize = 64;

/// A part with at least this many holes and handles is divided by its shape at once: the search for
/// so many cuts takes minutes.
const MOST_HOLES: usize = 300;

/// A web consists of flat faces if its charts by shape have an energy within this fraction of the way
/// from 4 to the bound.
const FLAT: f64 = 0.1;

/// A flat piece of a component.
#[derive(Clone)]
pub struct FlatChart {
    /// Coordinates in units of length on the surface.
    pub uvs: Vec<[f64; 2]>,
    /// Indices into them.
    pub triangles: Vec<[u32; 3]>,
    /// The component's triangle for every triangle of the chart.
    pub source: Vec<u32>,
    /// How far it is from an isometry.
    pub distortion: Distortion,
    /// Whether its sides lie along the axes and are to stay so.
    pub is_straight: bool,
}

/// A component that is to be cut and flattened.
#[derive(Clone, Copy)]
pub struct Task<'a, 'w> {
    pub config: &'a LayoutConfig,
    /// Cuts are made until the energy is within this share of the way from 4 to the bound.
    pub share: f64,
    /// In the unit of layouts.
    pub mesh: &'a TriangleMesh,
    /// UVs of the vertices, whose tears say where to cut.
    pub map: Option<&'a [[f32; 2]]>,
    /// The edges to cut and to avoid.
    pub marks: &'a ComponentMarks,
    /// What seams cost at every vertex for each unit of length; 1 if there are none.
    pub rates: Option<&'a [f64]>,
    /// Is told the progress so far, and says whether to go on refining.
    pub watch: &'a Watch<'w>,
}

/// Cuts a component into as few charts as it takes and flattens them. One that is flat as it is and on
/// which no seams are wanted is not changed.
///
/// A part that has no valid layout in one piece is divided, down to single triangles if it must
/// be. So is one whose energy stays above the bound, unless that takes too many charts or cuts
/// along forbidden edges: where it would overlap itself if it were free to, or by its shape.
pub fn flat_charts(task: &Task) -> Vec<FlatChart> {
    let is_free = task.marks.wanted.is_empty();
    if let Some(chart) = is_free.then(|| flat_chart(task.mesh)).flatten() {
        return vec![chart];
    }
    let Task {
        config,
        share,
        mesh,
        map,
        marks,
        rates,
        watch,
    } = *task;
    let goal = Goal {
        bound: 4.0 + share * (config.distortion_bound - 4.0),
        seam_weight: config.seam_weight,
        gives_up: config.max_charts.is_none(),
    };
    // A lower bound takes more cuts, and more are tried for each: with less, the dragon misses 4.03.
    let effort = (USUAL_EXCESS / (goal.bound - 4.0))
        .powf(1.5)
        .clamp(1.0, 8.0);
    let steps = (effort * MOST_STEPS as f64) as u64;
    let component = Component {
        goal,
        allowed: Distortion::allowed(config.distortion_bound),
        map,
        marks,
        rates,
        hides_seams: config.hide_seams > 0.0,
        crease_weight: config.crease_weight,
        tear_weight: config.tear_weight,
        areas: mesh.triangle_areas(),
        max_charts: config.max_charts,
        watch,
    };
    let most = config.max_charts.unwrap_or(usize::MAX);
    let parts = opened(mesh, marks);
    let budget = |part: &Part| steps * (part.triangles.len() as u64).max(SMALL);
    let budgets = parts.iter().map(budget).collect();
    component.divided(parts, most, budgets)
}

/// A component that is being flattened.
struct Component<'a, 'w> {
    /// For cutting.
    goal: Goal,
    /// What the bound allows.
    allowed: Distortion,
    map: Option<&'a [[f32; 2]]>,
    marks: &'a ComponentMarks,
    /// Of every vertex.
    rates: Option<&'a [f64]>,
    hides_seams: bool,
    crease_weight: f64,
    tear_weight: f64,
    /// Of every triangle.
    areas: Vec<f64>,
    max_charts: Option<usize>,
    watch: &'a Watch<'w>,
}

impl Component<'_, '_> {
    /// The charts of a part: `most` of them at most, unless it takes more to be valid. There is a
    /// `budget` of Newton steps, see [`refined`], from which those that are taken are subtracted.
    fn charts(&self, part: &Part, most: usize, budget: &mut u64) -> Vec<FlatChart> {
        let patch = self.patch(part);
        let several = part.triangles.len() > 1;
        if let Some(charts) = self.shaped_at_once(part, &patch) {
            return charts;
        }
        let placed = part.placed.as_ref().map(|placed| {
            let of = |h: u32| placed[h as usize / 3][corner(part, &patch, h)];
            let scaled = |h: u32| of(h).map(|c| c * patch.scale);
            (0..patch.topology.half_edges())
                .map(scaled)
                .collect::<Vec<[f64; 2]>>()
        });
        let layout = self.refined(part, &patch, placed.as_deref(), budget);
        match layout {
            Ok(layout) if layout.uv.iter().flatten().all(|c| c.is_finite()) => {
                let layout = self.continued(part, &patch, layout, budget);
                let layout = with_better_angles(&patch, layout, &self.allowed, self.watch);
                let whole = whole_chart(part, &patch, &layout);
                let room = several && most > 1 && self.watch.goes_on();
                if room
                    && self.is_above(&layout)
                    && let Some(charts) = self.several(part, &patch, layout, most, budget)
                {
                    let is_better = self.distortion(&charts).energy < whole.distortion.energy;
                    if charts.len() <= most && is_better {
                        return charts;
                    }
                }
                vec![whole]
            }
            Ok(_) | Err(_) if several => {
                let is_free = self.max_charts.is_none();
                let shaped = is_free.then(|| self.shaped(part, &patch)).flatten();
                shaped.unwrap_or_else(|| self.shared(halves(part, &split(&patch)), most, budget))
            }
            Ok(_) | Err(_) => vec![lone_triangle(part, &patch)],
        }
    }

    /// The charts of a part that is divided by its shape at once: one that is rough or full of holes
    /// and handles; or one that has many of them and consists of flat faces, so that cuts between
    /// them would be most of its seams.
    fn shaped_at_once(&self, part: &Part, patch: &Patch) -> Option<Vec<FlatChart>> {
        if self.max_charts.is_some() || !self.watch.goes_on() {
            return None;
        }
        let topology = &patch.topology;
        let holes = usize::try_from(2 - topology.euler_characteristic()).unwrap_or(0);
        let is_web = holes >= MANY_HOLES && holes * FINE > part.triangles.len();
        let is_torn = holes >= MOST_HOLES || is_rough(patch);
        if !is_web && !is_torn {
            return None;
        }
        let charts = self.shaped(part, patch)?;
        let is_flat = self.distortion(&charts).energy <= 4.0 + FLAT * (self.goal.bound - 4.0);
        (is_torn || is_flat).then_some(charts)
    }

    fn is_above(&self, layout: &Layout) -> bool {
        layout.energy > self.allowed.energy
    }

    /// Whether the energy of a layout is not far from the bound.
    fn is_near(&self, layout: &Layout) -> bool {
        layout.energy - 4.0 <= NEAR * (self.allowed.energy - 4.0)
    }

    /// A layout that is little above the bound when no steps are left, with some more.
    fn continued(&self, part: &Part, patch: &Patch, layout: Layout, budget: &mut u64) -> Layout {
        let is_short = *budget == 0 && self.watch.goes_on();
        if !is_short || !self.is_above(&layout) || !self.is_near(&layout) {
            return layout;
        }
        *budget = reserve(part);
        let flat = &layout.opened.topology;
        let corners = (0..flat.half_edges()).map(|h| layout.uv[flat.origin(h) as usize]);
        let corners: Vec<[f64; 2]> = corners.collect();
        match self.refined(part, patch, Some(&corners), budget) {
            Ok(further) if further.energy < layout.energy => further,
            Ok(_) | Err(_) => layout,
        }
    }

    /// Several charts of a part whose layout in one is above the bound; none if that takes cuts
    /// along forbidden edges. What is near to the bound is divided in two, what is far or small by
    /// its shape; that by shape may take more charts than are allowed.
    fn several(
        &self,
        part: &Part,
        patch: &Patch,
        layout: Layout,
        most: usize,
        budget: &mut u64,
    ) -> Option<Vec<FlatChart>> {
        let is_bounded = self.max_charts.is_some();
        if is_bounded || (self.is_near(&layout) && part.triangles.len() >= FEW) {
            *budget = reserve(part).max(*budget);
            let (parts, is_allowed) = self.division(part, patch, layout, budget);
            if is_allowed {
                return Some(self.shared(parts, most, budget));
            }
        }
        self.shaped(part, patch)
    }

    /// The charts of a part that is divided by its shape; none if that takes cuts along forbidden
    /// edges.
    fn shaped(&self, part: &Part, patch: &Patch) -> Option<Vec<FlatChart>> {
        let pieces = by_shape::divided(patch, self.goal.bound, self.watch)?;
        let of_piece = |piece: &Piece| chart(part, patch, &piece.triangles, &piece.layout);
        Some(pieces.iter().map(of_piece).collect())
    }

    /// The charts of the halves of a part, which share its budget by their sizes. It is used up then.
    fn shared(&self, parts: Vec<Part>, most: usize, budget: &mut u64) -> Vec<FlatChart> {
        let size = |part: &Part| part.triangles.len() as u128;
        let all: u128 = parts.iter().map(size).sum();
        let whole = u128::from(std::mem::take(budget));
        let share = |part: &Part| ((whole * size(part) / all.max(1)) as u64).max(reserve(part));
        let budgets = parts.iter().map(share).collect();
        self.divided(parts, most, budgets)
    }

    /// The charts of parts, each with a budget. Where the number of charts is bounded, they are laid
    /// out one after the other, and each leaves its successor what it has not spent.
    fn divided(&self, parts: Vec<Part>, most: usize, mut budgets: Vec<u64>) -> Vec<FlatChart> {
        if self.max_charts.is_none() {
            let sizes: Vec<usize> = parts.iter().map(|part| part.triangles.len()).collect();
            let charts = |i: usize| self.charts(&parts[i], most, &mut budgets[i].clone());
            let all = largest_first(&sizes, charts);
            return all.into_iter().flatten().collect();
        }
        let (mut found, mut unspent) = (Vec::new(), 0);
        for (i, (part, budget)) in parts.iter().zip(&mut budgets).enumerate() {
            let left = parts.len() - i - 1;
            let most = most.saturating_sub(found.len() + left).max(1);
            *budget += unspent;
            found.extend(self.charts(part, most, budget));
            unspent = *budget;
        }
        found
    }

    /// A part, ready to be cut.
    fn patch(&self, part: &Part) -> Patch {
        let patch = self.marks.patch(part, self.rates, self.crease_weight);
        Patch {
            hides_seams: self.hides_seams,
            ..patch
        }
    }

    fn refined(
        &self,
        part: &Part,
        patch: &Patch,
        placed: Option<&[[f64; 2]]>,
        budget: &mut u64,
    ) -> Result<Layout, SolveError> {
        let own: Option<Vec<[f32; 2]>> = self
            .map
            .map(|map| part.vertices.iter().map(|&v| map[v as usize]).collect());
        let cost = match &own {
            Some(own) => tear_costs(patch, own, self.tear_weight),
            None => crease_costs(patch),
        };
        let at_half_edges = own.map(|own| {
            let of = |h: u32| own[patch.source[patch.topology.origin(h) as usize] as usize];
            let corners = (0..patch.topology.half_edges()).map(|h| of(h).map(f64::from));
            corners.collect::<Vec<[f64; 2]>>()
        });
        let start = match (placed, &at_half_edges) {
            (Some(corners), _) => Start::Layout(corners),
            (None, Some(corners)) => Start::Map(corners),
            (None, None) => Start::Nothing,
        };
        refined(patch, cost, start, &self.goal, budget, self.watch)
    }

    /// A part in two, and whether the edges between are allowed to be cut.
    fn division(
        &self,
        part: &Part,
        patch: &Patch,
        layout: Layout,
        budget: &mut u64,
    ) -> (Vec<Part>, bool) {
        let free = without_regard_to_overlaps(patch, layout, &self.goal, budget, self.watch);
        let mut part = Part {
            mesh: part.mesh.clone(),
            vertices: part.vertices.clone(),
            triangles: part.triangles.clone(),
            placed: None,
        };
        let beyond = match divided_where_overlapping(patch, &free) {
            Some(beyond) if part.triangles.len() >= LARGE => beyond,
            Some(beyond) => {
                let chart = whole_chart(&part, patch, &free);
                let placed = chart.triangles.iter();
                part.placed = Some(placed.map(|t| t.map(|v| chart.uvs[v as usize])).collect());
                beyond
            }
            None => split(patch),
        };
        let is_allowed = !is_forbidden(patch, &free.cut, &beyond);
        (halves(&part, &beyond), is_allowed)
    }

    /// The distortion of charts together.
    fn distortion(&self, charts: &[FlatChart]) -> Distortion {
        let all: Vec<(Distortion, f64, usize)> = charts
            .iter()
            .map(|chart| {
                let areas = chart.source.iter().map(|&t| self.areas[t as usize]);
                (chart.distortion, areas.sum(), chart.source.len())
            })
            .collect();
        Distortion::together(&all)
    }
}

/// Which corner of its triangle of the part's mesh a half-edge of the patch starts in.
fn corner(part: &Part, patch: &Patch, h: u32) -> usize {
    let v = patch.source[patch.topology.origin(h) as usize];
    let corners = part.mesh.triangles()[h as usize / 3];
    corners.iter().position(|&c| c == v).unwrap_or(0)
}

/// Whether a division cuts forbidden edges that a cut does not.
pub fn is_forbidden(patch: &Patch, cut: &Cut, beyond: &[bool]) -> bool {
    let topology = &patch.topology;
    let is_across = |h: u32| {
        let twin = topology.twin(h).filter(|_| !cut.contains(h));
        twin.is_some_and(|twin| beyond[h as usize / 3] != beyond[twin as usize / 3])
    };
    topology
        .edges()
        .any(|h| patch.forbidden[h as usize] && is_across(h))
}

/// The least budget of a part.
fn reserve(part: &Part) -> u64 {
    RESERVE * part.triangles.len() as u64
}

/// Triangles of a part, laid out, with the winding that they have there and in units of the
/// surface.
pub fn chart(part: &Part, patch: &Patch, chosen: &[u32], layout: &Layout) -> FlatChart {
    let wound = |(&t, flat): (&u32, &[u32; 3])| {
        let mut corners = *flat;
        for (h, &v) in (3 * t..).zip(flat) {
            corners[corner(part, patch, h)] = v;
        }
        corners
    };
    let flat = layout.opened.topology.triangles();
    FlatChart {
        uvs: layout
            .uv
            .iter()
            .map(|q| q.map(|c| c / patch.scale))
            .collect(),
        triangles: chosen.iter().zip(flat).map(wound).collect(),
        source: chosen.iter().map(|&t| part.triangles[t as usize]).collect(),
        distortion: layout.distortion(),
        is_straight: false,
    }
}

/// The same of a whole part.
fn whole_chart(part: &Part, patch: &Patch, layout: &Layout) -> FlatChart {
    let all: Vec<u32> = (0..part.triangles.len() as u32).collect();
    chart(part, patch, &all, layout)
}

/// The first triangle of a part, as it is.
fn lone_triangle(part: &Part, patch: &Patch) -> FlatChart {
    let corners = patch.topology.triangles()[0].map(|v| patch.positions[v as usize]);
    let flat = RestShapes::new(&[corners], Some(1.0)).corners(0);
    FlatChart {
        uvs: flat.map(|q| q.map(|c| c / patch.scale)).to_vec(),
        triangles: vec![[0, 1, 2]],
        source: part.triangles.clone(),
        distortion: Distortion::NONE,
        is_straight: false,
    }
}
