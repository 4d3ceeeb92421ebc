//! Generated surfaces of known geometry, for a first run and for tests.
//!
//! - sheets: [`rectangle`], [`draped_cloth`], [`spiral`], [`moebius_strip`];
//! - around an axis: [`open_cylinder`], [`cone`], [`hemisphere`], [`open_sphere`], [`torus`],
//!   [`bust`];
//! - closed, without holes: [`cube`], [`sphere`], [`nail`], [`brain`];
//! - closed, with holes: [`bucket`] and [`knot`] of genus 1, [`double_torus`] of genus 2,
//!   [`three_holed_slab`] of genus 3;
//! - open, with several boundary loops: [`shirt`], [`car_shell`], [`hilbert_tube`];
//! - many parts in and through each other: [`assembly`].
//!
//! The same arguments make the same mesh, bit for bit. Triangles are counter-clockwise from
//! outside, but for the parts of an assembly that have their inside out.

mod assembly;
mod cubes;
mod fields;
mod grid;
mod hilbert;
mod implicit;
mod rings;
mod round;
mod sheets;
mod shells;
mod sizes;
mod solids;
#[cfg(test)]
mod tests;
mod tubes;

pub use assembly::assembly;
pub use cubes::{cube, sphere};
pub use round::{bust, cone, hemisphere, open_cylinder, open_sphere, torus};
pub use sheets::{draped_cloth, moebius_strip, rectangle, spiral};
pub use shells::{car_shell, shirt};
pub use solids::{brain, bucket, double_torus, nail, three_holed_slab};
pub use tubes::{hilbert_tube, knot};
