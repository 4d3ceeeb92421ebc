//! A first net of triangles over a body: in every cell of a grid that the surface crosses, a
//! vertex for each sheet of the surface in it; around every edge of the grid that the surface
//! crosses, a quad.

use super::Net;
use crate::shapes::fields::Point;
use crate::vector::{add, length, scale, sub};

/// Cells on each side of the box that stay empty: the quads around an edge need all four cells.
const MARGIN: f64 = 1.5;

/// The values of a function at the corners of a grid.
struct Samples {
    counts: [usize; 3],
    lowest: Point,
    cell: f64,
    values: Vec<f64>,
}

impl Samples {
    fn new(body: &dyn Fn(Point) -> f64, [lowest, highest]: [Point; 2], cell: f64) -> Self {
        let lowest = lowest.map(|c| c - MARGIN * cell);
        let counts =
            [0, 1, 2].map(|k| ((highest[k] - lowest[k]) / cell + MARGIN).ceil() as usize + 1);
        let mut samples = Self {
            counts,
            lowest,
            cell,
            values: Vec::with_capacity(counts.iter().product()),
        };
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    samples.values.push(body(samples.place([x, y, z])));
                }
            }
        }
        samples
    }

    fn place(&self, at: [usize; 3]) -> Point {
        [0, 1, 2].map(|k| self.lowest[k] + self.cell * at[k] as f64)
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    fn value(&self, at: [usize; 3]) -> f64 {
        self.values[self.number(at)]
    }

    /// Turns corners inside out where a face has two of them inside, across from each other: the
    /// surface through it would not be clear. Whether there were any; new ones may have come up.
    fn open_checkers(&mut self) -> bool {
        let mut found = false;
        for number in 0..self.values.len() {
            let row = number / self.counts[0];
            let at = [
                number % self.counts[0],
                row % self.counts[1],
                row / self.counts[1],
            ];
            for axis in 0..3 {
                let [one, two] = [(axis + 1) % 3, (axis + 2) % 3];
                if at[one] + 1 == self.counts[one] || at[two] + 1 == self.counts[two] {
                    continue;
                }
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
                    let mut corner = at;
                    corner[one] += i;
                    corner[two] += j;
                    self.number(corner)
                });
                let [a, b, c, d] = corners.map(|corner| self.values[corner] < 0.0);
                if a == c && b == d && a != b {
                    let pair = if a { [0, 2] } else { [1, 3] }.map(|k| corners[k]);
                    let nearer = usize::from(self.values[pair[0]] < self.values[pair[1]]);
                    self.values[pair[nearer]] = self.values[pair[nearer]].abs();
                    found = true;
                }
            }
        }
        found
    }

    fn inside(&self, at: [usize; 3]) -> bool {
        self.value(at) < 0.0
    }
}

/// The two ends of an edge of a cell. Edge 4 a + i runs along axis a; bit 0 of i says on which
/// side it lies along the axis after a, bit 1 along the one after that.
fn ends(cell: [usize; 3], edge: usize) -> [[usize; 3]; 2] {
    let (axis, side) = (edge / 4, edge % 4);
    let mut start = cell;
    start[(axis + 1) % 3] += side & 1;
    start[(axis + 2) % 3] += side >> 1;
    let mut end = start;
    end[axis] += 1;
    [start, end]
}

/// The sheets of the surface in a cell: for each of its edges the first edge of the same sheet.
/// Edges of a face of the cell are of the same sheet, since the surface crosses no more than two.
fn sheets(samples: &Samples, cell: [usize; 3]) -> [usize; 12] {
    let mut sheet: [usize; 12] = std::array::from_fn(|edge| edge);
    let mut join = |a: usize, b: usize| {
        let [low, high] = [sheet[a].min(sheet[b]), sheet[a].max(sheet[b])];
        sheet
            .iter_mut()
            .filter(|s| **s == high)
            .for_each(|s| *s = low);
    };
    let crossed = |edge: usize| {
        let [a, b] = ends(cell, edge);
        samples.inside(a) != samples.inside(b)
    };
    for (axis, far) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
        let [one, two] = [(axis + 1) % 3, (axis + 2) % 3];
        let along_one = [0, 1].map(|side| 4 * one + side + 2 * far);
        let along_two = [0, 1].map(|side| 4 * two + far + 2 * side);
        let all = [along_one[0], along_one[1], along_two[0], along_two[1]];
        let hits: Vec<usize> = all.into_iter().filter(|&edge| crossed(edge)).collect();
        if let [a, b] = hits[..] {
            join(a, b);
        }
    }
    sheet
}

/// The net over the surface of a body in a box, from cells of the given side.
pub(super) fn net(body: &dyn Fn(Point) -> f64, bounds: [Point; 2], cell: f64) -> Net {
    let mut samples = Samples::new(body, bounds, cell);
    while samples.open_checkers() {}
    let samples = samples;
    let mut positions = Vec::new();
    // For every cell the vertex at each of its edges.
    let mut vertices: Vec<Option<[u32; 12]>> = vec![None; samples.values.len()];
    let counts = samples.counts;
    let cells = |k: usize| 0..counts[k] - 1;
    for z in cells(2) {
        for y in cells(1) {
            for x in cells(0) {
                let at = [x, y, z];
                vertices[samples.number(at)] = cell_vertices(&samples, at, &mut positions);
            }
        }
    }
    let mut triangles = Vec::new();
    for (axis, z) in (0..3).flat_map(|axis| cells(2).map(move |z| (axis, z))) {
        for y in cells(1) {
            for x in cells(0) {
                let start = [x, y, z];
                let mut end = start;
                end[axis] += 1;
                let [one, two] = [(axis + 1) % 3, (axis + 2) % 3];
                if samples.inside(start) == samples.inside(end)
                    || start[one] == 0
                    || start[two] == 0
                {
                    continue;
                }
                let corner = |(i, j): (usize, usize)| {
                    let mut cell = start;
                    cell[one] -= i;
                    cell[two] -= j;
                    vertices[samples.number(cell)].map_or(0, |v| v[4 * axis + i + 2 * j])
                };
                let mut quad = [(1, 1), (0, 1), (0, 0), (1, 0)].map(corner);
                if samples.inside(end) {
                    quad.reverse();
                }
                triangles.extend(halves(&positions, quad));
            }
        }
    }
    Net {
        positions,
        triangles,
    }
}

/// Adds the vertices of a cell, each in the middle of its sheet: the vertex at each edge, if the
/// surface crosses the cell.
fn cell_vertices(
    samples: &Samples,
    cell: [usize; 3],
    positions: &mut Vec<Point>,
) -> Option<[u32; 12]> {
    let inside = samples.inside(cell);
    let mixed = (1..8).any(|corner| {
        let [x, y, z] = cell;
        samples.inside([x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)]) != inside
    });
    if !mixed {
        return None;
    }
    let sheet = sheets(samples, cell);
    let mut vertices = [0; 12];
    for first in (0..12).filter(|&edge| sheet[edge] == edge) {
        let mut sum = [0.0; 3];
        let mut hits = 0.0;
        for edge in (first..12).filter(|&edge| sheet[edge] == first) {
            let [a, b] = ends(cell, edge);
            if samples.inside(a) != samples.inside(b) {
                let (f, g) = (samples.value(a), samples.value(b));
                let (a, b) = (samples.place(a), samples.place(b));
                sum = add(sum, add(a, scale(sub(b, a), f / (f - g))));
                hits += 1.0;
            }
        }
        if hits > 0.0 {
            for edge in (first..12).filter(|&edge| sheet[edge] == first) {
                vertices[edge] = positions.len() as u32;
            }
            positions.push(scale(sum, 1.0 / hits));
        }
    }
    Some(vertices)
}

/// A quad in two triangles along its shorter diagonal.
pub(super) fn halves(positions: &[Point], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let way = |a: u32, b: u32| length(sub(positions[a as usize], positions[b as usize]));
    if way(a, c) <= way(b, d) {
        [[a, b, c], [a, c, d]]
    } else {
        [[a, b, d], [b, c, d]]
    }
}
