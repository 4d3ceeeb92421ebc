//! Pictures of a parameterized surface, drawn in software.
//!
//! [`uv_picture`] shows the UV layout, [`preview_picture`] the surface, its UVs, a checker
//! texture on it, and its seams. The same input gives the same pixels on every run.

mod camera;
mod cloud;
mod preview;
mod raster;
mod scene;
mod shading;
mod uv;

use fam_surface::{PointCloud, TriangleMesh, UvMap};
use image::{ExtendedColorType, ImageEncoder, ImageError, RgbImage, codecs::png::PngEncoder};

pub use preview::preview_picture;
pub use uv::uv_picture;

/// A surface together with its UV coordinates.
///
/// Triangles and points without a (finite) coordinate are left out of the layout and get no
/// texture.
#[derive(Debug, Clone, Copy)]
pub enum Flattened<'a> {
    /// A mesh and its map.
    Mesh(&'a TriangleMesh, &'a UvMap),
    /// A cloud and one coordinate per point.
    Cloud(&'a PointCloud, &'a [[f32; 2]]),
}

/// Where a parameterization cuts the surface open. Indices out of range are not drawn.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seams<'a> {
    /// Vertices or points that lie on a seam.
    pub points: &'a [u32],
    /// Pairs of vertices whose edge is torn.
    pub edges: &'a [[u32; 2]],
}

/// The picture as the bytes of a PNG file.
///
/// # Errors
/// The encoder refuses the picture.
pub fn encode_png(picture: &RgbImage) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(
        picture.as_raw(),
        picture.width(),
        picture.height(),
        ExtendedColorType::Rgb8,
    )?;
    Ok(bytes)
}
