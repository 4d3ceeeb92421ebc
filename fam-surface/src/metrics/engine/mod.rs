//! What an engine would complain about: a UV map, checked for lightmaps or textures.
//!
//! `docs/metrics.md` says which engine needs what.

use std::collections::HashSet;
use std::ops::ControlFlow;

use serde::Serialize;

use crate::{SurfaceError, TriangleMesh, UvMap};

use super::charts::Charts;
use super::edges::sides;
use super::layout::Layout;
use super::overlaps::overlapping_pairs_among;
use super::places::Places;
use super::repeats::first_alike;
use super::stacks::Stacks;

mod clip;
mod density;
mod display;
mod islands;
mod near;
#[cfg(test)]
mod tests;

use islands::{Island, islands};
use near::Gap;

/// How far coordinates may lie beyond a border, and charts be too near, in UV units: what rounding to
/// `f32` does to the coordinates of two charts near 1, with room to spare.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;

/// Pairs of places that are looked at for overlaps; with more of them a map is of no use anyway.
const MOST_OVERLAPS: usize = 1 << 20;

/// What a UV map is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Purpose {
    /// Light is baked into it: every point of the surface needs texels of its own.
    Lightmap,
    /// Textures are drawn with it: charts may share their place on purpose, and lie in UDIM tiles.
    Texture,
}

/// What a UV map is held against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineCheck {
    /// What the map is for.
    pub purpose: Purpose,
    /// Texels along the side of the UV square.
    pub resolution: u32,
    /// Texels that are to lie between two charts.
    pub margin: f64,
    /// Texels that a chart is to be wide on average: its area over the longer side of its bounding
    /// box. A narrower one than 1 may lie between the centres of texels, of which bakers take samples.
    pub least_width: f64,
    /// How many times the texel density where it is high (but for a twentieth of the surface)
    /// may be that where it is low (but for another).
    pub density_spread: f64,
    /// Whether there is a normal map in tangent space.
    pub normal_map: bool,
}

impl EngineCheck {
    /// For lightmaps of 1024 × 1024 texels, with Unity's least margin of two texels.
    pub const LIGHTMAP: Self = Self {
        purpose: Purpose::Lightmap,
        resolution: 1024,
        margin: 2.0,
        least_width: 1.0,
        density_spread: 2.0,
        normal_map: false,
    };

    /// For textures of 2048 × 2048 texels with a normal map, and a margin of four texels, one of which
    /// is left in the second mipmap.
    pub const TEXTURE: Self = Self {
        purpose: Purpose::Texture,
        resolution: 2048,
        margin: 4.0,
        least_width: 1.0,
        density_spread: 2.0,
        normal_map: true,
    };

    /// What keeps a map from being checked against this, if anything: a message that names the field.
    pub fn problem(&self) -> Option<&'static str> {
        let texels = 0.0..=f64::from(self.resolution);
        if !(1..=65_536).contains(&self.resolution) {
            Some("resolution must lie in 1..=65536")
        } else if !texels.contains(&self.margin) {
            Some("margin must lie between 0 and the resolution")
        } else if !texels.contains(&self.least_width) {
            Some("least-width must lie between 0 and the resolution")
        } else if self.density_spread.is_nan() || self.density_spread < 1.0 {
            Some("density-spread must be a number of at least 1")
        } else {
            None
        }
    }

    /// The length of a texel in UV units.
    fn texel(&self) -> f64 {
        1.0 / f64::from(self.resolution.max(1))
    }
}

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The engine would bake or draw something wrong.
    Error,
    /// It may look worse than it could.
    Warning,
    /// Somebody may want to know.
    Note,
}

/// What is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Pairs of triangles that overlap, but not as whole charts that are stacked. Worst is the largest
    /// area that two have in common, in texels.
    Overlapping,
    /// Charts that lie exactly on an earlier one. Worst is how many charts the highest stack has.
    Stacked,
    /// Triangles that repeat an earlier one, in space and in the plane. Worst is always 0.
    Repeated,
    /// Pairs of charts that are nearer to each other than the margin, where stacked ones count as one.
    /// Worst is the least distance, in texels.
    Near,
    /// Charts that reach out of the unit square. Worst is how far, in UV units.
    Outside,
    /// Charts that do not lie in one UDIM tile. Worst is how far one reaches out of its tile, in UV
    /// units.
    AcrossTiles,
    /// Charts that are narrower than a few texels. Worst is the least mean width, in texels.
    Narrow,
    /// Triangles of the surface that have no area in the plane. Worst is the largest share of the
    /// surface that one of them has.
    Collapsed,
    /// Triangles whose texel density is far from the median: more than the root of what the spread may
    /// be. Worst is the spread. It is infinite (`null` in JSON) if a twentieth of the surface has no
    /// texels.
    DensitySpread,
    /// Charts that are mirrored in the plane: most of their triangles are clockwise. Worst is the share
    /// of all charts.
    Mirrored,
}

/// Something that an engine would complain about.
///
/// Its [`Display`](std::fmt::Display) is one line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What it is.
    pub kind: Kind,
    /// How bad it is.
    pub severity: Severity,
    /// How many there are: charts, triangles or pairs of them, as `kind` says.
    pub count: u64,
    /// Whether all were counted. Counting stops where a map has millions of pairs, and the worst
    /// of them may not be among those that were seen.
    pub complete: bool,
    /// The worst value, in the unit that `kind` says.
    pub worst: f64,
    /// What was asked for, in the same unit; 0 where there is nothing to ask for.
    pub limit: f64,
    /// Texels along the side of the square.
    pub resolution: u32,
    /// The triangles of the mesh at the worst place: one, or a pair.
    pub triangles: Vec<u32>,
    /// The charts of `triangles`, counting from 0 in the order of their first triangles.
    pub charts: Vec<u32>,
    /// Where the worst place is in the plane.
    pub at: [f64; 2],
}

/// What an engine would complain about, errors first.
///
/// A map whose UVs are not finite is none: [`UvMap::new`] refuses it.
///
/// # Errors
/// The map has another number of triangles than the mesh, or the mesh has no area.
pub fn findings(
    mesh: &TriangleMesh,
    uv: &UvMap,
    check: &EngineCheck,
) -> Result<Vec<Finding>, SurfaceError> {
    let layout = Layout::new(mesh, uv)?;
    let first_alike = first_alike(mesh, uv);
    let charts = Charts::new(&layout, uv, &sides(mesh, uv), &first_alike);
    let stacks = Stacks::new(&layout, uv, &charts, &first_alike);
    let subject = Subject {
        islands: islands(&layout, &stacks.of_triangle, &first_alike),
        layout,
        uv,
        check,
        stacks,
        first_alike,
    };
    let (overlapping, of_charts) = subject.overlapping();
    let is_lightmap = check.purpose == Purpose::Lightmap;
    let mut found: Vec<Finding> = [
        overlapping,
        subject.stacked(),
        subject.repeated().filter(|_| is_lightmap),
        subject.near(&of_charts),
        match check.purpose {
            Purpose::Lightmap => subject.outside(),
            Purpose::Texture => subject.across_tiles(),
        },
        subject.narrow(),
        subject.collapsed(),
        subject.density_spread(),
        subject
            .mirrored()
            .filter(|_| is_lightmap || check.normal_map),
    ]
    .into_iter()
    .flatten()
    .collect();
    found.sort_by_key(|finding| finding.severity);
    Ok(found)
}

/// A map that is checked.
struct Subject<'a> {
    layout: Layout<'a>,
    uv: &'a UvMap,
    check: &'a EngineCheck,
    stacks: Stacks,
    first_alike: Vec<u32>,
    islands: Vec<Island>,
}

impl Subject<'_> {
    fn finding(&self, kind: Kind, count: u64, worst: f64, triangles: &[u32]) -> Option<Finding> {
        let chart = |&t: &u32| self.stacks.of_triangle[t as usize];
        (count > 0).then(|| Finding {
            kind,
            severity: self.severity(kind),
            count,
            complete: true,
            worst,
            limit: 0.0,
            resolution: self.check.resolution,
            triangles: triangles.to_vec(),
            charts: triangles.iter().map(chart).collect(),
            at: triangles.first().map_or([0.0; 2], |&t| self.center(t)),
        })
    }

    fn severity(&self, kind: Kind) -> Severity {
        match (kind, self.check.purpose) {
            (Kind::Overlapping | Kind::Outside, _) => Severity::Error,
            (Kind::AcrossTiles | Kind::DensitySpread, _) => Severity::Warning,
            (Kind::Mirrored, Purpose::Lightmap) | (Kind::Stacked, Purpose::Texture) => {
                Severity::Note
            }
            (_, Purpose::Lightmap) => Severity::Error,
            (_, Purpose::Texture) => Severity::Warning,
        }
    }

    /// The middle of a triangle in the plane.
    fn center(&self, triangle: u32) -> [f64; 2] {
        let [a, b, c] = self.layout.uv_corners(triangle as usize);
        [0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    }

    /// Overlaps but those of stacked charts, and the pairs of charts that overlap.
    fn overlapping(&self) -> (Option<Finding>, HashSet<[u32; 2]>) {
        let places = Places::new(self.uv, &self.stacks, &self.first_alike);
        let (mut count, mut seen) = (0, 0);
        let mut of_charts = HashSet::new();
        let mut worst: Option<(f64, [u32; 2], [f64; 2])> = None;
        let mut look = |[a, b]: [u32; 2], overlaps: u64| {
            if overlaps > 0 {
                count += overlaps;
                let corners = [a, b].map(|t| self.layout.uv_corners(t as usize));
                let (area, at) = clip::common(corners);
                if worst.is_none_or(|(most, ..)| area > most) {
                    worst = Some((area, [a, b], at));
                }
            }
        };
        // Those of the stacks at one place with those at another, or with each other.
        let mut join = |a: u32, b: u32| {
            for one in places.stacks(a) {
                for other in places.stacks(b) {
                    of_charts.insert(ascending([one, other]));
                    seen += 1;
                    if seen >= MOST_OVERLAPS {
                        return ControlFlow::Break(());
                    }
                }
            }
            ControlFlow::Continue(())
        };
        let mut flow = ControlFlow::Continue(());
        for first in places.firsts() {
            let pairs = places.within(first);
            if pairs.overlapping > pairs.stacked {
                let pair = places.overlaid(first).unwrap_or([first; 2]);
                look(pair, pairs.overlapping - pairs.stacked);
                if flow.is_continue() {
                    flow = join(first, first);
                }
            }
        }
        if flow.is_continue() {
            flow = overlapping_pairs_among(self.uv, places.firsts(), |[a, b]| {
                let pairs = places.between(a, b);
                look([a, b], pairs.overlapping - pairs.stacked);
                join(a, b)
            });
        }
        let Some((area, triangles, at)) = worst else {
            return (None, of_charts);
        };
        let texels = area / self.check.texel().powi(2);
        let finding = self.finding(Kind::Overlapping, count, texels, &triangles);
        let finding = finding.map(|finding| Finding {
            complete: flow.is_continue(),
            at,
            ..finding
        });
        (finding, of_charts)
    }

    fn stacked(&self) -> Option<Finding> {
        let mut heights = vec![0_u32; self.stacks.first.len()];
        for &first in &self.stacks.first {
            heights[first as usize] += 1;
        }
        // The first of the highest.
        let highest = (0..heights.len())
            .rev()
            .max_by_key(|&chart| heights[chart])?;
        let mut members = (0..).zip(&self.stacks.first);
        let is_upon =
            |&(chart, &first): &(usize, &u32)| chart != highest && first as usize == highest;
        let upon = members.find(is_upon).map_or(highest, |(chart, _)| chart);
        let triangles = [highest, upon].map(|chart| self.islands[chart].first);
        let count = self.stacks.stacked() as u64;
        self.finding(
            Kind::Stacked,
            count,
            f64::from(heights[highest]),
            &triangles,
        )
    }

    fn repeated(&self) -> Option<Finding> {
        let is_repeat = |&t: &u32| {
            let t = t as usize;
            self.first_alike[t] as usize != t && self.layout.uv_double_area(t) != 0.0
        };
        let mut repeats = (0..self.layout.len() as u32).filter(is_repeat);
        let first = repeats.next()?;
        let pair = [self.first_alike[first as usize], first];
        self.finding(Kind::Repeated, 1 + repeats.count() as u64, 0.0, &pair)
    }

    /// Charts nearer than the margin, but those that overlap.
    fn near(&self, overlapping: &HashSet<[u32; 2]>) -> Option<Finding> {
        let least = self.check.margin * self.check.texel() - ROUNDING;
        let counts = |t: usize| {
            let chart = self.stacks.of_triangle[t];
            self.stacks.first[chart as usize] == chart && self.first_alike[t] as usize == t
        };
        let near = near::near(
            &near::borders(self.uv, &self.stacks.of_triangle, counts),
            least,
            |charts| !overlapping.contains(&charts),
        );
        let Gap {
            distance,
            triangles,
            at,
        } = near.least?;
        let texels = distance / self.check.texel();
        let finding = self.finding(Kind::Near, near.count, texels, &triangles)?;
        Some(Finding {
            complete: near.complete,
            limit: self.check.margin,
            at,
            ..finding
        })
    }

    /// Charts for which `excess` is above 0, which is in the same unit as `worst` is.
    fn charts_by(
        &self,
        kind: Kind,
        excess: impl Fn(&Island) -> f64,
        at: impl Fn(&Island) -> [f64; 2],
    ) -> Option<(Finding, f64)> {
        let with_area = self.islands.iter().filter(|island| island.area > 0.0);
        let mut found = with_area
            .map(|island| (excess(island), island))
            .filter(|(excess, _)| *excess > 0.0);
        let mut worst = found.next()?;
        let mut count = 1;
        for one in found {
            count += 1;
            if one.0 > worst.0 {
                worst = one;
            }
        }
        let finding = self.finding(kind, count, worst.0, &[worst.1.first])?;
        let at = at(worst.1);
        Some((Finding { at, ..finding }, worst.0))
    }

    fn outside(&self) -> Option<Finding> {
        let square = [[0.0; 2], [1.0; 2]];
        let excess = |island: &Island| beyond(island.excess(square));
        let found = self.charts_by(Kind::Outside, excess, |island| island.farthest(square));
        found.map(|(finding, _)| finding)
    }

    fn across_tiles(&self) -> Option<Finding> {
        let excess = |island: &Island| beyond(island.excess(island.tile()));
        let at = |island: &Island| island.farthest(island.tile());
        let found = self.charts_by(Kind::AcrossTiles, excess, at);
        found.map(|(finding, _)| finding)
    }

    fn narrow(&self) -> Option<Finding> {
        let least = self.check.least_width;
        let missing = |island: &Island| least - island.width() / self.check.texel();
        let (finding, missing) = self.charts_by(Kind::Narrow, missing, Island::middle)?;
        Some(Finding {
            worst: least - missing,
            limit: least,
            ..finding
        })
    }

    fn collapsed(&self) -> Option<Finding> {
        let is_collapsed = |&t: &usize| self.layout.uv_double_area(t) == 0.0;
        let all: f64 = self
            .layout
            .measured()
            .map(|t| self.layout.double_area(t))
            .sum();
        let collapsed: Vec<usize> = self.layout.measured().filter(is_collapsed).collect();
        let by_area = |&a: &usize, &b: &usize| {
            self.layout
                .double_area(a)
                .total_cmp(&self.layout.double_area(b))
        };
        // The first of the largest.
        let largest = collapsed.iter().copied().rev().max_by(by_area)?;
        let share = self.layout.double_area(largest) / all;
        let count = collapsed.len() as u64;
        self.finding(Kind::Collapsed, count, share, &[largest as u32])
    }

    fn density_spread(&self) -> Option<Finding> {
        let limit = self.check.density_spread;
        let spread = density::spread(&self.layout, &self.first_alike, limit)?;
        let finding = self.finding(
            Kind::DensitySpread,
            spread.count,
            spread.ratio,
            &spread.triangles,
        )?;
        Some(Finding { limit, ..finding })
    }

    fn mirrored(&self) -> Option<Finding> {
        let mirrored = |island: &&Island| island.area > 0.0 && island.balance < 0;
        let all = self.islands.iter().filter(|island| island.area > 0.0);
        let count = self.islands.iter().filter(mirrored).count();
        let first = self.islands.iter().find(mirrored)?;
        let share = count as f64 / all.count() as f64;
        self.finding(Kind::Mirrored, count as u64, share, &[first.first])
    }
}

/// A length without what rounding may do.
fn beyond(excess: f64) -> f64 {
    if excess > ROUNDING { excess } else { 0.0 }
}

fn ascending([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
