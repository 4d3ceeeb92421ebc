//! Points spread evenly over a surface, in a frame of about unit size.

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::TriangleMesh;
use crate::vector::{add, cross, dot, length, normalize, scale, sub};

/// How many points stand for the surface.
const POINTS: usize = 16_000;

/// The frame in which planes are looked for: the longest side of the bounding box of all triangles is
/// 1, its centre the origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(super) center: [f64; 3],
    half_unit: f64,
    /// The diagonal of the bounding box here.
    pub(super) diagonal: f64,
}

impl Frame {
    pub(crate) fn of(mesh: &TriangleMesh) -> Self {
        let fold = |k: usize, f: fn(f64, f64) -> f64, start: f64| {
            let used = mesh.triangles().iter().flatten();
            // Halves, so that no sum overflows.
            let along = used.map(|&v| 0.5 * mesh.positions()[v as usize][k]);
            along.fold(start, f)
        };
        let low = [0, 1, 2].map(|k| fold(k, f64::min, f64::INFINITY));
        let high = [0, 1, 2].map(|k| fold(k, f64::max, f64::NEG_INFINITY));
        let sides = sub(high, low);
        let half_unit = sides.iter().fold(0.0_f64, |most, &side| most.max(side));
        let half_unit = if half_unit > 0.0 { half_unit } else { 1.0 };
        Self {
            center: add(low, high),
            half_unit,
            diagonal: length(sides.map(|side| side / half_unit)),
        }
    }

    pub(crate) fn place(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| (0.5 * p[k] - 0.5 * self.center[k]) / self.half_unit)
    }

    /// The offset in the units of the mesh of a plane in this frame.
    pub(super) fn offset_outside(&self, normal: [f64; 3], offset: f64) -> f64 {
        dot(normal, self.center) + 2.0 * (offset * self.half_unit)
    }

    /// The offset in this frame of a plane in the units of the mesh.
    pub(super) fn offset_inside(&self, normal: [f64; 3], offset: f64) -> f64 {
        (0.5 * offset - 0.5 * dot(normal, self.center)) / self.half_unit
    }
}

/// Points of a surface with the normals there.
pub(super) struct Samples {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) normals: Vec<[f64; 3]>,
    /// The mean of the points: the centre of the surface's area.
    pub(super) centroid: [f64; 3],
    /// About how far neighbours are apart.
    spacing: f64,
    tree: ImmutableKdTree<f32, 3>,
}

impl Samples {
    /// `None` without any area.
    pub(super) fn of(mesh: &TriangleMesh, frame: &Frame) -> Option<Self> {
        let corners = |t: usize| mesh.corners(t).map(|p| frame.place(p));
        let area_vector = |[a, b, c]: [[f64; 3]; 3]| cross(sub(b, a), sub(c, a));
        let mut sums = Vec::with_capacity(mesh.triangles().len());
        let mut total = 0.0;
        for t in 0..mesh.triangles().len() {
            total += 0.5 * length(area_vector(corners(t)));
            sums.push(total);
        }
        if total <= 0.0 {
            return None;
        }
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        let mut t = 0;
        for i in 0..POINTS {
            let at = (i as f64 + 0.5) / POINTS as f64 * total;
            while t + 1 < sums.len() && sums[t] < at {
                t += 1;
            }
            let [a, b, c] = corners(t);
            points.push(inside([a, b, c], i));
            normals.push(normalize(area_vector([a, b, c])));
        }
        let rounded: Vec<[f32; 3]> = points.iter().map(single).collect();
        let sum = points.iter().fold([0.0; 3], |sum, &p| add(sum, p));
        Some(Self {
            centroid: scale(sum, 1.0 / POINTS as f64),
            spacing: (total / POINTS as f64).sqrt(),
            tree: ImmutableKdTree::new_from_slice(&rounded).ok()?,
            points,
            normals,
        })
    }

    /// Every `step`-th point.
    pub(super) fn every(&self, step: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.points.iter().step_by(step).copied()
    }

    /// For every one of some points the point of the surface that is about nearest: in the plane of the
    /// nearest sample, where it is near.
    pub(super) fn nearest(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let rounded: Vec<[f32; 3]> = points.iter().map(single).collect();
        let found = self
            .tree
            .query_batch(&rounded)
            .nearest_one::<SquaredEuclidean<f32>>()
            .execute();
        found
            .iter()
            .zip(points)
            .map(|(found, &p)| {
                let (q, normal) = (
                    self.points[found.item as usize],
                    self.normals[found.item as usize],
                );
                let away = sub(p, q);
                let above = dot(away, normal);
                let along = sub(away, scale(normal, above));
                match length(along) < 2.0 * self.spacing {
                    true => sub(p, scale(normal, above)),
                    false => q,
                }
            })
            .collect()
    }
}

fn single(p: &[f64; 3]) -> [f32; 3] {
    p.map(|c| c as f32)
}

/// The `i`-th of many points that fill a triangle evenly (the sequence of Roberts' R₂).
fn inside([a, b, c]: [[f64; 3]; 3], i: usize) -> [f64; 3] {
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_2];
    let [s, t] = STEPS.map(|step| ((i as f64 + 0.5) * step).fract());
    let [s, t] = if s + t > 1.0 {
        [1.0 - s, 1.0 - t]
    } else {
        [s, t]
    };
    add(a, add(scale(sub(b, a), s), scale(sub(c, a), t)))
}
