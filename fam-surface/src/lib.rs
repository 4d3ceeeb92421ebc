//! Surfaces and their UV maps: triangle meshes and point clouds, what they fall into, how good
//! their UVs are.
//!
//! - [`TriangleMesh`], [`PointCloud`], [`Surface`], [`UvMap`]: the data;
//! - [`Components`]: the connected pieces of a mesh, ready to be flattened;
//! - [`polygons`]: faces of any number of corners, and the triangles that they become;
//! - [`charts`]: the connected pieces of a UV map;
//! - [`metrics`] and [`seams`]: how good a UV map is, and where it cuts;
//! - [`congruence`]: meshes that are copies of each other;
//! - [`neighbors`]: nearest points;
//! - [`occlusion`]: how much light reaches a surface;
//! - [`symmetry`]: mirror planes of surfaces, and which parts of a mesh mirror which;
//! - [`shapes`]: surfaces made by formula.
//!
//! Coordinates are `f64` in the units of the input, so that georeferenced scans
//! keep their precision; training works on a normalised `f32` copy
//! (see [`Normalization`]). Indices are zero-based.

pub mod charts;
mod components;
pub mod congruence;
mod crowding;
pub mod degenerate;
mod ears;
mod edges;
mod fans;
mod joining;
mod left_out;
mod mesh;
pub mod metrics;
pub mod neighbors;
mod normalization;
pub mod occlusion;
pub mod orientation;
pub mod plane;
mod point_cloud;
pub mod polygons;
pub mod random;
pub mod seams;
pub mod sets;
pub mod shapes;
mod sides;
pub mod symmetry;
mod uv_map;
pub mod vector;
pub mod weld;

pub use components::{Component, Components, Conditioning, Duplicates};
pub use edges::Edges;
pub use mesh::TriangleMesh;
pub use normalization::Normalization;
pub use point_cloud::PointCloud;
pub use uv_map::UvMap;

/// A surface to flatten: a triangle mesh or a raw point cloud.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// Triangles over shared vertices.
    Mesh(TriangleMesh),
    /// Points without connectivity.
    PointCloud(PointCloud),
}

impl Surface {
    /// The vertices of a mesh or the points of a cloud, in input units.
    pub fn positions(&self) -> &[[f64; 3]] {
        match self {
            Surface::Mesh(mesh) => mesh.positions(),
            Surface::PointCloud(cloud) => cloud.points(),
        }
    }

    /// How the surface is brought into the unit ball; vertices outside all triangles do not
    /// count.
    ///
    /// # Errors
    /// All points coincide.
    pub fn normalization(&self) -> Result<Normalization, SurfaceError> {
        match self {
            Surface::Mesh(mesh) => {
                let used = mesh.used_vertices();
                let points: Vec<_> = used.iter().map(|&v| mesh.positions()[v as usize]).collect();
                Normalization::of(&points)
            }
            Surface::PointCloud(cloud) => Normalization::of(cloud.points()),
        }
    }
}

/// Why a mesh, a cloud or a UV map could not be built from its parts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// There is not a single vertex or point.
    #[error("it has no vertices")]
    NoVertices,
    /// There are vertices but not a single face.
    #[error("it has no faces")]
    NoFaces,
    /// A coordinate is NaN or infinite.
    #[error("vertex {index} has a coordinate that is not a finite number")]
    NonFinitePosition {
        /// Zero-based index of the vertex.
        index: usize,
    },
    /// A texture coordinate is NaN or infinite.
    #[error("texture coordinate {index} is not a finite number")]
    NonFiniteUv {
        /// Zero-based index of the texture coordinate.
        index: usize,
    },
    /// A triangle refers to a vertex (or texture coordinate) that does not exist.
    #[error("face {face} refers to vertex {index}, but there are only {count}")]
    IndexOutOfRange {
        /// Zero-based index of the triangle.
        face: usize,
        /// The offending zero-based index.
        index: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// An attribute has another length than what it belongs to.
    #[error("{attribute}: expected {expected} entries, found {found}")]
    LengthMismatch {
        /// What the attribute is.
        attribute: &'static str,
        /// The required length.
        expected: usize,
        /// The length that was given.
        found: usize,
    },
    /// All points coincide, so there is no surface to flatten.
    #[error("all points are equal")]
    SinglePoint,
    /// There is too little surface to flatten.
    #[error("{0}")]
    TooSmall(&'static str),
}
