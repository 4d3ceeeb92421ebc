//! The shape of charts: straight, upright, and so that they fill the square.
//!
//! Charts come here flat and go on to be packed. Every step is off unless the configuration wants it:
//! charts that are nearly rectangles become such ([`straight`]), all are turned upright ([`upright`]),
//! and those that leave most of the square empty are divided ([`coverage`]).

mod corners;
mod coverage;
mod sheet;
mod straight;
mod strips;
mod upright;

pub use sheet::Surface;

use rayon::prelude::*;

use crate::LayoutConfig;
use crate::component::FlatChart;
use crate::pace::Pace;
use crate::pack::{bounds, square_around};
use coverage::Square;
use straight::straightened;
pub use upright::lying;
use upright::turned_upright;

/// Whether a configuration wants charts of another shape than they have.
pub fn is_shaped(config: &LayoutConfig) -> bool {
    config.straighten || config.upright.is_some() || config.coverage_weight > 0.0
}

/// The charts of all components, and what they are shaped by.
pub struct Shaping<'a> {
    pub config: &'a LayoutConfig,
    /// The surface of every component.
    pub surfaces: &'a [Surface<'a>],
    /// Share of a square that charts cover once they are packed into it.
    pub coverage: &'a (dyn Fn(&[&FlatChart]) -> f64 + Sync),
    /// About that much, in little time.
    pub estimate: &'a (dyn Fn(&[&FlatChart]) -> f64 + Sync),
    pub pace: &'a dyn Pace,
}

impl Shaping<'_> {
    /// The charts of every component as they are to be packed. `squares` has the UV square of each
    /// component.
    pub fn shaped(&self, charts: Vec<Vec<FlatChart>>, squares: &[u32]) -> Vec<Vec<FlatChart>> {
        let config = self.config;
        if !is_shaped(config) {
            return charts;
        }
        let mut charts = self.each(charts, |surface, charts| {
            self.upright(surface, self.straight(surface, charts))
        });
        if config.coverage_weight > 0.0 {
            let count = squares.iter().max().map_or(0, |&last| last + 1);
            for square in 0..count {
                let members: Vec<usize> = (0..charts.len())
                    .filter(|&c| squares[c] == square)
                    .collect();
                self.divide(&mut charts, &members);
            }
        }
        charts
    }

    /// The charts of every component, changed.
    fn each(
        &self,
        charts: Vec<Vec<FlatChart>>,
        change: impl Fn(&Surface, Vec<FlatChart>) -> Vec<FlatChart> + Sync,
    ) -> Vec<Vec<FlatChart>> {
        let all = charts.into_par_iter().zip(self.surfaces);
        all.map(|(own, surface)| change(surface, own)).collect()
    }

    /// The charts of a component with those straightened that can be. Their mean energy does not leave
    /// the bound for it.
    fn straight(&self, surface: &Surface, charts: Vec<FlatChart>) -> Vec<FlatChart> {
        if !self.config.straighten {
            return charts;
        }
        let bound = self.config.distortion_bound;
        let attempts: Vec<Option<FlatChart>> = charts
            .par_iter()
            .map(|chart| match chart.is_straight {
                true => None,
                false => straightened(surface, chart, bound, self.pace),
            })
            .collect();
        let areas = surface.mesh.triangle_areas();
        let area = |chart: &FlatChart| chart.source.iter().map(|&t| areas[t as usize]).sum::<f64>();
        let total: f64 = charts.iter().map(area).sum();
        let energy = |chart: &FlatChart| chart.distortion.energy * (area(chart) / total);
        let mut mean: f64 = charts.iter().map(energy).sum();
        // Those that cost least first.
        let mut gains: Vec<(f64, usize)> = attempts
            .iter()
            .enumerate()
            .filter_map(|(i, attempt)| Some((energy(attempt.as_ref()?) - energy(&charts[i]), i)))
            .collect();
        gains.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut is_taken = vec![false; charts.len()];
        for (rise, i) in gains {
            // Without any area there is no energy to count.
            if rise.is_nan() || mean + rise <= mean.max(bound) {
                is_taken[i] = true;
                mean += if rise.is_nan() { 0.0 } else { rise };
            }
        }
        let chosen = charts.into_iter().zip(attempts).zip(is_taken);
        chosen
            .map(|((before, attempt), is_taken)| attempt.filter(|_| is_taken).unwrap_or(before))
            .collect()
    }

    fn upright(&self, surface: &Surface, charts: Vec<FlatChart>) -> Vec<FlatChart> {
        match self.config.upright {
            Some(up) => charts
                .into_iter()
                .map(|chart| turned_upright(&surface.mesh, up, chart))
                .collect(),
            None => charts,
        }
    }

    /// Divides charts of the components that share a square.
    fn divide(&self, charts: &mut [Vec<FlatChart>], members: &[usize]) {
        let own: Vec<(usize, usize)> = members
            .iter()
            .flat_map(|&c| (0..charts[c].len()).map(move |k| (c, k)))
            .collect();
        let all: Vec<&FlatChart> = own.iter().map(|&(c, k)| &charts[c][k]).collect();
        // How many charts a component may have is shared by those that it has.
        let most = |i: usize| match self.config.max_charts {
            Some(most) => most.saturating_sub(charts[own[i].0].len()) / charts[own[i].0].len() + 1,
            None => usize::MAX,
        };
        let side = |chart: &FlatChart| match self.config.upright.is_some() || chart.is_straight {
            true => box_side(&chart.uvs),
            false => square_around(&chart.uvs),
        };
        let surface = |i: usize| &self.surfaces[own[i].0];
        let square = Square {
            coverage: self.coverage,
            estimate: self.estimate,
            side: &side,
            surface: &surface,
            turned: &|i, piece| {
                let is_straight = all[i].is_straight;
                let piece = FlatChart {
                    is_straight,
                    ..piece
                };
                match self.config.upright {
                    Some(up) => turned_upright(&surface(i).mesh, up, piece),
                    None => piece,
                }
            },
            goes_on: &|| self.pace.goes_on(),
        };
        let mut pieces = coverage::divided(self.config.coverage_weight, &all, most, &square);
        drop(all);
        if pieces.iter().all(Option::is_none) {
            return;
        }
        for &c in members {
            let mut of_own = pieces.drain(..charts[c].len());
            let whole = std::mem::take(&mut charts[c]).into_iter();
            charts[c] = whole
                .flat_map(|chart| of_own.next().flatten().unwrap_or_else(|| vec![chart]))
                .collect();
        }
        self.straighten_pieces(charts, members);
    }

    /// Straightens what only could be once it was divided, unless less of the square is used then.
    fn straighten_pieces(&self, charts: &mut [Vec<FlatChart>], members: &[usize]) {
        if !self.config.straighten {
            return;
        }
        let straight: Vec<Vec<FlatChart>> = members
            .par_iter()
            .map(|&c| {
                let surface = &self.surfaces[c];
                self.upright(surface, self.straight(surface, charts[c].clone()))
            })
            .collect();
        let before: Vec<&FlatChart> = members.iter().flat_map(|&c| &charts[c]).collect();
        let count = |charts: &[&FlatChart]| charts.iter().filter(|c| c.is_straight).count();
        let after: Vec<&FlatChart> = straight.iter().flatten().collect();
        let is_straighter = count(&after) > count(&before);
        if is_straighter && (self.coverage)(&after) >= (self.coverage)(&before) {
            for (&c, straight) in members.iter().zip(straight) {
                charts[c] = straight;
            }
        }
    }
}

/// The longer side of the upright box around points.
fn box_side(points: &[[f64; 2]]) -> f64 {
    let [low, high] = bounds(points);
    (high[0] - low[0]).max(high[1] - low[1])
}
