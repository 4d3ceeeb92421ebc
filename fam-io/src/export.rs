//! Writing a scene as a new file of any format.
//!
//! What a format has no place for is left out: OFF, PLY and XYZ have no materials and no
//! objects, and a vertex has one normal and one UV in them, so it is there once for each
//! combination that its corners have. Polygons stay whole where no seam crosses them, except in
//! glTF, which has triangles only.
//!
//! A scene may have one mesh in several places. glTF keeps that; in the other formats the mesh
//! is there several times, with the transform applied and with the same UVs. A mesh in no
//! place is written in its own coordinates. Where a transform mirrors, the corners of the faces
//! change their order, so that they stay counter-clockwise seen from outside.

mod baked;
mod gltf;
mod job;
mod materials;
mod names;
mod obj;
mod off;
mod parts;
mod place;
mod ply;
#[cfg(test)]
mod tests;
mod vertices;
mod xyz;

use std::io::Write;

use crate::error::WriteFault;
use crate::format::Format;
use crate::uvs::Uvs;
use baked::Baked;
pub(crate) use job::Export;
use parts::Part;

impl Export<'_> {
    /// The files that an OBJ file refers to: its materials and their textures, by their names
    /// in the folder of the OBJ file.
    pub fn companions(&self) -> Vec<(String, Vec<u8>)> {
        match &self.stem {
            Some(stem) => materials::companions(&self.scene, stem),
            None => Vec::new(),
        }
    }

    /// Writes a file of this format.
    pub fn write(&self, format: Format, out: &mut dyn Write) -> Result<(), WriteFault> {
        let parts = parts::parts(&self.scene, self.uvs)?;
        let no_place = |surface| WriteFault::NoPlaceForSurface { format, surface };
        if !parts.iter().all(Part::is_finite) {
            return Err(no_place("coordinates that are not finite"));
        }
        match format {
            Format::Glb | Format::Gltf => gltf::write(self, &parts, format, out)?,
            Format::Obj => obj::write(self, &parts, out)?,
            Format::Off => off::write(&Baked::of(&parts), out)?,
            Format::Ply => ply::write(&Baked::of(&parts), self.uvs, out)?,
            Format::Stl => return Err(WriteFault::NoPlaceForUvs(format)),
            Format::Xyz => match self.uvs {
                Uvs::Mesh(_) => return Err(no_place("a mesh")),
                Uvs::Points(_) => xyz::write(&Baked::of(&parts), out)?,
            },
        }
        Ok(())
    }
}
