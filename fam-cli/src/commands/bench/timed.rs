use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use burn::tensor::backend::{AutodiffBackend, Backend};
use burn::tensor::{Int, Tensor};
use burn_autodiff::Autodiff;
use fam_core::evaluation::Evaluation;
use fam_core::neighbors::NeighborSearch;
use fam_core::networks::Mlp;

/// Seconds that something took so far.
#[derive(Debug, Default)]
pub struct Clock(Mutex<f64>);

/// Clocks of the parts of a step that are hooked.
#[derive(Debug, Default)]
pub struct Clocks {
    pub forward: Clock,
    pub tangents: Clock,
    pub neighbors: Clock,
}

impl Clocks {
    /// That of an evaluation with these tangents.
    fn of<T>(&self, tangents: &[T]) -> &Clock {
        match tangents.is_empty() {
            true => &self.forward,
            false => &self.tangents,
        }
    }
}

/// An evaluation whose calls are timed.
pub struct TimedEvaluation<B: AutodiffBackend> {
    pub inner: Arc<dyn Evaluation<B>>,
    pub clocks: Arc<Clocks>,
}

/// A search whose calls are timed.
pub struct TimedSearch<B: AutodiffBackend> {
    pub inner: Arc<dyn NeighborSearch<B>>,
    pub clocks: Arc<Clocks>,
}

impl Clock {
    /// The seconds since it was last read.
    pub fn read(&self) -> f64 {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn time<B: Backend, T>(&self, device: &B::Device, work: impl FnOnce() -> T) -> T {
        let (result, seconds) = seconds::<B, T>(device, work);
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) += seconds;
        result
    }
}

/// The seconds that `work` takes, all that it starts on the device included.
pub fn seconds<B: Backend, T>(device: &B::Device, work: impl FnOnce() -> T) -> (T, f64) {
    // A device that cannot be waited for fails in the work itself.
    let _ = B::sync(device);
    let before = Instant::now();
    let result = work();
    let _ = B::sync(device);
    (result, before.elapsed().as_secs_f64())
}

impl<B: AutodiffBackend> Evaluation<B> for TimedEvaluation<B> {
    fn single(&self, xi: &Mlp<B>, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let device = x.device();
        let work = || self.inner.single(xi, x);
        self.clocks.forward.time::<B, _>(&device, work)
    }

    fn twofold(
        &self,
        xi_1: &Mlp<B>,
        xi_2: &Mlp<B>,
        x: Tensor<B, 2>,
        tangents: Vec<Tensor<B, 2>>,
    ) -> (Tensor<B, 2>, Vec<Tensor<B, 2>>) {
        let device = x.device();
        let clock = self.clocks.of(&tangents);
        clock.time::<B, _>(&device, || self.inner.twofold(xi_1, xi_2, x, tangents))
    }

    /// Not timed: it is a part of a Jacobian that is differentiated backward.
    fn twofold_above(
        &self,
        xi_1: &Mlp<B>,
        xi_2: &Mlp<B>,
        x: Tensor<B, 2>,
        copies: Tensor<Autodiff<B>, 3>,
    ) -> (Tensor<B, 2>, Tensor<Autodiff<B>, 3>) {
        self.inner.twofold_above(xi_1, xi_2, x, copies)
    }
}

impl<B: AutodiffBackend> NeighborSearch<B> for TimedSearch<B> {
    fn nearest(&self, points: Tensor<B, 2>, queries: Tensor<B, 2>) -> Tensor<B, 1, Int> {
        let device = points.device();
        let work = || self.inner.nearest(points, queries);
        self.clocks.neighbors.time::<B, _>(&device, work)
    }

    fn nearest_others(&self, points: Tensor<B, 2>, k: usize) -> Tensor<B, 1, Int> {
        let device = points.device();
        let work = || self.inner.nearest_others(points, k);
        self.clocks.neighbors.time::<B, _>(&device, work)
    }

    fn gather(&self, points: Tensor<B, 2>, indices: Tensor<B, 1, Int>) -> Tensor<B, 2> {
        self.inner.gather(points, indices)
    }
}
