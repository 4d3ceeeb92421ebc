//! The training objectives, each a mean over points.

mod conformality;
mod cycle_consistency;
mod objective;
mod terms;
mod unwrapping;
mod wrapping;

pub use conformality::{Flattening, conformality_loss, flattening_loss};
pub use cycle_consistency::{normal_loss, point_cycle_loss, uv_cycle_loss};
pub use objective::{LossWeights, Losses, Objective, Term};
pub use terms::{AddedTerm, Evaluated, Isometry, Landmarks, LossTerm, Mips, TermConfig, TermKind};
pub use unwrapping::{
    bounding_box_normalized, bounding_box_side, repulsion_threshold, unwrapping_loss,
};
pub use wrapping::{ChamferDistance, chamfer_distance};
