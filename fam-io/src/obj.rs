//! Wavefront OBJ.
//!
//! Read are `v`, `vt`, `vn` and `f` statements; all others, unknown ones too, are kept.
//! A statement may go over several lines with a backslash at the end of a line, and `#`
//! starts a comment. Faces may come before the vertices they refer to. Corners are `v`,
//! `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back from the last `v`, `vt` or
//! `vn` before the face. Faces of fewer than three corners are no part of the surface.
//!
//! The crate `tobj` reads the numbers of `v`, `vt` and `vn`. It reorders the vertices of
//! every group and forgets where a face was, so the faces are scanned here: their vertices
//! must keep the order of the file, and they are written back in place.
//!
//! - A fourth number of a `v` is a weight that divides the others; more than four numbers
//!   are a colour, which is not looked at.
//! - Normals are those of the corners: if a vertex has several, their mean. In a cloud there
//!   are normals if there is one `vn` for every `v`.
//! - UVs are there if every corner of every face refers to an existing `vt` and all `vt` are
//!   finite. In a cloud there are UVs if there is one `vt` for every `v`. References to `vt`
//!   and `vn` that do not exist are passed over.
//!
//! Writing keeps every byte but those of UVs: `vt` statements go, the new ones come before
//! the first face (in a cloud: at the end), and corners get their new `vt` index while `v`
//! and `vn` stay as written. A polygon with a seam inside becomes triangles. Lines (`l`) and
//! faces of two corners lose their `vt` references.

mod colors;
mod corner;
mod faces;
mod materials;
mod model;
mod names;
mod numbers;
mod scene;
mod statements;
mod write;

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use fam_core::surface::{Surface, SurfaceError};

use crate::document::{Content, Parsed, surface, vertex_uvs};
use crate::scene::Scene;
use crate::{ReadFault, Uvs};
use colors::Colors;
use materials::Libraries;
use model::Model;
use statements::{Fingerprint, open};

/// An OBJ file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    content: Content,
    fingerprint: Fingerprint,
    libraries: Vec<String>,
}

pub(crate) fn parse(content: Content) -> Result<Parsed<Source>, ReadFault> {
    let content = readable_twice(content)?;
    let model = Model::read(&content, |_| {})?;
    if model.numbers.positions.is_empty() {
        return Err(SurfaceError::NoVertices.into());
    }
    let labels = model.labels();
    let vertices = model.numbers.positions.len();
    let is_cloud = model.faces.vertices.len() == 0;
    let normals = if is_cloud {
        model.point_normals().map(<[_]>::to_vec)
    } else {
        model.faces.vertex_normals(vertices, &model.numbers.normals)
    };
    let Model { numbers, faces, .. } = model;
    let surface = surface(numbers.positions, &faces.vertices, normals)?;
    let uvs = match &surface {
        Surface::Mesh(_) => faces.uv_map(numbers.uvs),
        Surface::PointCloud(_) if numbers.uvs.len() == vertices => {
            vertex_uvs(&surface, numbers.uvs)
        }
        Surface::PointCloud(_) => None,
    };
    Ok(Parsed {
        surface,
        uvs,
        labels,
        source: Source {
            content,
            fingerprint: model.fingerprint,
            libraries: model.libraries,
        },
    })
}

/// The content, in memory if it can be read only once: that of a pipe, for example.
fn readable_twice(content: Content) -> io::Result<Content> {
    match &content {
        Content::File(path) if !fs::metadata(path)?.is_file() => {
            content.bytes().map(Content::Bytes)
        }
        _ => Ok(content),
    }
}

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        let input = open(&self.content)?;
        let written = match uvs {
            Uvs::Mesh(uvs) => write::mesh(input, uvs, out)?,
            Uvs::Points(uvs) => write::points(input, uvs, out)?,
        };
        if written == self.fingerprint {
            Ok(())
        } else {
            Err(write::changed())
        }
    }

    /// One mesh with all faces, as they are in the file.
    pub fn scene(&self) -> io::Result<Scene> {
        let mut colors = Colors::default();
        let model = Model::read(&self.content, |statement| colors.push(statement));
        let model = model.map_err(|fault| match fault {
            ReadFault::Io(error) => error,
            _ => write::changed(),
        })?;
        if model.fingerprint != self.fingerprint {
            return Err(write::changed());
        }
        let names = model.material_names();
        let materials = match self.libraries() {
            Some(libraries) => libraries.materials(&names)?,
            None => names.iter().map(|name| materials::white(name)).collect(),
        };
        Ok(scene::scene(model, colors.finish(), materials))
    }

    /// The material files that the file names and the images that these name, relative to
    /// its folder. They are needed where the file is.
    pub(crate) fn companions(&self) -> Vec<PathBuf> {
        self.libraries()
            .map_or_else(Vec::new, |libraries| libraries.files())
    }

    fn libraries(&self) -> Option<Libraries<'_>> {
        match &self.content {
            Content::File(path) => Some(Libraries::find(path.parent()?, &self.libraries)),
            Content::Bytes(_) => None,
        }
    }
}
