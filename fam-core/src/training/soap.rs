use burn::optim::SimpleOptimizer;
use burn::record::Record;
use burn::tensor::{Int, Tensor, TensorData, backend::Backend};
use faer::{Mat, MatRef, Side};

/// β₁ and β₂, of the running means of gradients, of their squares and of their products: short
/// memories, as suit a thousand steps.
const BETA: f32 = 0.95;

/// Added to the root of the mean square, as in Adam.
const EPSILON: f32 = 1e-8;

/// Steps between two turns of the bases, as in the authors' program; a turn waits for the device.
const TURN_EVERY: usize = 10;

/// SOAP (Vyas et al., *Improving and Stabilizing Shampoo using Adam*, 2024): Adam, for matrices in
/// the eigenbases of the running means of G·Gᵀ and Gᵀ·G of their gradients G.
///
/// A step in that basis is a step of Adam in which the directions do not compete. Parameters that
/// are no matrices take plain steps of Adam. The first gradient of a matrix only gives its bases.
#[derive(Debug, Clone)]
pub struct Soap {
    /// Decoupled, as in AdamW.
    pub weight_decay: f32,
}

/// Running means of one parameter, and the bases of a matrix.
#[derive(Record, Clone)]
pub struct SoapState<B: Backend, const D: usize> {
    time: usize,
    mean: Tensor<B, D>,
    /// Of the squares, in the bases.
    square: Tensor<B, D>,
    /// Of the rows' and the columns' side.
    left: Option<SideState<B, D>>,
    right: Option<SideState<B, D>>,
}

/// One side of a matrix.
#[derive(Record, Clone)]
pub struct SideState<B: Backend, const D: usize> {
    /// The running mean of G·Gᵀ or Gᵀ·G.
    products: Tensor<B, D>,
    /// Its eigenvectors, as columns, as of the last turn.
    basis: Tensor<B, D>,
}

impl<B: Backend> SimpleOptimizer<B> for Soap {
    type State<const D: usize> = SoapState<B, D>;

    fn step<const D: usize>(
        &self,
        rate: f64,
        parameter: Tensor<B, D>,
        gradient: Tensor<B, D>,
        state: Option<SoapState<B, D>>,
    ) -> (Tensor<B, D>, Option<SoapState<B, D>>) {
        let Some(mut state) = state else {
            let state = SoapState::new(gradient.clone());
            if D == 2 {
                // In its own bases, all of a gradient off the diagonal is rounding.
                return (parameter, Some(state));
            }
            return self.step(rate, parameter, gradient, Some(state));
        };
        state.time += 1;
        state.mean = running(state.mean, gradient.clone());
        let turned = state.turned(gradient.clone());
        state.square = running(state.square, turned.clone() * turned);
        let unbiased = 1.0 - BETA.powi(state.time as i32);
        let mean = state.turned(state.mean.clone()) / unbiased;
        let root = (state.square.clone() / unbiased).sqrt() + EPSILON;
        let update = state.turned_back(mean / root);
        state.observe(gradient);
        let decayed = parameter * (1.0 - rate * f64::from(self.weight_decay));
        (decayed - update * rate, Some(state))
    }

    fn to_device<const D: usize>(state: SoapState<B, D>, device: &B::Device) -> SoapState<B, D> {
        let side = |side: SideState<B, D>| SideState {
            products: side.products.to_device(device),
            basis: side.basis.to_device(device),
        };
        SoapState {
            time: state.time,
            mean: state.mean.to_device(device),
            square: state.square.to_device(device),
            left: state.left.map(side),
            right: state.right.map(side),
        }
    }
}

impl<B: Backend, const D: usize> SoapState<B, D> {
    fn new(gradient: Tensor<B, D>) -> Self {
        let [left, right] = match D {
            2 => [true, false].map(|left| {
                let products = products(gradient.clone(), left);
                Some(SideState::new(products))
            }),
            _ => [None, None],
        };
        Self {
            time: 0,
            mean: gradient.zeros_like(),
            square: gradient.zeros_like(),
            left,
            right,
        }
    }

    /// A matrix in the bases: Lᵀ·X·R.
    fn turned(&self, mut x: Tensor<B, D>) -> Tensor<B, D> {
        if let Some(left) = &self.left {
            x = left.basis.clone().transpose().matmul(x);
        }
        if let Some(right) = &self.right {
            x = x.matmul(right.basis.clone());
        }
        x
    }

    /// The way back: L·X·Rᵀ.
    fn turned_back(&self, mut x: Tensor<B, D>) -> Tensor<B, D> {
        if let Some(left) = &self.left {
            x = left.basis.clone().matmul(x);
        }
        if let Some(right) = &self.right {
            x = x.matmul(right.basis.clone().transpose());
        }
        x
    }

    /// Takes a gradient into account, and turns the bases if it is time.
    fn observe(&mut self, gradient: Tensor<B, D>) {
        let turn = self.time.is_multiple_of(TURN_EVERY);
        for (side, is_left) in [(&mut self.left, true), (&mut self.right, false)] {
            if let Some(side) = side {
                let product = products(gradient.clone(), is_left);
                side.products = running(side.products.clone(), product);
                if turn {
                    let order = side.turn();
                    let along = if is_left { 0 } else { 1 };
                    self.square = self.square.clone().select(along, order);
                }
            }
        }
    }
}

impl<B: Backend, const D: usize> SideState<B, D> {
    fn new(products: Tensor<B, D>) -> Self {
        let basis = eigenvectors(&products);
        Self { products, basis }
    }

    /// One power iteration for all eigenvectors, made orthonormal again, those of the largest
    /// eigenvalues first. Returns where each was before.
    fn turn(&mut self) -> Tensor<B, 1, Int> {
        let (products, basis) = (on_host(&self.products), on_host(&self.basis));
        let product = &products * &basis;
        let value = |c: usize| basis.col(c).transpose() * product.col(c);
        let values: Vec<f64> = (0..basis.ncols()).map(value).collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        let sorted = Mat::from_fn(product.nrows(), product.ncols(), |row, column| {
            product[(row, order[column])]
        });
        self.basis = on_device(sorted.qr().compute_thin_Q().as_ref(), &self.basis);
        let order: Vec<i32> = order.into_iter().map(|c| c as i32).collect();
        Tensor::from_ints(order.as_slice(), &self.basis.device())
    }
}

fn running<B: Backend, const D: usize>(mean: Tensor<B, D>, new: Tensor<B, D>) -> Tensor<B, D> {
    mean * BETA + new * (1.0 - BETA)
}

/// G·Gᵀ of the left or Gᵀ·G of the right side.
fn products<B: Backend, const D: usize>(gradient: Tensor<B, D>, left: bool) -> Tensor<B, D> {
    let transposed = gradient.clone().transpose();
    match left {
        true => gradient.matmul(transposed),
        false => transposed.matmul(gradient),
    }
}

/// The eigenvectors of a symmetric matrix, those of the largest eigenvalues first; the identity if
/// its values are not finite.
fn eigenvectors<B: Backend, const D: usize>(symmetric: &Tensor<B, D>) -> Tensor<B, D> {
    let matrix = on_host(symmetric);
    // What is not finite may keep the iteration of eigenvalues from its end.
    let eigen = matrix
        .is_all_finite()
        .then(|| matrix.self_adjoint_eigen(Side::Lower).ok());
    match eigen.flatten() {
        Some(eigen) => on_device(eigen.U().reverse_cols(), symmetric),
        None => {
            let identity = Mat::<f64>::identity(matrix.nrows(), matrix.ncols());
            on_device(identity.as_ref(), symmetric)
        }
    }
}

fn on_host<B: Backend, const D: usize>(matrix: &Tensor<B, D>) -> Mat<f64> {
    let dims = matrix.dims();
    let values: Vec<f32> = matrix.to_data().iter::<f32>().collect();
    Mat::from_fn(dims[0], dims[1], |row, column| {
        f64::from(values[row * dims[1] + column])
    })
}

/// A square matrix of the size of `like`, where that is.
fn on_device<B: Backend, const D: usize>(matrix: MatRef<f64>, like: &Tensor<B, D>) -> Tensor<B, D> {
    let rows = 0..matrix.nrows();
    let values = rows.flat_map(|row| (0..matrix.ncols()).map(move |c| matrix[(row, c)] as f32));
    let data = TensorData::new(values.collect(), like.shape());
    Tensor::from_data(data, &like.device())
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::optim::AdamWConfig;
    use burn::tensor::Tolerance;
    use burn_ndarray::NdArray;
    use rand::{RngExt, SeedableRng};

    type Matrix = Tensor<NdArray, 2>;

    fn matrix(rows: usize, columns: usize, seed: u64) -> Matrix {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut draw = || rng.random_range(-1.0..1.0f32);
        let values: Vec<f32> = (0..rows * columns).map(|_| draw()).collect();
        Tensor::from_data(
            TensorData::new(values, [rows, columns]),
            &Default::default(),
        )
    }

    fn orthogonal(size: usize, seed: u64) -> Matrix {
        let like = matrix(size, size, seed);
        on_device(on_host(&like).qr().compute_thin_Q().as_ref(), &like)
    }

    const SOAP: Soap = Soap { weight_decay: 0.0 };

    /// Minimises |A·X·B − T|² from zero, by targets that differ from T by `noise`; X then, and the
    /// squared distance of A·X·B from T.
    fn descend(
        optimizer: &impl SimpleOptimizer<NdArray>,
        [a, b, target]: [&Matrix; 3],
        noise: f32,
        rate: f64,
        steps: u64,
    ) -> (Matrix, f32) {
        let mut x = target.zeros_like();
        let mut state = None;
        let rest = |x: &Matrix| a.clone().matmul(x.clone()).matmul(b.clone()) - target.clone();
        for step in 0..steps {
            let [rows, columns] = target.dims();
            let rest = rest(&x) + matrix(rows, columns, 100 + step) * noise;
            let gradient = a
                .clone()
                .transpose()
                .matmul(rest)
                .matmul(b.clone().transpose());
            (x, state) = optimizer.step(rate, x, gradient, state);
        }
        let error = rest(&x).powf_scalar(2.0).sum().into_scalar();
        (x, error)
    }

    /// Turning rows and columns of the problem turns the steps, which Adam's do not.
    #[test]
    fn steps_do_not_depend_on_the_axes() {
        let (a, b, target) = (matrix(5, 5, 1), matrix(5, 5, 2), matrix(5, 5, 3));
        let (turn, other) = (orthogonal(5, 4), orthogonal(5, 5));
        let (straight, _) = descend(&SOAP, [&a, &b, &target], 0.3, 0.05, 25);
        let a = a.matmul(turn.clone().transpose());
        let b = other.clone().transpose().matmul(b);
        let (turned, _) = descend(&SOAP, [&a, &b, &target], 0.3, 0.05, 25);
        let back = turn.transpose().matmul(turned).matmul(other.transpose());
        let tolerance = Tolerance::<f32>::absolute(2e-3);
        back.into_data()
            .assert_approx_eq(&straight.into_data(), tolerance);
    }

    #[test]
    fn badly_scaled_directions_converge() {
        // Lengths from 1 to 30, along no axis.
        let scales = [[1.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 30.0]];
        let scales = Matrix::from_floats(scales, &Default::default());
        let a = orthogonal(3, 1).matmul(scales).matmul(orthogonal(3, 2));
        let b = orthogonal(3, 3);
        let target = a.clone().matmul(matrix(3, 3, 4)).matmul(b.clone());
        let start = target.clone().powf_scalar(2.0).sum().into_scalar();
        let (_, error) = descend(&SOAP, [&a, &b, &target], 0.0, 0.01, 400);
        assert!(error < 1e-4 * start, "{error} of {start}");
    }

    #[test]
    fn vectors_take_the_steps_of_adam() {
        let start = Tensor::<NdArray, 1>::from_floats([1.0, -2.0, 0.5], &Default::default());
        let soap = Soap { weight_decay: 0.1 };
        let adam = AdamWConfig::new()
            .with_beta_1(BETA)
            .with_beta_2(BETA)
            .with_epsilon(EPSILON)
            .with_weight_decay(0.1)
            .build();
        let (mut a, mut b) = (start.clone(), start);
        let (mut of_a, mut of_b) = (None, None);
        for _ in 0..5 {
            let gradient = |x: &Tensor<NdArray, 1>| x.clone() * 2.0 + 0.3;
            let (of, at) = (gradient(&a), gradient(&b));
            (a, of_a) = SimpleOptimizer::<NdArray>::step(&soap, 0.1, a, of, of_a);
            (b, of_b) = SimpleOptimizer::<NdArray>::step(&adam, 0.1, b, at, of_b);
        }
        let tolerance = Tolerance::<f32>::absolute(1e-5);
        a.into_data().assert_approx_eq(&b.into_data(), tolerance);
    }
}
