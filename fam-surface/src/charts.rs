//! The charts of a UV map.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use crate::metrics::for_each_overlapping_pair;
use crate::sets::Sets;
use crate::uv_map::UvMap;

/// The chart of every triangle, counting from 0 in the order of their first triangles. Triangles
/// with an edge at one place in the plane are in one chart, whatever the indices of its ends.
pub fn charts(uvs: &UvMap) -> Vec<u32> {
    charts_apart(uvs, &[])
}

/// The same, where triangles of different labels are never in one chart. `labels` has one for every
/// triangle, or none if all are alike.
pub fn charts_apart(uvs: &UvMap, labels: &[u32]) -> Vec<u32> {
    let label = |t: u32| labels.get(t as usize).copied().unwrap_or(0);
    let triangles = uvs.triangles();
    // Adding zero makes −0 and 0 one.
    let place = |v: u32| uvs.uvs()[v as usize].map(|c| (c + 0.0).to_bits());
    let mut sets = Sets::new(triangles.len());
    let mut sides: HashMap<(u32, [[u32; 2]; 2]), u32> = HashMap::new();
    for (t, corners) in (0..).zip(triangles) {
        let places = corners.map(place);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let mut side = [places[a], places[b]];
            side.sort_unstable();
            match sides.entry((label(t), side)) {
                Entry::Occupied(first) => sets.join(*first.get(), t),
                Entry::Vacant(free) => {
                    free.insert(t);
                }
            }
        }
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    (0..triangles.len() as u32)
        .map(|t| {
            let next = numbers.len() as u32;
            *numbers.entry(sets.root(t)).or_insert(next)
        })
        .collect()
}

/// What is wrong with a chart of a UV map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChartFlaws {
    /// Its first triangle.
    pub first_triangle: u32,
    /// How many triangles it has.
    pub triangles: usize,
    /// Whether more of its area is clockwise than counter-clockwise.
    pub is_mirrored: bool,
    /// Pairs of its triangles that overlap, without those that coincide: these share their place on
    /// purpose.
    pub overlapping: u64,
}

impl ChartFlaws {
    /// Whether there is anything wrong.
    pub fn is_flawed(&self) -> bool {
        self.is_mirrored || self.overlapping > 0
    }
}

/// Every chart of a map, in the order of [`charts_apart`], and what is wrong with it.
pub fn flaws(uvs: &UvMap, labels: &[u32]) -> Vec<ChartFlaws> {
    let of_triangle = charts_apart(uvs, labels);
    let mut found: Vec<ChartFlaws> = Vec::new();
    let mut areas: Vec<f64> = Vec::new();
    for (t, &chart) in of_triangle.iter().enumerate() {
        if chart as usize == found.len() {
            areas.push(0.0);
            found.push(ChartFlaws {
                first_triangle: t as u32,
                triangles: 0,
                is_mirrored: false,
                overlapping: 0,
            });
        }
        let [a, b, c] = uvs.corners(t).map(|q| q.map(f64::from));
        areas[chart as usize] += (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        found[chart as usize].triangles += 1;
    }
    for (chart, area) in found.iter_mut().zip(areas) {
        chart.is_mirrored = area < 0.0;
    }
    let places = |t: u32| {
        let mut corners = uvs
            .corners(t as usize)
            .map(|q| q.map(|c| (c + 0.0).to_bits()));
        corners.sort_unstable();
        corners
    };
    for_each_overlapping_pair(uvs, |pair| {
        let [a, b] = pair.map(|t| of_triangle[t as usize]);
        let counts = a == b && places(pair[0]) != places(pair[1]);
        found[a as usize].overlapping += u64::from(counts);
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_with_a_common_edge_are_one_chart() {
        let uvs = vec![
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [0.0, 1.0],
            // The first again, and far away.
            [-0.0, 0.0],
            [1.0, 1.0],
            [5.0, 5.0],
        ];
        let of =
            |triangles: &[[u32; 3]]| charts(&UvMap::new(uvs.clone(), triangles.into()).unwrap());
        assert_eq!(of(&[[0, 1, 2], [4, 5, 3]]), [0, 0]);
        // A corner in common is not enough.
        assert_eq!(of(&[[0, 1, 2], [3, 6, 4]]), [0, 1]);
        assert_eq!(of(&[[3, 6, 4], [0, 1, 2], [5, 1, 0]]), [0, 1, 1]);
        assert!(of(&[]).is_empty());
    }

    #[test]
    fn mirrored_and_folded_charts_are_found() {
        let square = |x: f32, width: f32| [[x, 0.0], [x + width, 0.0], [x + width, 1.0], [x, 1.0]];
        let mut uvs = [square(0.0, 1.0), square(3.0, -1.0), square(5.0, 1.0)].concat();
        // The last corner is drawn over the diagonal.
        uvs[11] = [5.9, 0.2];
        let quad = |k: u32| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]];
        let found = flaws(
            &UvMap::new(uvs, (0..3).flat_map(quad).collect()).unwrap(),
            &[],
        );
        let of = |chart: &ChartFlaws| (chart.first_triangle, chart.triangles);
        assert_eq!(
            found.iter().map(of).collect::<Vec<_>>(),
            [(0, 2), (2, 2), (4, 2)]
        );
        let told = found.iter().map(|one| (one.is_mirrored, one.overlapping));
        assert_eq!(
            told.collect::<Vec<_>>(),
            [(false, 0), (true, 0), (false, 1)]
        );
        assert!(!found[0].is_flawed() && found[1].is_flawed() && found[2].is_flawed());
        let twice = UvMap::new(square(0.0, 1.0).to_vec(), vec![[0, 1, 2], [2, 0, 1]]).unwrap();
        assert_eq!(flaws(&twice, &[])[0].overlapping, 0);
        assert_eq!(
            (charts(&twice), charts_apart(&twice, &[3, 5])),
            (vec![0, 0], vec![0, 1])
        );
        assert_eq!(flaws(&twice, &[3, 5]).len(), 2);
    }
}
