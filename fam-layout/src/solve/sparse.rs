//! Symmetric positive definite systems over a graph.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::SolveError;

/// A symmetric matrix of `D × D` blocks: one for every node of a graph and every pair of linked
/// nodes. The pattern is analysed once; values change.
///
/// The nodes are ordered by approximate minimum degree; of the matrix in that order the upper
/// triangle is stored by columns.
pub(super) struct SparseSystem<const D: usize> {
    /// The place of every node in the order.
    ranks: Vec<usize>,
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: MemBuffer,
}

/// Where the block of two linked nodes is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Slot<const D: usize> {
    /// The first entry of each of its columns.
    columns: [u32; D],
    /// Whether the columns are those of the first node.
    transposed: bool,
}

impl<const D: usize> SparseSystem<D> {
    /// The system of nodes 0 to `nodes` with links between some of them, in any order and as
    /// often as it may be, but none from a node to itself; all values are 0.
    ///
    /// # Errors
    /// It is too large.
    pub(super) fn new(nodes: usize, links: &[[u32; 2]]) -> Result<Self, SolveError> {
        let (starts, rows) = upper_columns(nodes, links, |node| node as usize);
        let ranks = minimum_degree(nodes, &starts, &rows)?;
        let (starts, rows) = upper_columns(nodes, links, |node| ranks[node as usize]);
        let (starts, rows) = in_blocks::<D>(&starts, &rows);
        if rows.len() > u32::MAX as usize {
            return Err(SolveError::Singular);
        }
        let size = D * nodes;
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &starts, None, &rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Upper,
            SymmetricOrdering::Identity,
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| SolveError::Singular)?;
        let request = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(2 / D, Par::Seq),
        ]);
        let scratch = MemBuffer::try_new(request).map_err(|_| SolveError::Singular)?;
        Ok(Self {
            ranks,
            values: vec![0.0; rows.len()],
            factor: vec![0.0; symbolic.len_val()],
            starts,
            rows,
            symbolic,
            scratch,
        })
    }

    /// Where the block of nodes `a` and `b` is; none if they are not linked.
    pub(super) fn slot(&self, a: u32, b: u32) -> Option<Slot<D>> {
        let (a, b) = (self.ranks[a as usize], self.ranks[b as usize]);
        let (row, column) = (D * a.min(b), D * a.max(b));
        let mut columns = [0; D];
        for (k, place) in columns.iter_mut().enumerate() {
            let start = self.starts[column + k];
            let entries = &self.rows[start..self.starts[column + k + 1]];
            *place = (start + entries.binary_search(&row).ok()?) as u32;
        }
        Some(Slot {
            columns,
            transposed: a > b,
        })
    }

    /// Sets all values to 0.
    pub(super) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Adds a block, given by its rows for the first of the nodes that the slot was asked for
    /// and its columns for the second.
    pub(super) fn add(&mut self, slot: Slot<D>, block: &[[f64; D]; D]) {
        for (k, &place) in slot.columns.iter().enumerate() {
            let entries = &mut self.values[place as usize..place as usize + D];
            for (i, entry) in entries.iter_mut().enumerate() {
                *entry += if slot.transposed {
                    block[k][i]
                } else {
                    block[i][k]
                };
            }
        }
    }

    /// Adds a symmetric block on the diagonal.
    pub(super) fn add_diagonal(&mut self, node: u32, block: &[[f64; D]; D]) {
        let column = D * self.ranks[node as usize];
        for k in 0..D {
            let end = self.starts[column + k + 1];
            let entries = &mut self.values[end - 1 - k..end];
            for (entry, row) in entries.iter_mut().zip(block) {
                *entry += row[k];
            }
        }
    }

    /// Multiplies the diagonal.
    pub(super) fn scale_diagonal(&mut self, factor: f64) {
        for &end in &self.starts[1..] {
            self.values[end - 1] *= factor;
        }
    }

    /// Factorises the matrix.
    ///
    /// # Errors
    /// It is not positive definite, to rounding.
    pub(super) fn factorize(&mut self) -> Result<(), SolveError> {
        let size = self.starts.len() - 1;
        let pattern =
            SymbolicSparseColMatRef::new_checked(size, size, &self.starts, None, &self.rows);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                SparseColMatRef::new(pattern, &self.values),
                Side::Upper,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Default::default(),
            )
            .map_err(|_| SolveError::Singular)?;
        Ok(())
    }

    /// Solves for two components per node with the last factorisation: for `D = 2` they are
    /// one right-hand side, for `D = 1` two.
    pub(super) fn solve(&mut self, nodes: &mut [[f64; 2]]) {
        let count = nodes.len();
        let place = |rank: usize, k: usize| {
            if D == 1 {
                k * count + rank
            } else {
                D * rank + k
            }
        };
        let mut sides = vec![0.0; 2 * count];
        for (&rank, node) in self.ranks.iter().zip(&*nodes) {
            for k in 0..2 {
                sides[place(rank, k)] = node[k];
            }
        }
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut sides, D * count, 2 / D),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for (&rank, node) in self.ranks.iter().zip(nodes) {
            *node = [0, 1].map(|k| sides[place(rank, k)]);
        }
    }
}

/// The upper triangle of a symmetric pattern by columns (with the diagonal), rows ascending,
/// for nodes at the places that `rank` gives them.
fn upper_columns(
    nodes: usize,
    links: &[[u32; 2]],
    rank: impl Fn(u32) -> usize,
) -> (Vec<usize>, Vec<usize>) {
    let ends = |&[a, b]: &[u32; 2]| {
        let (a, b) = (rank(a), rank(b));
        (a.max(b), a.min(b))
    };
    // A counting sort by columns: this is done for every cut that is tried.
    let mut ends_of_columns = vec![1; nodes];
    for link in links {
        ends_of_columns[ends(link).0] += 1;
    }
    let mut sum = 0;
    for end in &mut ends_of_columns {
        (*end, sum) = (sum, sum + *end);
    }
    let mut all_rows = vec![0; sum];
    let mut put = |column: usize, row: usize| {
        let end = &mut ends_of_columns[column];
        all_rows[*end] = row;
        *end += 1;
    };
    for node in 0..nodes {
        put(node, node);
    }
    for link in links {
        let (column, row) = ends(link);
        put(column, row);
    }
    let mut starts = vec![0; nodes + 1];
    let mut rows = Vec::with_capacity(sum);
    let mut start = 0;
    for (column, &end) in ends_of_columns.iter().enumerate() {
        let entries = &mut all_rows[start..end];
        entries.sort_unstable();
        rows.extend(entries.chunk_by(|a, b| a == b).map(|same| same[0]));
        starts[column + 1] = rows.len();
        start = end;
    }
    (starts, rows)
}

/// The place of every node in an order of little fill.
fn minimum_degree(
    nodes: usize,
    starts: &[usize],
    rows: &[usize],
) -> Result<Vec<usize>, SolveError> {
    let (mut order, mut ranks) = (vec![0; nodes], vec![0; nodes]);
    let request = amd::order_scratch::<usize>(nodes, rows.len());
    let mut scratch = MemBuffer::try_new(request).map_err(|_| SolveError::Singular)?;
    amd::order(
        &mut order,
        &mut ranks,
        SymbolicSparseColMatRef::new_checked(nodes, nodes, starts, None, rows),
        amd::Control::default(),
        MemStack::new(&mut scratch),
    )
    .map_err(|_| SolveError::Singular)?;
    Ok(ranks)
}

/// The upper columns of the pattern in which every entry is a block of `D × D`.
fn in_blocks<const D: usize>(starts: &[usize], rows: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let mut block_starts = vec![0];
    let mut block_rows = Vec::with_capacity(D * D * rows.len());
    for column in starts.windows(2) {
        for k in 0..D {
            let entries = &rows[column[0]..column[1]];
            let expanded = entries.iter().flat_map(|&row| D * row..D * (row + 1));
            block_rows.extend(expanded.take(D * (entries.len() - 1) + k + 1));
            block_starts.push(block_rows.len());
        }
    }
    (block_starts, block_rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Blocks of random diagonally dominant matrices; the product with a known vector is
    /// taken with a dense matrix.
    fn residual<const D: usize>(nodes: usize, seed: u64) -> f64 {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let links: Vec<[u32; 2]> = (0..3 * nodes)
            .map(|_| [0, 1].map(|_| random.random_range(0..nodes as u32)))
            .filter(|[a, b]| a != b)
            .collect();
        let mut system = SparseSystem::<D>::new(nodes, &links).unwrap();
        let mut dense = vec![vec![0.0; D * nodes]; D * nodes];
        for &[a, b] in &links {
            let block = [[0.0; D]; D].map(|row| row.map(|_| random.random_range(-1.0..1.0)));
            system.add(system.slot(a, b).unwrap(), &block);
            for i in 0..D {
                for k in 0..D {
                    dense[D * a as usize + i][D * b as usize + k] += block[i][k];
                    dense[D * b as usize + k][D * a as usize + i] += block[i][k];
                }
            }
        }
        for node in 0..nodes {
            let mut block = [[0.5; D]; D];
            for (i, row) in block.iter_mut().enumerate() {
                row[i] = 100.0;
            }
            system.add_diagonal(node as u32, &block);
            for i in 0..D {
                for k in 0..D {
                    dense[D * node + i][D * node + k] += block[i][k];
                }
            }
        }
        system.factorize().unwrap();
        let known: Vec<[f64; 2]> = (0..nodes)
            .map(|_| [0, 1].map(|_| random.random_range(-1.0..1.0)))
            .collect();
        let component = |k: usize, side: usize| {
            if D == 1 {
                known[k][side]
            } else {
                known[k / D][k % D]
            }
        };
        let product = |row: usize, side: usize| -> f64 {
            (0..D * nodes)
                .map(|k| dense[row][k] * component(k, side))
                .sum()
        };
        let mut solved: Vec<[f64; 2]> = (0..nodes)
            .map(|node| [0, 1].map(|k| product(D * node + if D == 1 { 0 } else { k }, k)))
            .collect();
        system.solve(&mut solved);
        std::iter::zip(known.iter().flatten(), solved.iter().flatten())
            .map(|(a, b): (&f64, &f64)| (a - b).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn solutions_are_those_of_the_dense_matrix() {
        for seed in 0..5 {
            assert!(residual::<1>(60, seed) < 1e-12);
            assert!(residual::<2>(60, seed) < 1e-12);
        }
        assert!(residual::<2>(1, 9) < 1e-12);
    }

    #[test]
    fn nodes_without_a_link_have_no_slot() {
        let system = SparseSystem::<2>::new(3, &[[2, 0]]).unwrap();
        assert!(system.slot(0, 2).is_some());
        assert!(system.slot(0, 1).is_none());
    }

    #[test]
    fn indefinite_matrices_are_an_error() {
        let mut system = SparseSystem::<1>::new(2, &[[0, 1]]).unwrap();
        system.add(system.slot(0, 1).unwrap(), &[[2.0]]);
        system.add_diagonal(0, &[[1.0]]);
        system.add_diagonal(1, &[[1.0]]);
        assert_eq!(system.factorize(), Err(SolveError::Singular));
    }
}
