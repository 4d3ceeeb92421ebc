//! Files of Flatten Anything: surfaces in, the same files with UVs out.
//!
//! - [`read_surface`] reads a mesh or a point cloud from a file of one of the [`Format`]s
//!   into a [`Document`]. It holds the [`Surface`](fam_surface::Surface) to flatten,
//!   the UVs the file already has, and what it takes to write the file back.
//! - [`Document::write_mesh_uvs`] and [`Document::write_point_uvs`] write that file again
//!   with UVs; everything else in it stays. Under a name with the extension of another format
//!   they convert it: what that format has a place for comes along. An OBJ file then gets its
//!   materials and textures beside it.
//! - [`Document::hard_edges`] and [`Document::vertex_attribute`] tell what a file says of where to
//!   cut: edges that it shades hard, and numbers that were painted on its vertices.
//! - [`CloudStream`] writes clouds with UVs that are too large to be held in memory.
//! - [`Document::of_surface`] makes a document of a surface that comes from no file.
//! - [`seams`] writes the torn edges and seam points of a result as JSON and OBJ.
//! - [`marks`] reads edges of a mesh that somebody marked in a file of their own.
//! - [`picture`] draws the layout and the textured surface.
//! - [`atomic`] replaces a file as a whole or not at all; every writer goes through it.
//!
//! The modules of the formats state which dialects they read and what they keep.
//! No input makes the readers panic, and none makes them allocate memory out of
//! proportion to the size of the file; what cannot be read is a [`ReadError`] that names
//! the file and the reason on one line.
//!
//! Conventions, in all formats:
//!
//! - Coordinates are in the units and axes of the file; nothing is scaled or turned.
//! - Triangles are counter-clockwise seen from outside. Readers keep the order of the file.
//! - Indices count from 0. A [`UvMap`](fam_surface::UvMap) has UVs for the corners of
//!   triangles: its triangles are those of the mesh in the same order, but refer to UVs. A
//!   vertex on a seam has several UVs, and vertices may share one.
//! - V points up: the UV 0 0 is the lower left corner of a texture.
//!
//! The example `edit_uvs` moves the UVs of any file into the unit square and writes it in
//! the format of the output's name.
//!
//! ```no_run
//! use fam_surface::{Surface, UvMap};
//! use fam_io::WriteOptions;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let document = fam_io::read_surface("spot.obj")?;
//! match document.surface() {
//!     Surface::Mesh(mesh) => {
//!         println!("{} vertices, {} triangles", mesh.positions().len(), mesh.triangles().len());
//!         let flat = mesh.positions().iter().map(|p| [p[0] as f32, p[1] as f32]).collect();
//!         let uvs = UvMap::new(flat, mesh.triangles().to_vec())?;
//!         document.write_mesh_uvs(&uvs, "spot-uv.obj", &WriteOptions::default())?;
//!     }
//!     Surface::PointCloud(cloud) => {
//!         println!("{} points", cloud.points().len());
//!         let flat: Vec<_> = cloud.points().iter().map(|p| [p[0] as f32, p[1] as f32]).collect();
//!         document.write_point_uvs(&flat, "spot-uv.obj", &WriteOptions::default())?;
//!     }
//! }
//! # Ok(())
//! # }
//! ```

pub mod atomic;
mod color;
mod content;
mod detect;
mod document;
mod error;
mod export;
mod format;
pub mod gltf;
mod kept;
mod labels;
pub mod marks;
pub mod obj;
pub mod off;
mod options;
mod parsed;
pub mod picture;
pub mod ply;
mod scene;
pub mod seams;
mod shading;
pub mod stl;
mod stream;
mod text;
mod uvs;
mod warning;
pub mod xyz;

pub use detect::format_of;
pub use document::{Document, read_surface};
pub use error::{AttributeError, ReadError, ReadFault, WriteError, WriteFault};
pub use format::Format;
pub use labels::Labels;
pub use options::WriteOptions;
pub use stream::{CloudStream, StreamError};
pub use uvs::Uvs;
pub use warning::Warning;
