//! A chart joined with its mirror image along a part of the plane.

use std::collections::HashMap;

use super::chart::{Winding, evened, judged, surface, vertices};
use super::halves::Symmetric;
use crate::component::FlatChart;
use crate::cut::Cut;
use crate::distortion::Distortion;
use crate::patch::Patch;
use crate::patch::topology::Topology;
use crate::refine::problem::{Effort, Problem};
use crate::refine::with_better_angles;
use fam_surface::TriangleMesh;
use fam_surface::vector::{length, sub};

/// How much the direction of what is joined may vary in the chart of the half by itself (its standard
/// deviation, in radians): joined, it is straight. The longest arc within each of these is tried.
const BENDS: [f64; 6] = [1.5, 0.9, 0.6, 0.4, 0.25, 0.12];

/// Of arcs of more edges only some are tried.
const MOST_STARTS: usize = 1_000;

/// An arc of less than this share of the longest at hand is not tried: nothing would be gained.
const LEAST_GAIN: f64 = 0.05;

/// The solves along a cut that is known.
const FIRST: Effort = Effort {
    iterations: 60,
    decrease: 1e-4,
};
const LAST: Effort = Effort {
    iterations: 30,
    decrease: 1e-6,
};

/// The most that the last solve lowers the energy, as a share of it: its steps gain no more than those
/// that ended the first.
const MOST_GAIN: f64 = LAST.iterations as f64 * FIRST.decrease;

/// A chart of a half and its image as one symmetric chart, with the image of every point. They are
/// joined along the longest arc at the plane that was found to allow a layout within what is allowed;
/// none if there is none. All points of the two have the same numbers.
pub fn hinged(
    symmetric: &Symmetric,
    chart: &FlatChart,
    image: &FlatChart,
    allowed: &Distortion,
) -> Option<(FlatChart, Vec<u32>)> {
    let arcs = arcs(symmetric, chart, image);
    let longest = arcs.iter().map(Arc::length).fold(0.0, f64::max);
    let mut tried: Vec<Vec<u32>> = Vec::new();
    for bend in BENDS {
        if !symmetric.task.watch.goes_on() {
            return None;
        }
        let windows = arcs.iter().filter_map(|arc| arc.straightest(bend));
        let best = windows.reduce(|best, one| if one.1 > best.1 { one } else { best });
        let Some((points, length)) = best else {
            continue;
        };
        if length < LEAST_GAIN * longest || tried.contains(&points) {
            continue;
        }
        if let Some(found) = joined(symmetric, chart, image, &points, allowed) {
            return Some(found);
        }
        tried.push(points);
    }
    None
}

/// A run of edges at the plane along the boundary of a chart.
struct Arc {
    /// Points of the chart, one more than edges.
    points: Vec<u32>,
    /// How long each edge is, and its direction in the chart, without jumps of a full turn.
    edges: Vec<(f64, f64)>,
    /// Whether it comes back to where it starts.
    is_closed: bool,
}

impl Arc {
    fn length(&self) -> f64 {
        self.edges.iter().map(|edge| edge.0).sum()
    }

    /// The longest part in which the direction varies by so much, with its length.
    fn straightest(&self, bend: f64) -> Option<(Vec<u32>, f64)> {
        let count = self.edges.len();
        let turns = if self.is_closed { self.turn() } else { 0.0 };
        let at = |i: usize| {
            let (length, direction) = self.edges[i % count];
            (length, direction + turns * (i / count) as f64)
        };
        let reach = if self.is_closed { 2 * count } else { count };
        // Sums of lengths, and of directions and their squares, each times the length.
        let mut sums = vec![[0.0; 3]];
        for i in 0..reach {
            let (length, direction) = at(i);
            let [a, b, c] = sums[i];
            sums.push([
                a + length,
                b + length * direction,
                c + length * direction * direction,
            ]);
        }
        // Two edges stay open, so that the chart has a boundary.
        let most = if self.is_closed {
            count.saturating_sub(2)
        } else {
            count
        };
        let stride = count.div_ceil(MOST_STARTS);
        let mut best: Option<(f64, usize, usize)> = None;
        for start in (0..count).step_by(stride) {
            let last = (start + most).min(reach);
            for end in (start + 1..=last).rev().step_by(stride) {
                let [a, b, c] = [0, 1, 2].map(|k| sums[end][k] - sums[start][k]);
                if best.is_some_and(|(length, ..)| a <= length) {
                    break;
                }
                let variance = c / a - (b / a) * (b / a);
                if variance <= bend * bend {
                    best = Some((a, start, end));
                    break;
                }
            }
        }
        let (length, start, end) = best?;
        let wrapped = |i: usize| if self.is_closed { i % count } else { i };
        Some((
            (start..=end).map(|i| self.points[wrapped(i)]).collect(),
            length,
        ))
    }

    /// By how much the direction turns once around.
    fn turn(&self) -> f64 {
        let Some((first, last)) = self.edges.first().zip(self.edges.last()) else {
            return 0.0;
        };
        last.1 - first.1 + small(first.1 - last.1)
    }
}

/// An angle without full turns.
fn small(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

/// Where a chart meets its image: runs of edges along its boundary.
fn arcs(symmetric: &Symmetric, chart: &FlatChart, image: &FlatChart) -> Vec<Arc> {
    let Some(mesh) = surface(symmetric.task.mesh, chart) else {
        return Vec::new();
    };
    let own = vertices(symmetric.task.mesh, chart);
    // Sides of the image, by points that lie on the plane.
    let is_fixed = |point: u32| {
        let v = own[point as usize];
        symmetric.pairing.images[v as usize] == Some(v)
    };
    let sides = |triangles: &[[u32; 3]]| {
        let mut count: HashMap<[u32; 2], u32> = HashMap::new();
        for &[a, b, c] in triangles {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if is_fixed(a) && is_fixed(b) {
                    *count.entry([a.min(b), a.max(b)]).or_default() += 1;
                }
            }
        }
        count
    };
    let theirs = sides(&image.triangles);
    let opened = Topology::oriented(&mesh);
    let topology = &opened.topology;
    let ends = |h: u32| [topology.origin(h), topology.target(h)].map(|v| opened.source[v as usize]);
    let is_at_plane = |h: &u32| {
        let [a, b] = ends(*h);
        theirs.get(&[a.min(b), a.max(b)]) == Some(&1)
    };
    let mut arcs = Vec::new();
    for edges in topology.boundary_loops() {
        let flags: Vec<bool> = edges.iter().map(is_at_plane).collect();
        let is_closed = flags.iter().all(|&flag| flag);
        let first = flags.iter().position(|&flag| !flag).unwrap_or(0);
        let mut run: Vec<u32> = Vec::new();
        for i in 0..=edges.len() {
            let k = (first + i) % edges.len();
            let goes_on = i < edges.len() && flags[k];
            if goes_on {
                run.push(edges[k]);
            } else if !run.is_empty() {
                arcs.push(arc(chart, &mesh, &run, ends, is_closed));
                run.clear();
            }
        }
    }
    arcs
}

fn arc(
    chart: &FlatChart,
    mesh: &TriangleMesh,
    run: &[u32],
    ends: impl Fn(u32) -> [u32; 2],
    is_closed: bool,
) -> Arc {
    let mut points: Vec<u32> = run.iter().map(|&h| ends(h)[0]).collect();
    points.extend(run.last().map(|&h| ends(h)[1]));
    let mut edges: Vec<(f64, f64)> = Vec::new();
    for &h in run {
        let [a, b] = ends(h);
        let [p, q] = [a, b].map(|v| mesh.positions()[v as usize]);
        let [[x, y], [z, w]] = [a, b].map(|v| chart.uvs[v as usize]);
        let direction = (w - y).atan2(z - x);
        let direction = match edges.last() {
            Some(&(_, before)) => before + small(direction - before),
            None => direction,
        };
        edges.push((length(sub(p, q)), direction));
    }
    Arc {
        points,
        edges,
        is_closed,
    }
}

/// A chart and its image over the same points along an arc, laid out and made symmetric.
fn joined(
    symmetric: &Symmetric,
    chart: &FlatChart,
    image: &FlatChart,
    arc: &[u32],
    allowed: &Distortion,
) -> Option<(FlatChart, Vec<u32>)> {
    let count = chart.uvs.len() as u32;
    let mut images: Vec<u32> = (0..count).collect();
    let mut is_on_arc = vec![false; count as usize];
    for &point in arc {
        is_on_arc[point as usize] = true;
    }
    for point in 0..count {
        if !is_on_arc[point as usize] {
            images[point as usize] = images.len() as u32;
            images.push(point);
        }
    }
    let mirrored = image
        .triangles
        .iter()
        .map(|t| t.map(|point| images[point as usize]));
    let mut whole = FlatChart {
        uvs: vec![[0.0; 2]; images.len()],
        triangles: chart.triangles.iter().copied().chain(mirrored).collect(),
        source: chart.source.iter().chain(&image.source).copied().collect(),
        distortion: chart.distortion,
        is_straight: false,
    };
    let mesh = surface(symmetric.task.mesh, &whole)?;
    let patch = Patch::of(&mesh);
    let mut problem = Problem::new(&patch, patch.lengths.clone(), symmetric.task.watch);
    problem.injective = true;
    let mut layout = problem.flattened(Cut::none(&patch.topology), FIRST).ok()?;
    if layout.energy * (1.0 - MOST_GAIN) > allowed.energy {
        return None;
    }
    let _ = problem.relax(&mut layout, LAST);
    if layout.energy > allowed.energy {
        return None;
    }
    let layout = with_better_angles(&patch, layout, allowed, symmetric.task.watch);
    if layout.uv.len() != images.len() {
        return None;
    }
    for (q, &v) in layout.uv.iter().zip(&layout.opened.source) {
        let point = patch.source[v as usize];
        whole.uvs[point as usize] = q.map(|c| c / patch.scale);
    }
    let winding = Winding::of(symmetric.task.mesh);
    let mut whole = winding.righted(whole);
    whole.uvs = evened(&whole.uvs, &images);
    if !winding.is_positive(&whole) {
        return None;
    }
    whole.distortion = judged(symmetric.task.mesh, &whole)?;
    (whole.distortion.energy <= allowed.energy).then_some((whole, images))
}
