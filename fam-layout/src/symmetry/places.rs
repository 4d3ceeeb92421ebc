//! Points with normals, for telling the two sides of a thin part from each other.

use fam_surface::TriangleMesh;
use fam_surface::vector::{cross, length, normalize, sub};

/// How far opposite normals set points apart, as a share of the diagonal: more than symmetric surfaces
/// deviate.
const NORMAL: f64 = 0.05;

/// The frame of a surface, in which places are compared.
pub struct Frame {
    low: [f64; 3],
    /// The diagonal of the bounding box, in the units of the surface; positive.
    pub diagonal: f64,
}

impl Frame {
    pub fn of(surface: &TriangleMesh) -> Self {
        let bound = |fold: fn(f64, f64) -> f64, start: f64| {
            [0, 1, 2].map(|k| {
                let along = surface.positions().iter().map(|p| p[k]);
                along.fold(start, fold)
            })
        };
        let low = bound(f64::min, f64::INFINITY);
        let diagonal = length(sub(bound(f64::max, f64::NEG_INFINITY), low));
        Self {
            low,
            diagonal: if diagonal > 0.0 { diagonal } else { 1.0 },
        }
    }

    /// A point of the surface, in units of the diagonal.
    pub fn point(&self, p: [f64; 3]) -> [f32; 3] {
        sub(p, self.low).map(|c| (c / self.diagonal) as f32)
    }

    /// A point with the normal there: those are near to each other whose points and normals are.
    pub fn place(&self, p: [f64; 3], normal: [f64; 3]) -> [f32; 6] {
        let [x, y, z] = self.point(p);
        let [a, b, c] = normal.map(|c| (NORMAL * c) as f32);
        [x, y, z, a, b, c]
    }

    /// The places of some vertices of a mesh.
    pub fn vertices(&self, mesh: &TriangleMesh, chosen: &[u32]) -> Vec<[f32; 6]> {
        let normals = mesh.vertex_normals();
        let place = |&v: &u32| self.place(mesh.positions()[v as usize], normals[v as usize]);
        chosen.iter().map(place).collect()
    }

    /// The places of the middles of all triangles of a mesh.
    pub fn middles(&self, mesh: &TriangleMesh) -> Vec<[f32; 6]> {
        let place = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            let middle = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
            self.place(middle, normalize(cross(sub(b, a), sub(c, a))))
        };
        (0..mesh.triangles().len()).map(place).collect()
    }
}
