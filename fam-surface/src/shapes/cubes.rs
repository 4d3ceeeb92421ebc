//! The cube, and the sphere that it is blown up to.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::TriangleMesh;
use crate::vector::normalize;

/// The surface of the unit cube with one corner at the origin: `squares` × `squares` squares on
/// every side, of two triangles each.
pub fn cube(squares: u32) -> TriangleMesh {
    block([squares; 3])
}

/// The surface of the unit cube with so many rows of rectangles along each axis.
pub(super) fn block(rows: [u32; 3]) -> TriangleMesh {
    let rows = rows.map(|n| n.max(1));
    let mut numbers = BTreeMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for (axis, far) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let [one, two] = [(axis + 1) % 3, (axis + 2) % 3];
        for (i, j) in (0..rows[one]).flat_map(|i| (0..rows[two]).map(move |j| (i, j))) {
            let corner = |(di, dj): (u32, u32)| {
                let mut at = [0; 3];
                at[axis] = if far { rows[axis] } else { 0 };
                at[one] = i + di;
                at[two] = j + dj;
                *numbers.entry(at).or_insert_with(|| {
                    positions.push([0, 1, 2].map(|k| f64::from(at[k]) / f64::from(rows[k])));
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
