//! The commands, one file each.

mod backends;
mod bench;
mod evaluate;
mod export;
mod import;
mod map;
mod metrics;
mod pack;
mod report;
mod unwrap;

pub use backends::backends;
pub use bench::bench;
pub use evaluate::evaluate;
pub use export::export;
pub use import::import;
pub use map::map;
pub use metrics::metrics;
pub use pack::pack;
pub use report::report;
pub use unwrap::unwrap;
