//! The method on ndarray, in one binary: its types take long to compile.

#[path = "../reference_numbers/mod.rs"]
mod reference_numbers;

mod atlas;
mod checkpoints;
mod gradients;
mod parity;
mod tensors;
mod terms;
mod training;
