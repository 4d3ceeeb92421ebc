use std::sync::{Mutex, MutexGuard, PoisonError};

static TURN: Mutex<()> = Mutex::new(());

/// The turn to build a graph and differentiate it: there is one in a process, and every
/// [`Trainer`](super::Trainer) waits for it before each step.
///
/// After a backward pass, burn-autodiff 0.21 frees steps of graphs that other threads are still
/// building, whose gradients are then wrong or missing without an error
/// (<https://github.com/tracel-ai/burn/issues/5573>). Code that differentiates on a thread beside
/// trainers holds this from the first operation until it has its gradients.
///
/// A thread that holds it must not ask for it again, nor step a trainer. So trainers do not belong
/// into tasks of `rayon`: what waits in one of them for another core may take up another, and with
/// it the turn that it has.
pub fn turn() -> MutexGuard<'static, ()> {
    // The lock guards no data that a panic could leave half done.
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}
