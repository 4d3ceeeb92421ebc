//! What the networks are worth, from the figures of the page.

use super::super::printed::PRINTED;
use super::super::record::LayoutKind;
use super::super::surfaces::{Kind, SuiteSurface};
use super::spread::median;
use super::{Page, direct, finished, raw};
use fam_surface::metrics::Metrics;

/// A metric of a layout in the mean over the seeds.
fn mean(
    page: &Page,
    surface: &SuiteSurface,
    (trial, kind): (String, LayoutKind),
    value: fn(&Metrics) -> f64,
) -> Option<f64> {
    page.metric(surface.name, (&trial, kind), value)
        .map(|spread| spread.mean)
}

fn conformality(metrics: &Metrics) -> f64 {
    metrics.conformality
}

/// The section.
pub fn section(page: &Page) -> String {
    let parts = [
        on_meshes(page),
        on_clouds(page),
        on_broken(page),
        at_new_points(page),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let mut text = String::from("## What the networks are worth\n");
    for part in &parts {
        text.push_str(&format!("\n- {part}"));
    }
    if let Some(worse) = worse_than_printed(page) {
        text.push_str(&format!("\n\n{worse}"));
    }
    text
}

/// The layout that the map leads to against the one without it.
fn on_meshes(page: &Page) -> Option<String> {
    let meshes = page
        .tried()
        .filter(|s| matches!(s.kind, Kind::Open | Kind::Closed));
    let seams: Vec<(f64, f64)> = meshes
        .filter_map(|surface| {
            let length = |layout| mean(page, surface, layout, |metrics| metrics.seam_length);
            Some((length(finished())?, length(direct())?))
        })
        .collect();
    // Seams that are not needed at all have no ratio.
    let cut = seams.iter().filter(|(_, direct)| *direct > 0.0);
    let ratio = median(cut.map(|(finished, direct)| finished / direct))?;
    let shorter = seams
        .iter()
        .filter(|(finished, direct)| finished < direct)
        .count();
    let longer = seams
        .iter()
        .filter(|(finished, direct)| finished > direct)
        .count();
    let (whole, _) = raw();
    let trained = page
        .tried()
        .flat_map(|surface| page.measured(surface.name, &whole));
    let training = median(trained.filter_map(|measured| measured.training_seconds))?;
    let (trial, _) = direct();
    let laid_out = page
        .tried()
        .flat_map(|surface| page.measured(surface.name, &trial));
    let layouts = laid_out.flat_map(|measured| &measured.layouts);
    let seconds = median(layouts.filter_map(|layout| layout.seconds))?;
    Some(format!(
        "**On meshes**: the layout that the map leads to has {ratio:.2} times the seam length of the direct \
         one in the median of {} models; it is shorter on {shorter} and longer on {longer}. Training takes \
         {training:.0} s in the median, the direct layout {seconds:.1} s. Where the triangles of a mesh hang \
         together, use `--method direct`, which is the default.",
        seams.len()
    ))
}

fn on_clouds(page: &Page) -> Option<String> {
    let clouds: Vec<&SuiteSurface> = page.surfaces(Kind::Cloud).collect();
    let of = |layout: fn() -> (String, LayoutKind)| {
        median(
            clouds
                .iter()
                .filter_map(|surface| mean(page, surface, layout(), conformality)),
        )
    };
    let (raw, finished) = (of(raw)?, of(finished)?);
    Some(format!(
        "**On clouds**: without networks there is no layout, since a cloud has no triangles to cut. The raw \
         map has a conformality of {raw:.3} in the median, the layout that it leads to {finished:.3}."
    ))
}

fn on_broken(page: &Page) -> Option<String> {
    let surface = page.surfaces(Kind::Broken).next()?;
    let learnt = mean(page, surface, raw(), conformality)?;
    let charts = mean(page, surface, direct(), |metrics| metrics.charts as f64)?;
    Some(format!(
        "**On broken surfaces**: where no triangle hangs together with another, geometry alone makes \
         {charts:.0} charts. The networks map all of it in one piece, with a conformality of {learnt:.3}."
    ))
}

fn at_new_points(page: &Page) -> Option<String> {
    let (whole, _) = raw();
    let ratios = |version: &'static str| {
        let whole = whole.clone();
        page.tried().filter_map(move |surface| {
            let own = mean(page, surface, raw(), conformality)?;
            let unseen = page.measured(surface.name, &whole).flat_map(|m| &m.unseen);
            let unseen = unseen.filter(|unseen| unseen.version == version);
            let new = median(unseen.map(|unseen| unseen.conformality))?;
            Some(new / own)
        })
    };
    let distance = median(page.tried().flat_map(|surface| {
        let unseen = page.measured(surface.name, &whole).flat_map(|m| &m.unseen);
        unseen
            .filter(|u| u.version == "remeshed")
            .map(|u| 100.0 * u.mean_distance)
    }))?;
    let (remeshed, decimated) = (median(ratios("remeshed"))?, median(ratios("decimated"))?);
    Some(format!(
        "**For points that were never seen**: on a new mesh of the same surface the map has {remeshed:.2} \
         times the conformality that it has on the mesh it was trained on, on one of a quarter of the \
         vertices {decimated:.2} times (medians). At new vertices it is {distance:.2} % of the UV square's \
         side from the map of the old mesh. A method that computes UVs for the vertices of one mesh has none \
         for those of another."
    ))
}

/// The models whose raw maps are less conformal than the figure that the paper prints.
fn worse_than_printed(page: &Page) -> Option<String> {
    let figures: Vec<(&str, f64, f64)> = page
        .tried()
        .filter_map(|surface| {
            let own = mean(page, surface, raw(), conformality)?;
            let printed = PRINTED.conformality.fam.get(surface.name)?;
            Some((surface.name, own, *printed))
        })
        .collect();
    let count = figures.len();
    let worse: Vec<String> = figures
        .iter()
        .filter(|(_, own, printed)| own > printed)
        .map(|(name, own, printed)| format!("{name} ({own:.3}, printed {printed:.3})"))
        .collect();
    match (count, worse.as_slice()) {
        (0, _) => None,
        (_, []) => Some(format!(
            "The raw maps are more conformal than the figures that the paper prints on all {count} models \
             of the same name or kind."
        )),
        (_, worse) => Some(format!(
            "The raw maps are more conformal than the figures that the paper prints on {} of {count} models \
             of the same name or kind. They are worse on {}. What differs: the surfaces themselves (where \
             they are generated, or another file of the same name) and the training, which is the paper's \
             10,000 iterations of networks of width 512 on 10,000 points only with `--preset paper`.",
            count - worse.len(),
            worse.join(", ")
        )),
    }
}
