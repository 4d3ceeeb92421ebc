use serde::{Deserialize, Serialize};

use fam_surface::TriangleMesh;
use fam_surface::vector::{add, cross, dot, length, normalize, scale, sub};

/// Largest distance from the plane, as a fraction of the extent, at which a component counts as
/// flat: on triangles of a hundredth of the extent, angles change by less than 1e-6.
const FLATNESS: f64 = 1e-5;

/// Least cosine between the normals of a triangle and of the plane. It rules out folds, and
/// tiny triangles that stand upright within the tolerance.
const SAME_SIDE: f64 = 0.99;

/// The orthogonal projection to the plane of a flat component: an isometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Projection {
    /// The point that has the UV (0, 0), in input units.
    pub origin: [f64; 3],
    /// Unit vectors along u and v.
    pub axes: [[f64; 3]; 2],
}

impl Projection {
    /// The projection of a mesh that lies in a plane without folds, counter-clockwise triangles
    /// staying so; `None` for any other. A mesh without area is flat if it lies on a line.
    pub fn of(mesh: &TriangleMesh) -> Option<Self> {
        let projection = Self::along_mean_normal(mesh);
        projection.is_isometric(mesh).then_some(projection)
    }

    /// The projection of any mesh along the mean normal of its area.
    pub fn along_mean_normal(mesh: &TriangleMesh) -> Self {
        let origin = mesh.corners(0)[0];
        let area_vectors = (0..mesh.triangles().len()).map(|t| mesh.area_vector(t));
        let mut normal = normalize(area_vectors.fold([0.0; 3], add));
        if normal == [0.0; 3] {
            let along = farthest(mesh, origin);
            normal = normalize(cross(along, least_axis(along)));
        }
        let axes = if normal == [0.0; 3] {
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        } else {
            axes(normal)
        };
        Self { origin, axes }
    }

    fn is_isometric(&self, mesh: &TriangleMesh) -> bool {
        let normal = cross(self.axes[0], self.axes[1]);
        let tolerance = FLATNESS * length(farthest(mesh, self.origin));
        let is_near = |v: u32| {
            let offset = sub(mesh.positions()[v as usize], self.origin);
            dot(offset, normal).abs() <= tolerance
        };
        let is_upright = |t: usize| {
            let area = mesh.area_vector(t);
            // Too small to have a direction.
            length(area) <= tolerance * tolerance || dot(area, normal) >= SAME_SIDE * length(area)
        };
        mesh.used_vertices().into_iter().all(is_near) && (0..mesh.triangles().len()).all(is_upright)
    }

    /// UVs in input units.
    pub fn uvs(&self, points: &[[f64; 3]]) -> Vec<[f32; 2]> {
        let project = |&p: &[f64; 3]| self.axes.map(|axis| dot(sub(p, self.origin), axis) as f32);
        points.iter().map(project).collect()
    }

    /// The derivatives of u and of v by the coordinates of a point, the same everywhere.
    pub fn jacobian(&self) -> [[f32; 3]; 2] {
        self.axes.map(|axis| axis.map(|c| c as f32))
    }
}

/// The longest offset of a vertex from a point.
fn farthest(mesh: &TriangleMesh, from: [f64; 3]) -> [f64; 3] {
    mesh.used_vertices()
        .into_iter()
        .map(|v| sub(mesh.positions()[v as usize], from))
        .max_by(|a, b| length(*a).total_cmp(&length(*b)))
        .unwrap_or_default()
}

/// The coordinate axis that is farthest from a direction.
fn least_axis(direction: [f64; 3]) -> [f64; 3] {
    let least = (0..3).min_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs()));
    let mut axis = [0.0; 3];
    axis[least.unwrap_or(0)] = 1.0;
    axis
}

/// Unit vectors of a plane, counter-clockwise seen against its normal. The first is along the
/// coordinate axis closest to the plane, so that what is built along the axes stays upright.
fn axes(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let axis = least_axis(normal);
    let u = normalize(sub(axis, scale(normal, dot(axis, normal))));
    [u, cross(normal, u)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::metrics::Metrics;
    use fam_surface::{UvMap, shapes};

    fn tilted(mesh: &TriangleMesh, far: f64) -> TriangleMesh {
        let [a, b] = axes(normalize([0.3, -0.5, 0.8]));
        let place = |p: &[f64; 3]| add(add(scale(a, p[0]), scale(b, p[1])), [far, 0.0, -far]);
        let positions = mesh.positions().iter().map(place).collect();
        TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap()
    }

    #[test]
    fn a_flat_sheet_keeps_its_lengths_and_its_side() {
        for far in [0.0, 1e4] {
            let sheet = tilted(&shapes::rectangle(3.0, 1.0, 6, 3), far);
            let uvs = Projection::of(&sheet).unwrap().uvs(sheet.positions());
            for (t, triangle) in sheet.triangles().iter().enumerate() {
                let corners = triangle.map(|v| uvs[v as usize].map(f64::from));
                let [a, b, c] = corners;
                let signed = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert!((signed - length(sheet.area_vector(t))).abs() < 1e-5);
            }
            let map = UvMap::new(uvs, sheet.triangles().to_vec()).unwrap();
            assert!(Metrics::measure(&sheet, &map).unwrap().conformality < 1e-5);
        }
    }

    #[test]
    fn what_is_curved_or_folded_is_not_projected() {
        assert!(Projection::of(&shapes::torus(1.0, 0.4, 8, 6)).is_none());
        let sheet = shapes::rectangle(1.0, 1.0, 4, 4);
        let mut positions = sheet.positions().to_vec();
        positions[6][2] += 1e-3;
        let dented = TriangleMesh::new(positions, sheet.triangles().to_vec()).unwrap();
        assert!(Projection::of(&dented).is_none());
        let mut triangles = sheet.triangles().to_vec();
        triangles[3].swap(0, 1);
        let folded = TriangleMesh::new(sheet.positions().to_vec(), triangles).unwrap();
        assert!(Projection::of(&folded).is_none());
    }

    #[test]
    fn a_line_and_a_point_are_flat() {
        let line = |ends: [f64; 3]| vec![[1.0, 1.0, 1.0], add([1.0; 3], ends), [1.0; 3]];
        for ends in [[0.0, 3.0, 4.0], [0.0; 3]] {
            let mesh = TriangleMesh::new(line(ends), vec![[0, 1, 2]]).unwrap();
            let uvs = Projection::of(&mesh).unwrap().uvs(mesh.positions());
            let [u, v] = uvs[1].map(f64::from);
            assert!((u.hypot(v) - length(ends)).abs() < 1e-6);
        }
    }
}
