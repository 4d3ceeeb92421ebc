//! Generated surfaces of known geometry, for a first run and for tests.

mod cubes;
mod grid;
mod rings;
mod round;
mod sheets;
#[cfg(test)]
mod tests;

pub use cubes::{cube, sphere};
pub use round::{bust, cone, open_cylinder, open_sphere, torus};
pub use sheets::{draped_cloth, moebius_strip, rectangle, spiral};
