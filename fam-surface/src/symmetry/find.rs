//! The mirror plane of a surface, found from its geometry.

use std::collections::{BTreeMap, HashSet};

use super::MirrorPlane;
use super::samples::{Frame, Samples};
use crate::TriangleMesh;
use crate::plane::{axes, least_axis};
use crate::vector::{add, dot, length, normalize, scale, sub};

/// How far from the surface its mirror image may lie, as a share of the diagonal of its bounding box.
/// Faces and animals that were scanned are symmetric to about half of this.
pub const TOLERANCE: f64 = 0.015;

/// The share of the area whose mirror image lies within [`TOLERANCE`], from which on a surface counts as
/// symmetric.
pub const LEAST_SHARE: f64 = 0.9;

/// A plane is no mirror plane if less than this share of the area lies farther from it than the
/// tolerance: a sheet is not symmetric for lying in a plane.
const LEAST_AWAY: f64 = 0.3;

/// Every so many-th sample is looked at: for a first choice, for fitting, and for judging.
const COARSE: usize = 32;
const FITTED: usize = 16;
const JUDGED: usize = 6;

/// How many candidates are fitted, and in how many steps.
const BEST: usize = 6;
const STEPS: usize = 14;

/// Pairs of every so many-th sample vote for the planes between them.
const VOTERS: usize = 48;
/// How near to the centre of the area the plane of a vote passes, in the frame's units.
const NEAR_CENTRE: f64 = 0.04;
/// The cosine of the angle by which the mirrored normal at one sample may differ from that at the other.
const ALIKE: f64 = 0.97;
/// Cells for directions along half an axis.
const CELLS: f64 = 8.0;
/// How many of the directions with the most votes are tried.
const ELECTED: usize = 12;

/// A fitted plane whose normal is nearer to an axis than this (the sine of the angle) is tried across
/// that axis.
const NEAR_AXIS: f64 = 0.03;

/// The share that a plane across an axis may be worse and is taken all the same.
const FAVOR: f64 = 0.01;

/// How well a plane mirrors a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// The share of the area that lies away from the plane whose mirror image lies within [`TOLERANCE`]
    /// of the surface.
    pub share: f64,
    /// The mean distance of the mirror image from the surface, as a share of the diagonal of its
    /// bounding box.
    pub deviation: f64,
}

impl Judgement {
    /// Whether that is a symmetry.
    pub fn is_symmetric(&self) -> bool {
        self.share >= LEAST_SHARE
    }
}

/// The plane at which a surface is its own mirror image, to a [`TOLERANCE`]. `None` if there is none.
///
/// Where all vertices of a mesh have mirror images among them to the last bit, the plane is across an
/// axis: the first for which that holds. Otherwise planes through the middle are tried: across axes,
/// across the axes of inertia, and those that many pairs of points lie on either side of. The best ones
/// are fitted to the surface. One across an axis is taken before others that are hardly better.
pub fn find(mesh: &TriangleMesh) -> Option<MirrorPlane> {
    if let Some(plane) = exact(mesh) {
        return Some(plane);
    }
    let frame = Frame::of(mesh);
    let samples = Samples::of(mesh, &frame)?;
    let mut candidates: Vec<(f64, Inside)> = candidates(&samples, &frame)
        .into_iter()
        .map(|plane| (likeness(&samples, &frame, &plane, COARSE), plane))
        .collect();
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fitted = candidates.iter().take(BEST).map(|(_, plane)| {
        let plane = fitted(&samples, &frame, *plane);
        (likeness(&samples, &frame, &plane, JUDGED), plane)
    });
    let fitted: Vec<(f64, Inside)> = fitted.collect();
    let upright = fitted
        .iter()
        .flat_map(|(_, plane)| upright(plane, &frame))
        .map(|plane| (likeness(&samples, &frame, &plane, JUDGED) + FAVOR, plane));
    let all = fitted.iter().copied().chain(upright);
    let (_, best) = all.reduce(|best, one| if one.0 > best.0 { one } else { best })?;
    let plane = best.outside(&frame)?;
    judgement(&samples, &frame, &best)?
        .is_symmetric()
        .then_some(plane)
}

/// The plane across an axis that mirrors a mesh best: at the origin or at the middle of its bounding
/// box if it is symmetric there, otherwise where it was fitted.
pub fn coordinate_plane(mesh: &TriangleMesh, axis: usize) -> MirrorPlane {
    let frame = Frame::of(mesh);
    let middle = MirrorPlane::across(axis, frame.center[axis]);
    let mirrored = Mirrored::of(mesh);
    let exact = [MirrorPlane::across(axis, 0.0), middle];
    if let Some(plane) = exact
        .into_iter()
        .find(|plane| mirrored.is_exact(mesh, plane))
    {
        return plane;
    }
    let Some(samples) = Samples::of(mesh, &frame) else {
        return middle;
    };
    let normal = MirrorPlane::across(axis, 0.0).normal();
    let at = |offset: f64| Inside { normal, offset };
    let mut fitted = at(dot(samples.centroid, normal));
    for _ in 0..STEPS {
        match between(&pairs(&samples, &frame, &fitted)) {
            Some((_, p)) => fitted = Inside::through(normal, p),
            None => break,
        }
    }
    let origin = at(frame.offset_inside(normal, 0.0));
    let all = [origin, at(0.0), fitted].map(|plane| {
        let favor = if plane == fitted { 0.0 } else { FAVOR };
        (likeness(&samples, &frame, &plane, JUDGED) + favor, plane)
    });
    let best = all
        .into_iter()
        .reduce(|best, one| if one.0 > best.0 { one } else { best });
    let outside = best.and_then(|(_, plane)| plane.outside(&frame));
    outside.unwrap_or(middle)
}

/// How well a plane mirrors a surface; `None` if that has no area, or hardly any away from the plane.
pub fn judged(mesh: &TriangleMesh, plane: &MirrorPlane) -> Option<Judgement> {
    let frame = Frame::of(mesh);
    let samples = Samples::of(mesh, &frame)?;
    let normal = plane.normal();
    let inside = Inside {
        normal,
        offset: frame.offset_inside(normal, plane.offset()),
    };
    judgement(&samples, &frame, &inside)
}

/// A plane in the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Inside {
    normal: [f64; 3],
    offset: f64,
}

impl Inside {
    fn through(normal: [f64; 3], p: [f64; 3]) -> Self {
        Self {
            normal,
            offset: dot(normal, p),
        }
    }

    fn height(&self, p: [f64; 3]) -> f64 {
        dot(self.normal, p) - self.offset
    }

    fn reflected(&self, p: [f64; 3]) -> [f64; 3] {
        sub(p, scale(self.normal, 2.0 * self.height(p)))
    }

    fn outside(&self, frame: &Frame) -> Option<MirrorPlane> {
        let Self { normal, offset } = *self;
        MirrorPlane::new(normal, frame.offset_outside(normal, offset))
    }
}

/// The used vertices of a mesh by their positions, to the last bit.
struct Mirrored {
    used: Vec<u32>,
    places: HashSet<[u64; 3]>,
}

impl Mirrored {
    fn of(mesh: &TriangleMesh) -> Self {
        let used = mesh.used_vertices();
        let place = |&v: &u32| bits(mesh.positions()[v as usize]);
        Self {
            places: used.iter().map(place).collect(),
            used,
        }
    }

    /// Whether every vertex has its mirror image, and they do not all lie on the plane.
    fn is_exact(&self, mesh: &TriangleMesh, plane: &MirrorPlane) -> bool {
        let at = |&v: &u32| mesh.positions()[v as usize];
        let has_image = |v: &u32| self.places.contains(&bits(plane.reflected(at(v))));
        self.used.iter().all(has_image) && self.used.iter().any(|v| plane.height(at(v)) != 0.0)
    }
}

/// A position by its bits, 0 and −0 being one.
pub(super) fn bits(p: [f64; 3]) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}

/// The first plane across an axis at which every vertex has its mirror image to the last bit.
fn exact(mesh: &TriangleMesh) -> Option<MirrorPlane> {
    let mirrored = Mirrored::of(mesh);
    let center = Frame::of(mesh).center;
    (0..3)
        .flat_map(|k| [0.0, center[k]].map(|at| MirrorPlane::across(k, at)))
        .find(|plane| mirrored.is_exact(mesh, plane))
}

fn candidates(samples: &Samples, frame: &Frame) -> Vec<Inside> {
    let unit = |k: usize| MirrorPlane::across(k, 0.0).normal();
    let origin = |k: usize| frame.offset_inside(unit(k), 0.0);
    let upright = (0..3).flat_map(|k| {
        let offsets = [0.0, origin(k), samples.centroid[k]];
        offsets.map(|offset| Inside {
            normal: unit(k),
            offset,
        })
    });
    let mut moments = [[0.0; 3]; 3];
    for &p in &samples.points {
        let d = sub(p, samples.centroid);
        for i in 0..3 {
            moments[i] = add(moments[i], scale(d, d[i]));
        }
    }
    let across = axes(moments).into_iter().chain(elected(samples));
    let across = across.map(|normal| Inside::through(normal, samples.centroid));
    upright.chain(across).collect()
}

/// The directions that lie between most pairs of points with mirrored normals.
fn elected(samples: &Samples) -> Vec<[f64; 3]> {
    let voters: Vec<usize> = (0..samples.points.len()).step_by(VOTERS).collect();
    let mut votes: BTreeMap<[i32; 3], (u32, [f64; 3])> = BTreeMap::new();
    for (i, &a) in voters.iter().enumerate() {
        for &b in &voters[..i] {
            let (p, q) = (samples.points[a], samples.points[b]);
            let normal = normalize(sub(p, q));
            let middle = scale(add(p, q), 0.5);
            if normal == [0.0; 3] || dot(normal, sub(middle, samples.centroid)).abs() > NEAR_CENTRE
            {
                continue;
            }
            let [m, n] = [a, b].map(|i| samples.normals[i]);
            let image = sub(m, scale(normal, 2.0 * dot(m, normal)));
            if dot(image, n).abs() < ALIKE {
                continue;
            }
            let cell = normal.map(|c| (c * CELLS).round() as i32);
            let (cell, normal) = match cell < [0; 3] {
                true => (cell.map(|c| -c), scale(normal, -1.0)),
                false => (cell, normal),
            };
            let (count, sum) = votes.entry(cell).or_default();
            *count += 1;
            *sum = add(*sum, normal);
        }
    }
    let mut found: Vec<(u32, [f64; 3])> = votes.into_values().collect();
    found.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    let best = found.into_iter().take(ELECTED);
    best.map(|(_, sum)| normalize(sum)).collect()
}

/// From 0 to 1, how much alike a surface and its mirror image are; also a plane that is nearly right gets
/// something.
fn likeness(samples: &Samples, frame: &Frame, plane: &Inside, step: usize) -> f64 {
    let reach = 2.0 * TOLERANCE * frame.diagonal;
    let distances = distances(samples, frame, plane, step);
    let away = distances.len() as f64;
    let all = samples.points.len().div_ceil(step) as f64;
    if away < LEAST_AWAY * all {
        return 0.0;
    }
    let near = |d: f64| (1.0 - d / reach).max(0.0);
    distances.into_iter().map(near).sum::<f64>() / away
}

fn judgement(samples: &Samples, frame: &Frame, plane: &Inside) -> Option<Judgement> {
    let distances = distances(samples, frame, plane, JUDGED);
    let away = distances.len() as f64;
    if away < LEAST_AWAY * samples.points.len().div_ceil(JUDGED) as f64 {
        return None;
    }
    let within = |d: &&f64| **d <= TOLERANCE * frame.diagonal;
    Some(Judgement {
        share: distances.iter().filter(within).count() as f64 / away,
        deviation: distances.iter().sum::<f64>() / away / frame.diagonal,
    })
}

/// How far the mirror images of samples lie from the surface; of those that lie away from the plane.
fn distances(samples: &Samples, frame: &Frame, plane: &Inside, step: usize) -> Vec<f64> {
    let is_away = |p: &[f64; 3]| plane.height(*p).abs() > TOLERANCE * frame.diagonal;
    let images: Vec<[f64; 3]> = samples
        .every(step)
        .filter(is_away)
        .map(|p| plane.reflected(p))
        .collect();
    let nearest = samples.nearest(&images);
    let apart = images.iter().zip(nearest);
    apart
        .map(|(&image, near)| length(sub(image, near)))
        .collect()
}

/// A plane fitted to the surface, step by step.
fn fitted(samples: &Samples, frame: &Frame, mut plane: Inside) -> Inside {
    for _ in 0..STEPS {
        match between(&pairs(samples, frame, &plane)) {
            Some((normal, p)) => plane = Inside::through(normal, p),
            None => break,
        }
    }
    plane
}

/// Samples with the points of the surface that are nearest to their images. Far ones are left out.
fn pairs(samples: &Samples, frame: &Frame, plane: &Inside) -> Vec<([f64; 3], [f64; 3])> {
    let reach = 6.0 * TOLERANCE * frame.diagonal;
    let points: Vec<[f64; 3]> = samples.every(FITTED).collect();
    let images: Vec<[f64; 3]> = points.iter().map(|&p| plane.reflected(p)).collect();
    let nearest = samples.nearest(&images);
    let pairs = points.into_iter().zip(images).zip(nearest);
    pairs
        .filter(|((_, image), near)| length(sub(*image, *near)) < reach)
        .map(|((p, _), near)| (p, near))
        .collect()
}

/// The plane that mirrors the first points of pairs best to the second ones: its normal, and a point on
/// it. `None` if there are too few.
fn between(pairs: &[([f64; 3], [f64; 3])]) -> Option<([f64; 3], [f64; 3])> {
    if pairs.len() < 8 {
        return None;
    }
    let count = 1.0 / pairs.len() as f64;
    let sums = pairs.iter().fold(([0.0; 3], [0.0; 3]), |(a, b), (p, q)| {
        (add(a, *p), add(b, *q))
    });
    let (mean, image) = (scale(sums.0, count), scale(sums.1, count));
    // |q − R p|² summed up is least where nᵀ M n is, with the symmetric part M of the sum of p qᵀ.
    let mut moments = [[0.0; 3]; 3];
    for (p, q) in pairs {
        let (p, q) = (sub(*p, mean), sub(*q, image));
        for i in 0..3 {
            for k in 0..3 {
                moments[i][k] += 0.5 * count * (p[i] * q[k] + p[k] * q[i]);
            }
        }
    }
    Some((least_axis(moments), scale(add(mean, image), 0.5)))
}

/// Planes across the axis that a plane's normal is nearest to, if it is near: where the plane is, at the
/// origin and at the middle of the bounding box.
fn upright(plane: &Inside, frame: &Frame) -> Vec<Inside> {
    let axis = (0..3).find(|&k| {
        let along = plane.normal[k];
        (1.0 - along * along).max(0.0).sqrt() < NEAR_AXIS
    });
    let Some(axis) = axis else {
        return Vec::new();
    };
    let normal = MirrorPlane::across(axis, 0.0).normal();
    let own = plane.offset * plane.normal[axis].signum();
    [frame.offset_inside(normal, 0.0), 0.0, own]
        .map(|offset| Inside { normal, offset })
        .to_vec()
}
