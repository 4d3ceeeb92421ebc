//! Flatten Anything: unsupervised neural surface parameterization on [Burn](https://burn.dev).
//!
//! Four small networks, trained on one surface in a bi-directional cycle, map its points to
//! UV coordinates and find the cutting seams themselves. No connectivity is needed: meshes
//! of any topology and raw point clouds are flattened alike. The method is that of Zhang, Hou,
//! Wang and He, *Flatten Anything: Unsupervised Neural Surface Parameterization* (NeurIPS 2024).
//!
//! Everything is generic over the backend `B`; this crate names none, and knows no file and no
//! terminal. Data flows one way:
//!
//! - [`sampling`]: the points that training sees;
//! - [`networks`], [`cycles`], [`jacobian`], [`losses`], [`neighbors`]: the method, equation by
//!   equation;
//! - [`evaluation`]: how the networks are computed, by plain operations or by faster ones;
//! - [`training`]: configuration and the loop;
//! - [`atlas`]: surfaces of several components, one map each, in one UV square;
//! - [`map`]: the trained map, UVs for any points, saved and loaded.
//!
//! Surfaces, their metrics and seams are those of `fam_surface`; `fam_layout` makes a layout of
//! a map: cut along edges, flattened, packed.
//!
//! ```no_run
//! use std::ops::ControlFlow;
//!
//! use burn_autodiff::Autodiff;
//! use burn_ndarray::NdArray;
//! use fam_surface::{Surface, shapes};
//! use fam_core::training::{Strategies, TrainingConfig, train};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 80, 40));
//! let config = TrainingConfig::fast();
//! let device = Default::default();
//! let map = train::<Autodiff<NdArray>>(config, &surface, &device, Strategies::tiled(), |step| {
//!     println!("{}: {}", step.iteration, step.total);
//!     ControlFlow::Continue(())
//! })?;
//! let uvs = map.uvs(surface.positions());
//! # Ok(())
//! # }
//! ```

pub mod atlas;
pub mod cycles;
pub mod evaluation;
pub mod jacobian;
pub mod losses;
pub mod map;
pub mod neighbors;
pub mod networks;
pub mod sampling;
pub mod training;
pub mod weights;
