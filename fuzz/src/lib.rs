//! What all fuzz targets do with their bytes.

#[path = "../../fam-io/tests/common/check.rs"]
mod check;

pub use check::check;
