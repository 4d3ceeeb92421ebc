//! Training of the Flatten Anything Model on one surface.

mod config;
mod optimizer;
mod soap;
mod strategies;
mod trainer;
mod turn;

pub use config::{Ablation, TrainingConfig};
pub use optimizer::OptimizerKind;
pub use soap::Soap;
pub use strategies::Strategies;
pub use trainer::{Step, Trainer, TrainingError, train};
pub use turn::turn;
