use fam_surface::neighbors::nearest_others;
use fam_surface::plane::{Plane, frame};
use fam_surface::vector::{dot, length, scale, sub};
use rayon::prelude::*;

/// How many neighbours of a point are looked at. Where other sheets come within twice the
/// spacing, a third of them is on the own sheet.
const NEIGHBORS: usize = 32;

/// The nearest among them that say how far points are apart.
const NEAREST: usize = 6;

/// The nearest of whose spacings the median is taken.
const MEDIAN: usize = 12;

/// A neighbour is along the map if its UV is not farther than this many times what the UVs
/// of the nearest suggest.
const STRETCH: f64 = 4.0;

/// What a neighbour counts for a normal if it is not along the map.
const OFF_MAP: f64 = 0.1;

/// How steep a neighbour may lie over the tangent plane, if it is along the map and if not.
const SLOPES: [f64; 2] = [1.7, 0.7];

/// Offset from the tangent plane, in spacings, that noise may cause.
const NOISE: f64 = 0.4;

/// How often the normals of neighbours are tried.
const ROUNDS: usize = 2;

/// The points of a cloud, their neighbours, and the plane that each is thought to lie on.
pub(super) struct Neighborhood<'a> {
    pub(super) points: &'a [[f64; 3]],
    uvs: &'a [[f32; 2]],
    neighbors: Vec<u32>,
    /// How many neighbours every point has.
    count: usize,
    /// Distance between neighbouring points: the root of the area per point.
    pub(super) spacing: Vec<f64>,
    /// UV length per length among the nearest neighbours.
    uv_scale: Vec<f64>,
    /// Two unit vectors along the plane and its normal.
    pub(super) frames: Vec<[[f64; 3]; 3]>,
}

impl<'a> Neighborhood<'a> {
    /// Of points that are at least three and distinct, and their UVs. `goes_on` is asked between the
    /// steps; none if it says no.
    pub(super) fn of(
        points: &'a [[f64; 3]],
        uvs: &'a [[f32; 2]],
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Self> {
        let count = NEIGHBORS.min(points.len() - 1);
        let neighbors = nearest_others(&centred(points), count);
        let mut of = Self {
            points,
            uvs,
            neighbors,
            count,
            spacing: Vec::new(),
            uv_scale: Vec::new(),
            frames: Vec::new(),
        };
        let all = || (0..points.len() as u32).into_par_iter();
        if !goes_on() {
            return None;
        }
        of.spacing = all().map(|p| of.own_spacing(p)).collect();
        of.spacing = all().map(|p| of.usual_spacing(p)).collect();
        of.uv_scale = all().map(|p| of.uv_scale_at(p)).collect();
        let mut normals: Vec<[f64; 3]> = all().map(|p| of.nearest_normal(p)).collect();
        for _ in 0..ROUNDS {
            if !goes_on() {
                return None;
            }
            normals = all().map(|p| of.best_normal(p, &normals)).collect();
        }
        of.frames = normals.into_iter().map(frame).collect();
        Some(of)
    }

    /// The neighbours of a point, nearest first.
    pub(super) fn around(&self, p: u32) -> &[u32] {
        &self.neighbors[p as usize * self.count..][..self.count]
    }

    /// From one point to another, along the frame of the first.
    pub(super) fn local(&self, from: u32, to: u32) -> [f64; 3] {
        let step = self.step(from, to);
        self.frames[from as usize].map(|axis| dot(axis, step))
    }

    /// Whether the UV of a neighbour is about as far as its distance suggests.
    pub(super) fn along_map(&self, from: u32, to: u32) -> bool {
        let step = self.step(from, to);
        let farthest = STRETCH * self.uv_scale[from as usize];
        self.squared_uv_distance(from, to) <= farthest * farthest * dot(step, step)
    }

    /// The few that are nearest to a point.
    fn nearest(&self, p: u32) -> &[u32] {
        &self.around(p)[..NEAREST.min(self.count)]
    }

    /// Whether a neighbour lies too far above or below the tangent plane of a point to be on
    /// the same sheet.
    pub(super) fn is_steep(&self, from: u32, to: u32) -> bool {
        let [x, y, z] = self.local(from, to);
        let slope = SLOPES[usize::from(!self.along_map(from, to))];
        z.abs() > slope * (x * x + y * y).sqrt() + NOISE * self.spacing[from as usize]
    }

    fn step(&self, from: u32, to: u32) -> [f64; 3] {
        sub(self.points[to as usize], self.points[from as usize])
    }

    fn squared_uv_distance(&self, a: u32, b: u32) -> f64 {
        let [a, b] = [a, b].map(|i| self.uvs[i as usize].map(f64::from));
        (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
    }

    /// A disk around a point that has `n` others inside has the area of `n` points and a half.
    fn own_spacing(&self, p: u32) -> f64 {
        let nearest = self.nearest(p);
        let farthest = nearest
            .iter()
            .fold(0.0, |d: f64, &q| d.max(length(self.step(p, q))));
        farthest * (std::f64::consts::PI / (nearest.len() as f64 + 0.5)).sqrt()
    }

    /// The median among the neighbours: that of a point off the surface is much less than its
    /// own.
    fn usual_spacing(&self, p: u32) -> f64 {
        let mut spacings: Vec<f64> = self.around(p)[..MEDIAN.min(self.count)]
            .iter()
            .map(|&q| self.spacing[q as usize])
            .collect();
        spacings.sort_by(f64::total_cmp);
        spacings[spacings.len() / 2]
    }

    /// A low quantile, as others may be across a tear or on another sheet.
    fn uv_scale_at(&self, p: u32) -> f64 {
        let mut scales: Vec<f64> = self.around(p)[..MEDIAN.min(self.count)]
            .iter()
            .map(|&q| self.squared_uv_distance(p, q).sqrt() / length(self.step(p, q)))
            .collect();
        scales.sort_by(f64::total_cmp);
        scales[scales.len() / 5]
    }

    /// The steps to a point and its neighbours, in spacings, and what each counts.
    fn weighted_steps(&self, p: u32) -> Vec<([f64; 3], f64)> {
        let unit = 1.0 / self.spacing[p as usize];
        let weight = |q: u32| if self.along_map(p, q) { 1.0 } else { OFF_MAP };
        let neighbors = self.around(p).iter();
        neighbors
            .map(|&q| (scale(self.step(p, q), unit), weight(q)))
            .chain([([0.0; 3], 1.0)])
            .collect()
    }

    /// The normal of the plane that fits the nearest.
    fn nearest_normal(&self, p: u32) -> [f64; 3] {
        let steps = self.weighted_steps(p);
        Plane::fit(steps.iter().map(|&(step, w)| (step, w * bell(step, 1.0)))).normal
    }

    /// Of the planes that a point and the nearest have the one that most neighbours are on,
    /// fitted to these.
    fn best_normal(&self, p: u32, normals: &[[f64; 3]]) -> [f64; 3] {
        let mut steps = self.weighted_steps(p);
        for (step, weight) in &mut steps {
            *weight *= bell(*step, 2.0);
        }
        let on = |plane: &Plane, step: [f64; 3]| {
            let off = 2.0 * dot(plane.normal, sub(step, plane.centre));
            1.0 / (1.0 + off * off).powi(2)
        };
        let support = |plane: &Plane| steps.iter().map(|&(step, w)| w * on(plane, step)).sum();
        let through = |q: u32| Plane {
            centre: [0.0; 3],
            normal: normals[q as usize],
        };
        let mut best = (through(p), support(&through(p)));
        for plane in self.nearest(p).iter().map(|&q| through(q)) {
            let support: f64 = support(&plane);
            if support > best.1 {
                best = (plane, support);
            }
        }
        let mut plane = best.0;
        for _ in 0..2 {
            plane = Plane::fit(steps.iter().map(|&(step, w)| (step, w * on(&plane, step))));
        }
        plane.normal
    }
}

/// Falls off with the distance from the origin.
fn bell(step: [f64; 3], width: f64) -> f64 {
    (-dot(step, step) / (width * width)).exp()
}

/// In single precision, about the median of all, which points far away do not move.
fn centred(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    let middle = [0, 1, 2].map(|axis| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        *values
            .select_nth_unstable_by(points.len() / 2, f64::total_cmp)
            .1
    });
    points
        .iter()
        .map(|&p| sub(p, middle).map(|c| c as f32))
        .collect()
}
