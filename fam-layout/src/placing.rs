//! Flat charts of all components, side by side in their UV squares.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::component::FlatChart;
use crate::pack::options::{Fixed, MOST_TILES, PackError, PackOptions, Size, Turns};
use crate::pack::{Chart, Reflection, bounds, corner_of_tile, pack, to_f32};
use crate::shape::lying;
use crate::symmetry::Mirror;
use crate::{Beside, LayoutConfig, Stack};
use fam_surface::charts::charts;

/// Steps towards the largest scale that tell about how much of the square charts cover.
const ESTIMATE: usize = 3;

/// Charts, packed.
pub struct Placed {
    /// The UVs of every chart of every component.
    pub uvs: Vec<Vec<Vec<[f32; 2]>>>,
    /// What was made of every UV square.
    pub squares: Vec<Square>,
}

/// A UV square, packed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// Share of it that its charts cover; of all its tiles if it has several.
    pub coverage: f64,
    /// Least number of texels between charts: less than the margin that was asked for where so many
    /// charts have no room for it.
    pub margin: f64,
    /// How many UDIM tiles it has. That of number `t` has its lower left corner at
    /// (`t % 10`, `t / 10`).
    pub tiles: u32,
    /// Texels along the side of a tile.
    pub resolution: u32,
}

/// Where the charts of a component belong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belonging {
    /// Its UV square.
    pub square: u32,
    /// How many times as large as others its charts are to be.
    pub weight: f64,
}

/// The charts of every component, packed. `mirrors` tells which are mirror images, `belonging` has an entry
/// for each component, and `unit` is the length of the charts' unit in input units. Once `goes_on` says no,
/// the first scale found at which all charts fit is taken.
///
/// # Errors
/// What is asked for is impossible.
pub fn placed(
    config: &LayoutConfig,
    unit: f64,
    charts: &[Vec<FlatChart>],
    mirrors: &[Vec<Mirror>],
    belonging: &[Belonging],
    beside: Option<Beside>,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Result<Placed, PackError> {
    let enlarged: Vec<Vec<Vec<[f64; 2]>>> = charts
        .iter()
        .zip(belonging)
        .map(|(charts, own)| charts.iter().map(|c| times(&c.uvs, own.weight)).collect())
        .collect();
    let unplaced = |chart: &FlatChart| vec![[0.0_f32; 2]; chart.uvs.len()];
    let mut uvs: Vec<Vec<Vec<[f32; 2]>>> = charts
        .iter()
        .map(|charts| charts.iter().map(unplaced).collect())
        .collect();
    let last = belonging.iter().map(|own| own.square).max();
    let count = last.map_or(1, |last| last as usize + 1);
    let shared = shared(config, mirrors, belonging);
    let mirrored = mirrored(mirrors);
    let mut members: Vec<Vec<([usize; 2], Chart)>> = vec![Vec::new(); count];
    for (c, charts) in charts.iter().enumerate() {
        for (k, chart) in charts.iter().enumerate() {
            if shared.contains_key(&[c, k]) {
                continue;
            }
            if let Some(own) = to_pack(config, chart, &enlarged[c][k]) {
                let own = match mirrored.contains(&[c, k]) {
                    true => own.with_turns(Turns::None),
                    false => own,
                };
                members[belonging[c].square as usize].push(([c, k], own));
            }
        }
    }
    let plan = Plan::new(config, unit, count as u32, beside.as_ref())?;
    let mut squares = Vec::new();
    for (s, members) in (0..).zip(&members) {
        let own: Vec<Chart> = members.iter().map(|(_, chart)| *chart).collect();
        let there = beside.map_or_else(Vec::new, |beside| plan.existing(&beside, s));
        let fixed: Vec<Fixed> = there.iter().filter_map(Existing::fixed).collect();
        let options = PackOptions {
            margin: config.margin,
            resolution: config.resolution,
            size: plan.size,
            whole_texels: config.whole_texels,
            first_tile: plan.first_tile(s),
            fixed: &fixed,
        };
        let packing = pack(&own, &options, goes_on)?;
        if packing.tiles > plan.tiles {
            return Err(PackError::MoreTiles {
                needed: packing.tiles,
                tiles: plan.tiles,
            });
        }
        let rounded = to_f32(&own, &packing, &reflections(members, mirrors))?;
        for (([c, k], _), placed) in members.iter().zip(rounded.uvs) {
            uvs[*c][*k] = placed;
        }
        squares.push(Square {
            coverage: packing.coverage,
            margin: packing.margin,
            tiles: packing.tiles,
            resolution: packing.resolution,
        });
    }
    for ([c, k], [of, chart]) in shared {
        uvs[c][k] = uvs[of][chart].clone();
    }
    Ok(Placed { uvs, squares })
}

/// The charts that lie on the place of the chart that they are mirror images of, and that chart.
fn shared(
    config: &LayoutConfig,
    mirrors: &[Vec<Mirror>],
    belonging: &[Belonging],
) -> HashMap<[usize; 2], [usize; 2]> {
    if config.stack != Stack::Mirrored {
        return HashMap::new();
    }
    let all = numbered(mirrors);
    all.filter_map(|(at, mirror)| match *mirror {
        Mirror::Of { component, chart } if belonging[at[0]] == belonging[component] => {
            Some((at, [component, chart]))
        }
        _ => None,
    })
    .collect()
}

/// All charts' mirrors, with the numbers of their components and their own.
fn numbered(mirrors: &[Vec<Mirror>]) -> impl Iterator<Item = ([usize; 2], &Mirror)> {
    mirrors.iter().enumerate().flat_map(|(c, own)| {
        let own = own.iter().enumerate();
        own.map(move |(k, mirror)| ([c, k], mirror))
    })
}

/// The charts that are symmetric, or mirror images of others, or have such: by component and number.
fn mirrored(mirrors: &[Vec<Mirror>]) -> HashSet<[usize; 2]> {
    let of = |(at, mirror): ([usize; 2], &Mirror)| match *mirror {
        Mirror::None => Vec::new(),
        Mirror::Own(_) | Mirror::Nearly => vec![at],
        Mirror::Of { component, chart } => vec![at, [component, chart]],
    };
    numbered(mirrors).flat_map(of).collect()
}

/// Which of the charts of a square are mirror images of others of them.
fn reflections<'a>(
    members: &[([usize; 2], Chart)],
    mirrors: &'a [Vec<Mirror>],
) -> Vec<Reflection<'a>> {
    let numbered = members.iter().enumerate();
    let numbers: HashMap<[usize; 2], usize> = numbered.map(|(n, (at, _))| (*at, n)).collect();
    members
        .iter()
        .map(|&([c, k], _)| match mirrors[c].get(k) {
            None | Some(Mirror::None | Mirror::Nearly) => Reflection::None,
            Some(Mirror::Own(images)) => Reflection::Own(images),
            Some(Mirror::Of { component, chart }) => numbers
                .get(&[*component, *chart])
                .map_or(Reflection::None, |&n| Reflection::Of(n)),
        })
        .collect()
}

/// Share of the square that charts cover if they are packed into one, as well as time allows.
pub fn coverage(
    config: &LayoutConfig,
    charts: &[&FlatChart],
    goes_on: &(dyn Fn() -> bool + Sync),
) -> f64 {
    let own: Vec<Chart> = charts
        .iter()
        .filter_map(|chart| to_pack(config, chart, &chart.uvs))
        .collect();
    let options = PackOptions::new(config.margin, config.resolution);
    let packing = pack(&own, &options, goes_on);
    packing.map_or(0.0, |packing| packing.coverage)
}

/// About that share, in little time: charts are turned by right angles only.
pub fn estimate(
    config: &LayoutConfig,
    charts: &[&FlatChart],
    goes_on: &(dyn Fn() -> bool + Sync),
) -> f64 {
    let lying: Vec<FlatChart> = match config.upright {
        Some(_) => charts.iter().map(|&chart| chart.clone()).collect(),
        None => charts.iter().map(|chart| lying(chart)).collect(),
    };
    let steps = AtomicUsize::new(0);
    let is_early = || steps.fetch_add(1, Ordering::Relaxed) < ESTIMATE;
    let lying: Vec<&FlatChart> = lying.iter().collect();
    coverage(config, &lying, &|| is_early() && goes_on())
}

/// A chart as it is packed, at coordinates `uvs`; none if these are no numbers.
fn to_pack<'a>(
    config: &LayoutConfig,
    chart: &'a FlatChart,
    uvs: &'a [[f64; 2]],
) -> Option<Chart<'a>> {
    let turns = match (config.upright.is_some(), chart.is_straight) {
        (true, _) => Turns::None,
        (false, true) => Turns::Quarters,
        (false, false) => Turns::Free,
    };
    let own = Chart::new(uvs, &chart.triangles).ok()?;
    Some(own.with_turns(turns))
}

/// What all squares have in common.
struct Plan {
    /// Tiles of each square.
    tiles: u32,
    /// Whether every square is a tile, the first one the first.
    squares_are_tiles: bool,
    size: Size,
}

impl Plan {
    fn new(
        config: &LayoutConfig,
        unit: f64,
        squares: u32,
        beside: Option<&Beside>,
    ) -> Result<Self, PackError> {
        let squares_are_tiles = squares > 1 && config.tiles > 1;
        if squares_are_tiles && squares > config.tiles {
            return Err(PackError::MoreTiles {
                needed: squares,
                tiles: config.tiles,
            });
        }
        let tiles = if squares > 1 { 1 } else { config.tiles };
        let has_side = config.tiles > 1 || beside.is_some();
        Ok(Self {
            tiles,
            squares_are_tiles,
            size: match config.texel_density.map(|density| density * unit) {
                Some(density) if has_side => Size::Tiles { density },
                Some(density) => Size::Side { density },
                None => Size::Largest {
                    tiles,
                    at_most: beside.map_or(f64::INFINITY, |beside| beside.scale * unit),
                },
            },
        })
    }

    /// The tile in which a square begins.
    fn first_tile(&self, square: u32) -> u32 {
        if self.squares_are_tiles { square } else { 0 }
    }

    /// The charts of a square that are there already, by the tiles that they reach into.
    fn existing(&self, beside: &Beside, square: u32) -> Vec<Existing> {
        let first = self.first_tile(square);
        let mut found: Vec<Existing> = Vec::new();
        for own in parts_of(beside, square) {
            for tile in own.tiles() {
                if let Some(tile) = tile.checked_sub(first).filter(|tile| *tile < self.tiles) {
                    found.push(own.in_tile(tile, corner_of_tile(tile + first)));
                }
            }
        }
        found
    }
}

/// A chart that is there already.
#[derive(Debug, Clone, Default)]
struct Existing {
    uvs: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    tile: u32,
}

impl Existing {
    /// The numbers of the UDIM tiles that its bounding box touches.
    fn tiles(&self) -> Vec<u32> {
        let [low, high] = bounds(&self.uvs);
        // Casting saturates.
        let range = |axis: usize, most: u32| {
            low[axis].floor().max(0.0) as u32..(high[axis].ceil().max(0.0) as u32).min(most)
        };
        let rows = MOST_TILES / ROW;
        range(1, rows)
            .flat_map(|row| range(0, ROW).map(move |column| ROW * row + column))
            .collect()
    }

    /// The same chart in the unit square of a tile.
    fn in_tile(&self, tile: u32, corner: [f64; 2]) -> Self {
        let place = |q: &[f64; 2]| [q[0] - corner[0], q[1] - corner[1]];
        Self {
            uvs: self.uvs.iter().map(place).collect(),
            triangles: self.triangles.clone(),
            tile,
        }
    }

    fn fixed(&self) -> Option<Fixed<'_>> {
        let chart = Chart::new(&self.uvs, &self.triangles).ok()?;
        let tile = self.tile;
        Some(Fixed { chart, tile })
    }
}

/// UDIM tiles in a row.
const ROW: u32 = 10;

/// The charts of a square that are there already, where they are.
fn parts_of(beside: &Beside, square: u32) -> Vec<Existing> {
    let chart_of = charts(beside.uvs);
    let mut parts: Vec<Existing> = Vec::new();
    for (t, corners) in beside.uvs.triangles().iter().enumerate() {
        if beside.squares.get(t).copied().unwrap_or(0) != square {
            continue;
        }
        let chart = chart_of[t] as usize;
        parts.resize(parts.len().max(chart + 1), Existing::default());
        let part = &mut parts[chart];
        let first = part.uvs.len() as u32;
        part.triangles.push([first, first + 1, first + 2]);
        let place = |&v: &u32| beside.uvs.uvs()[v as usize].map(f64::from);
        part.uvs.extend(corners.iter().map(place));
    }
    parts.retain(|part| !part.triangles.is_empty());
    parts
}

fn times(uvs: &[[f64; 2]], factor: f64) -> Vec<[f64; 2]> {
    uvs.iter().map(|q| q.map(|c| c * factor)).collect()
}
