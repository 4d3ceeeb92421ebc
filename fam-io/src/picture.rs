//! Pictures of a parameterized surface, drawn in software.
//!
//! [`uv_picture`] shows the UV layout, [`preview_picture`] the surface, its UVs, a checker
//! texture on it, and its seams. The same input gives the same pixels on every run.

mod camera;
mod cloud;
mod input;
mod png;
mod preview;
mod raster;
mod scene;
mod shading;
mod uv;

pub use input::{Flattened, Seams};
pub use png::encode_png;
pub use preview::preview_picture;
pub use uv::uv_picture;
