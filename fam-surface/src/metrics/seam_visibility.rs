use crate::occlusion::Occluders;
use crate::vector::{length, sub};
use crate::weld::weld;
use crate::{SurfaceError, TriangleMesh, UvMap};

use super::edges::sides;
use super::layout::Layout;
use super::seam_length::seam_edges;

/// How visible the seams of a UV map are: the mean over their length of the
/// [visibility](Occluders::visibility) of the surface, with the mesh itself in the way. `None` if the
/// map has no seams.
///
/// # Errors
/// The map has another number of triangles than the mesh, or the mesh has no area.
pub fn seam_visibility(mesh: &TriangleMesh, uv: &UvMap) -> Result<Option<f64>, SurfaceError> {
    let layout = Layout::new(mesh, uv)?;
    let first = weld(mesh.positions());
    let triangles = mesh.triangles().iter();
    let triangles = triangles.map(|t| t.map(|v| first[v as usize])).collect();
    let welded = TriangleMesh::new(mesh.positions().to_vec(), triangles)?;
    let visibility = Occluders::of([&welded]).visibility(&welded, None, &|| true);
    let visibility = visibility.unwrap_or_default();
    let (mut sum, mut total) = (0.0, 0.0);
    for [a, b] in seam_edges(&sides(mesh, uv)) {
        let length = length(sub(layout.position(b), layout.position(a)));
        sum += length * 0.5 * (visibility[a as usize] + visibility[b as usize]);
        total += length;
    }
    Ok((total > 0.0).then(|| sum / total))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// A cube inside of another. All triangles of one of them are charts of their own; the other is in
    /// one piece.
    #[test]
    fn seams_inside_are_not_visible_and_those_outside_are() {
        let cube = shapes::cube(2);
        let center = cube.positions().iter().fold(0.0_f64, |m, p| m.max(p[0])) / 2.0;
        let inner = cube
            .positions()
            .iter()
            .map(|p| p.map(|c| center + 0.5 * (c - center)));
        let mut positions = cube.positions().to_vec();
        positions.extend(inner);
        let (count, vertices) = (cube.triangles().len(), cube.positions().len() as u32);
        let mut triangles = cube.triangles().to_vec();
        triangles.extend(cube.triangles().iter().map(|t| t.map(|v| vertices + v)));
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        let torn = |is_torn: fn(usize, usize) -> bool| {
            let mut uvs: Vec<[f32; 2]> = mesh
                .positions()
                .iter()
                .map(|p| [p[0] as f32, p[1] as f32])
                .collect();
            let mut triangles = mesh.triangles().to_vec();
            for (t, triangle) in triangles.iter_mut().enumerate() {
                if is_torn(t, count) {
                    *triangle = triangle.map(|v| {
                        let [x, y] = uvs[v as usize];
                        uvs.push([x + 9.0 * (t + 1) as f32, y]);
                        uvs.len() as u32 - 1
                    });
                }
            }
            let uv = UvMap::new(uvs, triangles).unwrap();
            seam_visibility(&mesh, &uv).unwrap()
        };
        assert_eq!(torn(|_, _| false), None);
        assert_eq!(torn(|t, count| t < count), Some(1.0));
        assert_eq!(torn(|t, count| t >= count), Some(0.0));
    }
}
