//! One component, cut into charts and flattened.

use std::collections::HashMap;

use super::layout::Layout;
use super::patch::Patch;
use super::refine::{Goal, MOST_STEPS, refined};
use super::solve::rest::RestShapes;
use super::split::split;
use super::tears::tear_costs;
use super::{FinishConfig, Guidance};
use crate::surface::TriangleMesh;

/// Components of fewer triangles may take as many steps as one of this many: they are quick.
const SMALL: u64 = 5_000;

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
    /// Its mean symmetric Dirichlet energy.
    pub energy: f64,
}

/// A part of the component that is still to be flattened.
struct Part {
    mesh: TriangleMesh,
    /// For every vertex and triangle that of the component.
    vertices: Vec<u32>,
    triangles: Vec<u32>,
}

/// Cuts a component's mesh into as few charts as it takes and flattens them. `raw` has its
/// UVs by the network; `proceed` sees energy and seam length (over the square root of the
/// area) on the way and says whether to go on refining.
///
/// A part that has no valid layout in one piece is divided, down to single triangles if it must
/// be; one that stays above the distortion bound too, as long as there are not too many charts.
pub fn flat_charts(
    config: &FinishConfig,
    mesh: &TriangleMesh,
    raw: &[[f32; 2]],
    guidance: Guidance,
    proceed: &mut dyn FnMut(f64, f64) -> bool,
) -> Vec<FlatChart> {
    let goal = Goal {
        bound: config.distortion_bound,
        seam_weight: config.seam_weight,
    };
    let mut charts = Vec::new();
    let mut parts = vec![Part {
        mesh: mesh.clone(),
        vertices: (0..mesh.positions().len() as u32).collect(),
        triangles: (0..mesh.triangles().len() as u32).collect(),
    }];
    let mut going = true;
    // A lower bound takes more cuts.
    let effort = (USUAL_EXCESS / (goal.bound - 4.0)).clamp(1.0, 4.0);
    let steps = (effort * MOST_STEPS as f64) as u64;
    let mut budget = steps * (mesh.triangles().len() as u64).max(SMALL);
    while let Some(part) = parts.pop() {
        let patch = Patch::of(&part.mesh);
        let own: Vec<[f32; 2]> = part.vertices.iter().map(|&v| raw[v as usize]).collect();
        let cost = match guidance {
            Guidance::Tears => tear_costs(&patch, &own),
            Guidance::None => patch.lengths.clone(),
        };
        let map: Vec<[f64; 2]> = patch
            .source
            .iter()
            .map(|&v| own[v as usize].map(f64::from))
            .collect();
        let map = (guidance == Guidance::Tears).then_some(map.as_slice());
        let layout = refined(&patch, cost, map, &goal, &mut budget, |energy, seam| {
            going = going && proceed(energy, seam);
            going
        });
        let several = part.triangles.len() > 1;
        let room = charts.len() + parts.len() + 1 < config.max_charts && going && budget > 0;
        match layout {
            Ok(layout) if layout.uv.iter().flatten().all(|c| c.is_finite()) => {
                let division = (room && several && layout.energy > goal.bound)
                    .then(|| split(&patch))
                    .filter(|beyond| layout.energy - goal.bound > price(&patch, beyond, &goal));
                match division {
                    Some(beyond) => parts.extend(halves(&part, &beyond)),
                    None => charts.push(chart(&part, &patch, layout)),
                }
            }
            Ok(_) | Err(_) if several => parts.extend(halves(&part, &split(&patch))),
            Ok(_) | Err(_) => charts.push(lone_triangle(&part, &patch)),
        }
    }
    charts
}

/// What the energy must be above the bound for a division to be worth its seam.
fn price(patch: &Patch, beyond: &[bool], goal: &Goal) -> f64 {
    let topology = &patch.topology;
    let across = |h: &u32| {
        let twin = topology.twin(*h);
        twin.is_some_and(|twin| beyond[*h as usize / 3] != beyond[twin as usize / 3])
    };
    let seam = topology.edges().filter(across);
    goal.worth() * seam.map(|h| patch.lengths[h as usize]).sum::<f64>()
}

/// A layout with the winding of the part's triangles and in units of the surface.
fn chart(part: &Part, patch: &Patch, layout: Layout) -> FlatChart {
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
        energy: layout.energy,
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
        energy: 4.0,
    }
}

/// The two parts that a part falls into when it is divided. Vertices at one position stay
/// apart if they were.
fn halves(part: &Part, beyond: &[bool]) -> Vec<Part> {
    let half = |side: bool| {
        let chosen: Vec<usize> = (0..beyond.len()).filter(|&t| beyond[t] == side).collect();
        let mut index: HashMap<u32, u32> = HashMap::new();
        let mut vertices = Vec::new();
        let mut compact = |v: u32| {
            *index.entry(v).or_insert_with(|| {
                vertices.push(v);
                vertices.len() as u32 - 1
            })
        };
        let triangles: Vec<[u32; 3]> = chosen
            .iter()
            .map(|&t| part.mesh.triangles()[t].map(&mut compact))
            .collect();
        let position = |&v: &u32| part.mesh.positions()[v as usize];
        let positions = vertices.iter().map(position).collect();
        Some(Part {
            mesh: TriangleMesh::new(positions, triangles).ok()?,
            vertices: vertices
                .iter()
                .map(|&v| part.vertices[v as usize])
                .collect(),
            triangles: chosen.iter().map(|&t| part.triangles[t]).collect(),
        })
    };
    [false, true].into_iter().filter_map(half).collect()
}
