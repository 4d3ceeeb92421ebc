//! A component that is its own mirror image, laid out by its half.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::Mirror;
use super::chart::{Winding, evened, judged, surface};
use super::hinge::hinged;
use super::images::images;
use crate::component::{FlatChart, flat_charts};
use crate::distortion::Distortion;
use crate::flat::flat_chart;
use crate::marks::ComponentMarks;
use crate::part::Part;
use crate::watch::Watch;
use crate::{LayoutConfig, Stack};
use fam_surface::TriangleMesh;
use fam_surface::orientation::{NONE, across};
use fam_surface::sets::Sets;
use fam_surface::symmetry::{MirrorPlane, Pairing};
use fam_surface::vector::{length, sub};

/// How far the half is cut, as shares of what it would be by itself: what is left is for joining it
/// with its image. The best of these is taken.
const SHARES: [f64; 2] = [0.9, 0.6];

/// By how much the energy of what is mirrored may differ for rounding.
const ROUNDING: f64 = 1e-6;

/// A component that is its own mirror image, and how it is to be laid out.
pub struct Task<'a, 'w> {
    pub config: &'a LayoutConfig,
    /// How much of what the bound allows is for cutting.
    pub share: f64,
    /// The component in its own place.
    pub placed: &'a TriangleMesh,
    /// The same in the unit of layouts.
    pub mesh: &'a TriangleMesh,
    pub pairing: &'a Pairing,
    pub plane: &'a MirrorPlane,
    pub map: Option<&'a [[f32; 2]]>,
    pub marks: &'a ComponentMarks,
    pub rates: Option<&'a [f64]>,
    pub watch: &'a Watch<'w>,
}

/// Charts of the component of number `own`, with their mirror images; none if that leads to no valid
/// layout within the bound.
pub fn charts_of_both_halves(task: &Task, own: usize) -> Option<(Vec<FlatChart>, Vec<Mirror>)> {
    if task.marks.wanted.is_empty()
        && let Some(flat) = flat_chart(task.mesh)
    {
        let (chart, mirror) = evened_chart(task, flat)?;
        return Some((vec![chart], vec![mirror]));
    }
    let sides = Sides::of(task);
    let middle = sides.middle(task)?;
    let mut best: Option<Found> = None;
    let shares: &[f64] = match task.config.stack {
        // They are not joined, so nothing has to be left for it.
        Stack::Mirrored => &[1.0],
        Stack::None | Stack::Identical => &SHARES,
    };
    for share in shares {
        if best.is_some() && !task.watch.goes_on() {
            break;
        }
        let found = sides.both(task, share * task.share);
        let Some(found) = found else { continue };
        if best.as_ref().is_none_or(|best| found.seams < best.seams) {
            best = Some(found);
        }
    }
    let best = best?;
    let (mut charts, mut mirrors) = (Vec::new(), Vec::new());
    for group in best.groups {
        match group {
            Group::Joined(chart, images) => {
                charts.push(chart);
                mirrors.push(Mirror::Own(images));
            }
            Group::Apart(chart, image) => {
                charts.push(chart);
                mirrors.push(Mirror::None);
                charts.push(image);
                mirrors.push(Mirror::Of {
                    component: own,
                    chart: charts.len() - 2,
                });
            }
        }
    }
    for (chart, mirror) in middle {
        charts.push(chart);
        mirrors.push(mirror);
    }
    Some((charts, mirrors))
}

/// A chart of the half.
enum Group {
    /// Joined with its image.
    Joined(FlatChart, Vec<u32>),
    /// With its image by itself.
    Apart(FlatChart, FlatChart),
}

/// A symmetric layout of all but what lies across the plane.
struct Found {
    groups: Vec<Group>,
    /// How long the seams are.
    seams: f64,
}

/// On which side of the plane every triangle is.
struct Sides {
    half: Vec<u32>,
    image: Vec<u32>,
    /// Those that are their own mirror images, alone or with another in a quad.
    across: Vec<u32>,
    /// The first triangle of the face that every one belongs to.
    faces: Vec<u32>,
}

impl Sides {
    fn of(task: &Task) -> Self {
        let corners = &task.pairing.corners;
        let mut sets = Sets::new(corners.len());
        for own in corners {
            for corner in own {
                sets.join(own[0] / 3, corner / 3);
            }
        }
        sets.settle();
        let faces: Vec<u32> = (0..corners.len() as u32).map(|t| sets.find(t)).collect();
        let mut heights = vec![0.0; corners.len()];
        for (&face, t) in faces.iter().zip(0..) {
            let all = task.placed.corners(t).map(|p| 1e-3 * task.plane.height(p));
            heights[face as usize] += all.iter().sum::<f64>();
        }
        let (mut half, mut image, mut across) = (Vec::new(), Vec::new(), Vec::new());
        for (&face, t) in faces.iter().zip(0..) {
            let other = faces[corners[t as usize][0] as usize / 3];
            let [own, theirs] = [face, other].map(|face| heights[face as usize]);
            if face == other {
                across.push(t);
            } else if own > theirs || (own == theirs && face < other) {
                half.push(t);
            } else {
                image.push(t);
            }
        }
        Self {
            half,
            image,
            across,
            faces,
        }
    }

    /// What lies across the plane, as charts that are symmetric.
    fn middle(&self, task: &Task) -> Option<Vec<(FlatChart, Mirror)>> {
        let mut found = Vec::new();
        for part in pieces(task.mesh, &self.across) {
            for chart in self.charts(task, &part, task.share) {
                found.push(evened_chart(task, chart)?);
            }
        }
        Some(found)
    }

    /// The half, cut so far, and its image.
    fn both(&self, task: &Task, share: f64) -> Option<Found> {
        let mut charts = Vec::new();
        for part in pieces(task.mesh, &self.half) {
            charts.extend(self.charts(task, &part, share));
        }
        let winding = Winding::of(task.mesh);
        let charts: Vec<FlatChart> = charts.into_iter().map(|c| winding.righted(c)).collect();
        let images = images(task.mesh, &charts, &self.image, task.pairing)?;
        let allowed = Distortion::allowed(task.config.distortion_bound);
        if !is_within(task, &images, &charts, &allowed) {
            return None;
        }
        // A chart that is joined with its image cannot share the place of that.
        let may_be_joined = task.config.stack != Stack::Mirrored;
        let pairs = charts.into_par_iter().zip(images);
        let groups: Vec<Group> = pairs
            .map(|(chart, image)| {
                let joined = may_be_joined.then(|| hinged(task, &chart, &image, &allowed));
                match joined.flatten() {
                    Some((joined, images)) => Group::Joined(joined, images),
                    None => Group::Apart(chart, image),
                }
            })
            .collect();
        let seams = seams(task.mesh, &groups);
        Some(Found { groups, seams })
    }

    /// Charts of a part by itself. Marks on either side of the plane count, and the two triangles of a
    /// quad stay together.
    fn charts(&self, task: &Task, part: &Part, share: f64) -> Vec<FlatChart> {
        let image = |v: u32| task.pairing.images[part.vertices[v as usize] as usize];
        let own = |v: u32| part.vertices[v as usize];
        let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
        let is_marked = |marked: &HashSet<[u32; 2]>, [a, b]: [u32; 2]| {
            let there = image(a).zip(image(b)).map(|(a, b)| ordered(a, b));
            marked.contains(&ordered(own(a), own(b)))
                || there.is_some_and(|there| marked.contains(&there))
        };
        let edges = || {
            let triangles = part.mesh.triangles().iter();
            triangles.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        };
        let chosen = |marked: &HashSet<[u32; 2]>| -> HashSet<[u32; 2]> {
            let all = edges().filter(|&edge| !marked.is_empty() && is_marked(marked, edge));
            all.map(|[a, b]| ordered(a, b)).collect()
        };
        let mut marks = ComponentMarks {
            wanted: chosen(&task.marks.wanted),
            forbidden: chosen(&task.marks.forbidden),
            hard: chosen(&task.marks.hard),
        };
        marks.forbidden.extend(self.diagonals(part));
        let charts = match flat_chart(&part.mesh).filter(|_| marks.wanted.is_empty()) {
            Some(chart) => vec![chart],
            None => {
                let map = task.map.map(|map| at_vertices(part, map));
                let rates = task.rates.map(|rates| {
                    let rate = |v: u32| rates[v as usize];
                    let mean = |&v: &u32| {
                        let image = task.pairing.images[v as usize].unwrap_or(v);
                        0.5 * (rate(v) + rate(image))
                    };
                    part.vertices.iter().map(mean).collect::<Vec<f64>>()
                });
                // What there may be of charts is shared with the image.
                let config = LayoutConfig {
                    max_charts: task.config.max_charts.map(|most| most.div_ceil(2)),
                    ..task.config.clone()
                };
                let (map, rates) = (map.as_deref(), rates.as_deref());
                flat_charts(&config, share, &part.mesh, map, &marks, rates, task.watch)
            }
        };
        let placed = charts.into_iter().map(|mut chart| {
            for t in &mut chart.source {
                *t = part.triangles[*t as usize];
            }
            chart
        });
        placed.collect()
    }

    /// The edges inside of faces of two triangles.
    fn diagonals(&self, part: &Part) -> Vec<[u32; 2]> {
        let across = across(part.mesh.triangles());
        let face = |h: u32| self.faces[part.triangles[h as usize / 3] as usize];
        let inner = (0..across.len() as u32).filter(|&h| {
            let twin = across[h as usize];
            twin != NONE && h < twin && face(h) == face(twin)
        });
        inner
            .map(|h| {
                let corners = part.mesh.triangles()[h as usize / 3];
                let [a, b] = [0, 1].map(|k| corners[(h as usize + k) % 3]);
                [a.min(b), a.max(b)]
            })
            .collect()
    }
}

fn at_vertices<T: Copy>(part: &Part, values: &[T]) -> Vec<T> {
    part.vertices.iter().map(|&v| values[v as usize]).collect()
}

/// Whether the mirror images of charts are within what is allowed, or as good as what they are images of.
fn is_within(
    task: &Task,
    images: &[FlatChart],
    charts: &[FlatChart],
    allowed: &Distortion,
) -> bool {
    let areas = task.mesh.triangle_areas();
    let energy = |charts: &[FlatChart]| {
        let one = |chart: &FlatChart| {
            let area = chart.source.iter().map(|&t| areas[t as usize]).sum();
            (chart.distortion, area, chart.source.len())
        };
        Distortion::together(&charts.iter().map(one).collect::<Vec<_>>()).energy
    };
    let [theirs, own] = [images, charts].map(energy);
    theirs <= allowed.energy.max(own + ROUNDING)
}

/// The connected parts of some triangles of a mesh, the first triangle's first.
fn pieces(mesh: &TriangleMesh, chosen: &[u32]) -> Vec<Part> {
    let triangles: Vec<[u32; 3]> = chosen
        .iter()
        .map(|&t| mesh.triangles()[t as usize])
        .collect();
    let mut sets = Sets::new(triangles.len());
    for (&twin, h) in across(&triangles).iter().zip(0..) {
        if twin != NONE {
            sets.join(h / 3, twin / 3);
        }
    }
    sets.settle();
    let mut members: HashMap<u32, Vec<u32>> = HashMap::new();
    for (&t, i) in chosen.iter().zip(0..) {
        members.entry(sets.find(i)).or_default().push(t);
    }
    let mut members: Vec<Vec<u32>> = members.into_values().collect();
    members.sort_unstable();
    let whole = Part {
        mesh: mesh.clone(),
        vertices: (0..mesh.positions().len() as u32).collect(),
        triangles: (0..mesh.triangles().len() as u32).collect(),
        placed: None,
    };
    members
        .iter()
        .filter_map(|chosen| whole.subset(chosen))
        .collect()
}

/// A chart that is its own mirror image, made exactly symmetric; none if it is not, or not valid then.
fn evened_chart(task: &Task, chart: FlatChart) -> Option<(FlatChart, Mirror)> {
    let mut points: HashMap<u32, u32> = HashMap::new();
    for (&t, corners) in chart.source.iter().zip(&chart.triangles) {
        for (&point, c) in corners.iter().zip(0..) {
            points.insert(3 * t + c, point);
        }
    }
    let mut images: Vec<Option<u32>> = vec![None; chart.uvs.len()];
    for (&t, corners) in chart.source.iter().zip(&chart.triangles) {
        for (&point, corner) in corners.iter().zip(task.pairing.corners[t as usize]) {
            let image = *points.get(&corner)?;
            if *images[point as usize].get_or_insert(image) != image {
                return None;
            }
        }
    }
    let images: Vec<u32> = images.into_iter().collect::<Option<_>>()?;
    if (0..)
        .zip(&images)
        .any(|(point, &image)| images[image as usize] != point)
    {
        return None;
    }
    let winding = Winding::of(task.mesh);
    let mut chart = winding.righted(chart);
    chart.uvs = evened(&chart.uvs, &images);
    if !winding.is_positive(&chart) {
        return None;
    }
    chart.distortion = judged(task.mesh, &chart)?;
    Some((chart, Mirror::Own(images)))
}

/// The length of the edges at which charts end, less that of the mesh's own boundary: twice that of the
/// seams.
fn seams(mesh: &TriangleMesh, groups: &[Group]) -> f64 {
    let charts = groups.iter().flat_map(|group| match group {
        Group::Joined(chart, _) => vec![chart],
        Group::Apart(chart, image) => vec![chart, image],
    });
    let ends = |chart: &FlatChart| -> f64 {
        surface(mesh, chart).map_or(0.0, |surface| {
            let across = across(surface.triangles());
            let alone = (0..across.len()).filter(|&h| across[h] == NONE);
            let side = |h: usize| {
                let corners = surface.corners(h / 3);
                let [a, b] = [corners[h % 3], corners[(h + 1) % 3]];
                length(sub(a, b))
            };
            alone.map(side).sum()
        })
    };
    charts.map(ends).sum()
}
