//! Which cells of the square are taken, and where there is room.

use std::ops::Range;

use super::mask::{Mask, Run};

const WORD: usize = u64::BITS as usize;

/// Squares of up to 2 to the power of this many cells to a side have levels of their own. Larger
/// ones are tested by those at their corners.
const LARGEST_SQUARE: usize = 6;

/// How many of the runs of a shape are asked about before its places are looked at.
const RUNS_ASKED: usize = 4;

/// A field of cells. What is taken is known for runs of 2ᵏ cells in `runs[k]` and for squares of
/// 2ᵏ⁺¹ × 2ᵏ⁺¹ cells in `squares[k]`, so that a run or a square of any size is tested at many
/// places of a row at once.
#[derive(Clone)]
pub struct Occupancy {
    /// Columns and rows.
    size: [usize; 2],
    /// Words per row; two more than its cells need, so that a shifted read stays inside.
    stride: usize,
    /// Words that have one bit in [`Level::open`].
    per_group: usize,
    runs: Vec<Level>,
    squares: Vec<Level>,
    /// For every row the length of its longest run of free cells.
    longest: Vec<usize>,
}

/// Where runs or squares of one size have room.
#[derive(Clone)]
struct Level {
    /// A bit for every cell: whether any cell of the run or square that starts there, to the
    /// right and up, is taken.
    taken: Vec<u64>,
    /// For every row a bit for each group of its words: whether there is room at any of them.
    open: Vec<u64>,
}

/// A mask in the form in which it is placed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    size: [usize; 2],
    runs: Vec<Run>,
    square: Option<Square>,
}

/// Runs in an order in which the first few are far from each other and long: what one leaves open,
/// its neighbours mostly do as well. Each time the number of parts doubles into which the runs, by
/// their rows, are divided, the longest of each new part comes next.
fn spread(mut runs: Vec<Run>) -> Vec<Run> {
    runs.sort_by_key(|run| (run.row, run.start));
    let mut order = Vec::with_capacity(runs.len());
    let mut is_in = vec![false; runs.len()];
    let mut parts = 1;
    while order.len() < runs.len() {
        for part in 0..parts {
            let own = part * runs.len() / parts..(part + 1) * runs.len() / parts;
            if is_in[own.clone()].contains(&true) {
                continue;
            }
            let length = |&i: &usize| runs[i].end - runs[i].start;
            if let Some(longest) = own.max_by_key(length) {
                is_in[longest] = true;
                order.push(runs[longest]);
            }
        }
        parts *= 2;
    }
    order
}

/// In which rows, and in which groups of words there, a run or square of a shape has room.
struct Filter<'a> {
    /// From the row on in which it lies if the shape lies in the first.
    open: &'a [u64],
    /// How many groups it lies further to the right than the shape.
    shift: usize,
}

/// The groups of words with places in a row where a shape may have room.
fn groups(filters: &[Filter<'_>], y: usize) -> u64 {
    let mut groups = u64::MAX;
    for filter in filters {
        let open = filter.open[y] >> filter.shift;
        groups &= open | open >> 1;
        if groups == 0 {
            break;
        }
    }
    groups
}

/// A square of cells that are all in a shape.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Square {
    /// Its lower left cell.
    corner: [usize; 2],
    /// Cells along its side, of which two or more.
    side: usize,
}

impl Square {
    /// Squares with so many times doubled sides are looked up for it.
    fn level(&self) -> usize {
        (self.side.ilog2() as usize).min(LARGEST_SQUARE)
    }
}

impl Shape {
    /// The shape of a mask.
    pub fn new(mask: &Mask) -> Self {
        let (corner, side) = mask.largest_square();
        Self {
            size: mask.size(),
            runs: spread(mask.runs()),
            square: (side > 1).then_some(Square { corner, side }),
        }
    }

    /// Width and height in cells.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// How many cells it has.
    pub fn cells(&self) -> usize {
        self.runs.iter().map(|run| run.end - run.start).sum()
    }
}

impl Occupancy {
    /// An empty field of so many columns and rows.
    pub fn new(size: [usize; 2]) -> Self {
        let [columns, rows] = size;
        let stride = columns.div_ceil(WORD) + 2;
        let lengths = columns.max(1).ilog2() as usize + 1;
        let level = |_| Level {
            taken: vec![0; stride * rows],
            open: vec![u64::MAX; rows],
        };
        Self {
            size,
            stride,
            per_group: stride.div_ceil(WORD),
            runs: (0..lengths).map(level).collect(),
            squares: (0..LARGEST_SQUARE).map(level).collect(),
            longest: vec![columns; rows],
        }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The lowest place, and the leftmost of these, where a shape meets no cell that is taken, starts
    /// in row `bottom` or above and ends below row `top`.
    pub fn room(&self, shape: &Shape, bottom: usize, top: usize) -> Option<[usize; 2]> {
        let [width, height] = shape.size;
        let rows = (top.min(self.size[1]) + 1).checked_sub(height)?;
        let columns = (self.size[0] + 1).checked_sub(width)?;
        let wide_enough = |y: &usize| {
            let mut runs = shape.runs.iter();
            runs.all(|run| self.longest[y + run.row] >= run.end - run.start)
        };
        let filters = self.filters(shape);
        (bottom..rows).filter(wide_enough).find_map(|y| {
            let groups = groups(&filters, y);
            Some([self.room_in_row(shape, y, groups, columns)?, y])
        })
    }

    /// What tells for most rows that a shape has no room there: its largest square and a few of
    /// its runs.
    fn filters(&self, shape: &Shape) -> Vec<Filter<'_>> {
        let mut filters = Vec::with_capacity(1 + RUNS_ASKED);
        if let Some(square) = &shape.square {
            let [column, row] = square.corner;
            filters.push(self.filter(&self.squares[square.level() - 1], row, column));
        }
        for run in shape.runs.iter().take(RUNS_ASKED) {
            let level = &self.runs[(run.end - run.start).ilog2() as usize];
            filters.push(self.filter(level, run.row, run.start));
        }
        filters
    }

    fn filter<'a>(&self, level: &'a Level, row: usize, column: usize) -> Filter<'a> {
        Filter {
            open: &level.open[row..],
            shift: column / WORD / self.per_group,
        }
    }

    /// The leftmost of the first `columns` places in a row, in some groups of words, where a shape
    /// has room.
    fn room_in_row(
        &self,
        shape: &Shape,
        y: usize,
        mut groups: u64,
        columns: usize,
    ) -> Option<usize> {
        let per_group = self.per_group;
        while groups != 0 {
            let first = groups.trailing_zeros() as usize * per_group;
            groups &= groups - 1;
            for word in first..(first + per_group).min(columns.div_ceil(WORD)) {
                let mut free = match columns - word * WORD {
                    left if left < WORD => (1 << left) - 1,
                    _ => u64::MAX,
                };
                if let Some(square) = &shape.square {
                    free &= !self.square_taken(square, [word, y]);
                }
                for run in &shape.runs {
                    if free == 0 {
                        break;
                    }
                    free &= !self.run_taken(run, [word, y]);
                }
                if free != 0 {
                    return Some(word * WORD + free.trailing_zeros() as usize);
                }
            }
        }
        None
    }

    /// At which of the 64 places from a word of a row on a square meets cells that are taken; for
    /// large squares only the corners are looked at.
    fn square_taken(&self, square: &Square, [word, y]: [usize; 2]) -> u64 {
        let level = square.level();
        let taken = &self.squares[level - 1].taken;
        let last = square.side - (1 << level);
        let mut any = 0;
        for up in [0, last] {
            let row = &taken[(y + square.corner[1] + up) * self.stride..];
            for right in [0, last] {
                any |= read(row, word * WORD + square.corner[0] + right);
            }
        }
        any
    }

    /// At which of the 64 places from a word of a row on a run meets cells that are taken.
    fn run_taken(&self, run: &Run, [word, y]: [usize; 2]) -> u64 {
        let level = (run.end - run.start).ilog2() as usize;
        let row = &self.runs[level].taken[(y + run.row) * self.stride..];
        let last = run.end - (1 << level);
        read(row, word * WORD + run.start) | read(row, word * WORD + last)
    }

    /// Takes the cells of a shape.
    pub fn take(&mut self, shape: &Shape, [x, y]: [usize; 2]) {
        for run in &shape.runs {
            let row = (y + run.row) * self.stride;
            let (mut cell, end) = (x + run.start, x + run.end);
            while cell < end {
                let next = (cell / WORD * WORD + WORD).min(end);
                let bits = u64::MAX >> (WORD - (next - cell)) << (cell % WORD);
                self.runs[0].taken[row + cell / WORD] |= bits;
                cell = next;
            }
        }
        let columns = x..x + shape.size[0];
        let rows = y..y + shape.size[1];
        for row in rows.clone() {
            self.longest[row] = self.longest_free(row);
            self.update_runs(row, &columns);
        }
        for level in 1..=LARGEST_SQUARE {
            self.update_squares(level, &rows, &columns);
        }
    }

    fn update_runs(&mut self, row: usize, columns: &Range<usize>) {
        self.runs[0].close(row, &touched(columns, 1), self.size[0], self.stride);
        for k in 1..self.runs.len() {
            let (finer, coarser) = self.runs.split_at_mut(k);
            let finer = &finer[k - 1].taken[row * self.stride..][..self.stride];
            let words = touched(columns, 1 << k);
            for word in words.clone() {
                let ahead = read(finer, word * WORD + (1 << (k - 1)));
                coarser[0].taken[row * self.stride + word] = finer[word] | ahead;
            }
            coarser[0].close(row, &words, self.size[0], self.stride);
        }
    }

    fn update_squares(&mut self, level: usize, rows: &Range<usize>, columns: &Range<usize>) {
        let half = 1 << (level - 1);
        let words = touched(columns, 2 * half);
        let (finer, coarser) = self.squares.split_at_mut(level - 1);
        let finer = &finer.last().unwrap_or(&self.runs[0]).taken;
        let coarser = &mut coarser[0];
        for row in (rows.start + 1).saturating_sub(2 * half)..rows.end {
            let own = &finer[row * self.stride..][..self.stride];
            // Above the last row nothing is taken.
            let above = match row + half < self.size[1] {
                true => &finer[(row + half) * self.stride..][..self.stride],
                false => own,
            };
            let taken = &mut coarser.taken[row * self.stride..][..self.stride];
            for word in words.clone() {
                let ahead = word * WORD + half;
                taken[word] = own[word] | above[word] | read(own, ahead) | read(above, ahead);
            }
            coarser.close(row, &words, self.size[0], self.stride);
        }
    }

    fn longest_free(&self, row: usize) -> usize {
        let words = &self.runs[0].taken[row * self.stride..];
        let (mut longest, mut length) = (0, 0);
        let mut x = 0;
        while x < self.size[0] {
            let rest = words[x / WORD] >> (x % WORD);
            if rest & 1 == 1 {
                length = 0;
                x += rest.trailing_ones() as usize;
            } else {
                let left = (WORD - x % WORD).min(self.size[0] - x);
                let free = (rest.trailing_zeros() as usize).min(left);
                length += free;
                longest = longest.max(length);
                x += free;
            }
        }
        longest
    }
}

impl Level {
    /// Notes which groups have no room any more, among those of some words of a row that has
    /// `columns` cells and `stride` words.
    fn close(&mut self, row: usize, words: &Range<usize>, columns: usize, stride: usize) {
        let per_group = stride.div_ceil(WORD);
        let taken = &self.taken[row * stride..][..stride];
        let is_full = |word: usize| match columns.saturating_sub(word * WORD) {
            left if left < WORD => taken[word] | u64::MAX << left == u64::MAX,
            _ => taken[word] == u64::MAX,
        };
        for group in words.start / per_group..=(words.end - 1) / per_group {
            let first = group * per_group;
            if (first..(first + per_group).min(stride)).all(is_full) {
                self.open[row] &= !(1 << group);
            }
        }
    }
}

/// The words of a row in which something changes for runs or squares of so many cells to a side.
fn touched(columns: &Range<usize>, side: usize) -> Range<usize> {
    let first = (columns.start + 1).saturating_sub(side) / WORD;
    first..(columns.end - 1) / WORD + 1
}

/// The 64 bits of a row from a bit on; those past its end are 0.
fn read(row: &[u64], bit: usize) -> u64 {
    let (word, bits) = (bit / WORD, bit % WORD);
    let at = |word: usize| row.get(word).copied().unwrap_or(0);
    at(word) >> bits | at(word + 1) << 1 << (WORD - 1 - bits)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::super::outline::Outline;
    use super::*;

    /// Finds room as a search cell by cell does.
    #[test]
    fn room_is_the_first_that_a_plain_search_finds() {
        let mut random = Pcg64Mcg::seed_from_u64(11);
        for side in [5, 64, 65, 150, 300] {
            let mut occupancy = Occupancy::new([side; 2]);
            let mut taken = vec![false; side * side];
            for _ in 0..60 {
                let size = [0, 1].map(|_| random.random_range(1..=side.min(40) as u32 / 2 + 2));
                let [w, h] = size.map(f64::from);
                let corners = [[0.0, 0.0], [w, h * random.random::<f64>()], [0.3 * w, h]];
                let mut mask = Mask::empty([w, h].map(Mask::cells_for));
                mask.cover(&Outline::new(&corners, &[[0, 1, 2]]), 0.0);
                let shape = Shape::new(&mask);
                let [width, height] = shape.size;
                let meets = |x: usize, y: usize, taken: &[bool]| {
                    shape.runs.iter().any(|run| {
                        let row = &taken[(y + run.row) * side..];
                        row[x + run.start..x + run.end].contains(&true)
                    })
                };
                let expected = (0..(side + 1).saturating_sub(height))
                    .flat_map(|y| (0..(side + 1).saturating_sub(width)).map(move |x| [x, y]))
                    .find(|&[x, y]| !meets(x, y, &taken));
                let found = occupancy.room(&shape, 0, side);
                assert_eq!(found, expected);
                let Some([x, y]) = found else { continue };
                assert_eq!(occupancy.room(&shape, y, y + height), found);
                assert_eq!(occupancy.room(&shape, 0, y + height - 1), None);
                occupancy.take(&shape, [x, y]);
                for run in &shape.runs {
                    let row = &mut taken[(y + run.row) * side..];
                    row[x + run.start..x + run.end].fill(true);
                }
            }
        }
    }
}
