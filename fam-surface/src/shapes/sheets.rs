//! Sheets: flat, hung in waves, rolled up, twisted.

use std::f64::consts::TAU;

use super::grid::grid;
use crate::TriangleMesh;

/// A rectangle in the plane z = 0, centred at the origin.
pub fn rectangle(width: f64, height: f64, columns: u32, rows: u32) -> TriangleMesh {
    grid(columns, rows, [false, false], |s, t| {
        [(s - 0.5) * width, (t - 0.5) * height, 0.0]
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

/// A sheet of `columns` × `rows` square quads (the longer way 1) that hangs in waves, ever
/// higher until they overhang. It is a bent rectangle: developable.
pub fn draped_cloth(columns: u32, rows: u32) -> TriangleMesh {
    const WAVES: f64 = 3.0;
    let (columns, rows) = (columns.max(1), rows.max(1));
    let height = f64::from(rows) / f64::from(columns);
    let profile = profile(columns, |s, _| {
        let slope = (0.8 + 1.1 * s) * (TAU * WAVES * s).sin();
        [slope.cos(), slope.sin()]
    });
    bent(&profile, height, columns, rows)
}

/// A sheet of `columns` × `rows` quads, `length` × `width`, rolled up to a spiral around the y
/// axis with `gap` between its layers: developable. `inner` is the radius it begins with.
pub fn spiral(
    inner: f64,
    gap: f64,
    length: f64,
    width: f64,
    columns: u32,
    rows: u32,
) -> TriangleMesh {
    let pitch = gap / TAU;
    let profile = profile(columns.max(1), |_, [x, y]| {
        let [x, y] = [length * x + inner, length * y];
        let (radius, angle) = (x.hypot(y), y.atan2(x));
        let outwards = pitch / radius.hypot(pitch);
        let along = (1.0 - outwards * outwards).sqrt();
        [
            outwards * angle.cos() - along * angle.sin(),
            outwards * angle.sin() + along * angle.cos(),
        ]
    });
    let profile: Vec<[f64; 2]> = profile
        .iter()
        .map(|&[x, y]| [length * x + inner, length * y])
        .collect();
    bent(&profile, width, columns, rows)
}

/// A curve of length 1 in the plane, from the origin, at the ends of so many equal steps of its
/// arc length s. `direction(s, point)` is its unit tangent.
fn profile(steps: u32, direction: impl Fn(f64, [f64; 2]) -> [f64; 2]) -> Vec<[f64; 2]> {
    const SUBSTEPS: u32 = 32;
    let step = 1.0 / f64::from(steps * SUBSTEPS);
    let mut point = [0.0; 2];
    let mut points = vec![point];
    for i in 0..steps * SUBSTEPS {
        let s = f64::from(i) * step;
        let ahead = |d: [f64; 2], length: f64| [0, 1].map(|k| point[k] + length * d[k]);
        let middle = ahead(direction(s, point), 0.5 * step);
        point = ahead(direction(s + 0.5 * step, middle), step);
        if (i + 1).is_multiple_of(SUBSTEPS) {
            points.push(point);
        }
    }
    points
}

/// A sheet that follows a curve in the x-z plane and is straight along y.
fn bent(profile: &[[f64; 2]], height: f64, columns: u32, rows: u32) -> TriangleMesh {
    grid(columns, rows, [false, false], |s, t| {
        let [x, z] = profile[(s * f64::from(columns.max(1))).round() as usize];
        [x, (t - 0.5) * height, z]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn bent_sheets_keep_their_lengths() {
        let cloth = draped_cloth(100, 70);
        let area: f64 = cloth.triangle_areas().iter().sum();
        assert!((area - 0.7).abs() < 2e-3, "{area}");
        let rolled = spiral(3.0, 3.0, 200.0, 10.0, 400, 20);
        let area: f64 = rolled.triangle_areas().iter().sum();
        assert!((area / 2000.0 - 1.0).abs() < 1e-2, "{area}");
        let last = rolled.positions()[rolled.positions().len() - 1];
        // The area between the first and the last layer is length × gap.
        let outer = (9.0 + 200.0 * 3.0 / PI).sqrt();
        assert!((last[0].hypot(last[2]) - outer).abs() < 0.05);
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
