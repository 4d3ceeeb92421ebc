//! The method without its parts, and on noisy points.

use super::super::plan::Variant;
use super::super::record::LayoutKind;
use super::super::surfaces::SuiteSurface;
use super::markdown::Table;
use super::spread::{Spread, median};
use super::tables::{conformality, self_intersection_of};
use super::{Page, cell, title};
use fam_surface::metrics::Metrics;

/// A figure of a map.
type Metric = fn(&Metrics) -> f64;

/// Clouds with noise.
pub fn noise(page: &Page) -> String {
    let titles = ["none", "1 %", "2 %", "4 %"];
    let columns: Vec<_> = titles.into_iter().zip(Variant::noises()).collect();
    let surfaces = tried_with(page, &columns);
    let table = variants(page, &surfaces, &columns, conformality);
    format!(
        "## Noise\n\n\
         Conformality of the raw maps of clouds whose points were moved by a Gaussian; its standard \
         deviation is in percent of the radius of the bounding sphere. A percent of it is about as far as \
         points are apart, so no map of the moved points keeps the angles between them; the map is evaluated \
         where the points were before, on the triangles that they come from.\n\n{table}"
    )
}

/// The method without its parts.
pub fn ablations(page: &Page) -> String {
    let titles = [
        "whole method",
        "without 2D→3D→2D",
        "without 3D→2D→3D",
        "without Cut-Net",
    ];
    let columns: Vec<_> = titles.into_iter().zip(Variant::ablations()).collect();
    let surfaces = tried_with(page, &columns);
    let mut text = String::from(
        "## Ablations\n\n\
         Raw maps of the method without the branch 2D→3D→2D, which starts at the lattice of UVs; without the \
         branch 3D→2D→3D, so that the UVs of a point are those of the nearest point of the wrapped lattice; \
         and without Cut-Net.\n",
    );
    // A map without area overlaps nothing, and one that squeezes an area keeps angles elsewhere.
    let metrics: [(&str, Metric); 5] = [
        ("Conformality", conformality),
        ("Area distortion", |metrics| metrics.area_distortion),
        ("Self-intersection, in percent", self_intersection_of),
        ("Flipped triangles, in percent", |metrics| {
            100.0 * metrics.flipped_triangles as f64 / metrics.triangles as f64
        }),
        ("Triangles without area in the map, in percent", |metrics| {
            100.0 * metrics.collapsed_triangles as f64 / metrics.triangles as f64
        }),
    ];
    for (name, metric) in metrics {
        let table = variants(page, &surfaces, &columns, metric);
        text.push_str(&format!("\n{name}:\n\n{table}"));
    }
    text.push('\n');
    for (title, variant) in &columns[1..] {
        text.push_str(&verdict(page, &surfaces, title, *variant).unwrap_or_default());
    }
    text
}

/// A table of a metric of raw maps: surfaces by variants.
fn variants(
    page: &Page,
    surfaces: &[&SuiteSurface],
    variants: &[(&str, Variant)],
    metric: Metric,
) -> Table {
    let titles = variants.iter().map(|(title, _)| *title);
    let mut table = Table::new(["model"].into_iter().chain(titles).chain(["run"]), 1);
    for surface in surfaces {
        let cells = variants.iter().map(|(_, variant)| {
            let trial = variant.name();
            match page.metric(surface.name, (&trial, LayoutKind::Raw), metric) {
                None => page.failure(surface.name, &trial).unwrap_or_default(),
                figure => cell(figure),
            }
        });
        let row = [title(surface)].into_iter().chain(cells);
        table.push(row.chain([page.run(surface.name)]).collect());
    }
    table
}

/// The surfaces on which one of the variants after the first was tried.
fn tried_with(page: &Page, variants: &[(&str, Variant)]) -> Vec<&'static SuiteSurface> {
    let tried = |surface: &&'static SuiteSurface| {
        let mut others = variants[1..].iter();
        others.any(|(_, variant)| page.records(surface.name, &variant.name()).next().is_some())
    };
    page.tried().filter(tried).collect()
}

/// What leaving out a part did, in a sentence. None if it was not tried.
fn verdict(
    page: &Page,
    surfaces: &[&SuiteSurface],
    title: &str,
    variant: Variant,
) -> Option<String> {
    let (whole, part) = (Variant::Whole.name(), variant.name());
    let pairs = |metric: Metric| -> Vec<(Spread, Spread)> {
        let figure = |surface: &SuiteSurface, trial: &str| {
            page.metric(surface.name, (trial, LayoutKind::Raw), metric)
        };
        let pair =
            |surface: &&SuiteSurface| Some((figure(surface, &whole)?, figure(surface, &part)?));
        surfaces.iter().filter_map(pair).collect()
    };
    let ratio = |pairs: &[(Spread, Spread)]| median(pairs.iter().map(|(a, b)| b.mean / a.mean));
    let angles = pairs(conformality);
    let conformality = ratio(&angles)?;
    let area = match ratio(&pairs(|metrics| metrics.area_distortion))? {
        finite if finite.is_finite() => format!("{finite:.2} times the area distortion"),
        _ => "infinitely many times the area distortion".to_string(),
    };
    let worse = angles.iter().filter(|(a, b)| b.low > a.high).count();
    let better = angles.iter().filter(|(a, b)| b.high < a.low).count();
    Some(format!(
        "\n- *{title}*: {conformality:.2} times the conformality and {area} of the \
         whole method (medians; models: {}). Conformality is worse with every seed on {worse} and better \
         with every seed on {better}.",
        angles.len()
    ))
}
