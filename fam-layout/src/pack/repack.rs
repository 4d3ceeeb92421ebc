//! Charts of a UV map that is there, laid side by side anew.

use std::collections::HashMap;

use fam_surface::charts::charts_apart;
use fam_surface::{SurfaceError, UvMap};

use super::{Chart, PackError, PackOptions, Turns, pack, to_f32};

/// A UV map whose charts were laid side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Repacked {
    /// The map: triangles in their order, every chart with UVs of its own.
    pub uvs: UvMap,
    /// Share of the squares that charts cover.
    pub coverage: f64,
    /// Least number of texels between charts: less than asked for where there is no room.
    pub margin: f64,
    /// How many squares there are, of which that of number `t` has its lower left corner at
    /// (`t % 10`, `t / 10`).
    pub tiles: u32,
    /// Texels along the side of a square.
    pub resolution: u32,
}

/// Lays the charts of a map side by side in unit squares, each turned as far as it may be. Charts that
/// overlap themselves or are mirrored stay so.
///
/// `labels` has one for every triangle, or none: triangles of different labels, as of two files, are never
/// in one chart, even where they lie on one place.
///
/// All charts are enlarged or reduced by the same factor, and the unit of length of the options is that of
/// the map's UVs. With `areas`, of all triangles of the surface, every chart is first enlarged or reduced to
/// the area of its triangles, and the unit is that of the surface.
///
/// # Errors
/// A UV is not finite, or what is asked for is impossible.
///
/// # Panics
/// If there are fewer areas than triangles.
pub fn repacked(
    uvs: &UvMap,
    labels: &[u32],
    areas: Option<&[f64]>,
    turns: Turns,
    options: &PackOptions<'_>,
) -> Result<Repacked, PackError> {
    let of_triangle = charts_apart(uvs, labels);
    let count = of_triangle
        .iter()
        .max()
        .map_or(0, |&last| last as usize + 1);
    let mut parts = vec![Part::default(); count];
    for (t, &chart) in (0..).zip(&of_triangle) {
        parts[chart as usize].push(uvs, t);
    }
    if let Some(areas) = areas {
        parts.iter_mut().for_each(|part| part.enlarge_to(areas));
    }
    let own: Vec<Chart> = parts
        .iter()
        .map(|part| Ok(Chart::new(&part.uvs, &part.triangles)?.with_turns(turns)))
        .collect::<Result<_, SurfaceError>>()?;
    let packing = pack(&own, options, &|| true)?;
    let placed = to_f32(&own, &packing, &[])?;
    let mut found = Vec::new();
    let mut triangles = vec![[0; 3]; uvs.triangles().len()];
    for (part, placed) in parts.iter().zip(placed.uvs) {
        let first = found.len() as u32;
        found.extend(placed);
        for (corners, &t) in part.triangles.iter().zip(&part.source) {
            triangles[t as usize] = corners.map(|v| first + v);
        }
    }
    Ok(Repacked {
        uvs: UvMap::new(found, triangles)?,
        coverage: packing.coverage,
        margin: packing.margin,
        tiles: packing.tiles,
        resolution: packing.resolution,
    })
}

/// A chart with indices of its own: one for each place.
#[derive(Clone, Default)]
struct Part {
    uvs: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    /// The triangle of the map for each of its own.
    source: Vec<u32>,
    numbers: HashMap<[u32; 2], u32>,
}

impl Part {
    /// Enlarges or reduces it to the area of its triangles, of those of all triangles of the map. Without
    /// any area in the plane it stays as it is.
    fn enlarge_to(&mut self, areas: &[f64]) {
        let in_plane = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.uvs[v as usize]);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
        };
        let own: f64 = self.triangles.iter().map(in_plane).sum();
        let asked: f64 = self.source.iter().map(|&t| areas[t as usize]).sum();
        let factor = (asked / own).sqrt();
        if factor.is_finite() {
            self.uvs.iter_mut().for_each(|q| *q = q.map(|c| c * factor));
        }
    }

    fn push(&mut self, map: &UvMap, triangle: u32) {
        let corners = map.corners(triangle as usize);
        // Adding zero makes −0 and 0 one.
        let own = corners.map(|q| {
            let place = q.map(|c| (c + 0.0).to_bits());
            *self.numbers.entry(place).or_insert_with(|| {
                self.uvs.push(q.map(f64::from));
                self.uvs.len() as u32 - 1
            })
        });
        self.triangles.push(own);
        self.source.push(triangle);
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
        let packed = repacked(&map, &[], None, Turns::Free, &PackOptions::new(4.0, 256)).unwrap();
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
        assert!(
            repacked(&empty, &[], None, Turns::Free, &PackOptions::new(4.0, 256))
                .unwrap()
                .uvs
                .uvs()
                .is_empty()
        );
    }
    #[test]
    fn charts_that_touch_at_a_corner_come_apart() {
        let mut uvs = Vec::new();
        let mut triangles = Vec::new();
        for k in 0..3 {
            let low = k as f32;
            let first = 4 * k;
            // The first two share the index of the corner at which they touch, the last does not.
            uvs.extend([
                [low, low],
                [low + 1.0, low],
                [low + 1.0, low + 1.0],
                [low, low + 1.0],
            ]);
            let corner = if k == 1 { 2 } else { first };
            triangles.extend([
                [corner, first + 1, first + 2],
                [corner, first + 2, first + 3],
            ]);
        }
        let map = UvMap::new(uvs, triangles).unwrap();
        let packed = repacked(&map, &[], None, Turns::Free, &PackOptions::new(2.0, 256)).unwrap();
        let mut overlapping = 0;
        for_each_overlapping_pair(&packed.uvs, |_| overlapping += 1);
        assert_eq!(overlapping, 0);
        let side = |t: usize| {
            let [a, b, _] = packed.uvs.corners(t);
            f64::from(a[0] - b[0]).hypot(f64::from(a[1] - b[1]))
        };
        let sides = [0, 2, 4].map(side);
        assert!(
            sides
                .iter()
                .all(|side| (side / sides[0] - 1.0).abs() < 1e-5)
        );
    }

    #[test]
    fn charts_get_the_areas_of_their_triangles() {
        let square = |x: f32, side: f32| [[x, 0.0], [x + side, 0.0], [x + side, side], [x, side]];
        let uvs = [square(0.0, 1.0), square(2.0, 0.1)].concat();
        let quad = |k: u32| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]];
        let map = UvMap::new(uvs, (0..2).flat_map(quad).collect()).unwrap();
        let areas = [0.5, 0.5, 2.0, 2.0];
        let options = PackOptions {
            size: super::super::options::Size::Side { density: 100.0 },
            ..PackOptions::new(2.0, 1024)
        };
        let packed = repacked(&map, &[], Some(&areas), Turns::Quarters, &options).unwrap();
        let texels = f64::from(packed.resolution);
        for (t, side) in [(0, 100.0), (2, 200.0)] {
            let [a, b, _] = packed.uvs.corners(t).map(|q| q.map(f64::from));
            let found = (a[0] - b[0]).hypot(a[1] - b[1]) * texels;
            assert!((found - side).abs() < 0.01, "{found}");
        }
        assert!(texels <= 308.0, "{texels}");
    }
}
