//! What the user has to know about a finished surface.

use fam_layout::{self, Distortion, LayoutConfig, Measure, MeshLayout};
use fam_surface::metrics::Metrics;

use crate::finish::{Finished, Outcome};
use crate::marks::MarksReport;

/// Where a finished surface falls short of what was asked for, a sentence each; `mesh` has the
/// metrics of its UVs.
pub fn warnings(finished: &Finished, mesh: Option<&Metrics>) -> Vec<String> {
    let mut warnings = Vec::new();
    if finished.stopped {
        warnings.push("finishing was stopped early".to_string());
    }
    warnings.extend(finished.marks.iter().flat_map(MarksReport::warnings));
    let (Outcome::Mesh { atlas, .. } | Outcome::Cloud { atlas, .. }) = &finished.outcome;
    let config = &finished.config;
    warnings.extend(too_distorted(atlas, config));
    // Wanted seams make as many charts as they do.
    if !finished
        .marks
        .as_ref()
        .is_some_and(MarksReport::wants_seams)
    {
        warnings.extend(too_many_charts(atlas, config));
    }
    warnings.extend(too_narrow(atlas, config));
    if let Outcome::Cloud { unreached, .. } = finished.outcome
        && unreached > 0
    {
        warnings.push(format!(
            "{unreached} points have no place in the surface and keep the raw map's UVs"
        ));
    }
    warnings.extend(mesh.into_iter().flat_map(invalid));
    warnings
}

/// The measures that are above what the distortion bound allows.
fn too_distorted(atlas: &MeshLayout, config: &LayoutConfig) -> Vec<String> {
    let limits = Distortion::allowed(config.distortion_bound);
    // Specks without area have no distortion to speak of.
    let with_area = |one: &&finish::Finished| one.root_area > 0.0;
    let all: Vec<&finish::Finished> = atlas.components.iter().filter(with_area).collect();
    Measure::ALL
        .into_iter()
        .filter_map(|measure| {
            let limit = limits.of(measure);
            let values = all.iter().map(|one| one.distortion.of(measure));
            let above: Vec<f64> = values.filter(|value| *value > limit).collect();
            let worst = above.iter().copied().reduce(f64::max)?;
            Some(format!(
                "the {measure}{} is above the {limit:.4} that the distortion bound allows: \
                 {worst:.4}{}",
                of_components(above.len(), all.len()),
                if all.len() > 1 { " at worst" } else { "" },
            ))
        })
        .collect()
}

/// That more charts were needed than were asked for.
fn too_many_charts(atlas: &MeshLayout, config: &LayoutConfig) -> Option<String> {
    let all = &atlas.components;
    let charts = all.iter().map(|one| one.charts);
    let above: Vec<usize> = charts.filter(|&count| count > config.max_charts).collect();
    let most = above.iter().max()?;
    Some(format!(
        "the number of charts{} is above max-charts = {}, since no valid layout was found with \
         fewer: {most}{}",
        of_components(above.len(), all.len()),
        config.max_charts,
        if all.len() > 1 { " at most" } else { "" },
    ))
}

/// That charts lie closer together than was asked for.
fn too_narrow(atlas: &MeshLayout, config: &LayoutConfig) -> Option<String> {
    let least = atlas.margin.iter().copied().reduce(f64::min)?;
    (least < config.margin).then(|| {
        format!(
            "the margin is {least:.2} texels instead of {}: so many charts leave no room for more",
            config.margin
        )
    })
}

/// What is wrong with UVs.
fn invalid(metrics: &Metrics) -> Vec<String> {
    let counts = [
        (
            metrics.collapsed_triangles as u64,
            "triangles without area in the plane",
        ),
        (metrics.flipped_triangles as u64, "flipped triangles"),
        (metrics.overlapping_pairs, "overlapping pairs of triangles"),
    ];
    counts
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
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
    use fam_surface::UvMap;

    use super::*;

    fn component(distortion: Distortion, charts: usize) -> finish::Finished {
        finish::Finished {
            uvs: UvMap::new(vec![[0.0; 2]], vec![[0; 3]]).unwrap(),
            charts,
            distortion,
            root_area: 1.0,
            seam_length: 0.0,
        }
    }

    fn warned(components: Vec<finish::Finished>, margin: f64, unreached: usize) -> Vec<String> {
        let atlas = MeshLayout {
            coverage: vec![0.5],
            margin: vec![margin],
            components,
        };
        let finished = Finished {
            config: LayoutConfig::default(),
            stopped: false,
            marks: None,
            outcome: Outcome::Cloud { unreached, atlas },
        };
        warnings(&finished, None)
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
