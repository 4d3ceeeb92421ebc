//! Which cells of the square are taken, and where there is room.

use super::mask::{Mask, Run};

const WORD: usize = u64::BITS as usize;

/// A square of cells. A bit of `levels[k]` says whether any of the 2ᵏ cells from there on in
/// its row is taken, so that a run of any length is tested at all places of a row at once.
pub struct Occupancy {
    side: usize,
    /// Words per row; two more than its cells need, so that a shifted read stays inside.
    stride: usize,
    levels: Vec<Vec<u64>>,
    /// For every row the length of its longest run of free cells.
    longest: Vec<usize>,
}

/// A mask in the form in which it is placed.
pub struct Shape {
    size: [usize; 2],
    runs: Vec<Run>,
}

impl Shape {
    /// The shape of a mask.
    pub fn new(mask: &Mask) -> Self {
        Self {
            size: mask.size(),
            runs: mask.runs(),
        }
    }

    /// Width and height in cells.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }
}

impl Occupancy {
    /// An empty square.
    pub fn new(side: usize) -> Self {
        let stride = side.div_ceil(WORD) + 2;
        let levels = side.max(1).ilog2() as usize + 1;
        Self {
            side,
            stride,
            levels: vec![vec![0; stride * side]; levels],
            longest: vec![side; side],
        }
    }

    /// The lowest place, and the leftmost of these, where a shape meets no cell that is taken
    /// and ends below row `top`.
    pub fn room(&self, shape: &Shape, top: usize) -> Option<[usize; 2]> {
        let [width, height] = shape.size;
        let rows = (top.min(self.side) + 1).checked_sub(height)?;
        let columns = (self.side + 1).checked_sub(width)?;
        let mut free = vec![0; columns.div_ceil(WORD)];
        let wide_enough = |y: &usize| {
            let mut runs = shape.runs.iter();
            runs.all(|run| self.longest[y + run.row] >= run.end - run.start)
        };
        (0..rows).filter(wide_enough).find_map(|y| {
            free.fill(u64::MAX);
            if columns % WORD > 0 {
                free[columns / WORD] = (1 << (columns % WORD)) - 1;
            }
            shape
                .runs
                .iter()
                .all(|run| self.keep_free(&mut free, y + run.row, run))
                .then(|| [first_bit(&free), y])
        })
    }

    /// How many rows there are up to the highest cell that is taken.
    pub fn height(&self) -> usize {
        let highest = self.longest.iter().rposition(|&free| free < self.side);
        highest.map_or(0, |row| row + 1)
    }

    /// Takes the cells of a shape.
    pub fn take(&mut self, shape: &Shape, [x, y]: [usize; 2]) {
        for run in &shape.runs {
            let row = (y + run.row) * self.stride;
            for cell in x + run.start..x + run.end {
                self.levels[0][row + cell / WORD] |= 1 << (cell % WORD);
            }
        }
        for row in y..y + shape.size[1] {
            self.update(row);
        }
    }

    fn update(&mut self, row: usize) {
        self.longest[row] = self.longest_free(row);
        let words = row * self.stride..row * self.stride + self.stride - 1;
        for k in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(k);
            let finer = &finer[k - 1];
            for i in words.clone() {
                let shift = 1 << (k - 1);
                let ahead = match i + shift / WORD {
                    from if from < words.end => shifted(finer[from], finer[from + 1], shift % WORD),
                    _ => 0,
                };
                coarser[0][i] = finer[i] | ahead;
            }
        }
    }

    fn longest_free(&self, row: usize) -> usize {
        let words = &self.levels[0][row * self.stride..];
        let (mut longest, mut length) = (0, 0);
        let mut x = 0;
        while x < self.side {
            let rest = words[x / WORD] >> (x % WORD);
            if rest & 1 == 1 {
                length = 0;
                x += rest.trailing_ones() as usize;
            } else {
                let left = (WORD - x % WORD).min(self.side - x);
                let free = (rest.trailing_zeros() as usize).min(left);
                length += free;
                longest = longest.max(length);
                x += free;
            }
        }
        longest
    }

    /// Drops the places where a run meets a cell that is taken; returns whether any remain.
    fn keep_free(&self, free: &mut [u64], row: usize, run: &Run) -> bool {
        let level = (run.end - run.start).ilog2() as usize;
        let taken = &self.levels[level][row * self.stride..(row + 1) * self.stride];
        let mut any = 0;
        for start in [run.start, run.end - (1 << level)] {
            any = 0;
            let ahead = &taken[start / WORD..];
            for (word, pair) in free.iter_mut().zip(ahead.windows(2)) {
                *word &= !shifted(pair[0], pair[1], start % WORD);
                any |= *word;
            }
        }
        any != 0
    }
}

/// The 64 bits that start `bits` (fewer than 64) after the first of two words.
fn shifted(word: u64, next: u64, bits: usize) -> u64 {
    word >> bits | next << 1 << (WORD - 1 - bits)
}

fn first_bit(words: &[u64]) -> usize {
    let word = words.iter().position(|&word| word != 0).unwrap_or(0);
    word * WORD + words[word].trailing_zeros() as usize
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Finds room as a search cell by cell does.
    #[test]
    fn room_is_the_first_that_a_plain_search_finds() {
        let mut random = Pcg64Mcg::seed_from_u64(11);
        for side in [5, 64, 65, 150] {
            let mut occupancy = Occupancy::new(side);
            let mut taken = vec![false; side * side];
            for _ in 0..60 {
                let size = [0, 1].map(|_| random.random_range(1..=side.min(40) as u32 / 2 + 2));
                let [w, h] = size.map(f64::from);
                let corners = [[0.0, 0.0], [w, h * random.random::<f64>()], [0.3 * w, h]];
                let mask = Mask::new(&corners, &[[0, 1, 2]], [w, h], 0.0);
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
                let found = occupancy.room(&shape, side);
                assert_eq!(found, expected);
                let Some([x, y]) = found else { continue };
                assert_eq!(occupancy.room(&shape, y + height), found);
                assert_eq!(occupancy.room(&shape, y + height - 1), None);
                occupancy.take(&shape, [x, y]);
                for run in &shape.runs {
                    let row = &mut taken[(y + run.row) * side..];
                    row[x + run.start..x + run.end].fill(true);
                }
            }
        }
    }
}
