//! The four sub-networks of the Flatten Anything Model and the module that holds them.
//!
//! All map points row by row: `[N, in] → [N, out]`. Each is stacked linear layers ([`Mlp`]);
//! all but Unwrap-Net feed their input a second time into a second stack: ξ″([x, ξ′(x)]).

mod cut;
mod deform;
mod mlp;
mod model;
mod unwrap;
mod wrap;

pub use cut::CutNet;
pub use deform::DeformNet;
pub use mlp::{Mlp, Slopes};
pub(crate) use mlp::{NEGATIVE_SLOPE, activation_slope};
pub use model::{FlattenAnything, FlattenAnythingConfig};
pub use unwrap::UnwrapNet;
pub use wrap::{WrapNet, Wrapped};
