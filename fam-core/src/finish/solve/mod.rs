//! Layouts of charts in the plane.

pub(crate) mod boundary;
