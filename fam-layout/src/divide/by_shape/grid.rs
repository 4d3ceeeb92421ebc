//! Segments in the plane, found by where they are.

use std::collections::HashMap;

/// Numbered segments, by the square cells that they come through.
pub(super) struct Grid {
    cell: f64,
    members: HashMap<[i64; 2], Vec<u32>>,
}

impl Grid {
    /// Without segments; cells have sides of a length.
    pub(super) fn new(cell: f64) -> Self {
        Self {
            cell,
            members: HashMap::new(),
        }
    }

    /// Enters a segment.
    pub(super) fn insert(&mut self, number: u32, ends: [[f64; 2]; 2]) {
        for cell in self.cells(ends) {
            self.members.entry(cell).or_default().push(number);
        }
    }

    /// The segments that come nearer to another than half a cell, and some that do not, ascending.
    pub(super) fn near(&self, ends: [[f64; 2]; 2]) -> Vec<u32> {
        let mut found = Vec::new();
        for [x, y] in self.cells(ends) {
            for cell in (-1..=1).flat_map(|i| (-1..=1).map(move |j| [x + i, y + j])) {
                found.extend(self.members.get(&cell).into_iter().flatten());
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The cells of points of a segment that are half a cell apart.
    fn cells(&self, [from, to]: [[f64; 2]; 2]) -> Vec<[i64; 2]> {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let steps = (2.0 * length / self.cell).ceil().max(1.0) as u32;
        let mut cells: Vec<[i64; 2]> = (0..=steps)
            .map(|i| {
                let share = f64::from(i) / f64::from(steps);
                let at = |k: usize| from[k] + share * (to[k] - from[k]);
                [0, 1].map(|k| (at(k) / self.cell).floor() as i64)
            })
            .collect();
        cells.dedup();
        cells
    }
}

/// How far two segments are apart; 0 if they meet.
pub(super) fn distance(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> f64 {
    let side = |[a, b]: [[f64; 2]; 2], p: [f64; 2]| {
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    };
    let parts = |line: [[f64; 2]; 2], ends: [[f64; 2]; 2]| {
        let [a, b] = ends.map(|p| side(line, p));
        (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0)
    };
    if parts(one, other) && parts(other, one) {
        return 0.0;
    }
    let from = |p: [f64; 2], [a, b]: [[f64; 2]; 2]| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let dot = (p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1];
        let share = if squared > 0.0 {
            (dot / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (p[0] - a[0] - share * along[0]).hypot(p[1] - a[1] - share * along[1])
    };
    let ends = one.map(|p| from(p, other));
    let others = other.map(|p| from(p, one));
    ends.into_iter().chain(others).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_found_where_they_are_near() {
        let mut grid = Grid::new(1.0);
        grid.insert(7, [[0.0, 0.0], [10.0, 5.0]]);
        grid.insert(3, [[20.0, 0.0], [20.0, 1.0]]);
        assert_eq!(grid.near([[4.0, 2.4], [4.0, 9.0]]), [7]);
        assert_eq!(grid.near([[0.0, 20.0], [1.0, 20.0]]), [0_u32; 0]);
        assert_eq!(grid.near([[9.0, 4.5], [20.4, 0.5]]), [3, 7]);
    }

    #[test]
    fn distances_of_segments() {
        let one = [[0.0, 0.0], [2.0, 0.0]];
        assert_eq!(distance(one, [[1.0, -1.0], [1.0, 1.0]]), 0.0);
        assert_eq!(distance(one, [[1.0, 3.0], [1.0, 1.0]]), 1.0);
        assert_eq!(distance(one, [[5.0, 4.0], [6.0, 4.0]]), 5.0);
        assert_eq!(distance(one, [[0.5, 0.0], [1.0, 0.0]]), 0.0);
        assert_eq!(distance([[1.0, 1.0]; 2], one), 1.0);
    }
}
