//! Surfaces that are flat already.

use robust::{Coord, orient2d};

use crate::component::FlatChart;
use crate::distortion::Distortion;
use crate::patch::topology::{Opened, Topology};
use crate::solve::boundary::Boundary;
use fam_surface::TriangleMesh;
use fam_surface::vector::{cross, dot, length, normalize, sub};

/// The most that a triangle of a flat surface is tilted, in radians. Projecting such a one raises
/// its symmetric Dirichlet energy by the fourth power of it, far less than rounding to `f32` does.
const TILT: f64 = 1e-4;

/// A connected mesh laid out by projection, if it is flat: its triangles lie in one plane as good
/// as exactly and do not overlap there.
pub fn flat_chart(mesh: &TriangleMesh) -> Option<FlatChart> {
    let uvs = projected(mesh)?;
    let triangles = mesh.triangles();
    if triangles.len() > 1 && !is_injective(mesh, &uvs) {
        return None;
    }
    Some(FlatChart {
        uvs,
        triangles: triangles.to_vec(),
        source: (0..triangles.len() as u32).collect(),
        distortion: Distortion::NONE,
        is_straight: false,
    })
}

/// The vertices in the plane of all triangles, if there is one. All triangles are
/// counter-clockwise in it.
fn projected(mesh: &TriangleMesh) -> Option<Vec<[f64; 2]>> {
    let vectors = || (0..mesh.triangles().len()).map(|t| mesh.area_vector(t));
    let sum = vectors().fold([0.0; 3], |sum, v| [0, 1, 2].map(|k| sum[k] + v[k]));
    let normal = normalize(sum);
    let is_level = |v: [f64; 3]| {
        let (along, across) = (dot(v, normal), length(cross(v, normal)));
        along > 0.0 && across <= TILT * along
    };
    if !vectors().all(is_level) {
        return None;
    }
    let axis = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))?;
    let right = normalize(cross([0, 1, 2].map(|k| f64::from(k == axis)), normal));
    let up = cross(normal, right);
    let origin = mesh.positions().first()?;
    let place = |p: &[f64; 3]| [right, up].map(|direction| dot(sub(*p, *origin), direction));
    let uvs: Vec<[f64; 2]> = mesh.positions().iter().map(place).collect();
    let is_positive = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle
            .map(|v| uvs[v as usize])
            .map(|[x, y]| Coord { x, y });
        orient2d(a, b, c) > 0.0
    };
    mesh.triangles().iter().all(is_positive).then_some(uvs)
}

/// Whether the triangles, all counter-clockwise, do not overlap: their boundary does not touch
/// itself.
fn is_injective(mesh: &TriangleMesh, uvs: &[[f64; 2]]) -> bool {
    let Opened { topology, source } = Topology::oriented(mesh);
    let own: Vec<[f64; 2]> = source.iter().map(|&v| uvs[v as usize]).collect();
    Boundary::new(&topology, |_| 1.0).is_simple(&own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    /// A strip of quads around the origin through an angle, rising by a height.
    fn strip(angle: f64, rise: f64) -> TriangleMesh {
        let steps = 24;
        let place = |i: u32| {
            let along = f64::from(i / 2) / f64::from(steps);
            let (sin, cos) = (along * angle).sin_cos();
            let radius = 1.0 + f64::from(i % 2);
            [radius * cos, radius * sin, rise * along]
        };
        let quad = |i: u32| {
            let a = 2 * i;
            [[a, a + 1, a + 3], [a, a + 3, a + 2]]
        };
        let positions = (0..2 * (steps + 1)).map(place).collect();
        TriangleMesh::new(positions, (0..steps).flat_map(quad).collect()).unwrap()
    }

    /// With a side of the triangle mesh for a side of the chart.
    fn assert_isometric(mesh: &TriangleMesh) {
        let chart = flat_chart(mesh).unwrap();
        for (t, own) in mesh.triangles().iter().zip(&chart.triangles) {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| mesh.positions()[v as usize]);
                let [p, q] = [own[k], own[(k + 1) % 3]].map(|v| chart.uvs[v as usize]);
                let (on_surface, in_plane) = (length(sub(a, b)), (p[0] - q[0]).hypot(p[1] - q[1]));
                assert!((in_plane / on_surface - 1.0).abs() < 1e-6);
            }
        }
    }

    fn moved(mesh: &TriangleMesh, place: impl Fn([f64; 3]) -> [f64; 3]) -> TriangleMesh {
        let positions = mesh.positions().iter().map(|&p| place(p)).collect();
        TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap()
    }

    #[test]
    fn flat_surfaces_keep_their_lengths_however_they_lie() {
        let triangle = TriangleMesh::new(
            vec![[0.0; 3], [1.0, 0.2, 3.0], [-2.0, 1.0, 0.5]],
            vec![[0, 1, 2]],
        );
        assert_isometric(&triangle.unwrap());
        let sheet = shapes::rectangle(2.0, 1.0, 7, 3);
        for axes in [[0, 1, 2], [1, 0, 2], [2, 0, 1], [1, 2, 0]] {
            assert_isometric(&moved(&sheet, |p| axes.map(|k| 1e-5 * p[k] + 4.0)));
        }
        // A ring that is not closed.
        assert_isometric(&strip(6.2, 0.0));
    }

    #[test]
    fn what_is_bent_or_would_overlap_is_not_flat() {
        let sheet = shapes::rectangle(2.0, 1.0, 8, 4);
        let bent = moved(&sheet, |[x, y, _]| [x, y, 0.01 * x * x]);
        assert!(flat_chart(&bent).is_none());
        let folded = moved(&sheet, |[x, y, z]| [x.abs(), y, z]);
        assert!(flat_chart(&folded).is_none());
        assert!(flat_chart(&strip(7.0, 0.0)).is_none());
        assert!(flat_chart(&strip(7.0, 1e-5)).is_none());
        let line = TriangleMesh::new(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2]]);
        assert!(flat_chart(&line.unwrap()).is_none());
        assert!(flat_chart(&shapes::cube(2)).is_none());
    }
}
