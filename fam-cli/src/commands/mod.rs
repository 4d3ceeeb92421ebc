//! The commands, one file each.

mod backends;
mod map;
mod metrics;
mod unwrap;

pub use backends::backends;
pub use map::map;
pub use metrics::metrics;
pub use unwrap::unwrap;
