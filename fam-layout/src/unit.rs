//! The unit of length in which surfaces are laid out.

use fam_surface::symmetry::MirrorPlane;
use fam_surface::vector::dot;
use fam_surface::{Component, TriangleMesh};

/// The unit of length, as half of it, in which the largest component has an extent of 1, so that
/// no square of a length overflows.
pub fn common_unit(list: &[Component]) -> f64 {
    let extents = list.iter().map(|c| half_extent(&c.mesh));
    extents.fold(0.0, f64::max)
}

/// A mesh near the origin, in a unit of twice the length given.
pub fn scaled(mesh: &TriangleMesh, half_unit: f64) -> TriangleMesh {
    let unit = if half_unit > 0.0 { half_unit } else { 1.0 };
    let low = [0, 1, 2].map(|axis| low_and_high(mesh, axis).0);
    let place = |p: &[f64; 3]| [0, 1, 2].map(|a| (0.5 * p[a] - 0.5 * low[a]) / unit);
    let positions = mesh.positions().iter().map(place).collect();
    TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap_or_else(|_| mesh.clone())
}

/// The plane of a mesh where it lies once that is [`scaled`].
pub fn scaled_plane(
    plane: &MirrorPlane,
    mesh: &TriangleMesh,
    half_unit: f64,
) -> Option<MirrorPlane> {
    let unit = if half_unit > 0.0 { half_unit } else { 1.0 };
    let low = [0, 1, 2].map(|axis| low_and_high(mesh, axis).0);
    let above = 0.5 * plane.offset() - 0.5 * dot(plane.normal(), low);
    MirrorPlane::new(plane.normal(), above / unit)
}

/// Half of the longest side of a mesh's bounding box.
pub fn half_extent(mesh: &TriangleMesh) -> f64 {
    let side = |axis| {
        let (low, high) = low_and_high(mesh, axis);
        0.5 * high - 0.5 * low
    };
    (0..3).map(side).fold(0.0, f64::max)
}

fn low_and_high(mesh: &TriangleMesh, axis: usize) -> (f64, f64) {
    let along = mesh.positions().iter().map(|p| p[axis]);
    along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| {
        (low.min(c), high.max(c))
    })
}
