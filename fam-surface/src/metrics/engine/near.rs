//! How near charts are to each other.

use std::collections::HashMap;

use rayon::prelude::*;
use robust::{Coord, orient2d};
use rstar::{AABB, RTree, RTreeObject};

use crate::UvMap;

use super::super::layout::signed_double_area;
use super::ascending;

/// Edges of other charts that one edge is compared with, and such comparisons for each edge in the
/// mean. In a map with so many that near, the least distance says nothing any more; in a good one
/// there are a few.
const MOST_OF_ONE: usize = 1 << 9;
const MOST_IN_THE_MEAN: usize = 1 << 6;

/// Edges of any chart that are looked at for one edge.
const MOST_SEEN: usize = 1 << 14;

/// Edges that are compared before it is asked whether these are too many: always the same, on any
/// number of threads.
const CHUNK: usize = 1 << 10;

/// An edge at the border of a chart.
pub(super) struct Border {
    ends: [[f64; 2]; 2],
    chart: u32,
    triangle: u32,
}

/// A place where two charts are near each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    /// In UV units.
    pub distance: f64,
    /// One of either chart.
    pub triangles: [u32; 2],
    /// The middle between the two.
    pub at: [f64; 2],
}

/// Pairs of charts that are near each other.
pub(super) struct Near {
    pub count: u64,
    /// Where they are nearest.
    pub least: Option<Gap>,
    /// Whether all were compared.
    pub complete: bool,
}

/// The borders of charts: edges of triangles with UV area which have no other triangle of the chart
/// on their other side. Only triangles for which `counts` holds are there.
pub(super) fn borders(uv: &UvMap, charts: &[u32], counts: impl Fn(usize) -> bool) -> Vec<Border> {
    let mut sides = Vec::new();
    for t in (0..charts.len()).filter(|&t| counts(t)) {
        let mut corners = uv.corners(t);
        let area = signed_double_area(corners);
        if area == 0.0 {
            continue;
        }
        if area < 0.0 {
            corners.swap(1, 2);
        }
        // Counter-clockwise, the triangle is on the left of every side.
        let places = corners.map(|q| q.map(|c| (c + 0.0).to_bits()));
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (places[i], places[j]);
            let reversed = a > b;
            let ends = if reversed { [b, a] } else { [a, b] };
            sides.push((charts[t], ends, reversed, t as u32));
        }
    }
    sides.par_sort_unstable();
    let border = |own: &[(u32, [[u32; 2]; 2], bool, u32)]| {
        let (chart, ends, reversed, triangle) = own[0];
        let is_inside = own.iter().any(|side| side.2 != reversed);
        (!is_inside).then(|| Border {
            ends: ends.map(|q| q.map(|c| f32::from_bits(c).into())),
            chart,
            triangle,
        })
    };
    sides
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .filter_map(border)
        .collect()
}

/// The pairs of charts nearer to each other than `least`, among those for which `counts` holds; the
/// lower chart is first.
pub(super) fn near(borders: &[Border], least: f64, counts: impl Fn([u32; 2]) -> bool) -> Near {
    let mut near = Near {
        count: 0,
        least: None,
        complete: true,
    };
    if least.is_nan() || least <= 0.0 {
        return near;
    }
    let leaves = (0..).zip(borders).map(|(index, border)| Leaf {
        index,
        ends: border.ends,
    });
    let tree = RTree::bulk_load(leaves.collect());
    let mut gaps: HashMap<[u32; 2], Gap> = HashMap::new();
    let most = MOST_IN_THE_MEAN * borders.len().max(CHUNK);
    let mut compared = 0;
    for chunk in borders.chunks(CHUNK) {
        let found: Vec<Found> = chunk
            .par_iter()
            .map(|border| border.gaps(borders, &tree, least))
            .collect();
        for (border, found) in chunk.iter().zip(found) {
            compared += found.compared;
            near.complete &= found.complete;
            for (chart, gap) in found.gaps {
                let pair = ascending([border.chart, chart]);
                gaps.entry(pair)
                    .and_modify(|known| *known = known.nearer(gap))
                    .or_insert(gap);
            }
        }
        if compared > most {
            near.complete = false;
            break;
        }
    }
    for (_, gap) in gaps.into_iter().filter(|(pair, _)| counts(*pair)) {
        near.count += 1;
        near.least = Some(near.least.map_or(gap, |known| known.nearer(gap)));
    }
    near
}

/// What is near to an edge.
struct Found {
    /// By the chart, the nearest place.
    gaps: Vec<(u32, Gap)>,
    compared: usize,
    complete: bool,
}

impl Border {
    /// Where charts of higher numbers are nearer than `least`.
    fn gaps(&self, borders: &[Border], tree: &RTree<Leaf>, least: f64) -> Found {
        let [a, b] = self.ends;
        let low = [0, 1].map(|k| a[k].min(b[k]) - least);
        let high = [0, 1].map(|k| a[k].max(b[k]) + least);
        let mut found = Found {
            gaps: Vec::new(),
            compared: 0,
            complete: true,
        };
        let leaves = tree.locate_in_envelope_intersecting(AABB::from_corners(low, high));
        for (seen, leaf) in leaves.enumerate() {
            if seen > MOST_SEEN || found.compared > MOST_OF_ONE {
                found.complete = false;
                break;
            }
            let other = &borders[leaf.index as usize];
            if other.chart <= self.chart {
                continue;
            }
            found.compared += 1;
            let (distance, at) = between(self.ends, other.ends);
            if distance < least {
                let triangles = [self.triangle, other.triangle];
                let gap = Gap {
                    distance,
                    triangles,
                    at,
                };
                match found
                    .gaps
                    .iter_mut()
                    .find(|(chart, _)| *chart == other.chart)
                {
                    Some((_, known)) => *known = known.nearer(gap),
                    None => found.gaps.push((other.chart, gap)),
                }
            }
        }
        found
    }
}

impl Gap {
    /// The nearer of two; of equal ones that between the first triangles.
    fn nearer(self, other: Self) -> Self {
        let order = self.distance.total_cmp(&other.distance);
        match order.then(self.triangles.cmp(&other.triangles)).is_le() {
            true => self,
            false => other,
        }
    }
}

/// An edge in a tree of edges.
struct Leaf {
    index: u32,
    ends: [[f64; 2]; 2],
}

impl RTreeObject for Leaf {
    type Envelope = AABB<[f64; 2]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners(self.ends[0], self.ends[1])
    }
}

/// The distance of two segments, and the middle between their nearest points.
fn between(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> (f64, [f64; 2]) {
    let ends = [
        (one[0], other),
        (one[1], other),
        (other[0], one),
        (other[1], one),
    ];
    let to_segment = |(q, segment): ([f64; 2], [[f64; 2]; 2])| {
        let nearest = nearest_on(segment, q);
        let distance = (q[0] - nearest[0]).hypot(q[1] - nearest[1]);
        (distance, [0, 1].map(|k| 0.5 * (q[k] + nearest[k])))
    };
    let least = ends
        .map(to_segment)
        .into_iter()
        .reduce(|a, b| if b.0 < a.0 { b } else { a });
    let (distance, at) = least.unwrap_or((f64::INFINITY, [0.0; 2]));
    if distance > 0.0 && cross(one, other) {
        return (0.0, at);
    }
    (distance, at)
}

fn nearest_on([a, b]: [[f64; 2]; 2], q: [f64; 2]) -> [f64; 2] {
    let along = [b[0] - a[0], b[1] - a[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    let share = ((q[0] - a[0]) * along[0] + (q[1] - a[1]) * along[1]) / squared;
    match share {
        share if share <= 0.0 => a,
        share if share >= 1.0 => b,
        share => [0, 1].map(|k| a[k] + share * along[k]),
    }
}

/// Whether two segments cross between their ends; exact.
fn cross(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> bool {
    let side = |[a, b]: [[f64; 2]; 2], q: [f64; 2]| {
        let [a, b, q] = [a, b, q].map(|[x, y]| Coord { x, y });
        orient2d(a, b, q)
    };
    let apart = |line: [[f64; 2]; 2], ends: [[f64; 2]; 2]| {
        let [p, q] = ends.map(|end| side(line, end));
        (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0)
    };
    apart(one, other) && apart(other, one)
}
