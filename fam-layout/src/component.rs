//! One component, cut into charts and flattened.

use crate::LayoutConfig;
use crate::costs::creases::crease_costs;
use crate::costs::tears::tear_costs;
use crate::cut::Cut;
use crate::distortion::Distortion;
use crate::divide::overlap::divided_where_overlapping;
use crate::divide::split::split;
use crate::marks::ComponentMarks;
use crate::marks::opening::opened;
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

/// Components of fewer triangles may take as many steps as one of this many: they are quick.
const SMALL: u64 = 5_000;

/// What a part of at least this many triangles is divided into is cut anew, on simpler surfaces,
/// rather than from where it lies: steps over all of it take long.
const LARGE: usize = 20_000;

/// What the default bound is above the energy of an isometry.
const USUAL_EXCESS: f64 = 0.1;

/// A flat piece of a component.
pub struct FlatChart {
    /// Coordinates in units of length on the surface.
    pub uvs: Vec<[f64; 2]>,
    /// Indices into them.
    pub triangles: Vec<[u32; 3]>,
    /// For every triangle that of the component.
    pub source: Vec<u32>,
    /// How far it is from an isometry.
    pub distortion: Distortion,
}

/// Cuts a component's mesh into as few charts as it takes and flattens them. Where to cut is looked
/// for at a `share` of what the bound is above the energy of an isometry. `map` has UVs of its vertices
/// that say where to cut; `marks` says where to cut and where not to; `watch` sees what is reached on the way and
/// says whether to go on refining.
///
/// A part that has no valid layout in one piece is divided, down to single triangles if it must
/// be. One whose energy stays above the bound is divided where it would overlap itself if it were
/// free to, as long as there are not too many charts.
pub fn flat_charts(
    config: &LayoutConfig,
    share: f64,
    mesh: &TriangleMesh,
    map: Option<&[[f32; 2]]>,
    marks: &ComponentMarks,
    watch: &Watch,
) -> Vec<FlatChart> {
    let goal = Goal {
        bound: 4.0 + share * (config.distortion_bound - 4.0),
        seam_weight: config.seam_weight,
    };
    // A lower bound takes more cuts, and more are tried for each: with less, the dragon misses 4.03.
    let effort = (USUAL_EXCESS / (goal.bound - 4.0))
        .powf(1.5)
        .clamp(1.0, 8.0);
    let steps = (effort * MOST_STEPS as f64) as u64;
    let mut component = Component {
        goal,
        allowed: Distortion::allowed(config.distortion_bound),
        map,
        marks,
        areas: mesh.triangle_areas(),
        budget: steps * (mesh.triangles().len() as u64).max(SMALL),
        watch,
    };
    component.divided(opened(mesh, marks), config.max_charts)
}

/// A component that is being flattened.
struct Component<'a, 'w> {
    /// For cutting.
    goal: Goal,
    /// What the bound allows.
    allowed: Distortion,
    map: Option<&'a [[f32; 2]]>,
    marks: &'a ComponentMarks,
    /// Of every triangle.
    areas: Vec<f64>,
    /// What is left to be spent, see [`refined`].
    budget: u64,
    watch: &'a Watch<'w>,
}

impl Component<'_, '_> {
    /// The charts of a part: `most` of them at most, unless it takes more to be valid.
    fn charts(&mut self, part: Part, most: usize) -> Vec<FlatChart> {
        let patch = self.marks.patch(&part);
        let several = part.triangles.len() > 1;
        let placed = part.placed.as_ref().map(|placed| {
            let of = |h: u32| placed[h as usize / 3][corner(&part, &patch, h)];
            let scaled = |h: u32| of(h).map(|c| c * patch.scale);
            (0..patch.topology.half_edges())
                .map(scaled)
                .collect::<Vec<[f64; 2]>>()
        });
        let layout = self.refined(&part, &patch, placed.as_deref());
        match layout {
            Ok(layout) if layout.uv.iter().flatten().all(|c| c.is_finite()) => {
                let layout = with_better_angles(&patch, layout, &self.allowed, self.watch);
                let whole = chart(&part, &patch, &layout);
                let room = several && most > 1 && self.budget > 0 && self.watch.goes_on();
                if room && layout.energy > self.allowed.energy {
                    let (parts, price) = self.division(&part, &patch, layout);
                    if whole.distortion.energy - self.allowed.energy > price {
                        let charts = self.divided(parts, most);
                        let gain = whole.distortion.energy - self.distortion(&charts).energy;
                        if charts.len() <= most && gain > price {
                            return charts;
                        }
                    }
                }
                vec![whole]
            }
            Ok(_) | Err(_) if several => self.divided(halves(&part, &split(&patch)), most),
            Ok(_) | Err(_) => vec![lone_triangle(&part, &patch)],
        }
    }

    /// The charts of parts.
    fn divided(&mut self, parts: Vec<Part>, most: usize) -> Vec<FlatChart> {
        let mut charts = Vec::new();
        let mut left = parts.len();
        for part in parts {
            left -= 1;
            let most = most.saturating_sub(charts.len() + left).max(1);
            charts.extend(self.charts(part, most));
        }
        charts
    }

    fn refined(
        &mut self,
        part: &Part,
        patch: &Patch,
        placed: Option<&[[f64; 2]]>,
    ) -> Result<Layout, SolveError> {
        let own: Option<Vec<[f32; 2]>> = self
            .map
            .map(|map| part.vertices.iter().map(|&v| map[v as usize]).collect());
        let cost = match &own {
            Some(own) => tear_costs(patch, own),
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
        refined(patch, cost, start, &self.goal, &mut self.budget, self.watch)
    }

    /// A part in two, and what the energy must be above the bound for that to be worth its seam.
    fn division(&mut self, part: &Part, patch: &Patch, layout: Layout) -> (Vec<Part>, f64) {
        let free =
            without_regard_to_overlaps(patch, layout, &self.goal, &mut self.budget, self.watch);
        let mut part = Part {
            mesh: part.mesh.clone(),
            vertices: part.vertices.clone(),
            triangles: part.triangles.clone(),
            placed: None,
        };
        let beyond = match divided_where_overlapping(patch, &free) {
            Some(beyond) if part.triangles.len() >= LARGE => beyond,
            Some(beyond) => {
                let chart = chart(&part, patch, &free);
                let placed = chart.triangles.iter();
                part.placed = Some(placed.map(|t| t.map(|v| chart.uvs[v as usize])).collect());
                beyond
            }
            None => split(patch),
        };
        let price = price(patch, &free.cut, &beyond, &self.goal);
        (halves(&part, &beyond), price)
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

/// What the energy must be above the bound for a division to be worth the seam that it adds to a
/// cut; no number is enough where that is forbidden.
fn price(patch: &Patch, cut: &Cut, beyond: &[bool], goal: &Goal) -> f64 {
    let topology = &patch.topology;
    let across = |h: &u32| {
        let twin = topology.twin(*h).filter(|_| !cut.contains(*h));
        twin.is_some_and(|twin| beyond[*h as usize / 3] != beyond[twin as usize / 3])
    };
    let seam = topology.edges().filter(across);
    let length = seam
        .map(|h| match patch.forbidden[h as usize] {
            true => f64::INFINITY,
            false => patch.lengths[h as usize],
        })
        .sum::<f64>();
    goal.worth() * length
}

/// A layout with the winding of the part's triangles and in units of the surface.
fn chart(part: &Part, patch: &Patch, layout: &Layout) -> FlatChart {
    let opened = &layout.opened;
    let triangles = std::iter::zip(part.mesh.triangles(), opened.topology.triangles())
        .map(|(corners, open)| {
            corners.map(|corner| {
                let is_corner =
                    |v: &&u32| patch.source[opened.source[**v as usize] as usize] == corner;
                open.iter().find(is_corner).copied().unwrap_or(open[0])
            })
        })
        .collect();
    FlatChart {
        uvs: layout
            .uv
            .iter()
            .map(|q| q.map(|c| c / patch.scale))
            .collect(),
        triangles,
        source: part.triangles.clone(),
        distortion: layout.distortion(),
    }
}

/// The first triangle of a part, as it is.
fn lone_triangle(part: &Part, patch: &Patch) -> FlatChart {
    let corners = patch.topology.triangles()[0].map(|v| patch.positions[v as usize]);
    let rest = RestShapes::new(&[corners], Some(1.0));
    let [_, p, q] = rest.gradients(0);
    // The sides are to the gradients as a matrix to its inverse.
    let [a, b] = [[q[1], -q[0]], [-p[1], p[0]]];
    let doubled_area = 2.0 * rest.area(0);
    let side = |s: [f64; 2]| s.map(|c| c * doubled_area / patch.scale);
    FlatChart {
        uvs: vec![[0.0; 2], side(a), side(b)],
        triangles: vec![[0, 1, 2]],
        source: part.triangles.clone(),
        distortion: Distortion::NONE,
    }
}
