//! A component that is its own mirror image, laid out by its half.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::Mirror;
use super::chart::{Winding, evened, judged, surface};
use super::hinge::hinged;
use super::images::images;
use crate::component::{FlatChart, Task, flat_charts};
use crate::distortion::Distortion;
use crate::flat::flat_chart;
use crate::marks::ComponentMarks;
use crate::part::Part;
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

/// A component that is its own mirror image, to be laid out.
pub struct Symmetric<'a, 'w> {
    pub task: Task<'a, 'w>,
    /// The component in its own place.
    pub placed: &'a TriangleMesh,
    pub pairing: &'a Pairing,
    /// Where it is its own mirror image in that place.
    pub plane: &'a MirrorPlane,
}

/// Charts of the component of number `own`, with their mirror images; none if that leads to no valid
/// layout within the bound.
pub fn charts_of_both_halves(
    symmetric: &Symmetric,
    own: usize,
) -> Option<(Vec<FlatChart>, Vec<Mirror>)> {
    if symmetric.task.marks.wanted.is_empty()
        && let Some(flat) = flat_chart(symmetric.task.mesh)
    {
        let (chart, mirror) = evened_chart(symmetric, flat)?;
        return Some((vec![chart], vec![mirror]));
    }
    let sides = Sides::of(symmetric);
    let middle = sides.middle(symmetric)?;
    let shares: &[f64] = match symmetric.task.config.stack {
        // They are not joined, so nothing has to be left for it.
        Stack::Mirrored => &[1.0],
        Stack::None | Stack::Identical => &SHARES,
    };
    let found: Vec<Option<Found>> = shares
        .par_iter()
        .map(|share| sides.both(symmetric, share * symmetric.task.share))
        .collect();
    let shorter = |best: Found, one: Found| if one.seams < best.seams { one } else { best };
    let best = found.into_iter().flatten().reduce(shorter);
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
    fn of(symmetric: &Symmetric) -> Self {
        let corners = &symmetric.pairing.corners;
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
            let all = symmetric
                .placed
                .corners(t)
                .map(|p| 1e-3 * symmetric.plane.height(p));
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
    fn middle(&self, symmetric: &Symmetric) -> Option<Vec<(FlatChart, Mirror)>> {
        let mut found = Vec::new();
        for part in pieces(symmetric.task.mesh, &self.across) {
            for chart in self.charts(symmetric, &part, symmetric.task.share) {
                found.push(evened_chart(symmetric, chart)?);
            }
        }
        Some(found)
    }

    /// The half, cut so far, and its image.
    fn both(&self, symmetric: &Symmetric, share: f64) -> Option<Found> {
        let mut charts = Vec::new();
        for part in pieces(symmetric.task.mesh, &self.half) {
            charts.extend(self.charts(symmetric, &part, share));
        }
        let winding = Winding::of(symmetric.task.mesh);
        let charts: Vec<FlatChart> = charts.into_iter().map(|c| winding.righted(c)).collect();
        let images = images(symmetric.task.mesh, &charts, &self.image, symmetric.pairing)?;
        let allowed = Distortion::allowed(symmetric.task.config.distortion_bound);
        if !is_within(symmetric, &images, &charts, &allowed) {
            return None;
        }
        // A chart that is joined with its image cannot share the place of that.
        let may_be_joined = symmetric.task.config.stack != Stack::Mirrored;
        let pairs = charts.into_par_iter().zip(images);
        let groups: Vec<Group> = pairs
            .map(|(chart, image)| {
                let joined = may_be_joined.then(|| hinged(symmetric, &chart, &image, &allowed));
                match joined.flatten() {
                    Some((joined, images)) => Group::Joined(joined, images),
                    None => Group::Apart(chart, image),
                }
            })
            .collect();
        let seams = seams(symmetric.task.mesh, &groups);
        Some(Found { groups, seams })
    }

    /// Charts of a part by itself. Marks on either side of the plane count, and the two triangles of a
    /// quad stay together.
    fn charts(&self, symmetric: &Symmetric, part: &Part, share: f64) -> Vec<FlatChart> {
        let image = |v: u32| symmetric.pairing.images[part.vertices[v as usize] as usize];
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
            wanted: chosen(&symmetric.task.marks.wanted),
            forbidden: chosen(&symmetric.task.marks.forbidden),
            hard: chosen(&symmetric.task.marks.hard),
        };
        marks.forbidden.extend(self.diagonals(part));
        let Task { map, rates, .. } = symmetric.task;
        let map = map.map(|map| at_vertices(part, map));
        let rates = rates.map(|rates| {
            let rate = |v: u32| rates[v as usize];
            let mean = |&v: &u32| {
                let image = symmetric.pairing.images[v as usize].unwrap_or(v);
                0.5 * (rate(v) + rate(image))
            };
            part.vertices.iter().map(mean).collect::<Vec<f64>>()
        });
        // What there may be of charts is shared with the image.
        let most = symmetric.task.config.max_charts;
        let config = LayoutConfig {
            max_charts: most.map(|most| most.div_ceil(2)),
            ..symmetric.task.config.clone()
        };
        let charts = flat_charts(&Task {
            config: &config,
            share,
            mesh: &part.mesh,
            map: map.as_deref(),
            marks: &marks,
            rates: rates.as_deref(),
            ..symmetric.task
        });
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
    symmetric: &Symmetric,
    images: &[FlatChart],
    charts: &[FlatChart],
    allowed: &Distortion,
) -> bool {
    let areas = symmetric.task.mesh.triangle_areas();
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
    let whole = Part::whole(mesh);
    members
        .iter()
        .filter_map(|chosen| whole.subset(chosen))
        .collect()
}

/// A chart that is its own mirror image, made exactly symmetric; none if it is not, or not valid then.
fn evened_chart(symmetric: &Symmetric, chart: FlatChart) -> Option<(FlatChart, Mirror)> {
    let mut points: HashMap<u32, u32> = HashMap::new();
    for (&t, corners) in chart.source.iter().zip(&chart.triangles) {
        for (&point, c) in corners.iter().zip(0..) {
            points.insert(3 * t + c, point);
        }
    }
    let mut images: Vec<Option<u32>> = vec![None; chart.uvs.len()];
    for (&t, corners) in chart.source.iter().zip(&chart.triangles) {
        for (&point, corner) in corners.iter().zip(symmetric.pairing.corners[t as usize]) {
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
    let winding = Winding::of(symmetric.task.mesh);
    let mut chart = winding.righted(chart);
    chart.uvs = evened(&chart.uvs, &images);
    if !winding.is_positive(&chart) {
        return None;
    }
    chart.distortion = judged(symmetric.task.mesh, &chart)?;
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
