//! Grids of quads mapped into space.

use crate::TriangleMesh;

/// A grid of `columns` × `rows` quads mapped by `place(s, t)`, s and t in 0..=1;
/// a wrapped direction joins its end to its start.
pub(super) fn grid(
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
