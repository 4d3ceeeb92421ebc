//! Training of the Flatten Anything Model on one surface.

mod config;
mod trainer;
mod turn;

pub use config::{Ablation, TrainingConfig};
pub use trainer::{Step, Trainer, TrainingError, train};
pub use turn::turn;
