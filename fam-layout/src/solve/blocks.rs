//! Less distortion of a large chart, block by block.
//!
//! A chart that comes from a coarser one is nearly where it should be: what is left to do is
//! local. So it falls into blocks of a few thousand vertices, and each is relaxed while all others
//! keep their place (a Schwarz method). Time and memory grow with the number of triangles, while
//! one system for all of them would take more and more for each.
//!
//! Blocks that lie apart are relaxed at once. The result does not depend on how many threads there
//! are.

use std::collections::HashMap;

use rayon::prelude::*;

use super::SolveError;
use super::boundary::{Boundary, Bounds};
use super::energy::{Integrals, mean_energy};
use super::newton::{Flattening, Stop};
use super::orientation::first_flipped;
use super::rest::RestShapes;

/// Most vertices of a block. Twice and half as many take about as long.
const MOST_VERTICES: usize = 3_000;

/// Newton steps of a block before its neighbours move again.
const STEPS: usize = 3;

/// Sweeps over all blocks at most.
const MOST_SWEEPS: usize = 4;

/// A sweep that lowers the energy above that of an isometry by a lesser share is the last.
const LEAST_GAIN: f64 = 0.01;

/// How far the vertices of a block may move outside of where it lies, as a share of its size.
const ROOM: f64 = 0.05;

/// A chart that is relaxed.
pub(crate) struct Blockwise<'a> {
    triangles: &'a [[u32; 3]],
    rest: &'a RestShapes,
    boundary: Option<&'a Boundary>,
}

/// Some vertices of a chart that move together.
struct Block {
    vertices: Vec<u32>,
    /// The triangles that have one of them as a corner.
    triangles: Vec<u32>,
    /// Where these lie.
    bounds: Bounds,
}

impl Block {
    /// How far outside of its bounds its vertices may move.
    fn room(&self) -> f64 {
        ROOM * self.bounds.longest_side()
    }
}

impl<'a> Blockwise<'a> {
    /// Of all triangles of a chart. If there is a `boundary`, it stays simple.
    pub(crate) fn new(
        triangles: &'a [[u32; 3]],
        rest: &'a RestShapes,
        boundary: Option<&'a Boundary>,
    ) -> Self {
        Self {
            triangles,
            rest,
            boundary,
        }
    }

    /// Moves the vertices, so that the energy decreases, no triangle turns over and the boundary
    /// stays simple. The map is scaled to its best size first. Returns how many Newton steps over
    /// all triangles that took.
    ///
    /// # Errors
    /// At the start a triangle is not counter-clockwise or the boundary not simple.
    pub(crate) fn minimize(&self, uv: &mut [[f64; 2]], stop: &Stop) -> Result<usize, SolveError> {
        if let Some(triangle) = first_flipped(self.triangles, uv) {
            return Err(SolveError::Flipped { triangle });
        }
        let is_simple = |uv: &[[f64; 2]]| self.boundary.is_none_or(|b| b.is_simple(uv));
        if !is_simple(uv) {
            return Err(SolveError::NotSimple);
        }
        let valid = uv.to_vec();
        let scale = Integrals::of(self.triangles, self.rest, uv).best_scale();
        for q in uv.iter_mut() {
            *q = q.map(|c| scale * c);
        }
        let mut energy = mean_energy(self.triangles, self.rest, uv);
        let mut steps = 0;
        for sweep in 0..MOST_SWEEPS.min(stop.iterations.div_ceil(STEPS)) {
            if steps >= stop.least && !stop.pace.goes_on() {
                break;
            }
            self.sweep(uv, sweep, stop);
            steps += STEPS;
            let before = energy;
            energy = mean_energy(self.triangles, self.rest, uv);
            let least = (LEAST_GAIN * (before - 4.0)).max(stop.relative_decrease * before);
            if before - energy <= least {
                break;
            }
        }
        // Every block is checked by itself; this is for what rounding may do to all together.
        if first_flipped(self.triangles, uv).is_some() || !is_simple(uv) {
            uv.copy_from_slice(&valid);
        }
        Ok(steps)
    }

    /// Relaxes every block once.
    fn sweep(&self, uv: &mut [[f64; 2]], number: usize, stop: &Stop) {
        let blocks = self.blocks(uv, number);
        for of_color in colored(&blocks) {
            let seen: &[[f64; 2]] = uv;
            let moved: Vec<Vec<[f64; 2]>> = of_color
                .par_iter()
                .map(|&b| self.relaxed(&blocks[b as usize], seen, stop))
                .collect();
            for (&b, places) in of_color.iter().zip(moved) {
                for (&v, place) in blocks[b as usize].vertices.iter().zip(places) {
                    uv[v as usize] = place;
                }
            }
        }
    }

    /// The vertices in blocks by where they lie: halves of halves. Every other sweep has other
    /// borders between them.
    fn blocks(&self, uv: &[[f64; 2]], sweep: usize) -> Vec<Block> {
        let mut used = vec![false; uv.len()];
        for &v in self.triangles.iter().flatten() {
            used[v as usize] = true;
        }
        let mut vertices: Vec<u32> = (0..uv.len() as u32).filter(|&v| used[v as usize]).collect();
        let mut members: Vec<Vec<u32>> = Vec::new();
        let first = if sweep.is_multiple_of(2) { 0.5 } else { 0.3 };
        divide(&mut vertices, uv, first, &mut members);
        let mut block_of = vec![0; uv.len()];
        for (b, members) in (0..).zip(&members) {
            for &v in members {
                block_of[v as usize] = b;
            }
        }
        let mut triangles: Vec<Vec<u32>> = vec![Vec::new(); members.len()];
        for (t, corners) in (0..).zip(self.triangles) {
            let [a, b, c] = corners.map(|v| block_of[v as usize]);
            triangles[a as usize].push(t);
            if b != a {
                triangles[b as usize].push(t);
            }
            if c != a && c != b {
                triangles[c as usize].push(t);
            }
        }
        let blocks = members.into_iter().zip(triangles);
        let of_block = |(vertices, triangles): (Vec<u32>, Vec<u32>)| {
            let corners = triangles.iter().flat_map(|&t| self.triangles[t as usize]);
            let bounds = Bounds::around(corners.map(|v| uv[v as usize]))?;
            Some(Block {
                vertices,
                triangles,
                bounds,
            })
        };
        blocks.filter_map(of_block).collect()
    }

    /// Where the vertices of a block lie best while all others keep their place.
    fn relaxed(&self, block: &Block, uv: &[[f64; 2]], stop: &Stop) -> Vec<[f64; 2]> {
        let before = || block.vertices.iter().map(|&v| uv[v as usize]).collect();
        let mut local: HashMap<u32, u32> =
            (0..).zip(&block.vertices).map(|(i, &v)| (v, i)).collect();
        let mut all: Vec<u32> = block.vertices.clone();
        let mut number = |v: u32| {
            *local.entry(v).or_insert_with(|| {
                all.push(v);
                all.len() as u32 - 1
            })
        };
        let corners = block.triangles.iter().map(|&t| self.triangles[t as usize]);
        let triangles: Vec<[u32; 3]> = corners.map(|t| t.map(&mut number)).collect();
        let room = block.room();
        let boundary = self
            .boundary
            .map(|boundary| boundary.within(uv, block.bounds.widened(2.0 * room), &mut number));
        let is_fixed: Vec<bool> = (0..all.len()).map(|i| i >= block.vertices.len()).collect();
        let mut places: Vec<[f64; 2]> = all.iter().map(|&v| uv[v as usize]).collect();
        let rest = self.rest.subset(&block.triangles);
        let few = Stop {
            iterations: STEPS,
            least: stop.least,
            ..stop.clone()
        };
        // What was reached stays valid when a step fails.
        if let Ok(mut flattening) = Flattening::new(&triangles, rest, &is_fixed) {
            let _ = flattening.minimize(&mut places, boundary.as_ref(), &few);
        }
        places.truncate(block.vertices.len());
        let allowed = block.bounds.widened(room);
        match places.iter().all(|&q| allowed.contains(q)) {
            true => places,
            false => before(),
        }
    }
}

/// Divides vertices at medians of their places, along the longer side of where they lie, until
/// there are few enough in each part; the first time at the given share of them.
fn divide(vertices: &mut [u32], uv: &[[f64; 2]], share: f64, parts: &mut Vec<Vec<u32>>) {
    if vertices.len() <= MOST_VERTICES {
        parts.push(vertices.to_vec());
        return;
    }
    let bounds = Bounds::around(vertices.iter().map(|&v| uv[v as usize]));
    let axis = bounds.map_or(0, |bounds| bounds.longer_axis());
    let middle = (share * vertices.len() as f64) as usize;
    vertices.select_nth_unstable_by(middle, |&a, &b| {
        let [p, q] = [a, b].map(|v| uv[v as usize][axis]);
        p.total_cmp(&q).then(a.cmp(&b))
    });
    let (one, other) = vertices.split_at_mut(middle);
    divide(one, uv, 0.5, parts);
    divide(other, uv, 0.5, parts);
}

/// The blocks by colours: those of one colour do not come near each other, wherever their vertices
/// may move.
fn colored(blocks: &[Block]) -> Vec<Vec<u32>> {
    let reach = |block: &Block| block.bounds.widened(2.0 * block.room());
    let mut colors: Vec<Vec<u32>> = Vec::new();
    for (b, block) in (0..).zip(blocks) {
        let own = reach(block);
        let is_free = |members: &Vec<u32>| {
            let mut others = members.iter().map(|&o| &blocks[o as usize]);
            others.all(|other| !reach(other).meets(&own))
        };
        let free = colors.iter().position(is_free).unwrap_or(colors.len());
        if free == colors.len() {
            colors.push(Vec::new());
        }
        colors[free].push(b);
    }
    colors
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::pace::Pace;
    use crate::patch::topology::{Opened, Topology};
    use fam_surface::shapes;

    const GOES_ON: &dyn Pace = &|| true;

    fn stop(pace: &dyn Pace) -> Stop<'_> {
        Stop {
            iterations: 12,
            relative_decrease: 1e-9,
            least: 0,
            pace,
        }
    }

    /// A sheet of several blocks, with the places of its vertices up to a fifth of an edge away
    /// from where they belong.
    fn shaken() -> (Topology, RestShapes, Boundary, Vec<[f64; 2]>) {
        let sheet = shapes::rectangle(1.5, 1.0, 120, 80);
        let corners: Vec<_> = (0..sheet.triangles().len())
            .map(|t| sheet.corners(t))
            .collect();
        let Opened { topology, source } = Topology::oriented(&sheet);
        let boundary = Boundary::new(&topology, |_| 1.0 / 80.0);
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut moved = |x: f64| x + random.random_range(-0.2..0.2) / 80.0;
        let uv = source.iter().map(|&v| {
            let [x, y, _] = sheet.positions()[v as usize];
            [moved(x), moved(y)]
        });
        let uv = uv.collect();
        (topology, RestShapes::new(&corners, None), boundary, uv)
    }

    #[test]
    fn what_is_nearly_in_place_comes_to_lie_there() {
        let (topology, rest, boundary, mut uv) = shaken();
        let triangles = topology.triangles();
        let before = mean_energy(triangles, &rest, &uv) - 4.0;
        let blocks = Blockwise::new(triangles, &rest, Some(&boundary));
        assert!(blocks.blocks(&uv, 0).len() > 2);
        blocks.minimize(&mut uv, &stop(GOES_ON)).unwrap();
        let after = mean_energy(triangles, &rest, &uv) - 4.0;
        assert!(after < 0.01 * before, "{after} {before}");
        assert!(first_flipped(triangles, &uv).is_none() && boundary.is_simple(&uv));
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let of_threads = |threads: usize| {
            let (topology, rest, boundary, mut uv) = shaken();
            let blocks = Blockwise::new(topology.triangles(), &rest, Some(&boundary));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let solve = || blocks.minimize(&mut uv, &stop(GOES_ON));
            pool.unwrap().install(solve).unwrap();
            uv
        };
        let one = of_threads(1);
        assert!([2, 8].into_iter().all(|threads| of_threads(threads) == one));
    }

    #[test]
    fn every_vertex_is_in_one_block_and_blocks_of_one_colour_lie_apart() {
        let (topology, rest, _, uv) = shaken();
        let blocks = Blockwise::new(topology.triangles(), &rest, None);
        for sweep in 0..2 {
            let blocks = blocks.blocks(&uv, sweep);
            let mut all: Vec<u32> = blocks.iter().flat_map(|b| b.vertices.clone()).collect();
            all.sort_unstable();
            assert_eq!(all, (0..uv.len() as u32).collect::<Vec<u32>>());
            let colors = colored(&blocks);
            assert_eq!(colors.iter().map(Vec::len).sum::<usize>(), blocks.len());
            for color in colors {
                let corners = color.iter().flat_map(|&b| &blocks[b as usize].triangles);
                let mut corners: Vec<u32> = corners.copied().collect();
                let count = corners.len();
                corners.sort_unstable();
                corners.dedup();
                assert_eq!(corners.len(), count, "no triangle is in two of them");
            }
        }
    }

    #[test]
    fn nothing_moves_once_it_is_to_stop_and_invalid_starts_are_errors() {
        let (topology, rest, boundary, mut uv) = shaken();
        let blocks = Blockwise::new(topology.triangles(), &rest, Some(&boundary));
        let stopped = blocks.minimize(&mut uv, &stop(&|| false));
        assert_eq!(stopped, Ok(0));
        let centre = 60 + 40 * 121;
        uv[centre] = uv[centre + 2];
        let flipped = blocks.minimize(&mut uv, &stop(GOES_ON));
        assert!(matches!(flipped, Err(SolveError::Flipped { .. })));
    }

    /// A ring of more than a full turn, which starts with less than one: to have its shape, it would
    /// have to overlap itself.
    #[test]
    fn the_boundary_stays_simple_where_ends_press_against_each_other() {
        let sheet = shapes::rectangle(1.0, 1.0, 240, 40);
        let bent = |p: [f64; 3], turns: f64| {
            let (sin, cos) = (turns * std::f64::consts::TAU * (1.0 - p[0])).sin_cos();
            [(1.0 + p[1]) * cos, (1.0 + p[1]) * sin]
        };
        let low = sheet.positions().iter().fold([f64::INFINITY; 3], |low, p| {
            [0, 1, 2].map(|axis| low[axis].min(p[axis]))
        });
        let at = |v: u32| {
            let p = sheet.positions()[v as usize];
            [0, 1, 2].map(|axis| p[axis] - low[axis])
        };
        let corners = sheet.triangles().iter().map(|t| {
            t.map(|v| {
                let [x, y] = bent(at(v), 1.1);
                [x, y, 0.0]
            })
        });
        let rest = RestShapes::new(&corners.collect::<Vec<_>>(), Some(1.0));
        let Opened { topology, source } = Topology::oriented(&sheet);
        let mut uv: Vec<[f64; 2]> = source.iter().map(|&v| bent(at(v), 0.99)).collect();
        let boundary = Boundary::new(&topology, |_| 0.025);
        assert!(boundary.is_simple(&uv));
        let triangles = topology.triangles();
        let mut free = uv.clone();
        let blocks = Blockwise::new(triangles, &rest, None);
        blocks.minimize(&mut free, &stop(GOES_ON)).unwrap();
        assert!(!boundary.is_simple(&free), "without a boundary it overlaps");
        let before = mean_energy(triangles, &rest, &uv);
        let blocks = Blockwise::new(triangles, &rest, Some(&boundary));
        blocks.minimize(&mut uv, &stop(GOES_ON)).unwrap();
        assert!(boundary.is_simple(&uv));
        assert!(mean_energy(triangles, &rest, &uv) < before);
    }
}
