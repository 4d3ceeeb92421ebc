//! Generated surfaces of known geometry, for a first run and for tests.

use std::f64::consts::{PI, TAU};

use super::TriangleMesh;

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

/// A Möbius strip of one half twist: one-sided, one boundary loop.
/// `along` quads on the centre circle of radius 1, `across` on the `width`.
pub fn moebius_strip(width: f64, along: u32, across: u32) -> TriangleMesh {
    let open = grid(along, across, [false, false], |s, t| {
        let a = s * TAU;
        let offset = (t - 0.5) * width;
        let ring = 1.0 + offset * (a / 2.0).cos();
        [ring * a.cos(), ring * a.sin(), offset * (a / 2.0).sin()]
    });
    // The last column meets the first upside down.
    let rows = across + 1;
    let last = along * rows;
    let glue = |v: u32| if v >= last { rows - 1 - (v - last) } else { v };
    let triangles = open.triangles().iter().map(|t| t.map(glue)).collect();
    let positions = open.positions()[..last as usize].to_vec();
    TriangleMesh::new(positions, triangles).expect("a grid is a valid mesh")
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

/// A rectangle in the plane z = 0, centred at the origin.
pub fn rectangle(width: f64, height: f64, columns: u32, rows: u32) -> TriangleMesh {
    grid(columns, rows, [false, false], |s, t| {
        [(s - 0.5) * width, (t - 0.5) * height, 0.0]
    })
}

/// A grid of `columns` × `rows` quads mapped by `place(s, t)`, s and t in 0..=1;
/// a wrapped direction joins its end to its start.
fn grid(
    columns: u32,
    rows: u32,
    wraps: [bool; 2],
    place: impl Fn(f64, f64) -> [f64; 3],
) -> TriangleMesh {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let counts = [
        if wraps[0] { columns } else { columns + 1 },
        if wraps[1] { rows } else { rows + 1 },
    ];
    let mut positions = Vec::with_capacity((counts[0] * counts[1]) as usize);
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            positions.push(place(
                f64::from(i) / f64::from(columns),
                f64::from(j) / f64::from(rows),
            ));
        }
    }
    let vertex = |i: u32, j: u32| (i % counts[0]) * counts[1] + j % counts[1];
    let mut triangles = Vec::with_capacity((2 * columns * rows) as usize);
    for i in 0..columns {
        for j in 0..rows {
            let [a, b, c, d] = [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ];
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        }
    }
    TriangleMesh::new(positions, triangles).expect("a grid is a valid mesh")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_those_of_the_smooth_surfaces() {
        let area = |mesh: TriangleMesh| mesh.triangle_areas().iter().sum::<f64>();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 5e-3, "{a} against {b}");
        near(area(torus(1.0, 0.4, 120, 60)), 4.0 * PI * PI * 0.4);
        near(area(open_cylinder(0.5, 2.0, 100, 4)), TAU);
        near(area(rectangle(2.0, 3.0, 4, 5)), 6.0);
        near(area(open_sphere(0.5, 100, 60)), TAU * (1.0 + 0.5_f64.cos()));
    }

    #[test]
    fn moebius_strip_has_one_boundary_loop() {
        let mesh = moebius_strip(0.6, 40, 6);
        let mut edges = std::collections::HashMap::new();
        for t in mesh.triangles() {
            for c in 0..3 {
                let (a, b) = (t[c], t[(c + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
            }
        }
        assert!(edges.values().all(|&n| n == 1 || n == 2));
        let mut next: std::collections::HashMap<u32, Vec<u32>> = Default::default();
        for (&(a, b), _) in edges.iter().filter(|(_, n)| **n == 1) {
            next.entry(a).or_default().push(b);
            next.entry(b).or_default().push(a);
        }
        let start = *next.keys().next().unwrap();
        let (mut previous, mut at, mut steps) = (u32::MAX, start, 0);
        loop {
            let step = *next[&at].iter().find(|&&v| v != previous).unwrap();
            (previous, at, steps) = (at, step, steps + 1);
            if at == start {
                break;
            }
        }
        assert_eq!(steps, next.len(), "one loop visits every boundary vertex");
        // Euler characteristic of a Möbius strip: V − E + F = 0.
        let euler =
            mesh.positions().len() as i64 - edges.len() as i64 + mesh.triangles().len() as i64;
        assert_eq!(euler, 0);
    }
}
