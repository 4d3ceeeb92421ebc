//! The cells that a chart takes up.

use super::outline::Outline;

/// What rounding may move an outline by, in cells, and more.
const ROUNDING: f64 = 1e-9;

/// Cells `start..end` of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// The row, counted from the lowest of the mask.
    pub row: usize,
    /// The first cell.
    pub start: usize,
    /// The cell after the last.
    pub end: usize,
}

/// A set of cells in a box of `size` (width, height) cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    size: [usize; 2],
    cells: Vec<bool>,
}

impl Mask {
    /// No cells of a box.
    pub fn empty(size: [usize; 2]) -> Self {
        Self {
            size,
            cells: vec![false; size[0] * size[1]],
        }
    }

    /// So many cells hold a length, where rounding may have made it a little longer.
    pub fn cells_for(length: f64) -> usize {
        ((length - 2.0 * ROUNDING).ceil() as usize).max(1)
    }

    /// Adds the cells of the box that come closer than `reach` to what is within the outline, or
    /// some more. Lengths are in cells; the box has its lower left corner at the origin.
    pub fn cover(&mut self, outline: &Outline, reach: f64) {
        self.fill(outline);
        for edge in &outline.edges {
            self.cover_edge(
                edge.ends.map(|v| outline.points[v as usize]),
                reach + ROUNDING,
            );
        }
    }

    /// Width and height in cells.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The same cells and `width` more on every side, in a box that is as much larger.
    pub fn padded(&self, width: usize) -> Self {
        let [columns, rows] = self.size;
        let mut wide = Self::empty([columns + 2 * width, rows]);
        for row in 0..rows {
            for run in self.runs_of_row(row) {
                wide.row(row)[run.start..run.end + 2 * width].fill(true);
            }
        }
        let mut all = Self::empty([wide.size[0], rows + 2 * width]);
        for row in 0..rows {
            for run in wide.runs_of_row(row) {
                for row in row..=row + 2 * width {
                    all.row(row)[run.start..run.end].fill(true);
                }
            }
        }
        all
    }

    /// A part of the box, which lies so many cells from all of its sides.
    pub fn inner(&self, from_sides: usize) -> Self {
        let mut inner = Self::empty(self.size.map(|count| count - 2 * from_sides));
        let width = inner.size[0];
        for (row, cells) in inner.cells.chunks_exact_mut(width).enumerate() {
            let first = (row + from_sides) * self.size[0] + from_sides;
            cells.copy_from_slice(&self.cells[first..first + width]);
        }
        inner
    }

    /// The mask in cells of `by` × `by` of these, each taken where one of these is.
    pub fn coarser(&self, by: usize) -> Self {
        if by == 1 {
            return self.clone();
        }
        let mut coarse = Self::empty(self.size.map(|count| count.div_ceil(by)));
        for row in 0..self.size[1] {
            for run in self.runs_of_row(row) {
                coarse.row(row / by)[run.start / by..(run.end - 1) / by + 1].fill(true);
            }
        }
        coarse
    }

    /// The runs of neighbouring cells, the longest first.
    pub fn runs(&self) -> Vec<Run> {
        let mut runs: Vec<Run> = (0..self.size[1])
            .flat_map(|row| self.runs_of_row(row))
            .collect();
        runs.sort_by_key(|run| std::cmp::Reverse(run.end - run.start));
        runs
    }

    /// The runs of a row, from left to right.
    fn runs_of_row(&self, row: usize) -> impl Iterator<Item = Run> {
        let mut start = 0;
        let cells = &self.cells[row * self.size[0]..][..self.size[0]];
        cells.chunk_by(|a, b| a == b).filter_map(move |part| {
            let run = Run {
                row,
                start,
                end: start + part.len(),
            };
            start = run.end;
            part[0].then_some(run)
        })
    }

    fn row(&mut self, row: usize) -> &mut [bool] {
        let width = self.size[0];
        &mut self.cells[row * width..][..width]
    }

    /// The lower left cell of a largest square of cells of the mask, and its side.
    pub fn largest_square(&self) -> ([usize; 2], usize) {
        let width = self.size[0];
        let mut largest = ([0; 2], 0);
        // Of every cell of a row the side of the largest square that ends there.
        let mut below = vec![0; width];
        for (y, cells) in self.cells.chunks_exact(width).enumerate() {
            let mut diagonal = 0;
            for (x, &cell) in cells.iter().enumerate() {
                let left = if x > 0 { below[x - 1] } else { 0 };
                let side = match cell {
                    true => 1 + left.min(below[x]).min(diagonal),
                    false => 0,
                };
                diagonal = std::mem::replace(&mut below[x], side);
                if side > largest.1 {
                    largest = ([x + 1 - side, y + 1 - side], side);
                }
            }
        }
        largest
    }

    /// The indices of `count` cells that meet an interval.
    fn between(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
        // Casts saturate, so what lies outside of the box becomes an empty range.
        let end = ((high.floor() + 1.0).max(0.0) as usize).min(count);
        (low.max(0.0) as usize).min(end)..end
    }

    /// Adds the cells whose centres are within an outline.
    fn fill(&mut self, outline: &Outline) {
        // Where edges cross the line through the centres of a row, and the winding behind it.
        let mut crossings: Vec<(usize, f64, i32)> = Vec::new();
        for edge in outline.edges.iter().filter(|edge| edge.winding != 0) {
            let [a, b] = edge.ends.map(|v| outline.points[v as usize]);
            let (low, high, winding) = match a[1] < b[1] {
                true => (a, b, -edge.winding),
                false => (b, a, edge.winding),
            };
            let slope = (high[0] - low[0]) / (high[1] - low[1]);
            for row in Self::between(low[1] - 0.5, high[1] - 0.5, self.size[1]) {
                let center = row as f64 + 0.5;
                if (low[1]..high[1]).contains(&center) {
                    crossings.push((row, low[0] + slope * (center - low[1]), winding));
                }
            }
        }
        crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        for row in crossings.chunk_by(|a, b| a.0 == b.0) {
            let mut winding = 0;
            for pair in row.windows(2) {
                winding += pair[0].2;
                if winding != 0 {
                    let cells = self.row(pair[0].0);
                    let [start, end] = [pair[0].1, pair[1].1].map(|x| {
                        let first = (x - 0.5).ceil().max(0.0) as usize;
                        first.min(cells.len())
                    });
                    cells[start..end].fill(true);
                }
            }
        }
    }

    /// Adds the cells that come closer than `reach` to a line.
    fn cover_edge(&mut self, [a, b]: [[f64; 2]; 2], reach: f64) {
        let [width, height] = self.size;
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let across = match length > 0.0 {
            true => [-along[1], along[0]].map(|c| c / length * reach),
            false => [0.0; 2],
        };
        let shifted = |p: [f64; 2], sign: f64| [0, 1].map(|k| p[k] + sign * across[k]);
        let body = [
            shifted(a, 1.0),
            shifted(b, 1.0),
            shifted(b, -1.0),
            shifted(a, -1.0),
        ];
        let low = a[1].min(b[1]) - reach;
        let high = a[1].max(b[1]) + reach;
        for row in Self::between(low, high, height) {
            let band = [row as f64, row as f64 + 1.0];
            let mut left = f64::INFINITY;
            let mut right = f64::NEG_INFINITY;
            let disks = [a, b].map(|center| extent_of_disk(center, reach, band));
            let parts = disks.into_iter().chain([extent_in_band(&body, band)]);
            for [from, to] in parts.flatten() {
                left = left.min(from);
                right = right.max(to);
            }
            if left <= right {
                self.row(row)[Self::between(left, right, width)].fill(true);
            }
        }
    }
}

/// Between which x a disk lies where y is in the band.
fn extent_of_disk([x, y]: [f64; 2], radius: f64, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let away = (low - y).max(y - high).max(0.0);
    let half = ((radius - away) * (radius + away)).sqrt();
    (away <= radius).then_some([x - half, x + half])
}

/// Between which x a convex polygon lies where y is in the band, bounds included.
fn extent_in_band(corners: &[[f64; 2]], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let mut extent: Option<[f64; 2]> = None;
    let mut add = |x: f64| {
        let [left, right] = extent.get_or_insert([x; 2]);
        *left = left.min(x);
        *right = right.max(x);
    };
    for (i, &[x, y]) in corners.iter().enumerate() {
        if (low..=high).contains(&y) {
            add(x);
        }
        let [to_x, to_y] = corners[(i + 1) % corners.len()];
        for level in [low, high] {
            if (y < level) != (to_y < level) {
                let share = ((level - y) / (to_y - y)).clamp(0.0, 1.0);
                add(x + share * (to_x - x));
            }
        }
    }
    extent
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    fn mask(points: &[[f64; 2]], triangles: &[[u32; 3]], size: [usize; 2]) -> Mask {
        let mut mask = Mask::empty(size);
        mask.cover(&Outline::new(points, triangles), 0.0);
        mask
    }

    fn picture(mask: &Mask) -> Vec<String> {
        let mark = |&cell: &bool| if cell { '#' } else { '.' };
        let rows = mask.cells.chunks_exact(mask.size[0]);
        rows.rev()
            .map(|row| row.iter().map(mark).collect())
            .collect()
    }

    #[test]
    fn triangle_covers_the_cells_that_it_meets() {
        let triangle = [[0.0, 0.0], [3.9, 0.0], [0.0, 3.9]];
        let mask = mask(&triangle, &[[0, 1, 2]], [4, 4]);
        assert_eq!(picture(&mask), ["#...", "##..", "###.", "####"]);
        let coarse = mask.coarser(2);
        assert_eq!(picture(&coarse), ["#.", "##"]);
        assert_eq!(picture(&coarse.padded(1)), ["###.", "####", "####", "####"]);
    }

    #[test]
    fn holes_stay_free_and_what_overlaps_or_is_mirrored_does_not() {
        let ring = [
            [0.2, 0.2],
            [6.8, 0.2],
            [6.8, 6.8],
            [0.2, 6.8],
            [2.2, 2.2],
            [4.8, 2.2],
            [4.8, 4.8],
            [2.2, 4.8],
        ];
        let around: Vec<[u32; 3]> = (0..4)
            .flat_map(|i| {
                let j = (i + 1) % 4;
                [[i, j, 4 + j], [i, 4 + j, 4 + i]]
            })
            .collect();
        let hole = mask(&ring, &around, [7, 7]);
        assert_eq!(picture(&hole)[3], "###.###");
        let mirrored: Vec<[u32; 3]> = around.iter().map(|&[a, b, c]| [a, c, b]).collect();
        assert_eq!(mask(&ring, &mirrored, [7, 7]), hole);
        let closed = [&around[..], &[[4, 6, 5], [4, 6, 7]]].concat();
        assert_eq!(picture(&mask(&ring, &closed, [7, 7]))[3], "#######");
        let doubled = [&around[..], &mirrored[..], &closed[..]].concat();
        assert_eq!(picture(&mask(&ring, &doubled, [7, 7]))[3], "#######");
    }

    #[test]
    fn runs_are_the_cells() {
        let points = [[0.0, 0.0], [4.5, 0.0], [2.5, 1.5]];
        let mask = mask(&points, &[], [5, 2]);
        assert_eq!(picture(&mask), ["..#..", "#...#"]);
        let run = |row, start| Run {
            row,
            start,
            end: start + 1,
        };
        assert_eq!(mask.runs(), [run(0, 0), run(0, 4), run(1, 2)]);
    }

    #[test]
    fn the_largest_square_lies_within() {
        let triangle = [[0.0, 0.0], [3.9, 0.0], [0.0, 3.9]];
        let mask = mask(&triangle, &[[0, 1, 2]], [4, 4]);
        assert_eq!(mask.largest_square(), ([0, 0], 2));
        assert_eq!(Mask::empty([3, 2]).largest_square().1, 0);
    }

    #[test]
    fn all_points_within_reach_lie_in_covered_cells() {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        for _ in 0..200 {
            let size: [f64; 2] = [random.random_range(0.0..9.0), random.random_range(0.0..9.0)];
            let reach = random.random_range(0.0..2.0);
            let corners = [0; 3].map(|_| size.map(|s| reach + s * random.random::<f64>()));
            let mut mask = Mask::empty(size.map(|s| Mask::cells_for(s + 2.0 * reach)));
            mask.cover(&Outline::new(&corners, &[[0, 1, 2]]), reach);
            for _ in 0..50 {
                let mut weights = [0; 3].map(|_| random.random::<f64>());
                let sum: f64 = weights.iter().sum();
                weights = weights.map(|w| w / sum);
                let angle: f64 = random.random_range(0.0..7.0);
                let offset = [angle.cos(), angle.sin()].map(|c| c * reach);
                let cell = [0, 1].map(|k| {
                    let c: f64 = (0..3).map(|i| weights[i] * corners[i][k]).sum();
                    (c + offset[k]) as usize
                });
                assert!(mask.cells[cell[1] * mask.size[0] + cell[0]]);
            }
        }
    }
}
