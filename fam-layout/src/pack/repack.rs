//! Charts of a UV map that is there, laid side by side anew.

use std::collections::HashMap;

use fam_surface::charts::charts;
use fam_surface::{SurfaceError, UvMap};

use super::{Chart, pack, to_f32};

/// A UV map whose charts were laid side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Repacked {
    /// The map: its UVs and triangles in their order. A UV that is in several charts has the place
    /// of the last of them.
    pub uvs: UvMap,
    /// Share of the square that charts cover.
    pub coverage: f64,
    /// Least number of texels between charts: less than asked for where there is no room.
    pub margin: f64,
}

/// Lays the charts of a map side by side in the unit square, each turned, and all enlarged or reduced
/// by the same factor. `margin` texels of `resolution` along a side stay free between them. Charts
/// that overlap themselves or are mirrored stay so.
///
/// # Errors
/// A UV is not finite.
pub fn repacked(uvs: &UvMap, margin: f64, resolution: u32) -> Result<Repacked, SurfaceError> {
    let of_triangle = charts(uvs);
    let count = of_triangle
        .iter()
        .max()
        .map_or(0, |&last| last as usize + 1);
    let mut parts = vec![Part::default(); count];
    for (&chart, triangle) in of_triangle.iter().zip(uvs.triangles()) {
        parts[chart as usize].push(uvs, triangle);
    }
    let own: Vec<Chart> = parts
        .iter()
        .map(|part| Chart::new(&part.uvs, &part.triangles))
        .collect::<Result<_, _>>()?;
    let packing = pack(&own, margin, resolution, &|| true);
    let placed = to_f32(&own, &packing)?;
    let mut found = vec![[0.0; 2]; uvs.uvs().len()];
    for (part, placed) in parts.iter().zip(placed.uvs) {
        for (&v, q) in part.source.iter().zip(placed) {
            found[v as usize] = q;
        }
    }
    Ok(Repacked {
        uvs: UvMap::new(found, uvs.triangles().to_vec())?,
        coverage: packing.coverage,
        margin: packing.margin,
    })
}

/// A chart with indices of its own.
#[derive(Clone, Default)]
struct Part {
    uvs: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    /// The index of every UV in the map.
    source: Vec<u32>,
    numbers: HashMap<u32, u32>,
}

impl Part {
    fn push(&mut self, map: &UvMap, triangle: &[u32; 3]) {
        let own = triangle.map(|v| {
            *self.numbers.entry(v).or_insert_with(|| {
                self.uvs.push(map.uvs()[v as usize].map(f64::from));
                self.source.push(v);
                self.source.len() as u32 - 1
            })
        });
        self.triangles.push(own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::metrics::for_each_overlapping_pair;

    #[test]
    fn charts_keep_their_shapes_and_no_longer_overlap() {
        let square = |x: f32, side: f32| [[x, 0.0], [x + side, 0.0], [x + side, side], [x, side]];
        let uvs = [square(0.0, 1.0), square(0.5, 2.0), square(7.0, 1.0)].concat();
        let triangles =
            (0..3).flat_map(|k| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]);
        let map = UvMap::new(uvs, triangles.collect()).unwrap();
        let packed = repacked(&map, 4.0, 256).unwrap();
        let mut overlapping = 0;
        for_each_overlapping_pair(&packed.uvs, |_| overlapping += 1);
        assert_eq!(overlapping, 0);
        let area = |t: usize| {
            let [a, b, c] = packed.uvs.corners(t).map(|q| q.map(f64::from));
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        for (t, share) in (0..6).zip([1.0, 1.0, 4.0, 4.0, 1.0, 1.0]) {
            assert!((area(t) / area(0) / share - 1.0).abs() < 1e-4);
        }
        let all: f64 = (0..6).map(area).sum();
        assert!((all - packed.coverage).abs() < 1e-4 && all > 0.4);
        assert_eq!(packed.margin, 4.0);
        let empty = UvMap::new(vec![], vec![]).unwrap();
        assert!(repacked(&empty, 4.0, 256).unwrap().uvs.uvs().is_empty());
    }
}
