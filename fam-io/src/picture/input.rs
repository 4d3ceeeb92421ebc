use fam_surface::{PointCloud, TriangleMesh, UvMap};

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
