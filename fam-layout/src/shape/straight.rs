//! Charts that are nearly rectangles or strips, with straight sides along the axes.
//!
//! Four places of the outline become the corners of a rectangle. It is filled by Tutte's embedding
//! and relaxed, where every vertex of a side slides along it. The rectangle gets the width and the
//! height at which the energy is least. What stays within the bound is kept.

use super::corners::corners;
use super::sheet::{Sheet, Surface};
use crate::component::FlatChart;
use crate::pace::Pace;
use crate::patch::topology::Topology;
use crate::solve::SolveError;
use crate::solve::boundary::Boundary;
use crate::solve::energy::mean_energy;
use crate::solve::newton::{Flattening, Stop};
use crate::solve::orientation::first_flipped;
use crate::solve::rest::RestShapes;
use crate::solve::stretch::even_out_axes;
use crate::solve::tutte::embed_within;

/// How often a rectangle is brought to its best size and then relaxed, and in how many steps.
const ROUNDS: usize = 6;
const STEPS: usize = 20;

/// A round that lowers the energy above that of an isometry by a lesser share is the last.
const LEAST_GAIN: f64 = 1e-3;

/// The relative decrease of the energy that ends a round.
const DECREASE: f64 = 1e-9;

/// A rectangle that is this many times as far above 4 as the bound after a round is given up.
const HOPELESS: f64 = 4.0;

/// Opposite sides whose lengths differ by this factor more than the bound allows are no sides of a
/// rectangle.
const UNEQUAL: f64 = 1.5;

/// The energy of a rectangle, and where its vertices lie.
type Rectangle = (f64, Vec<[f64; 2]>);

/// A chart as a rectangle along the axes, if that has at most the energy `bound`.
pub fn straightened(
    surface: &Surface,
    chart: &FlatChart,
    bound: f64,
    pace: &dyn Pace,
) -> Option<FlatChart> {
    if chart.triangles.len() < 2 || !pace.goes_on() {
        return None;
    }
    let sheet = Sheet::of(surface, chart)?;
    let plan = Plan::new(&sheet, bound, pace)?;
    let best = corners(&sheet.patch, &plan.outline, &sheet.uv)
        .into_iter()
        .filter_map(|corners| plan.rectangle(corners).ok().flatten())
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, uv) = best?;
    let straight = FlatChart {
        is_straight: true,
        ..sheet.moved(uv)
    };
    (straight.distortion.energy <= bound).then_some(straight)
}

/// A chart that is to become a rectangle.
struct Plan<'a> {
    sheet: &'a Sheet,
    topology: &'a Topology,
    rest: RestShapes,
    /// The half-edges around it, and those around its holes.
    outline: Vec<u32>,
    holes: Vec<Vec<u32>>,
    bound: f64,
    pace: &'a dyn Pace,
}

impl<'a> Plan<'a> {
    /// None if the chart is no disk with holes, or not valid.
    fn new(sheet: &'a Sheet, bound: f64, pace: &'a dyn Pace) -> Option<Self> {
        let topology = &sheet.patch.topology;
        let mut holes = topology.boundary_loops();
        let is_disk = topology.euler_characteristic() == 2 - holes.len() as i64;
        if !is_disk || first_flipped(topology.triangles(), &sheet.uv).is_some() {
            return None;
        }
        let outer = holes.iter().position(|edges| {
            let at = |h: u32| sheet.uv[topology.origin(h) as usize];
            let pairs = edges.iter().zip(edges.iter().cycle().skip(1));
            let origin = at(edges[0]);
            let cross = pairs.map(|(&h, &next)| {
                let [p, q] = [h, next].map(|h| [0, 1].map(|k| at(h)[k] - origin[k]));
                p[0] * q[1] - p[1] * q[0]
            });
            cross.sum::<f64>() > 0.0
        })?;
        let outline = holes.remove(outer);
        let at = |v: u32| sheet.patch.positions[v as usize];
        let shapes: Vec<[[f64; 3]; 3]> = topology.triangles().iter().map(|t| t.map(at)).collect();
        (outline.len() >= 4).then_some(Self {
            rest: RestShapes::new(&shapes, Some(1.0)),
            sheet,
            topology,
            outline,
            holes,
            bound,
            pace,
        })
    }

    /// The rectangle with corners at the given places of the outline, and its energy; none if that is
    /// far above the bound.
    fn rectangle(&self, corners: [usize; 4]) -> Result<Option<Rectangle>, SolveError> {
        let Some(sides) = self.sides(corners) else {
            return Ok(None);
        };
        let triangles = self.topology.triangles();
        let mut uv = embed_within(self.topology, &self.rest, sides.places, &self.holes)?;
        let mut flattening =
            Flattening::new(triangles, self.rest.clone(), &[])?.holding(sides.held)?;
        let length = |h: u32| self.sheet.patch.lengths[h as usize];
        let boundary = Boundary::new(self.topology, length);
        // A convex outline cannot touch itself, but the rims of holes can.
        let kept_apart = Some(&boundary).filter(|_| !self.holes.is_empty());
        let stop = Stop {
            iterations: STEPS,
            relative_decrease: DECREASE,
            least: 0,
            pace: self.pace,
        };
        let mut energy = f64::INFINITY;
        for _ in 0..ROUNDS {
            even_out_axes(triangles, &self.rest, &mut uv);
            flattening.minimize(&mut uv, kept_apart, &stop)?;
            let before = energy;
            energy = mean_energy(triangles, &self.rest, &uv);
            if energy - 4.0 > HOPELESS * (self.bound - 4.0) {
                return Ok(None);
            }
            if before - energy <= LEAST_GAIN * (before - 4.0) || !self.pace.goes_on() {
                break;
            }
        }
        even_out_axes(triangles, &self.rest, &mut uv);
        let is_valid = first_flipped(triangles, &uv).is_none() && boundary.is_simple(&uv);
        Ok(is_valid.then(|| (mean_energy(triangles, &self.rest, &uv), uv)))
    }

    /// The vertices of the outline on the sides of a rectangle, by their distances on the surface; none
    /// if an edge joins two vertices of one side, whose triangle would collapse.
    fn sides(&self, corners: [usize; 4]) -> Option<Sides> {
        let count = self.outline.len();
        let order = |side: usize| {
            let (start, end) = (corners[side], corners[(side + 1) % 4]);
            let steps = (end + count - start) % count;
            (0..steps).map(move |k| (start + k) % count)
        };
        let length = |i: usize| self.sheet.patch.lengths[self.outline[i] as usize];
        let lengths = [0, 1, 2, 3].map(|side| order(side).map(length).sum::<f64>());
        let size = [0, 1].map(|k| 0.5 * (lengths[k] + lengths[k + 2]));
        // Where the logarithm of the stretch goes from −x to x between two sides, the energy is about
        // 4 x² / 3 above that of an isometry.
        let most = UNEQUAL * 2.0 * (0.75 * (self.bound - 4.0)).sqrt();
        let is_alike = |k: usize| (lengths[k] / lengths[k + 2]).ln().abs() <= most;
        let has_size = lengths.iter().all(|&l| l > 0.0) && size.iter().all(|s| s.is_finite());
        if !has_size || !(0..2).all(is_alike) {
            return None;
        }
        let none = self.topology.vertices();
        let mut sides = Sides {
            places: vec![None; none],
            held: vec![[false; 2]; none],
        };
        let mut on: Vec<[bool; 4]> = vec![[false; 4]; none];
        for side in 0..4 {
            let mut way = 0.0;
            for i in order(side) {
                let v = self.topology.origin(self.outline[i]) as usize;
                let share = way / lengths[side];
                sides.places[v] = Some(match side {
                    0 => [share * size[0], 0.0],
                    1 => [size[0], share * size[1]],
                    2 => [(1.0 - share) * size[0], size[1]],
                    _ => [0.0, (1.0 - share) * size[1]],
                });
                sides.held[v][1 - side % 2] = true;
                on[v][side] = true;
                way += length(i);
            }
            let corner = self.outline[corners[(side + 1) % 4]];
            let v = self.topology.origin(corner) as usize;
            sides.held[v][1 - side % 2] = true;
            on[v][side] = true;
        }
        let joins_one_side = |h: u32| {
            let [a, b] = [self.topology.origin(h), self.topology.target(h)];
            let both = |side: usize| on[a as usize][side] && on[b as usize][side];
            self.topology.twin(h).is_some() && (0..4).any(both)
        };
        let is_open = !self.topology.edges().any(joins_one_side);
        is_open.then_some(sides)
    }
}

/// The outline as the sides of a rectangle.
struct Sides {
    /// Of every vertex of the outline.
    places: Vec<Option<[f64; 2]>>,
    /// Which coordinates every vertex keeps.
    held: Vec<[bool; 2]>,
}
