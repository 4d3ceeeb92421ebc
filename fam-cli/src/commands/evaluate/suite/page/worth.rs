//! What the networks are worth, from the figures of the page.

use super::super::printed::PRINTED;
use super::super::record::LayoutKind;
use super::super::surfaces::{Kind, SuiteSurface};
use super::spread::median;
use super::tables::conformality;
use super::{Page, direct, finished, raw};
use fam_surface::metrics::Metrics;

/// Lengths of seams that differ by less are the same.
const SAME: f64 = 0.005;

/// The section.
pub fn section(page: &Page) -> String {
    let parts = [
        on_meshes(page),
        on_clouds(page),
        on_broken(page),
        at_new_points(page),
    ];
    let mut text = String::from("## What the networks are worth\n");
    for part in parts.iter().flatten() {
        text.push_str(&format!("\n- {part}"));
    }
    for (kind, generated) in [
        ("public models of the same name", false),
        ("generated stand-ins", true),
    ] {
        if let Some(sentence) = beside_printed(page, kind, generated) {
            text.push_str(&format!("\n\n{sentence}"));
        }
    }
    text
}

/// A metric of a layout in the mean over the seeds.
fn mean(
    page: &Page,
    surface: &SuiteSurface,
    (trial, kind): (String, LayoutKind),
    value: fn(&Metrics) -> f64,
) -> Option<f64> {
    let spread = page.metric(surface.name, (&trial, kind), value);
    spread.map(|spread| spread.mean)
}

/// The layout that the map leads to against the one without it.
fn on_meshes(page: &Page) -> Option<String> {
    let meshes: Vec<&SuiteSurface> = page
        .tried()
        .filter(|surface| matches!(surface.kind, Kind::Open | Kind::Closed))
        .collect();
    let length = |surface, layout| mean(page, surface, layout, |metrics| metrics.seam_length);
    // Surfaces that need no cut have no ratio.
    let ratios: Vec<f64> = meshes
        .iter()
        .filter_map(|surface| Some(length(surface, finished())? / length(surface, direct())?))
        .filter(|ratio| ratio.is_finite())
        .collect();
    let ratio = median(ratios.iter().copied())?;
    let shorter = ratios.iter().filter(|ratio| **ratio < 1.0 - SAME).count();
    let longer = ratios.iter().filter(|ratio| **ratio > 1.0 + SAME).count();
    let (whole, _) = raw();
    let trained = meshes
        .iter()
        .flat_map(|surface| page.measured(surface.name, &whole));
    let training = median(trained.filter_map(|measured| measured.training_seconds));
    let (trial, _) = direct();
    let laid_out = meshes
        .iter()
        .flat_map(|surface| page.measured(surface.name, &trial));
    let layouts = laid_out.flat_map(|measured| &measured.layouts);
    let seconds = median(layouts.filter_map(|layout| layout.seconds));
    let times = training
        .zip(seconds)
        .map_or(String::new(), |(training, seconds)| {
            format!(
                " Training takes {training:.0} s in the median, the direct layout {seconds:.1} s."
            )
        });
    let advice = match ratio < 0.95 {
        true => "The map pays where seams must be short.",
        false => "So the default for meshes is the direct layout.",
    };
    Some(format!(
        "**On meshes**: the layout that the map leads to has {ratio:.2} times the seam length of the direct \
         one in the median. Of {} models that need a cut it is shorter on {shorter} and longer on {longer}, \
         and the same on the others: on meshes of 5,000 triangles or more, the map leads one of four searches, \
         of which the best counts.{times} {advice}",
        ratios.len()
    ))
}

fn on_clouds(page: &Page) -> Option<String> {
    let clouds: Vec<&SuiteSurface> = page.surfaces(Kind::Cloud).collect();
    let of = |layout: fn() -> (String, LayoutKind)| {
        let figures = clouds.iter();
        median(figures.filter_map(|surface| mean(page, surface, layout(), conformality)))
    };
    let (raw, finished) = (of(raw)?, of(finished)?);
    Some(format!(
        "**On clouds**: the direct method needs triangles, and a cloud has none. The raw map has a \
         conformality of {raw:.3} in the median. It also tells which points are neighbours on the surface; \
         the layout of the triangles found with it has {finished:.3}."
    ))
}

fn on_broken(page: &Page) -> Option<String> {
    let surface = page.surfaces(Kind::Broken).next()?;
    let learnt = mean(page, surface, raw(), conformality)?;
    let charts = mean(page, surface, direct(), |metrics| metrics.charts as f64)?;
    Some(format!(
        "**On broken surfaces**: where no triangle shares an edge with another, geometry alone makes \
         {charts:.0} charts of {}. The networks see the points and map neighbours to neighbours, with a \
         conformality of {learnt:.3}.",
        surface.name
    ))
}

fn at_new_points(page: &Page) -> Option<String> {
    let (whole, _) = raw();
    let all = |version: &'static str| {
        let measured = page
            .tried()
            .flat_map(|surface| page.measured(surface.name, &whole));
        measured
            .flat_map(|m| &m.unseen)
            .filter(move |unseen| unseen.version == version)
    };
    let ratio =
        |version| median(all(version).map(|unseen| unseen.conformality / unseen.interpolated));
    let distance = median(all("remeshed").map(|unseen| 100.0 * unseen.mean_distance))?;
    let (remeshed, decimated) = (ratio("remeshed")?, ratio("decimated")?);
    Some(format!(
        "**For points that were never seen**: on a new mesh of the same surface the networks' UVs have \
         {remeshed:.2} times the conformality of UVs that are interpolated on the mesh that they were trained \
         on, on one of a quarter of the vertices {decimated:.2} times (medians), and are {distance:.2} % of \
         the UV square's side from them. The networks need no mesh to interpolate on: levels of detail, scans \
         of the same object and points that are added later get the same map."
    ))
}

/// How raw maps compare with the figures that the paper prints; none if there are none of this kind.
fn beside_printed(page: &Page, kind: &str, generated: bool) -> Option<String> {
    let surfaces = page
        .tried()
        .filter(|surface| surface.is_generated() == generated);
    let figures: Vec<(&str, f64, f64)> = surfaces
        .filter_map(|surface| {
            let own = mean(page, surface, raw(), conformality)?;
            let printed = PRINTED.conformality.fam.get(surface.name)?;
            Some((surface.name, own, *printed))
        })
        .collect();
    let is_worse = |(_, own, printed): &&(&str, f64, f64)| own > printed;
    let worse: Vec<String> = figures
        .iter()
        .filter(is_worse)
        .map(|(name, own, printed)| format!("{name} ({own:.3}, printed {printed:.3})"))
        .collect();
    let count = figures.len();
    match worse.as_slice() {
        _ if count == 0 => None,
        [] => Some(format!(
            "The raw maps of {kind} are more conformal than the paper prints on all {count}."
        )),
        worse => Some(format!(
            "The raw maps of {kind} are more conformal than the paper prints on {} of {count}, and worse on \
             {}. The surfaces differ (another file of the name, or another shape of the kind), and so does \
             the training, as said above.",
            count - worse.len(),
            worse.join(", ")
        )),
    }
}
