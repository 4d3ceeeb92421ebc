//! The cells that a chart takes up.

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
    /// The cells that come closer than `reach` to any of the triangles, or a few more; the
    /// lower left corner of the box is at -`reach`. Lengths are in cells, `points` lie in
    /// the rectangle from the origin to `size`.
    pub fn new(points: &[[f64; 2]], triangles: &[[u32; 3]], size: [f64; 2], reach: f64) -> Self {
        let mut mask = Self::empty(size.map(|length| {
            // A cell more where rounding could push the farthest point over the edge.
            let cells = (length + 2.0 * reach) * (1.0 + 1e-12);
            (cells.ceil() as usize).max(1)
        }));
        let mut in_triangle = vec![false; points.len()];
        for triangle in triangles {
            let corners = triangle.map(|v| points[v as usize].map(|c| c + reach));
            mask.cover(&corners, reach);
            for &v in triangle {
                in_triangle[v as usize] = true;
            }
        }
        for (point, _) in points.iter().zip(&in_triangle).filter(|(_, used)| !**used) {
            mask.cover(&[point.map(|c| c + reach)], reach);
        }
        mask
    }

    fn empty(size: [usize; 2]) -> Self {
        Self {
            size,
            cells: vec![false; size[0] * size[1]],
        }
    }

    /// Width and height in cells.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The mask turned counter-clockwise by a right angle.
    pub fn quarter_turned(&self) -> Self {
        let [width, height] = self.size;
        let mut turned = Self::empty([height, width]);
        for y in 0..height {
            for x in 0..width {
                turned.cells[x * height + (height - 1 - y)] = self.cells[y * width + x];
            }
        }
        turned
    }

    /// The runs of neighbouring cells, the longest first.
    pub fn runs(&self) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for (row, cells) in self.cells.chunks_exact(self.size[0]).enumerate() {
            let mut start = 0;
            for part in cells.chunk_by(|a, b| a == b) {
                let end = start + part.len();
                if part[0] {
                    runs.push(Run { row, start, end });
                }
                start = end;
            }
        }
        runs.sort_by_key(|run| std::cmp::Reverse(run.end - run.start));
        runs
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

    /// Adds the cells that come closer than `reach`, along either axis, to a convex polygon.
    fn cover(&mut self, corners: &[[f64; 2]], reach: f64) {
        let [width, height] = self.size;
        let cell = |c: f64, count: usize| (c.max(0.0) as usize).min(count - 1);
        let low = corners.iter().fold(f64::MAX, |m, p| m.min(p[1]));
        let high = corners.iter().fold(f64::MIN, |m, p| m.max(p[1]));
        for row in cell(low - reach, height)..=cell(high + reach, height) {
            let band = [row as f64 - reach, row as f64 + 1.0 + reach];
            if let Some([left, right]) = extent_in_band(corners, band) {
                let cells = cell(left - reach, width)..=cell(right + reach, width);
                self.cells[row * width..][cells].fill(true);
            }
        }
    }
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
        let mask = Mask::new(&triangle, &[[0, 1, 2]], [3.9, 3.9], 0.0);
        assert_eq!(picture(&mask), ["#...", "##..", "###.", "####"]);
        let turned = mask.quarter_turned();
        assert_eq!(picture(&turned), ["...#", "..##", ".###", "####"]);
    }

    #[test]
    fn runs_are_the_cells() {
        let points = [[0.0, 0.0], [4.5, 0.0], [2.5, 1.5]];
        let mask = Mask::new(&points, &[], [4.5, 1.5], 0.0);
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
        let mask = Mask::new(&triangle, &[[0, 1, 2]], [3.9, 3.9], 0.0);
        assert_eq!(mask.largest_square(), ([0, 0], 2));
        let turned = mask.quarter_turned().quarter_turned();
        let ([x, y], side) = turned.largest_square();
        assert_eq!(side, 2);
        let cell = |x: usize, y: usize| turned.cells[y * 4 + x];
        assert!(cell(x, y) && cell(x + 1, y) && cell(x, y + 1) && cell(x + 1, y + 1));
        assert_eq!(Mask::empty([3, 2]).largest_square().1, 0);
    }

    #[test]
    fn all_points_within_reach_lie_in_covered_cells() {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        for _ in 0..200 {
            let size: [f64; 2] = [random.random_range(0.0..9.0), random.random_range(0.0..9.0)];
            let reach = random.random_range(0.0..2.0);
            let corners = [0; 3].map(|_| size.map(|s| s * random.random::<f64>()));
            let mask = Mask::new(&corners, &[[0, 1, 2]], size, reach);
            for _ in 0..50 {
                let mut weights = [0; 3].map(|_| random.random::<f64>());
                let sum: f64 = weights.iter().sum();
                weights = weights.map(|w| w / sum);
                let angle: f64 = random.random_range(0.0..7.0);
                let offset = [angle.cos(), angle.sin()].map(|c| c * reach);
                let cell = [0, 1].map(|k| {
                    let c: f64 = (0..3).map(|i| weights[i] * corners[i][k]).sum();
                    (c + offset[k] + reach) as usize
                });
                assert!(mask.cells[cell[1] * mask.size[0] + cell[0]]);
            }
        }
    }
}
