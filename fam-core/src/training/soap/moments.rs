use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

use crate::training::checkpoint::{CheckpointError, Reader, Writer};

/// β₁ and β₂, of the running means of gradients, of their squares and of their products: short
/// memories, as suit a thousand steps.
pub(super) const BETA: f32 = 0.95;

/// Added to the root of the mean square, as in Adam.
pub(super) const EPSILON: f32 = 1e-8;

/// Steps between two turns of the bases, as in the authors' program.
const TURN_EVERY: i32 = 10;

/// Names of the bases of columns and rows in checkpoints.
const SIDES: [&str; 2] = ["columns", "rows"];

/// Running means of one parameter, whose values are taken in the order in which tensors have them.
#[derive(Debug, Clone)]
pub(super) struct Moments {
    time: i32,
    mean: Vec<f32>,
    /// Of the squares, in the bases.
    square: Vec<f32>,
    sides: Sides,
}

/// The bases in which steps are taken.
#[derive(Debug, Clone)]
enum Sides {
    /// Of a parameter that is no matrix: its own.
    None,
    /// Of a matrix without a gradient so far.
    Unknown([usize; 2]),
    /// Of the columns and the rows of a matrix, which is worked on as its transpose: row by row is
    /// column by column there.
    Known(Box<[Basis; 2]>),
}

/// The basis of one side of a matrix G.
#[derive(Debug, Clone)]
struct Basis {
    /// The running mean of G·Gᵀ or Gᵀ·G.
    products: Mat<f32>,
    /// Its eigenvectors, as columns, as of the last turn.
    vectors: Mat<f32>,
}

impl Moments {
    /// Of a parameter before its first gradient.
    pub fn new(shape: &[usize]) -> Self {
        let count = shape.iter().product();
        Self {
            time: 0,
            mean: vec![0.0; count],
            square: vec![0.0; count],
            sides: match *shape {
                [rows, columns] => Sides::Unknown([columns, rows]),
                _ => Sides::None,
            },
        }
    }

    /// Writes them under a name.
    pub fn write(&self, name: &str, out: &mut Writer) {
        // Whole numbers of training are exact in 32 bits.
        out.put(format!("{name}.time"), vec![1], &[self.time as f32]);
        out.put(format!("{name}.mean"), vec![self.mean.len()], &self.mean);
        out.put(
            format!("{name}.square"),
            vec![self.square.len()],
            &self.square,
        );
        if let Sides::Known(bases) = &self.sides {
            for (side, basis) in SIDES.iter().zip(&**bases) {
                for (what, matrix) in [("products", &basis.products), ("vectors", &basis.vectors)] {
                    let values: Vec<f32> =
                        matrix.col_iter().flat_map(|c| c.iter().copied()).collect();
                    out.put(format!("{name}.{side}.{what}"), vec![values.len()], &values);
                }
            }
        }
    }

    /// Those of a parameter of a shape that were written under a name, if any were.
    pub fn read(
        name: &str,
        shape: &[usize],
        file: &Reader,
    ) -> Result<Option<Self>, CheckpointError> {
        let mut moments = Self::new(shape);
        let (time, count) = (format!("{name}.time"), moments.mean.len());
        if !file.has(&time) {
            return Ok(None);
        }
        moments.time = file.get(&time, &[1])?[0] as i32;
        moments.mean = file.get(&format!("{name}.mean"), &[count])?;
        moments.square = file.get(&format!("{name}.square"), &[count])?;
        if let Sides::Unknown(sides) = moments.sides
            && file.has(&format!("{name}.{}.products", SIDES[0]))
        {
            let basis = |k: usize| -> Result<Basis, CheckpointError> {
                let n = sides[k];
                let matrix = |what: &str| -> Result<Mat<f32>, CheckpointError> {
                    let name = format!("{name}.{}.{what}", SIDES[k]);
                    let values = file.get(&name, &[n * n])?;
                    Ok(MatRef::from_column_major_slice(&values, n, n).to_owned())
                };
                Ok(Basis {
                    products: matrix("products")?,
                    vectors: matrix("vectors")?,
                })
            };
            moments.sides = Sides::Known(Box::new([basis(0)?, basis(1)?]));
        }
        Ok(Some(moments))
    }

    /// Takes a gradient into account. Returns the step against it, of a learning rate of 1: none
    /// by the first gradient of a matrix, which gives the bases.
    pub fn step(&mut self, gradient: Vec<f32>) -> Vec<f32> {
        if let Sides::Unknown([rows, columns]) = self.sides {
            let gradient = MatRef::from_column_major_slice(&gradient, rows, columns);
            // In its own bases, all of a gradient off the diagonal is rounding.
            self.sides = Sides::Known(Box::new(products(gradient).map(Basis::new)));
            return self.mean.clone();
        }
        self.time = self.time.saturating_add(1);
        running(&mut self.mean, &gradient);
        let unbiased = 1.0 / (1.0 - BETA.powi(self.time));
        let (mut update, turned) = (self.turned(&self.mean), self.turned(&gradient));
        for ((update, square), turned) in update.iter_mut().zip(&mut self.square).zip(turned) {
            *square = *square * BETA + turned * turned * (1.0 - BETA);
            *update = *update * unbiased / ((*square * unbiased).sqrt() + EPSILON);
        }
        let update = self.turned_back(update);
        self.observe(&gradient);
        update
    }

    /// Values in the bases: Lᵀ·X·R.
    fn turned(&self, x: &[f32]) -> Vec<f32> {
        match &self.sides {
            Sides::Known(bases) => {
                let [left, right] = bases.each_ref().map(|basis| basis.vectors.as_ref());
                sandwich(left.transpose(), x, right)
            }
            _ => x.to_vec(),
        }
    }

    /// The way back: L·X·Rᵀ.
    fn turned_back(&self, x: Vec<f32>) -> Vec<f32> {
        match &self.sides {
            Sides::Known(bases) => {
                let [left, right] = bases.each_ref().map(|basis| basis.vectors.as_ref());
                sandwich(left, &x, right.transpose())
            }
            _ => x,
        }
    }

    /// Takes a gradient into the bases, and turns them if it is time.
    fn observe(&mut self, gradient: &[f32]) {
        let Sides::Known(bases) = &mut self.sides else {
            return;
        };
        let [rows, columns] = bases.each_ref().map(|basis| basis.vectors.nrows());
        let gradient = MatRef::from_column_major_slice(gradient, rows, columns);
        for (basis, new) in bases.iter_mut().zip(products(gradient)) {
            for column in 0..new.ncols() {
                let mean = basis.products.col_as_slice_mut(column);
                running(mean, new.col_as_slice(column));
            }
        }
        if self.time % TURN_EVERY == 0 {
            let order = bases.each_mut().map(Basis::turn);
            let before = &self.square;
            self.square = order[1]
                .iter()
                .flat_map(|column| order[0].iter().map(move |row| before[column * rows + row]))
                .collect();
        }
    }
}

impl Basis {
    /// The eigenvectors of a symmetric matrix, those of the largest eigenvalues first; the identity
    /// if its values are not finite.
    fn new(products: Mat<f32>) -> Self {
        // What is not finite may keep the iteration of eigenvalues from its end.
        let eigen = products
            .is_all_finite()
            .then(|| products.self_adjoint_eigen(Side::Lower).ok())
            .flatten();
        let vectors = match eigen {
            Some(eigen) => eigen.U().reverse_cols().to_owned(),
            None => Mat::identity(products.nrows(), products.ncols()),
        };
        Self { products, vectors }
    }

    /// One power iteration for all eigenvectors, made orthonormal again, those of the largest
    /// eigenvalues first. Returns where each was before.
    fn turn(&mut self) -> Vec<usize> {
        let moved = product(self.products.as_ref(), self.vectors.as_ref());
        let value = |column: usize| {
            let vector = self.vectors.col_as_slice(column).iter();
            vector
                .zip(moved.col_as_slice(column))
                .map(|(a, b)| a * b)
                .sum()
        };
        let values: Vec<f32> = (0..moved.ncols()).map(value).collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        let mut sorted = moved.clone();
        for (column, &from) in order.iter().enumerate() {
            let to = sorted.col_as_slice_mut(column);
            to.copy_from_slice(moved.col_as_slice(from));
        }
        self.vectors = sorted.qr().compute_thin_Q();
        order
    }
}

/// Moves a running mean towards new values.
fn running(mean: &mut [f32], new: &[f32]) {
    for (mean, new) in mean.iter_mut().zip(new) {
        *mean = *mean * BETA + new * (1.0 - BETA);
    }
}

/// G·Gᵀ and Gᵀ·G.
fn products(gradient: MatRef<f32>) -> [Mat<f32>; 2] {
    let transposed = gradient.transpose();
    [product(gradient, transposed), product(transposed, gradient)]
}

/// a·X·b of square matrices a and b and a matrix X, column by column.
fn sandwich(a: MatRef<f32>, x: &[f32], b: MatRef<f32>) -> Vec<f32> {
    let (rows, columns) = (a.nrows(), b.nrows());
    let left = product(a, MatRef::from_column_major_slice(x, rows, columns));
    let mut result = vec![0.0; rows * columns];
    let to = MatMut::from_column_major_slice_mut(&mut result, rows, columns);
    matmul(to, Accum::Replace, left.as_ref(), b, 1.0, Par::Seq);
    result
}

/// a·b, on this thread.
fn product(a: MatRef<f32>, b: MatRef<f32>) -> Mat<f32> {
    let mut product = Mat::zeros(a.nrows(), b.ncols());
    matmul(product.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    product
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn matrix(rows: usize, columns: usize, seed: u64) -> Mat<f32> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        Mat::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0))
    }

    fn orthogonal(size: usize, seed: u64) -> Mat<f32> {
        matrix(size, size, seed).qr().compute_thin_Q()
    }

    fn by_rows(matrix: MatRef<f32>) -> Vec<f32> {
        let rows = 0..matrix.nrows();
        rows.flat_map(|row| matrix.row(row).iter().copied().collect::<Vec<_>>())
            .collect()
    }

    /// Minimises |A·X·B − T|² from zero, by targets that differ from T by `noise`; X then, and the
    /// distance of A·X·B from T.
    fn descend(
        [a, b, target]: [&Mat<f32>; 3],
        noise: f32,
        rate: f32,
        steps: u64,
    ) -> (Mat<f32>, f32) {
        let [rows, columns] = [target.nrows(), target.ncols()];
        let mut x = Mat::<f32>::zeros(rows, columns);
        let mut moments = Moments::new(&[rows, columns]);
        for step in 0..steps {
            let rest = a * &x * b - target + matrix(rows, columns, 100 + step) * faer::Scale(noise);
            let gradient = a.transpose() * rest * b.transpose();
            let update = moments.step(by_rows(gradient.as_ref()));
            let update = MatRef::from_row_major_slice(&update, rows, columns);
            x -= update * faer::Scale(rate);
        }
        let rest = a * &x * b - target;
        (x, rest.norm_l2())
    }

    /// Turning rows and columns of the problem turns the steps, which Adam's do not.
    #[test]
    fn steps_do_not_depend_on_the_axes() {
        let (a, b, target) = (matrix(5, 5, 1), matrix(5, 5, 2), matrix(5, 5, 3));
        let (turn, other) = (orthogonal(5, 4), orthogonal(5, 5));
        let (straight, _) = descend([&a, &b, &target], 0.3, 0.05, 25);
        let (a, b) = (a * turn.transpose(), other.transpose() * b);
        let (turned, _) = descend([&a, &b, &target], 0.3, 0.05, 25);
        let back = turn.transpose() * turned * other.transpose();
        let error = (back - straight).norm_max();
        assert!(error < 2e-3, "{error}");
    }

    /// A gradient of rank one that stays the same is a single number in its bases, and the step along it
    /// is Adam's: 1.
    #[test]
    fn an_oblong_matrix_steps_along_its_gradient() {
        let direction = [3.0f32, -2.0, 6.0].map(|x| x / 7.0);
        let other = [0.6f32, 0.8];
        let gradient: Vec<f32> = other
            .iter()
            .flat_map(|row| direction.map(|column| row * column))
            .collect();
        let mut moments = Moments::new(&[2, 3]);
        assert_eq!(moments.step(gradient.clone()), [0.0; 6]);
        for _ in 0..3 * TURN_EVERY {
            let update = moments.step(gradient.clone());
            let along: f32 = update.iter().zip(&gradient).map(|(a, b)| a * b).sum();
            assert!((along - 1.0).abs() < 1e-3, "{update:?}");
        }
    }

    #[test]
    fn badly_scaled_directions_converge() {
        // Lengths from 1 to 30, along no axis.
        let scales = faer::mat![[1.0f32, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 30.0]];
        let a = orthogonal(3, 1) * scales * orthogonal(3, 2);
        let b = orthogonal(3, 3);
        let target = &a * &b * matrix(3, 3, 4);
        let (_, error) = descend([&a, &b, &target], 0.0, 0.01, 400);
        let start = target.norm_l2();
        assert!(error < 1e-2 * start, "{error} of {start}");
    }
}
