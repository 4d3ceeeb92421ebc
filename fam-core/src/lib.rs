//! placeholder
pub mod cycles;
pub mod jacobian;
pub mod losses;
pub mod neighbors;
pub mod networks;
pub mod surface;
pub mod weights;
