//! Several parameterizations side by side in one UV square, at one texel density.

use serde::{Deserialize, Serialize};

use fam_surface::TriangleMesh;
use fam_surface::vector::length;

/// Space around every box, as a fraction of the square root of the area of all.
const MARGIN: f64 = 1.0 / 256.0;

/// Widths that are tried for the rows of boxes, as multiples of that square root.
const WIDTHS: std::ops::RangeInclusive<u32> = 20..=60;
const WIDTH_STEP: f64 = 0.05;

/// Where a parameterization lies in the square: q ↦ scale · q + offset.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// Factor of both coordinates.
    pub scale: f32,
    /// Added after scaling.
    pub offset: [f32; 2],
}

impl Placement {
    /// Leaves a parameterization where it is.
    pub(super) const IDENTITY: Self = Self {
        scale: 1.0,
        offset: [0.0; 2],
    };

    /// The UV of a point whose parameter is `q`.
    pub fn place(&self, q: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|axis| self.scale * q[axis] + self.offset[axis])
    }
}

/// UV length per length on the surface: the median over its area, so that the few triangles
/// that a cut smears do not count. `None` where no triangle has area in both.
pub(super) fn texel_density(mesh: &TriangleMesh, uvs: &[[f32; 2]]) -> Option<f64> {
    let mut densities: Vec<(f64, f64)> = mesh
        .triangles()
        .iter()
        .enumerate()
        .filter_map(|(t, triangle)| {
            let area = length(mesh.area_vector(t));
            let [a, b, c] = triangle.map(|v| uvs[v as usize].map(f64::from));
            let image = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let density = (image.abs() / area).sqrt();
            (area > 0.0 && density.is_finite() && density > 0.0).then_some((density, area))
        })
        .collect();
    densities.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * densities.iter().map(|(_, area)| area).sum::<f64>();
    let mut sum = 0.0;
    densities.into_iter().find_map(|(density, area)| {
        sum += area;
        (sum >= half).then_some(density)
    })
}

/// Places parameterizations in the unit square without overlap of their bounding boxes; a
/// single one fills it. `uvs` and `densities` (see [`texel_density`]) have one entry for each.
pub(super) fn side_by_side(uvs: &[&[[f32; 2]]], densities: &[Option<f64>]) -> Vec<Placement> {
    let boxes: Vec<UvBox> = uvs
        .iter()
        .zip(densities)
        .map(|(uvs, density)| UvBox::around(uvs, density.map_or(1.0, |density| 1.0 / density)))
        .collect();
    let root = boxes
        .iter()
        .map(|b| b.size[0] * b.size[1])
        .sum::<f64>()
        .sqrt();
    let margin = if boxes.len() > 1 { MARGIN * root } else { 0.0 };
    let sizes: Vec<[f64; 2]> = boxes.iter().map(|b| b.size.map(|s| s + margin)).collect();
    let widest = sizes.iter().fold(0.0, |w: f64, s| w.max(s[0]));
    let (corners, side) = WIDTHS
        .map(|step| rows(&sizes, widest.max(f64::from(step) * WIDTH_STEP * root)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or_default();
    let side = if side > 0.0 { side } else { 1.0 };
    boxes
        .iter()
        .zip(corners)
        .map(|(b, corner)| {
            let offset = [0, 1].map(|axis| {
                let corner = corner[axis] + 0.5 * margin;
                ((corner - b.low[axis] * b.scale) / side) as f32
            });
            Placement {
                scale: (b.scale / side) as f32,
                offset,
            }
        })
        .collect()
}

/// The bounding box of a parameterization, its size in units of the surface.
struct UvBox {
    low: [f64; 2],
    size: [f64; 2],
    scale: f64,
}

impl UvBox {
    fn around(uvs: &[[f32; 2]], scale: f64) -> Self {
        let bound = |axis: usize, fold: fn(f64, f64) -> f64, start: f64| {
            let values = uvs.iter().map(|uv| f64::from(uv[axis]));
            values.fold(start, fold)
        };
        let low = [0, 1].map(|axis| bound(axis, f64::min, f64::INFINITY));
        let high = [0, 1].map(|axis| bound(axis, f64::max, f64::NEG_INFINITY));
        Self {
            low,
            size: [0, 1].map(|axis| (high[axis] - low[axis]) * scale),
            scale,
        }
    }
}

/// Sets boxes in rows of a width, the highest first; returns their lower left corners and the
/// side of the square around all of them.
fn rows(sizes: &[[f64; 2]], width: f64) -> (Vec<[f64; 2]>, f64) {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b][1].total_cmp(&sizes[a][1]).then(a.cmp(&b)));
    let mut corners = vec![[0.0; 2]; sizes.len()];
    let (mut x, mut y, mut height, mut reached) = (0.0, 0.0, 0.0, 0.0_f64);
    for i in order {
        if x > 0.0 && x + sizes[i][0] > width {
            y += height;
            x = 0.0;
            height = 0.0;
        }
        if x == 0.0 {
            height = sizes[i][1];
        }
        corners[i] = [x, y];
        x += sizes[i][0];
        reached = reached.max(x);
    }
    (corners, reached.max(y + height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    fn square(corner: [f32; 2], size: [f32; 2]) -> Vec<[f32; 2]> {
        let [[x, y], [w, h]] = [corner, size];
        vec![[x, y], [x + w, y], [x, y + h], [x + w, y + h]]
    }

    #[test]
    fn one_parameterization_fills_the_unit_square() {
        let uvs = square([3.0, -2.0], [4.0, 1.0]);
        let [placement] = side_by_side(&[&uvs], &[Some(7.0)])[..] else {
            panic!("one placement");
        };
        let placed: Vec<_> = uvs.iter().map(|&q| placement.place(q)).collect();
        assert_eq!(placed, square([0.0, 0.0], [1.0, 0.25]));
    }

    #[test]
    fn boxes_keep_apart_in_the_unit_square_at_one_density() {
        let uvs: Vec<_> = (1..40)
            .map(|i| {
                let i = i as f32;
                square([i, -i], [1.0 + (i * 7.0) % 5.0, 0.5 + (i * 3.0) % 4.0])
            })
            .collect();
        let densities: Vec<_> = (1..40).map(|i| Some(0.5 * f64::from(i % 4 + 1))).collect();
        let slices: Vec<&[[f32; 2]]> = uvs.iter().map(Vec::as_slice).collect();
        let placements = side_by_side(&slices, &densities);
        let boxes: Vec<_> = std::iter::zip(&uvs, &placements)
            .map(|(uvs, placement)| (placement.place(uvs[0]), placement.place(uvs[3])))
            .collect();
        let mut covered = 0.0;
        for (i, (low, high)) in boxes.iter().enumerate() {
            assert!(low.iter().all(|&c| c >= 0.0) && high.iter().all(|&c| c <= 1.0));
            covered += (high[0] - low[0]) * (high[1] - low[1]);
            for (other_low, other_high) in &boxes[..i] {
                let apart =
                    |axis: usize| low[axis] > other_high[axis] || high[axis] < other_low[axis];
                assert!(apart(0) || apart(1));
            }
        }
        assert!(covered > 0.5, "{covered}");
        for (placement, density) in placements.iter().zip(&densities) {
            let scale = f64::from(placement.scale) * density.unwrap();
            let first = f64::from(placements[0].scale) * densities[0].unwrap();
            assert!((scale / first - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn points_and_lines_have_a_place_too() {
        let point = vec![[2.0, 2.0]; 3];
        let placements = side_by_side(&[&point], &[None]);
        assert_eq!(placements[0].place(point[0]), [0.0, 0.0]);
        let line = square([0.0, 0.0], [1.0, 0.0]);
        let placements = side_by_side(&[&point, &line], &[None, None]);
        assert!(placements.iter().all(|p| p.scale.is_finite()));
    }

    #[test]
    fn density_is_that_of_most_of_the_area() {
        let sheet = shapes::rectangle(4.0, 2.0, 20, 10);
        let mut uvs: Vec<[f32; 2]> = sheet
            .positions()
            .iter()
            .map(|p| [0.5 * p[0] as f32, 0.5 * p[1] as f32])
            .collect();
        uvs[17] = [1e6, -1e6];
        assert!((texel_density(&sheet, &uvs).unwrap() - 0.5).abs() < 1e-6);
        assert_eq!(texel_density(&sheet, &vec![[0.0; 2]; uvs.len()]), None);
    }
}
