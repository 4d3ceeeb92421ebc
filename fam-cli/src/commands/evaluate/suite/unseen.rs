//! The map at points that training did not see: what the vertices of another mesh of the same
//! surface get.

use std::collections::BTreeSet;

use fam_core::sampling::{SurfacePoint, poisson_disk};
use fam_layout::Reconstruction;
use fam_surface::metrics::Metrics;
use fam_surface::{SurfaceError, TriangleMesh, UvMap};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// Vertices of other meshes of the same surface, as shares of its own number. They become up to 1.3
/// times as many.
const VERSIONS: [(&str, f64); 2] = [("remeshed", 1.0), ("decimated", 0.25)];

/// Fewest vertices of such a mesh: fewer do not show the surface.
const FEWEST: usize = 200;

/// Seed of the new vertices.
const SEED: u64 = 0;

/// New vertices on a surface.
pub struct NewPoints {
    pub version: &'static str,
    pub points: Vec<SurfacePoint>,
}

/// The map on another mesh of the same surface.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Unseen {
    /// `remeshed` or `decimated`.
    pub version: String,
    pub vertices: usize,
    /// Conformality of the map on the new triangles, in radians.
    pub conformality: f64,
    /// The same of the map of the original mesh, which is linear on its triangles.
    pub interpolated: f64,
    /// How far these maps are from each other at a new vertex: mean and 95th percentile over all whose
    /// triangle the map does not tear, in units of the side of the UV square.
    pub mean_distance: f64,
    pub p95_distance: f64,
}

impl NewPoints {
    /// Evenly spread new vertices: as many as the mesh has, and a quarter of them.
    pub fn on(mesh: &TriangleMesh) -> Result<Vec<Self>, SurfaceError> {
        let own = mesh.used_vertices().len() as f64;
        let version = |(version, share): (&'static str, f64)| {
            let count = ((own * share).round() as usize).max(FEWEST);
            let points = poisson_disk(mesh, count, &mut Pcg64::seed_from_u64(SEED))?;
            Ok(Self { version, points })
        };
        VERSIONS.into_iter().map(version).collect()
    }

    /// Where they are.
    pub fn positions(&self) -> Vec<[f64; 3]> {
        self.points.iter().map(|point| point.position).collect()
    }

    /// Compares the map at these points (`uvs`, one each) with that of the mesh's own vertices.
    /// `torn` are the edges of the mesh that the map tears. None if the points make no surface, or all
    /// triangles are torn.
    pub fn measure(
        &self,
        mesh: &TriangleMesh,
        own: &UvMap,
        torn: &[[u32; 2]],
        uvs: &[[f32; 2]],
    ) -> Option<Unseen> {
        // Triangles of these points alone: no map says which are neighbours.
        let blank = vec![[0.0; 2]; uvs.len()];
        let found = Reconstruction::of(&self.positions(), &blank, &|| true).ok()??;
        let conformality = |uvs: &[[f32; 2]]| {
            let map = UvMap::new(uvs.to_vec(), found.mesh.triangles().to_vec()).ok()?;
            Some(Metrics::measure(&found.mesh, &map).ok()?.conformality)
        };
        let interpolated: Vec<[f32; 2]> =
            self.points.iter().map(|p| interpolated(own, p)).collect();
        let torn: BTreeSet<[u32; 2]> = torn.iter().map(|&edge| sorted(edge)).collect();
        let is_torn = |t: usize| {
            let [a, b, c] = mesh.triangles()[t];
            let edges = [[a, b], [b, c], [c, a]];
            edges.iter().any(|&edge| torn.contains(&sorted(edge)))
        };
        let whole = (0..uvs.len()).filter(|&i| !is_torn(self.points[i].triangle));
        let distance = |i: usize| {
            let [a, b] = [uvs[i], interpolated[i]].map(|uv| uv.map(f64::from));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        let mut distances: Vec<f64> = whole.map(distance).collect();
        distances.sort_by(f64::total_cmp);
        let count = distances.len();
        let p95 = *distances.get((count * 95 / 100).min(count.checked_sub(1)?))?;
        Some(Unseen {
            version: self.version.to_string(),
            vertices: self.points.len(),
            conformality: conformality(uvs)?,
            interpolated: conformality(&interpolated)?,
            mean_distance: distances.iter().sum::<f64>() / count as f64,
            p95_distance: p95,
        })
    }
}

/// The UV of a point on a triangle.
fn interpolated(map: &UvMap, point: &SurfacePoint) -> [f32; 2] {
    let corners = map.corners(point.triangle);
    [0, 1].map(|axis| {
        let corners = corners.iter().zip(point.weights);
        corners
            .map(|(uv, weight)| weight * f64::from(uv[axis]))
            .sum::<f64>() as f32
    })
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    /// A map that is linear on the whole surface is the same on every mesh of it.
    #[test]
    fn a_linear_map_is_the_same_on_every_mesh() {
        let sheet = shapes::rectangle(1.0, 1.0, 20, 20);
        let place = |p: &[f64; 3]| [p[0] as f32, p[1] as f32];
        let own = sheet.positions().iter().map(place).collect();
        let own = UvMap::new(own, sheet.triangles().to_vec()).unwrap();
        for new in NewPoints::on(&sheet).unwrap() {
            let uvs: Vec<_> = new.positions().iter().map(place).collect();
            let same = new.measure(&sheet, &own, &[], &uvs).unwrap();
            assert!(
                same.conformality < 1e-4 && same.p95_distance < 1e-6,
                "{same:?}"
            );
            // Moved by a tenth.
            let moved: Vec<_> = uvs.iter().map(|[u, v]| [u + 0.1, *v]).collect();
            let moved = new.measure(&sheet, &own, &[], &moved).unwrap();
            assert!((moved.mean_distance - 0.1).abs() < 1e-6, "{moved:?}");
        }
    }

    #[test]
    fn triangles_that_are_torn_do_not_count() {
        let sheet = shapes::rectangle(1.0, 1.0, 20, 20);
        // The right half lies far away; the edges between the halves are torn.
        let place = |p: &[f64; 3]| {
            [
                p[0] as f32 + if p[0] > 0.01 { 9.0 } else { 0.0 },
                p[1] as f32,
            ]
        };
        let uvs: Vec<_> = sheet.positions().iter().map(place).collect();
        let far = |a: u32, b: u32| (uvs[a as usize][0] - uvs[b as usize][0]).abs() > 1.0;
        let edges = sheet.triangles().iter();
        let edges = edges.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let torn: Vec<_> = edges.filter(|&[a, b]| far(a, b)).collect();
        let own = UvMap::new(uvs.clone(), sheet.triangles().to_vec()).unwrap();
        let new = &NewPoints::on(&sheet).unwrap()[0];
        let uvs: Vec<_> = new.positions().iter().map(place).collect();
        assert!(
            new.measure(&sheet, &own, &torn, &uvs)
                .unwrap()
                .mean_distance
                < 1e-6
        );
        assert!(new.measure(&sheet, &own, &[], &uvs).unwrap().mean_distance > 0.01);
    }
}
