//! How symmetric a UV map is.

use std::collections::BTreeMap;

use crate::charts::charts;
use crate::neighbors::nearest;
use crate::symmetry::{Frame, MirrorPlane};
use crate::{TriangleMesh, UvMap};

/// How far a place may be from where the mirror image should be, as a share of the side of a square of
/// the charts' area.
const NEAR: f64 = 0.03;

/// The share of the area of a mesh, from 0 to 1, whose mirror image at a plane has mirrored UVs: at a
/// vertical line, up to a shift between every two charts, and to within 3 % of the side of a square of the
/// charts' area. Vertices need not correspond: the mirror image of a triangle is the one whose middle is
/// nearest to that of its middle. 0 without any area, or with one beyond the range of numbers.
///
/// # Panics
/// If the map has not as many triangles as the mesh.
pub fn mirrored_share(mesh: &TriangleMesh, uvs: &UvMap, plane: &MirrorPlane) -> f64 {
    let all = 0..mesh.triangles().len();
    let middle = |t: usize| {
        let corners = mesh.corners(t).map(|p| p.map(|c| c / 3.0));
        [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>())
    };
    let place = |t: usize| {
        let corners = uvs.corners(t).map(|q| q.map(|c| f64::from(c) / 3.0));
        [0, 1].map(|k| corners.iter().map(|q| q[k]).sum::<f64>())
    };
    let frame = Frame::of(mesh);
    let point = |p: [f64; 3]| frame.place(p).map(|c| c as f32);
    let points: Vec<[f32; 3]> = all.clone().map(|t| point(middle(t))).collect();
    let reflected = |t: usize| point(plane.reflected(middle(t)));
    let reflected: Vec<[f32; 3]> = all.clone().map(reflected).collect();
    let images = nearest(&points, &reflected);
    let chart_of = charts(uvs);
    let areas = mesh.triangle_areas();
    let mut pairs: BTreeMap<[u32; 2], Vec<Pair>> = BTreeMap::new();
    for t in all.clone() {
        let image = images[t] as usize;
        let ([u, v], [mirrored_u, mirrored_v]) = (place(t), place(image));
        let pair = Pair {
            shift: [u + mirrored_u, v - mirrored_v],
            area: areas[t],
        };
        let charts = [chart_of[t], chart_of[image]];
        pairs.entry(charts).or_default().push(pair);
    }
    let near = NEAR * all.map(|t| uvs.area(t).abs()).sum::<f64>().sqrt();
    let mirrored = pairs.into_values().map(|pairs| {
        let [u, v] = [0, 1].map(|k| median(pairs.iter().map(|pair| pair.shift[k]).collect()));
        let is_near = |pair: &&Pair| (pair.shift[0] - u).hypot(pair.shift[1] - v) < near;
        let near = pairs.iter().filter(is_near);
        near.map(|pair| pair.area).sum::<f64>()
    });
    let total: f64 = areas.iter().sum();
    if total > 0.0 {
        mirrored.sum::<f64>() / total
    } else {
        0.0
    }
}

/// A triangle and its mirror image.
struct Pair {
    /// By how much the UVs of the one are shifted against the mirrored ones of the other.
    shift: [f64; 2],
    area: f64,
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::rectangle;

    /// A sheet and its own coordinates, changed by `place`.
    fn share(place: impl Fn([f64; 3]) -> [f64; 2]) -> f64 {
        let sheet = rectangle(2.0, 1.0, 40, 20);
        let uv = |&p: &[f64; 3]| place(p).map(|c| c as f32);
        let uvs = sheet.positions().iter().map(uv).collect();
        let uvs = UvMap::new(uvs, sheet.triangles().to_vec()).unwrap();
        mirrored_share(&sheet, &uvs, &MirrorPlane::across(0, 0.0))
    }

    #[test]
    fn symmetric_maps_are_told_from_others() {
        assert_eq!(share(|[x, y, _]| [x + 5.0, y - 2.0]), 1.0);
        assert_eq!(
            share(|[x, y, _]| [x + 0.1 * x.powi(3), y + 0.3 * x * x]),
            1.0
        );
        // On its side: mirrored at a horizontal line.
        assert!(share(|[x, y, _]| [y, x]) < 0.2);
        // One half is right, the other a little too far to the right.
        let halves = share(|[x, y, _]| [x + if y > 0.0 { 0.3 * y } else { 0.0 }, y]);
        assert!((0.5..0.7).contains(&halves), "{halves}");
    }
}
