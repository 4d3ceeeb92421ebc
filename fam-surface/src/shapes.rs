//! Generated surfaces of known geometry, for a first run and for tests.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::TriangleMesh;
use super::vector::{length, normalize, sub};

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

/// The surface of the unit cube with one corner at the origin: `squares` × `squares` squares on
/// every side, of two triangles each.
pub fn cube(squares: u32) -> TriangleMesh {
    let n = squares.max(1);
    let mut numbers = BTreeMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for (axis, far) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let corner = |(di, dj): (u32, u32)| {
                let mut at = [0; 3];
                at[axis] = if far { n } else { 0 };
                at[(axis + 1) % 3] = i + di;
                at[(axis + 2) % 3] = j + dj;
                *numbers.entry(at).or_insert_with(|| {
                    positions.push(at.map(|c| f64::from(c) / f64::from(n)));
                    positions.len() as u32 - 1
                })
            };
            let mut corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(corner);
            if !far {
                corners.reverse();
            }
            let [a, b, c, d] = corners;
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleMesh::new(positions, triangles).expect("a cube is a valid mesh")
}

/// A closed sphere of radius 1: the [`cube`] blown up, its squares of about equal size.
pub fn sphere(squares: u32) -> TriangleMesh {
    let cube = cube(squares);
    let blown_up = |p: &[f64; 3]| normalize(p.map(|c| (PI / 4.0 * (2.0 * c - 1.0)).tan()));
    let positions = cube.positions().iter().map(blown_up).collect();
    TriangleMesh::new(positions, cube.triangles().to_vec()).expect("a sphere is a valid mesh")
}

/// A rectangle in the plane z = 0, centred at the origin.
pub fn rectangle(width: f64, height: f64, columns: u32, rows: u32) -> TriangleMesh {
    grid(columns, rows, [false, false], |s, t| {
        [(s - 0.5) * width, (t - 0.5) * height, 0.0]
    })
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

/// A surface around an axis in rings of vertices about `spacing` apart, from a point at the
/// top down: `place(w, angle)` with w from 0 to 1.
fn rings(spacing: f64, place: impl Fn(f64, f64) -> [f64; 3]) -> TriangleMesh {
    const STEPS: u32 = 200;
    let around = |w: f64| {
        let corner = |i: u32| place(w, TAU * f64::from(i) / f64::from(STEPS));
        (0..STEPS)
            .map(|i| length(sub(corner(i + 1), corner(i))))
            .sum::<f64>()
    };
    // Heights at which the mean way down since the last ring is the spacing.
    let down = |w: f64| {
        let next = w + 1e-3;
        let way = |i: u32| {
            let a = TAU * f64::from(i) / 12.0;
            length(sub(place(next.min(1.0), a), place(w, a)))
        };
        (0..12).map(way).sum::<f64>() / 12.0
    };
    let mut ways = vec![0.0];
    for i in 0..1000 {
        ways.push(ways[i] + down(i as f64 * 1e-3));
    }
    let count = (ways[1000] / (spacing * 0.75_f64.sqrt())).round().max(1.0);
    let mut positions = vec![place(0.0, 0.0)];
    let mut triangles = Vec::new();
    let mut above = 0..1;
    for ring in 1..=count as u32 {
        let way = ways[1000] * f64::from(ring) / count;
        let after = ways.partition_point(|&x| x < way).clamp(1, 1000);
        let share = (way - ways[after - 1]) / (ways[after] - ways[after - 1]);
        let w = ((after as f64 - 1.0 + share) * 1e-3).min(1.0);
        let corners = (around(w) / spacing).round().max(3.0) as u32;
        let below = above.end..above.end + corners;
        for i in 0..corners {
            positions.push(place(w, TAU * f64::from(i) / f64::from(corners)));
        }
        join(&above, &below, &mut triangles);
        above = below;
    }
    TriangleMesh::new(positions, triangles).expect("rings are a valid mesh")
}

/// Triangles between two rings of vertices that start at the same angle.
fn join(above: &Range<u32>, below: &Range<u32>, triangles: &mut Vec<[u32; 3]>) {
    let (m, n) = (above.len() as u32, below.len() as u32);
    let upper = |i: u32| above.start + i % m;
    let lower = |j: u32| below.start + j % n;
    let (mut i, mut j) = (0, 0);
    while i < m || j < n {
        let next_upper = (f64::from(i) + 0.5) / f64::from(m);
        let next_lower = (f64::from(j) + 0.5) / f64::from(n);
        if j < n && (i == m || next_lower <= next_upper) {
            triangles.push([upper(i), lower(j), lower(j + 1)]);
            j += 1;
        } else {
            if m > 1 {
                triangles.push([upper(i), lower(j), upper(i + 1)]);
            }
            i += 1;
        }
    }
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
    use crate::vector::{cross, dot};

    #[test]
    fn areas_are_those_of_the_smooth_surfaces() {
        let area = |mesh: TriangleMesh| mesh.triangle_areas().iter().sum::<f64>();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 5e-3, "{a} against {b}");
        near(area(torus(1.0, 0.4, 120, 60)), 4.0 * PI * PI * 0.4);
        near(area(open_cylinder(0.5, 2.0, 100, 4)), TAU);
        near(area(rectangle(2.0, 3.0, 4, 5)), 6.0);
        near(area(cone(3.0, 4.0, 100, 5)), 15.0 * PI);
        near(area(cube(7)), 6.0);
        near(area(sphere(24)), 2.0 * TAU);
        near(area(open_sphere(0.5, 100, 60)), TAU * (1.0 + 0.5_f64.cos()));
    }

    /// The signed volume is positive where triangles are counter-clockwise from outside.
    #[test]
    fn closed_surfaces_enclose_their_volume() {
        let volume = |mesh: TriangleMesh| {
            let signed = |t: usize| {
                let [a, b, c] = mesh.corners(t);
                dot(a, cross(b, c)) / 6.0
            };
            (0..mesh.triangles().len()).map(signed).sum::<f64>()
        };
        assert!((volume(cube(3)) - 1.0).abs() < 1e-12);
        assert!((volume(sphere(24)) / (4.0 / 3.0 * PI) - 1.0).abs() < 5e-3);
        let apex = cone(3.0, 4.0, 100, 5);
        let down = |p: &[f64; 3]| [p[0], p[1], p[2] - 4.0];
        let positions = apex.positions().iter().map(down).collect();
        let from_apex = TriangleMesh::new(positions, apex.triangles().to_vec()).unwrap();
        assert!(volume(from_apex).abs() < 1e-9);
        assert!((volume(apex) - 12.0 * PI).abs() < 0.1 * PI);
    }

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
