//! Surfaces around an axis.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::grid::grid;
use super::rings::rings;
use super::sizes::within;
use crate::TriangleMesh;

/// A torus around the z axis: closed, genus 1. `major` radius of the ring,
/// `minor` of the tube, `around` × `across` quads of two triangles each.
pub fn torus(major: f64, minor: f64, around: u32, across: u32) -> TriangleMesh {
    grid(around, across, [true, true], |s, t| {
        let (a, b) = (s * TAU, t * TAU);
        let ring = major + minor * b.cos();
        [ring * a.cos(), ring * a.sin(), minor * b.sin()]
    })
}

/// An open cylinder around the z axis (no caps), centred at the origin.
pub fn open_cylinder(radius: f64, height: f64, around: u32, along: u32) -> TriangleMesh {
    grid(around, along, [true, false], |s, t| {
        let a = s * TAU;
        [radius * a.cos(), radius * a.sin(), (t - 0.5) * height]
    })
}

/// A sphere of radius 1 with a circular hole at its south pole: a disk that has to be
/// stretched to lie flat. `opening` is the polar angle of the hole in radians.
pub fn open_sphere(opening: f64, around: u32, along: u32) -> TriangleMesh {
    grid(around, along, [true, false], |s, t| {
        let a = s * TAU;
        // Starts a little off the north pole: a ring instead of a fan.
        let polar = 1e-3 + (PI - opening - 1e-3) * (1.0 - t);
        [polar.sin() * a.cos(), polar.sin() * a.sin(), polar.cos()]
    })
}

/// The side of a cone around the z axis, open at the bottom (z = 0): a fan around the apex and
/// `along` − 1 rings of quads. Developable but for the apex.
pub fn cone(radius: f64, height: f64, around: u32, along: u32) -> TriangleMesh {
    let (around, along) = (around.max(3), along.max(1));
    let mut positions = vec![[0.0, 0.0, height]];
    let mut triangles = Vec::new();
    let vertex = |ring: u32, i: u32| 1 + (ring - 1) * around + i % around;
    for ring in 1..=along {
        let s = f64::from(ring) / f64::from(along);
        for i in 0..around {
            let a = TAU * f64::from(i) / f64::from(around);
            positions.push([
                s * radius * a.cos(),
                s * radius * a.sin(),
                (1.0 - s) * height,
            ]);
            if ring == 1 {
                triangles.push([0, vertex(1, i), vertex(1, i + 1)]);
            } else {
                let above = [vertex(ring - 1, i), vertex(ring - 1, i + 1)];
                let below = [vertex(ring, i), vertex(ring, i + 1)];
                triangles.push([above[0], below[0], below[1]]);
                triangles.push([above[0], below[1], above[1]]);
            }
        }
    }
    TriangleMesh::new(positions, triangles).expect("a cone is a valid mesh")
}

/// Half a sphere of radius 1, open below (z = 0), in triangles of edges about `spacing` long; a
/// spacing that is no number or outside 0.001 to 1 becomes the next in there.
pub fn hemisphere(spacing: f64) -> TriangleMesh {
    rings(within(spacing, 1e-3, 1.0), |w, a| {
        let (sin, cos) = (w * FRAC_PI_2).sin_cos();
        [sin * a.cos(), sin * a.sin(), cos]
    })
}

/// Head, neck and shoulders, about 3 high, in triangles of edges about `spacing` long, open at
/// the bottom.
pub fn bust(spacing: f64) -> TriangleMesh {
    // Distance from the axis and height, from the crown down.
    const OUTLINE: [[f64; 2]; 12] = [
        [0.0, 3.0],
        [0.35, 2.94],
        [0.6, 2.72],
        [0.7, 2.4],
        [0.66, 2.05],
        [0.5, 1.72],
        [0.36, 1.5],
        [0.36, 1.25],
        [0.55, 1.02],
        [0.95, 0.85],
        [1.2, 0.55],
        [1.22, 0.0],
    ];
    let place = |w: f64, a: f64| {
        let [radius, height] = smooth(&OUTLINE, w);
        // The shoulders are wider than deep; nose and chin stand out.
        let depth = 0.55 + 0.45 * (1.0 + (3.0 * (height - 1.2)).tanh()) / 2.0;
        let nose = 0.18 * (-((a.sin() - 1.0) / 0.08).abs() - ((height - 2.2) / 0.25).powi(2)).exp();
        [
            radius * a.cos(),
            depth * radius * a.sin()
                + if a.sin() > 0.0 {
                    nose * radius / 0.7
                } else {
                    0.0
                },
            height,
        ]
    };
    rings(spacing, place)
}

/// The point at `w` (0 to 1) on a smooth curve (Catmull and Rom's) through points.
fn smooth(points: &[[f64; 2]], w: f64) -> [f64; 2] {
    let spans = points.len() - 1;
    let at = w * spans as f64;
    let span = (at as usize).min(spans - 1);
    let t = at - span as f64;
    let point = |i: isize| points[(span as isize + i).clamp(0, spans as isize) as usize];
    let (a, b, c, d) = (point(-1), point(0), point(1), point(2));
    [0, 1].map(|k| {
        let cubic = -a[k] + 3.0 * b[k] - 3.0 * c[k] + d[k];
        let square = 2.0 * a[k] - 5.0 * b[k] + 4.0 * c[k] - d[k];
        (b[k] + 0.5 * t * (c[k] - a[k] + t * (square + t * cubic))).max(0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bust_is_a_disk_of_even_triangles() {
        let mesh = bust(0.1);
        let (v, t) = (mesh.positions().len(), mesh.triangles().len());
        let areas = mesh.triangle_areas();
        let mean = areas.iter().sum::<f64>() / t as f64;
        assert!((mean / (0.01 * 0.75_f64.sqrt() / 2.0) - 1.0).abs() < 0.2);
        assert!(areas.iter().all(|a| (0.2..4.0).contains(&(a / mean))));
        // Vertices less edges plus triangles is 1; a disk has 3 T edges, the inner ones twice.
        let last = mesh.positions().iter().filter(|p| p[2] < 1e-9).count();
        assert_eq!(2 * v - 2 - last, t);
    }
}
