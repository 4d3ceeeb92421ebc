//! Closed bodies: with holes, with walls, with folds.

use std::f64::consts::TAU;

use super::fields::{Point, joined, polygon, ring, rounded_rectangle, segment, shared};
use super::implicit::{closed, grown};
use super::sizes::within;
use crate::TriangleMesh;
use crate::random::Random;
use crate::vector::{dot, length, scale};

/// An edge length that keeps all features: at most `coarsest`, which also stands in for what is
/// no number, and no less than a fiftieth of it, so that the mesh stays below some ten million
/// triangles.
pub(super) fn fitting(spacing: f64, coarsest: f64) -> f64 {
    within(spacing, coarsest / 50.0, coarsest)
}

/// Two rings of radius 1 side by side, grown together: closed, genus 2. About 4.8 × 2.8 × 0.8,
/// in triangles of edges about `spacing` long; a spacing above 0.2 counts as 0.2.
pub fn double_torus(spacing: f64) -> TriangleMesh {
    let body = |[x, y, z]: Point| {
        let rings = [-1.2, 1.2].map(|centre| ring([x - centre, y, z], 1.0, 0.4));
        joined(rings[0], rings[1], 0.4)
    };
    let corners = [[-2.7, -1.5, -0.5], [2.7, 1.5, 0.5]];
    closed(&body, corners, fitting(spacing, 0.2))
}

/// A slab of 3.6 × 1.6 × 0.5 with round edges and three round holes: closed, genus 3. Edges are
/// about `spacing` long; a spacing above 0.12 counts as 0.12.
pub fn three_holed_slab(spacing: f64) -> TriangleMesh {
    let body = |[x, y, z]: Point| {
        let holes = [-1.1, 0.0, 1.1].map(|centre| (x - centre).hypot(y) - 0.35);
        let hole = holes[0].min(holes[1]).min(holes[2]);
        let outline = rounded_rectangle([x, y], [1.8, 0.8], 0.4).max(-hole);
        shared(outline, z.abs() - 0.25, 0.12)
    };
    let corners = [[-1.8, -0.8, -0.25], [1.8, 0.8, 0.25]];
    closed(&body, corners, fitting(spacing, 0.12))
}

/// A bucket with walls 0.2 thick and a bail over its mouth: closed, genus 1. About 2.2 across
/// and 3 high, in triangles of edges about `spacing` long; a spacing above 0.1 counts as 0.1.
pub fn bucket(spacing: f64) -> TriangleMesh {
    const MOUTH: f64 = 1.8;
    /// The middle of the wall: distance from the axis and height.
    const PROFILE: [[f64; 2]; 6] = [
        [0.0, 0.0],
        [0.55, 0.0],
        [0.67, 0.03],
        [0.75, 0.1],
        [0.79, 0.22],
        [1.0, MOUTH],
    ];
    let body = |[x, y, z]: Point| {
        let wall = PROFILE
            .windows(2)
            .map(|ends| segment([x.hypot(y), z], [ends[0], ends[1]]) - 0.1)
            .fold(f64::INFINITY, f64::min);
        // Half a ring, that ends in the rim.
        let above = z - MOUTH;
        let bail = if above > 0.0 {
            ring([x, above, y], 1.0, 0.12)
        } else {
            length([x.abs() - 1.0, y, above]) - 0.12
        };
        joined(wall, bail, 0.12)
    };
    let corners = [[-1.2, -1.2, -0.2], [1.2, 1.2, MOUTH + 1.2]];
    closed(&body, corners, fitting(spacing, 0.1))
}

/// A nail, 3 long: a round head, a shaft, a point. Closed, genus 0, in triangles of edges about
/// `spacing` long; a spacing above 0.06 counts as 0.06.
pub fn nail(spacing: f64) -> TriangleMesh {
    /// How round its edges are.
    const ROUND: f64 = 0.04;
    /// Half its outline, less what the rounding adds: distance from the axis and height.
    const OUTLINE: [[f64; 2]; 4] = [[0.4, 0.0], [0.4, -0.1], [0.12, -0.1], [0.12, -2.45]];
    const TIP: f64 = -2.9;
    let mirrored = OUTLINE.iter().rev().map(|&[r, z]| [-r, z]);
    let whole: Vec<[f64; 2]> = OUTLINE
        .into_iter()
        .chain([[0.0, TIP]])
        .chain(mirrored)
        .collect();
    let body = |[x, y, z]: Point| polygon([x.hypot(y), z], &whole) - ROUND;
    let corners = [[-0.5, -0.5, TIP - 0.1], [0.5, 0.5, 0.1]];
    closed(&body, corners, fitting(spacing, 0.06))
}

/// An ellipsoid of radii 1, 0.8 and 0.72 with winding folds about 0.15 deep, and a deeper one
/// between its two halves: closed, genus 0. The seed says where the folds run. Edges are about
/// `spacing` long; a spacing above 0.05 counts as 0.05.
pub fn brain(spacing: f64, seed: u64) -> TriangleMesh {
    const RADII: Point = [1.0, 0.8, 0.72];
    /// Folds lie where a sum of so many waves of random directions and phases is about zero.
    const WAVES: usize = 40;
    /// Radians of a wave in a unit of length: folds are about 0.45 apart.
    const PITCH: f64 = 7.0;
    let mut random = Random::new(seed);
    let waves: Vec<(Point, f64)> = (0..WAVES)
        .map(|_| {
            let pitch = PITCH * random.between(0.85, 1.15);
            (scale(random.direction(), pitch), random.between(0.0, TAU))
        })
        .collect();
    // Every point is measured against the one between it and the centre, so that the surface
    // goes once around the centre whatever the folds are.
    let body = |share: f64, p: Point| {
        let reach = length([0, 1, 2].map(|k| p[k] / RADII[k])).max(1e-9);
        let foot = scale(p, 1.0 / reach);
        let sum: f64 = waves
            .iter()
            .map(|(wave, phase)| (dot(*wave, foot) + phase).cos())
            .sum();
        let height = sum * (2.0 / WAVES as f64).sqrt();
        let fold = 0.18 * (-(height / 0.6).powi(2)).exp();
        let upper = 1.0 / (1.0 + (-12.0 * (foot[2] + 0.1)).exp());
        let gap = 0.28 * upper * (-(foot[1] / 0.12).powi(2)).exp();
        (reach - (1.0 - share * fold) * (1.0 - share * gap)) * RADII[2]
    };
    let corners = [RADII.map(|r| -r), RADII];
    grown(&body, corners, fitting(spacing, 0.05))
}
