//! Charts divided where the square is used so much better then that it pays for the seam.
//!
//! Of `n` texels the surface gets `coverage · n`, so a texel covers `1 / √coverage` times the length that
//! it would if the whole square were used. What is made as small as possible is
//!
//! > length of new seams / √area + 2 · weight / √coverage.
//!
//! With a weight of 1, a seam as long as the side of a square of the surface's area is worth it where
//! that factor falls by a half, as from a coverage of 44 % to one of 100 %.
//!
//! A chart that leaves much of the square around it empty is cut across into pieces that lie side by
//! side: a strip into shorter ones, a hook at its corners. Several lengths of pieces are tried, and the
//! packer says what each is worth; so the coverage never becomes worse.

use super::sheet::{Sheet, Surface};
use super::strips::{cut_across, length_between};
use crate::component::FlatChart;
use crate::parallel::largest_first;

/// What 1 / √coverage counts at a weight of 1, in lengths of a seam over the square root of the area.
/// With half of it, a ribbon of 1 : 10,000 fills 59 % of the square, and with it 60 % and more.
const WORTH: f64 = 2.0;

/// The side of the empty part of a chart's square up to which it stays whole, as multiples of the
/// square root of the area of all: the least that is tried, and the factor from each to the next.
const LEAST_ROOM: f64 = 0.4;
const FACTOR: f64 = 1.15;

/// Pieces may be larger than they should by this factor: they are not all equally long.
const TOLERANCE: f64 = 1.2;

/// So many of the divisions that seem best are packed as well as can be.
const FINALISTS: usize = 3;

/// Charts that share a square, and how they are packed.
pub struct Square<'a> {
    /// Share of the square that given charts cover, and about that much in little time.
    pub coverage: &'a (dyn Fn(&[&FlatChart]) -> f64 + Sync),
    pub estimate: &'a (dyn Fn(&[&FlatChart]) -> f64 + Sync),
    /// Side of the smallest square around a chart.
    pub side: &'a (dyn Fn(&FlatChart) -> f64 + Sync),
    /// The surface that a chart is of, by its number.
    pub surface: &'a (dyn Fn(usize) -> &'a Surface<'a> + Sync),
    /// What is done with a piece before it is packed.
    pub turned: &'a (dyn Fn(usize, FlatChart) -> FlatChart + Sync),
    /// Whether to look for something better still.
    pub goes_on: &'a (dyn Fn() -> bool + Sync),
}

/// The pieces of a chart, for a limit.
struct Divided {
    pieces: Vec<FlatChart>,
    /// Length of the edges between them.
    seams: f64,
}

/// For every chart the pieces that it is divided into; none if it stays whole. `most` says how many
/// there may be.
pub fn divided(
    weight: f64,
    charts: &[&FlatChart],
    most: impl Fn(usize) -> usize + Sync,
    square: &Square,
) -> Vec<Option<Vec<FlatChart>>> {
    let weight = WORTH * weight;
    let whole = || charts.iter().map(|_| None).collect();
    let root = charts.iter().map(|chart| area(chart)).sum::<f64>().sqrt();
    let empty: Vec<f64> = charts
        .iter()
        .map(|chart| empty_side((square.side)(chart), area(chart)))
        .collect();
    let emptiest = empty.iter().copied().fold(0.0, f64::max);
    let is_usual = root > 0.0 && root.is_finite() && emptiest.is_finite();
    if !is_usual || emptiest <= LEAST_ROOM * root {
        return whole();
    }
    let mut least = weight / (square.estimate)(charts).sqrt();
    let mut finalists: Vec<Division> = Vec::new();
    let sizes: Vec<usize> = (0..charts.len())
        .map(|i| match empty[i] > LEAST_ROOM * root {
            true => charts[i].triangles.len(),
            false => 0,
        })
        .collect();
    let sheets: Vec<Option<Sheet>> = largest_first(&sizes, |i| {
        let is_divisible = sizes[i] > 1 && most(i) > 1;
        let surface = is_divisible.then(|| (square.surface)(i))?;
        Sheet::of(surface, charts[i])
    });
    let mut limit = LEAST_ROOM * root;
    while limit < emptiest && (square.goes_on)() {
        // No coverage is better than all of the square.
        let affordable = (least - weight) * root;
        let attempt = largest_first(&sizes, |i| {
            let sheet = sheets[i].as_ref().filter(|_| empty[i] > limit)?;
            let found = pieces_of(sheet, limit, affordable, square.side)?;
            (found.pieces.len() <= most(i)).then_some(found)
        });
        limit *= FACTOR;
        let seams: f64 = attempt.iter().flatten().map(|found| found.seams).sum();
        if seams >= affordable || attempt.iter().all(Option::is_none) {
            continue;
        }
        let pieces: Vec<Option<Vec<FlatChart>>> = attempt
            .into_iter()
            .enumerate()
            .map(|(i, found)| {
                let pieces = found?.pieces.into_iter();
                Some(pieces.map(|piece| (square.turned)(i, piece)).collect())
            })
            .collect();
        let division = Division {
            cost: f64::INFINITY,
            seams: seams / root,
            pieces,
        };
        let now = division.charts(charts);
        let longest = now.iter().map(|c| (square.side)(c)).fold(0.0, f64::max) / root;
        // Larger pieces are longer still.
        if weight * longest >= least {
            break;
        }
        if division.seams + weight * longest.max(1.0) >= least {
            continue;
        }
        let cost = division.seams + weight / (square.estimate)(&now).sqrt();
        drop(now);
        least = least.min(cost);
        finalists.push(Division { cost, ..division });
        finalists.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        finalists.truncate(FINALISTS);
    }
    if finalists.is_empty() {
        return whole();
    }
    let before = (square.coverage)(charts);
    let mut best = (weight / before.sqrt(), None);
    for division in finalists {
        let coverage = (square.coverage)(&division.charts(charts));
        let cost = division.seams + weight / coverage.sqrt();
        if cost < best.0 && coverage > before {
            best = (cost, Some(division.pieces));
        }
    }
    best.1.unwrap_or_else(whole)
}

/// Charts divided in one way.
struct Division {
    /// What is to be small, as far as it is known.
    cost: f64,
    /// Length of the seams, over the square root of the area.
    seams: f64,
    /// The pieces of every chart that is divided.
    pieces: Vec<Option<Vec<FlatChart>>>,
}

impl Division {
    /// All pieces, and the charts that stay whole.
    fn charts<'a>(&'a self, charts: &[&'a FlatChart]) -> Vec<&'a FlatChart> {
        let all = self.pieces.iter().zip(charts);
        all.flat_map(|(pieces, whole)| match pieces {
            Some(pieces) => pieces.iter().collect(),
            None => vec![*whole],
        })
        .collect()
    }
}

/// Pieces whose squares have no more empty room than `limit`, unless they cannot be divided
/// further; none if the seams between them are longer than `affordable`.
fn pieces_of(
    sheet: &Sheet,
    limit: f64,
    affordable: f64,
    side: &dyn Fn(&FlatChart) -> f64,
) -> Option<Divided> {
    let patch = &sheet.patch;
    let whole: Vec<u32> = (0..patch.areas.len() as u32).collect();
    let (mut pieces, mut seams) = (Vec::new(), 0.0);
    let mut open = vec![whole];
    while let Some(triangles) = open.pop() {
        let piece = sheet.piece(&triangles);
        let empty = empty_side(side(&piece), area(&piece));
        let is_whole = triangles.len() == patch.areas.len();
        if !is_whole && empty <= TOLERANCE * limit {
            pieces.push(piece);
            continue;
        }
        let count = (empty / limit)
            .ceil()
            .clamp(2.0, triangles.len().max(2) as f64);
        let parts = cut_across(patch, triangles, count as usize);
        if parts.len() < 2 {
            pieces.push(piece);
            continue;
        }
        seams += length_between(patch, &parts) / patch.scale;
        if seams > affordable {
            return None;
        }
        open.extend(parts);
    }
    (pieces.len() > 1).then_some(Divided { pieces, seams })
}

/// The side of a square as large as what a chart of an area leaves empty of the square around it.
fn empty_side(side: f64, area: f64) -> f64 {
    // Not by a difference of squares, which might overflow.
    let share = (area / side / side).min(1.0);
    side * (1.0 - share).sqrt()
}

/// The sum of the areas of a chart's triangles in the plane.
fn area(chart: &FlatChart) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| chart.uvs[v as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    };
    chart.triangles.iter().map(of).sum()
}
