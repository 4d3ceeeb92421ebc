//! glTF 2.0, as GLB and as JSON.
//!
//! Buffers are in the binary chunk, in data URIs or in files, whose paths are relative to the
//! document and may leave its folder; absolute paths and URLs are refused. A required
//! extension is no obstacle, except for the compressions `KHR_draco_mesh_compression`,
//! `EXT_meshopt_compression` and `KHR_meshopt_compression`.
//!
//! - The surface is that of all triangles: lists, strips and fans, with or without indices,
//!   floats or quantized, sparse or not. Points and lines are only kept, but if there are no
//!   triangles, the vertices of the points are a point cloud.
//! - Its vertices are in the coordinates of the scene. A mesh is where the first node puts it
//!   that uses it (by the default scene, the other scenes, and then the other nodes); other
//!   places of the mesh are no part of the surface. A skinned node, one whose transform is
//!   singular and a mesh without a node count as not transformed.
//! - Primitives of a mesh with the same accessors as attributes and morph targets share their
//!   vertices. Triangles are those of the file in order; the ones that join the parts of a
//!   strip or fan are left out.
//! - Accessors without data, and many that share theirs, can announce any number of elements; a
//!   document may have 16 for each of its bytes, and a million more.
//! - UVs are those of `TEXCOORD_0`, and normals those of `NORMAL`, if all primitives have them.
//!
//! # What is written
//! UVs are written as floats to the set asked for, up to 15, on all triangles. Sets are numbered
//! without gaps, so the same UVs become the sets below that are missing. Where the UVs of a vertex
//! differ, all of its attributes, bit by bit, and its morph targets are there several times;
//! copies come after all other vertices. Indices are rewritten only where the vertices of
//! triangles change; strips and fans become lists then. Tangents are left out if they belong
//! to UVs that have been replaced. A vertex of no triangle has the UV (0, 0).
//!
//! Everything else stays: names, materials, nodes, animations, skins, lines and points, extras
//! and extensions, known or not, and the order of it all. What is out of use after writing
//! makes room for what is new, so that files do not grow when they are written again, but any
//! number in an extension that may refer to an accessor or a buffer view counts as a
//! reference to it. Seam lines replace those of an earlier run.
//!
//! The output stands alone: one buffer, and images that were files are embedded if they are
//! PNG, JPEG, WebP or KTX2 files at a relative path; others stay where they are. The names of
//! buffers but the first, and chunks of a GLB that are neither JSON nor binary are lost.

mod attributes;
mod center;
mod checker;
mod compact;
mod elements;
mod geometry;
mod glb;
mod images;
mod load;
mod package;
mod read;
mod scene;
mod seam_lines;
mod tangents;
mod transforms;
mod uri;
mod usage;
mod value;
mod write;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::content::Content;
use crate::error::{ReadFault, WriteFault};
use crate::format::Format;
use crate::options::WriteOptions;
use crate::parsed::Parsed;
use crate::scene::{Node, Scene};
use crate::uvs::Uvs;
use compact::Before;
use geometry::Geometry;
use load::{Loaded, load};
use write::UvWriter;

pub(crate) use center::center;
pub(crate) use package::Package;

/// The highest set of UVs that is written: the sets below it must all be there.
const LAST_UV_SET: u32 = 15;

/// A glTF document, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    loaded: Loaded,
    geometry: Geometry,
    /// Where the meshes are.
    nodes: Vec<Node>,
}

pub(crate) fn parse(content: Content) -> Result<Parsed<Source>, ReadFault> {
    let loaded = load(content)?;
    let package = &loaded.package;
    let geometry = Geometry::of(package, loaded.size)?;
    let nodes = transforms::placed_meshes(&package.json)?;
    let surface = read::surface(package, &geometry, &nodes)?;
    Ok(Parsed {
        uvs: read::uvs(package, &geometry, &surface),
        labels: read::labels(package, &geometry),
        surface,
        diagonals: Vec::new(),
        warnings: Vec::new(),
        source: Source {
            loaded,
            geometry,
            nodes,
        },
    })
}

/// Refuses sets of UVs that would need too many others.
pub(crate) fn check_uv_set(options: &WriteOptions) -> io::Result<()> {
    if options.uv_set > LAST_UV_SET {
        let problem = format!("the last set of UVs that is written is {LAST_UV_SET}");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    Ok(())
}

impl Source {
    /// The buffers and images that are files of their own.
    pub fn files(&self) -> &[PathBuf] {
        &self.loaded.files
    }

    pub fn format(&self) -> Format {
        self.loaded.format
    }

    pub fn scene(&self) -> io::Result<Scene> {
        let Loaded {
            package, folder, ..
        } = &self.loaded;
        Ok(scene::scene(
            package,
            folder.as_deref(),
            &self.geometry,
            &self.nodes,
        ))
    }

    /// An attribute of all vertices as one number each, those of the primitives that lack it 0, or
    /// 1 in a colour; `None` if there is none of the name.
    pub fn vertex_numbers(&self, name: &str) -> Option<Vec<f64>> {
        attributes::numbers(&self.loaded.package, &self.geometry, name)
    }

    /// The names that there are numbers of.
    pub fn number_names(&self) -> Vec<String> {
        attributes::names(&self.geometry)
    }

    /// The normals of all vertices in the coordinates of the surface, zero where there are none;
    /// `None` if there are none at all.
    pub fn normals(&self) -> Option<Vec<[f64; 3]>> {
        read::known_normals(&self.loaded.package, &self.geometry, &self.nodes)
    }

    pub fn write(
        &self,
        uvs: &Uvs,
        format: Format,
        options: &WriteOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteFault> {
        check_uv_set(options)?;
        let segments = self.segments(&options.seam_lines)?;
        let mut package = self.loaded.package.clone();
        let before = Before::of(&package);
        let mut writer = UvWriter {
            package: &mut package,
            geometry: &self.geometry,
            uv_set: options.uv_set,
            replaced: BTreeMap::new(),
        };
        match uvs {
            Uvs::Mesh(uvs) => writer.write_mesh(uvs),
            Uvs::Points(uvs) => writer.write_points(uvs),
        }
        let replaced = writer.replaced;
        if options.checker {
            package.add_checker(options.uv_set);
        }
        package.add_seam_lines(&segments);
        images::embed(&mut package, self.loaded.folder.as_deref(), format);
        before.compact(&mut package, &replaced);
        Ok(package.write(format, out)?)
    }

    /// Edges between vertices of the surface, in the coordinates of the scene.
    fn segments(&self, edges: &[[u32; 2]]) -> Result<Vec<[[f64; 3]; 2]>, WriteFault> {
        if edges.is_empty() {
            return Ok(Vec::new());
        }
        let positions = read::positions(&self.loaded.package, &self.geometry, &self.nodes);
        let end = |index: u32| {
            let count = positions.len();
            let fault = WriteFault::SeamOutOfRange { index, count };
            positions.get(index as usize).copied().ok_or(fault)
        };
        edges.iter().map(|&[a, b]| Ok([end(a)?, end(b)?])).collect()
    }
}
