use fam_surface::{Surface, UvMap};

use crate::error::WriteFault;

/// UVs of a surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Uvs {
    /// Of a mesh.
    Mesh(UvMap),
    /// Of a point cloud, one per point.
    Points(Vec<[f32; 2]>),
}

/// UVs per vertex as those of the surface; `None` unless all are finite.
pub(crate) fn vertex_uvs(surface: &Surface, uvs: Vec<[f32; 2]>) -> Option<Uvs> {
    match surface {
        Surface::Mesh(mesh) => {
            let map = UvMap::new(uvs, mesh.triangles().to_vec()).ok()?;
            Some(Uvs::Mesh(map))
        }
        Surface::PointCloud(_) => uvs.iter().all(is_finite).then_some(Uvs::Points(uvs)),
    }
}

pub(crate) fn check_count(
    of: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), WriteFault> {
    if expected == found {
        Ok(())
    } else {
        Err(WriteFault::CountMismatch {
            of,
            expected,
            found,
        })
    }
}

pub(crate) fn is_finite(uv: &[f32; 2]) -> bool {
    uv.iter().all(|c| c.is_finite())
}
