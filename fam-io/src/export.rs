//! Writing a scene as a new file of any format.

use std::io::Write;

use crate::scene::Scene;
use crate::{Format, Uvs, WriteFault, WriteOptions};

/// Writes a scene with UVs: one triangle of UVs for each of its polygons' fans in order, or
/// one UV for each of its points.
pub(crate) fn write(
    _scene: &Scene,
    _uvs: &Uvs,
    format: Format,
    _options: &WriteOptions,
    _out: &mut dyn Write,
) -> Result<(), WriteFault> {
    Err(WriteFault::NoPlaceForUvs(format))
}
