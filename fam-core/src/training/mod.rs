//! Training of the Flatten Anything Model on one surface.

pub(crate) mod checkpoint;
mod config;
mod optimizer;
mod soap;
mod starts;
mod state;
mod strategies;
mod trainer;
mod turn;

pub use checkpoint::CheckpointError;
pub use config::{Ablation, TrainingConfig};
pub use optimizer::OptimizerKind;
pub use soap::Soap;
pub use strategies::Strategies;
pub(crate) use trainer::TrainerRecord;
pub use trainer::{Step, Trainer, TrainingError, train};
pub use turn::turn;
