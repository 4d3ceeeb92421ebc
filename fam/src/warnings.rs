//! Where a layout falls short of what was asked for.

use std::fmt;

use fam_layout::{ComponentLayout, Distortion, LayoutConfig, Measure, MeshLayout};
use fam_surface::metrics::Metrics;

use crate::layout::{LaidOut, MarksReport};

/// Something that the user has to know about a layout.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// It was stopped before it was done.
    Stopped,
    /// Edges that were not to be cut are cut: so many of all of them.
    ForbiddenCut {
        /// That are cut.
        cut: usize,
        /// That were not to be.
        all: usize,
    },
    /// A measure of distortion is above what the bound allows.
    TooDistorted {
        /// Which.
        measure: Measure,
        /// What the bound allows.
        limit: f64,
        /// The highest value of a component.
        worst: f64,
        /// Components above the limit.
        some: usize,
        /// All components.
        all: usize,
    },
    /// More charts than [`LayoutConfig::max_charts`].
    TooManyCharts {
        /// The limit for a component.
        limit: usize,
        /// The most charts of a component.
        most: usize,
        /// Components above the limit.
        some: usize,
        /// All components.
        all: usize,
    },
    /// Charts lie closer together than [`LayoutConfig::margin`], in texels.
    NarrowMargin {
        /// The least margin.
        least: f64,
        /// What was asked for.
        asked: f64,
    },
    /// So many points of a cloud have no place in the surface through it.
    Unreached(usize),
    /// So many triangles have no area in the plane.
    Collapsed(usize),
    /// So many triangles are mirrored.
    Flipped(usize),
    /// So many pairs of triangles overlap.
    Overlapping(u64),
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Stopped => write!(f, "finishing was stopped early"),
            Self::ForbiddenCut { cut, all } => {
                write!(f, "forbidden edges that are cut: {cut} of {all}")
            }
            Self::TooDistorted {
                measure,
                limit,
                worst,
                some,
                all,
            } => {
                let at_worst = if all > 1 { " at worst" } else { "" };
                let of = of_components(some, all);
                write!(
                    f,
                    "the {measure}{of} is above the {limit:.4} that the distortion bound allows: \
                     {worst:.4}{at_worst}"
                )
            }
            Self::TooManyCharts {
                limit,
                most,
                some,
                all,
            } => {
                let at_most = if all > 1 { " at most" } else { "" };
                let of = of_components(some, all);
                write!(
                    f,
                    "the number of charts{of} is above max-charts = {limit}, since no valid layout \
                     was found with fewer: {most}{at_most}"
                )
            }
            Self::NarrowMargin { least, asked } => write!(
                f,
                "the margin is {least:.2} texels instead of {asked}: so many charts leave no room \
                 for more"
            ),
            Self::Unreached(points) => write!(
                f,
                "{points} points have no place in the surface and keep the raw map's UVs"
            ),
            Self::Collapsed(count) => write!(f, "{count} triangles without area in the plane"),
            Self::Flipped(count) => write!(f, "{count} flipped triangles"),
            Self::Overlapping(count) => write!(f, "{count} overlapping pairs of triangles"),
        }
    }
}

/// What the user has to know about a layout whose UVs have these metrics.
pub fn warnings(laid_out: &LaidOut, metrics: Option<&Metrics>) -> Vec<Warning> {
    let LaidOut { config, layout, .. } = laid_out;
    let mut warnings = Vec::new();
    if laid_out.stopped {
        warnings.push(Warning::Stopped);
    }
    warnings.extend(laid_out.marks.as_ref().and_then(forbidden_cut));
    warnings.extend(too_distorted(layout, config));
    // Wanted seams make as many charts as they do.
    if laid_out.marks.is_none_or(|marks| marks.wanted == 0) {
        warnings.extend(too_many_charts(layout, config));
    }
    warnings.extend(too_narrow(layout, config));
    let unreached = laid_out.unreached.filter(|points| *points > 0);
    warnings.extend(unreached.map(Warning::Unreached));
    warnings.extend(metrics.into_iter().flat_map(invalid));
    warnings
}

fn forbidden_cut(marks: &MarksReport) -> Option<Warning> {
    let (cut, all) = (marks.forbidden_cut, marks.forbidden);
    (cut > 0).then_some(Warning::ForbiddenCut { cut, all })
}

/// The measures that are above what the distortion bound allows.
fn too_distorted(layout: &MeshLayout, config: &LayoutConfig) -> Vec<Warning> {
    let limits = Distortion::allowed(config.distortion_bound);
    // Specks without area have no distortion to speak of.
    let with_area = |one: &&ComponentLayout| one.root_area > 0.0;
    let components: Vec<&ComponentLayout> = layout.components.iter().filter(with_area).collect();
    let too_high = |measure: Measure| {
        let limit = limits.of(measure);
        let values = components.iter().map(|one| one.distortion.of(measure));
        let above: Vec<f64> = values.filter(|value| *value > limit).collect();
        Some(Warning::TooDistorted {
            measure,
            limit,
            worst: above.iter().copied().reduce(f64::max)?,
            some: above.len(),
            all: components.len(),
        })
    };
    Measure::ALL.into_iter().filter_map(too_high).collect()
}

/// That more charts were needed than were asked for.
fn too_many_charts(layout: &MeshLayout, config: &LayoutConfig) -> Option<Warning> {
    let limit = config.max_charts?;
    let charts = layout.components.iter().map(|one| one.charts);
    let above: Vec<usize> = charts.filter(|&count| count > limit).collect();
    Some(Warning::TooManyCharts {
        limit,
        most: *above.iter().max()?,
        some: above.len(),
        all: layout.components.len(),
    })
}

/// That charts lie closer together than was asked for.
fn too_narrow(layout: &MeshLayout, config: &LayoutConfig) -> Option<Warning> {
    let least = layout.squares.iter().map(|s| s.margin).reduce(f64::min)?;
    let asked = config.margin;
    (least < asked).then_some(Warning::NarrowMargin { least, asked })
}

/// What is wrong with UVs.
fn invalid(metrics: &Metrics) -> Vec<Warning> {
    let all = [
        Warning::Collapsed(metrics.collapsed_triangles),
        Warning::Flipped(metrics.flipped_triangles),
        Warning::Overlapping(metrics.unintended_overlaps()),
    ];
    let none = [
        Warning::Collapsed(0),
        Warning::Flipped(0),
        Warning::Overlapping(0),
    ];
    all.into_iter()
        .filter(|found| !none.contains(found))
        .collect()
}

/// How many of the components, if there are several.
fn of_components(some: usize, all: usize) -> String {
    match all {
        1 => String::new(),
        _ => format!(" of {some} of {all} components"),
    }
}

#[cfg(test)]
mod tests {
    use fam_layout::Square;
    use fam_surface::UvMap;

    use super::*;

    fn component(distortion: Distortion, charts: usize) -> ComponentLayout {
        ComponentLayout {
            uvs: UvMap::new(vec![[0.0; 2]], vec![[0; 3]]).unwrap(),
            charts,
            distortion,
            root_area: 1.0,
            seam_length: 0.0,
            stacked: None,
        }
    }

    fn warned(components: Vec<ComponentLayout>, margin: f64, unreached: usize) -> Vec<String> {
        let laid_out = LaidOut {
            config: LayoutConfig {
                max_charts: Some(10),
                ..LayoutConfig::default()
            },
            stopped: false,
            marks: None,
            layout: MeshLayout {
                squares: vec![Square {
                    coverage: 0.5,
                    margin,
                    tiles: 1,
                    resolution: 2048,
                }],
                components,
            },
            unreached: Some(unreached),
        };
        let found = warnings(&laid_out, None);
        found.iter().map(Warning::to_string).collect()
    }

    #[test]
    fn a_good_layout_has_no_warnings() {
        let at_the_limits = component(Distortion::allowed(4.1), 10);
        assert_eq!(warned(vec![at_the_limits], 4.0, 0), [""; 0]);
    }

    #[test]
    fn every_limit_that_is_missed_is_told() {
        let bad = |energy, area, conformality| Distortion {
            energy,
            area,
            conformality,
        };
        let of_one = |distortion| warned(vec![component(distortion, 1)], 4.0, 0);
        let allowed = "that the distortion bound allows:";
        let energy = format!("the energy is above the 4.1000 {allowed} 4.2000");
        assert_eq!(of_one(bad(4.2, 1.0, 0.0)), [energy.as_str()]);
        let area = format!("the area distortion is above the 1.1200 {allowed} 1.2500");
        assert_eq!(of_one(bad(4.0, 1.25, 0.0)), [area.as_str()]);
        let angle = format!("the conformality is above the 0.1000 {allowed} 0.2000");
        assert_eq!(of_one(bad(4.0, 1.0, 0.2)), [angle]);
        assert_eq!(of_one(bad(4.2, 1.25, 0.0)), [energy, area]);

        let three = [4.3, 4.0, 4.2].map(|energy| component(bad(energy, 1.0, 0.0), 1));
        let several = format!(
            "the energy of 2 of 3 components is above the 4.1000 {allowed} 4.3000 at worst"
        );
        assert_eq!(warned(three.to_vec(), 4.0, 0), [several]);
    }

    #[test]
    fn charts_margin_and_points_beyond_what_was_asked_for_are_told() {
        let of = |charts| component(Distortion::NONE, charts);
        let one = "the number of charts is above max-charts = 10, since no valid layout was found \
                   with fewer: 12";
        assert_eq!(warned(vec![of(12)], 4.0, 0), [one]);
        let two = "the number of charts of 1 of 2 components is above max-charts = 10, since no \
                   valid layout was found with fewer: 11 at most";
        assert_eq!(warned(vec![of(11), of(10)], 4.0, 0), [two]);
        let margin = "the margin is 2.56 texels instead of 4: so many charts leave no room for \
                      more";
        let points = "7 points have no place in the surface and keep the raw map's UVs";
        assert_eq!(warned(vec![of(1)], 2.56, 7), [margin, points]);
    }
}
