//! From a surface to its UV layout in one call.
//!
//! [`unwrap_direct`] lays out a mesh from its geometry alone, in seconds. [`unwrap`] also trains
//! the networks of *Flatten Anything* where [`Options::method`] or the surface asks for them: for
//! point clouds, and for maps that give UVs to any point. It is generic over the Burn backend.
//! This crate knows no file and no terminal.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use fam::{Options, Uvs, unwrap_direct};
//! use fam_surface::{Surface, shapes};
//!
//! # fn main() -> Result<(), fam::UnwrapError> {
//! let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 24, 12));
//! // No networks, so no map of any type.
//! let unwrapped = unwrap_direct::<()>(&surface, &Options::default(), &mut |_| {
//!     ControlFlow::Continue(())
//! })?;
//! if let Uvs::Mesh(uvs) = &unwrapped.uvs {
//!     println!("{} UVs; {:?}", uvs.uvs().len(), unwrapped.metrics);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Data flows one way: [`Options`], then training ([`train`]; [`plan`] fits it to a time), then
//! the layout, then [`Unwrapped`], of which [`Report`] is the part that is written down.

mod error;
mod kept;
mod layout;
mod measured;
mod method;
mod options;
mod parting;
mod pipeline;
pub mod plan;
mod progress;
mod report;
mod training;
mod unwrapped;
mod warnings;

pub use error::UnwrapError;
pub use kept::Kept;
pub use layout::{LaidOut, MarksReport, Uvs};
pub use measured::in_a_row;
pub use method::{FinishMode, Method, Used};
pub use options::Options;
pub use parting::{Parting, WEIGHTS};
pub use pipeline::{unwrap, unwrap_direct};
pub use progress::{Observer, Progress};
pub use report::Report;
pub use training::{Trained, train};
pub use unwrapped::{Training, Unwrapped};
pub use warnings::Warning;
