//! The tables of the paper, and those of points that training did not see.

use super::super::plan::Variant;
use super::super::printed::PRINTED;
use super::super::record::LayoutKind;
use super::super::surfaces::{Kind, SuiteSurface};
use super::markdown::Table;
use super::spread::Spread;
use super::{Page, cell, direct, finished, printed, raw, seconds, title};
use fam_surface::metrics::Metrics;

fn conformality(metrics: &Metrics) -> f64 {
    metrics.conformality
}

fn self_intersection_of(metrics: &Metrics) -> f64 {
    metrics.overlap_percentage
}

/// The cell of a layout; of a trial that failed, the reason.
fn layout_cell(page: &Page, surface: &str, (trial, kind): (String, LayoutKind)) -> String {
    match page.metric(surface, (&trial, kind), conformality) {
        None => page.failure(surface, &trial).unwrap_or_default(),
        figure => cell(figure),
    }
}

/// The conformality of a peer's layout.
fn peer_cell(page: &Page, peer: &str, surface: &str) -> String {
    let Some(layout) = page.peer(peer, surface) else {
        return String::new();
    };
    match &layout.metrics {
        Some(metrics) => {
            let cut = if layout.told.cut { " †" } else { "" };
            format!("{:.3}{cut}", metrics.conformality)
        }
        None => layout.told.reason.clone().unwrap_or_default(),
    }
}

fn triangles(page: &Page, surface: &str) -> String {
    let tried = page
        .records
        .iter()
        .filter(|record| record.surface == surface);
    let layouts = tried
        .filter_map(|record| record.measured())
        .flat_map(|m| &m.layouts);
    let mut counts = layouts.map(|layout| layout.metrics.triangles);
    counts
        .next()
        .map_or(String::new(), |count| count.to_string())
}

/// Tables 1 and 2.
pub fn meshes(page: &Page) -> String {
    let table = |kind: Kind| {
        let mut table = Table::new(
            [
                "model",
                "triangles",
                "raw map",
                "finished",
                "direct",
                "SLIM",
                "LSCM",
                "FAM, printed",
                "SLIM, printed",
                "run",
            ],
            1,
        );
        for surface in page.surfaces(kind) {
            let name = surface.name;
            table.push(vec![
                title(surface),
                triangles(page, name),
                layout_cell(page, name, raw()),
                layout_cell(page, name, finished()),
                layout_cell(page, name, direct()),
                peer_cell(page, "slim", name),
                peer_cell(page, "lscm", name),
                printed(PRINTED.conformality.fam.get(name)),
                printed(PRINTED.conformality.slim.get(name)),
                page.run(name),
            ]);
        }
        table
    };
    let note = match page.peer_names().is_empty() {
        true => "",
        false => {
            "\n† cut along the seams of our direct layout first: the surface is no disk, and the tool \
             finds no seams itself.\n"
        }
    };
    format!(
        "## Conformality of open surfaces (table 1)\n\n\
         Mean absolute difference of angles, in radians.\n\n{}\n\
         ## Conformality of closed surfaces, of higher genus and one-sided (table 2)\n\n{}{note}",
        table(Kind::Open),
        table(Kind::Closed)
    )
}

/// Table 3.
pub fn clouds(page: &Page) -> String {
    let mut table = Table::new(
        [
            "cloud",
            "points",
            "raw map",
            "finished",
            "FAM, printed",
            "FBCP-PC, printed",
            "run",
        ],
        1,
    );
    for surface in page.surfaces(Kind::Cloud) {
        let name = surface.name;
        let (trial, kind) = raw();
        let points = page.metric(name, (&trial, kind), |metrics| metrics.vertices as f64);
        table.push(vec![
            title(surface),
            points.map_or(String::new(), |points| format!("{:.0}", points.mean)),
            layout_cell(page, name, raw()),
            layout_cell(page, name, finished()),
            printed(PRINTED.conformality.fam.get(name)),
            printed(PRINTED.conformality.fbcp_pc.get(name)),
            page.run(name),
        ]);
    }
    format!(
        "## Conformality of point clouds (table 3)\n\n\
         Clouds have no normals and no triangles. Conformality is measured on the triangles that the \
         points come from, which the program is not told. FBCP-PC was given the boundary of each cloud.\n\n\
         {table}"
    )
}

/// Table 4.
pub fn self_intersection(page: &Page) -> String {
    let mean = |kind: Kind, (trial, layout): (String, LayoutKind)| {
        let surfaces = page.surfaces(kind);
        let figures = surfaces.filter_map(|surface| {
            page.metric(surface.name, (&trial, layout), self_intersection_of)
        });
        Spread::of(figures.map(|figure| figure.mean)).map(|figure| figure.mean)
    };
    let peer_mean = |kind: Kind, peer: &str| {
        let surfaces = page.surfaces(kind);
        let figures = surfaces.filter_map(|surface| {
            let metrics = page.peer(peer, surface.name)?.metrics.as_ref()?;
            Some(metrics.overlap_percentage)
        });
        Spread::of(figures).map(|figure| figure.mean)
    };
    let percent = |figure: Option<f64>| match figure {
        Some(0.0) => "0".to_string(),
        Some(figure) if figure < 5e-4 => format!("{figure:.0e}"),
        Some(figure) => format!("{figure:.3}"),
        None => String::new(),
    };
    let printed = &PRINTED.self_intersection;
    let mut table = Table::new(
        [
            "models",
            "raw map",
            "finished",
            "direct",
            "SLIM",
            "FAM, printed",
            "SLIM, printed",
        ],
        1,
    );
    for (title, kind, fam, slim) in [
        (
            "open",
            Kind::Open,
            printed.fam_open,
            Some(printed.slim_open),
        ),
        ("closed", Kind::Closed, printed.fam_closed, None),
    ] {
        table.push(vec![
            title.to_string(),
            percent(mean(kind, raw())),
            percent(mean(kind, finished())),
            percent(mean(kind, direct())),
            percent(peer_mean(kind, "slim")),
            format!("*{fam:.3}*"),
            slim.map_or(String::new(), |slim| format!("*{slim:.3}*")),
        ]);
    }
    format!(
        "## Self-intersection (table 4)\n\n\
         Pairs of triangles whose interiors overlap, in percent of all pairs, in the mean over the models \
         above; the test is exact.\n\n{table}"
    )
}

/// How long everything took.
pub fn time(page: &Page) -> String {
    let peers = page.peer_names();
    let mut titles = vec!["model", "training", "finishing", "direct"];
    titles.extend(&peers);
    titles.extend(["FAM, printed", "SLIM, printed"]);
    let mut table = Table::new(titles, 1);
    for surface in page.tried() {
        let name = surface.name;
        let took = |(trial, kind): (String, LayoutKind)| {
            let layouts = page
                .measured(name, &trial)
                .flat_map(|measured| &measured.layouts);
            Spread::of(layouts.filter(|l| l.kind == kind).filter_map(|l| l.seconds))
        };
        let (whole, _) = raw();
        let training = page
            .measured(name, &whole)
            .filter_map(|m| m.training_seconds);
        let mut row = vec![title(surface), seconds(Spread::of(training))];
        row.extend([seconds(took(finished())), seconds(took(direct()))]);
        row.extend(peers.iter().map(|peer| {
            let layout = page.peer(peer, name);
            seconds(layout.and_then(|layout| Spread::of(layout.told.seconds)))
        }));
        let is_printed = PRINTED.conformality.slim.contains_key(name);
        row.push(match is_printed {
            true => format!("*{:.0}*", 60.0 * PRINTED.minutes.fam),
            false => String::new(),
        });
        let slim = PRINTED.minutes.slim.get(name);
        row.push(slim.map_or(String::new(), |minutes| format!("*{:.0}*", 60.0 * minutes)));
        table.push(row);
    }
    format!(
        "## Time\n\n\
         Seconds. *Training* ends with the raw map, *finishing* makes a layout of it, *direct* is the layout \
         without networks. The paper trained on a GPU and ran SLIM on an Intel Core i7-9700.\n\n{table}"
    )
}

/// A table of a metric of raw maps: surfaces by variants.
fn variants(
    page: &Page,
    surfaces: &[&SuiteSurface],
    variants: &[(&str, Variant)],
    value: impl Fn(&Metrics) -> f64,
) -> Table {
    let titles = variants.iter().map(|(title, _)| *title);
    let mut table = Table::new(["model"].into_iter().chain(titles), 1);
    for surface in surfaces {
        let cells = variants.iter().map(|(_, variant)| {
            let trial = variant.name();
            match page.metric(surface.name, (&trial, LayoutKind::Raw), &value) {
                None => page.failure(surface.name, &trial).unwrap_or_default(),
                figure => cell(figure),
            }
        });
        table.push([title(surface)].into_iter().chain(cells).collect());
    }
    table
}

/// The surfaces on which one of the variants after the first was tried.
fn tried_with<'a>(page: &Page, variants: &[(&str, Variant)]) -> Vec<&'a SuiteSurface> {
    let tried = |surface: &&'static SuiteSurface| {
        let mut others = variants[1..].iter();
        others.any(|(_, variant)| page.records(surface.name, &variant.name()).next().is_some())
    };
    page.tried().filter(tried).collect()
}

/// Clouds with noise.
pub fn noise(page: &Page) -> String {
    let titles = ["none", "1 %", "2 %", "4 %"];
    let columns: Vec<_> = titles.into_iter().zip(Variant::noises()).collect();
    let surfaces = tried_with(page, &columns);
    let table = variants(page, &surfaces, &columns, conformality);
    format!(
        "## Noise\n\n\
         Conformality of the raw maps of clouds whose points were moved by a Gaussian; its standard \
         deviation is in percent of the radius of the bounding sphere. The map is evaluated where the \
         points were before, on the triangles that they come from.\n\n{table}"
    )
}

/// The columns of the ablations.
fn ablation_columns() -> Vec<(&'static str, Variant)> {
    let titles = [
        "whole method",
        "without 2D→3D→2D",
        "without 3D→2D→3D",
        "without Cut-Net",
    ];
    titles.into_iter().zip(Variant::ablations()).collect()
}

/// The method without its parts.
pub fn ablations(page: &Page) -> String {
    let columns = ablation_columns();
    let surfaces = tried_with(page, &columns);
    let mut text = format!(
        "## Ablations\n\n\
         Conformality of raw maps without the branch 2D→3D→2D (no Deform-Net, so the points of the UV \
         lattice are not learned), without the branch 3D→2D→3D (the UVs of a point are those of the \
         nearest point of the wrapped lattice), and without Cut-Net.\n\n{}\n\
         Self-intersection of the same, in percent.\n\n{}",
        variants(page, &surfaces, &columns, conformality),
        variants(
            page,
            &surfaces,
            &columns,
            LayoutKind::Raw,
            self_intersection_of
        )
    );
    for (title, variant) in &columns[1..] {
        text.push_str(&verdict(page, &surfaces, title, *variant));
    }
    text
}

/// What leaving out a part did, in a sentence.
fn verdict(page: &Page, surfaces: &[&SuiteSurface], title: &str, variant: Variant) -> String {
    let (whole, part) = (Variant::Whole.name(), variant.name());
    let figure = |surface: &SuiteSurface, trial: &str| {
        page.metric(surface.name, (trial, LayoutKind::Raw), conformality)
    };
    let pairs: Vec<(Spread, Spread)> = surfaces
        .iter()
        .filter_map(|surface| Some((figure(surface, &whole)?, figure(surface, &part)?)))
        .collect();
    let Some(ratio) = super::spread::median(pairs.iter().map(|(a, b)| b.mean / a.mean)) else {
        return String::new();
    };
    let worse = pairs.iter().filter(|(a, b)| b.low > a.high).count();
    let better = pairs.iter().filter(|(a, b)| b.high < a.low).count();
    format!(
        "\n- *{title}*: {ratio:.2} times the conformality of the whole method in the median of {} \
         surfaces; worse with every seed on {worse}, better with every seed on {better}.",
        pairs.len()
    )
}

/// The map at points that training did not see.
pub fn unseen(page: &Page) -> String {
    let mut table = Table::new(
        [
            "model",
            "own vertices",
            "remeshed",
            "distance, %",
            "95th percentile, %",
            "decimated",
            "distance, %",
            "95th percentile, %",
        ],
        1,
    );
    let (whole, kind) = raw();
    for surface in page.tried() {
        let of_version = |version: &str, value: fn(&super::super::unseen::Unseen) -> f64| {
            let all = page
                .measured(surface.name, &whole)
                .flat_map(|measured| &measured.unseen);
            let own = all.filter(|unseen| unseen.version == version);
            Spread::of(own.map(value)).map(|spread| spread.mean)
        };
        if of_version("remeshed", |unseen| unseen.conformality).is_none() {
            continue;
        }
        let mut row = vec![title(surface)];
        let own = page.metric(surface.name, (&whole, kind), conformality);
        row.push(own.map_or(String::new(), |own| format!("{:.3}", own.mean)));
        for version in ["remeshed", "decimated"] {
            let conformality = of_version(version, |unseen| unseen.conformality);
            row.push(conformality.map_or(String::new(), |c| format!("{c:.3}")));
            for value in [
                of_version(version, |unseen| 100.0 * unseen.mean_distance),
                of_version(version, |unseen| 100.0 * unseen.p95_distance),
            ] {
                row.push(value.map_or(String::new(), |value| format!("{value:.2}")));
            }
        }
        table.push(row);
    }
    format!(
        "## Points that training did not see\n\n\
         The trained map at the vertices of another mesh of the same surface, which no method that computes \
         UVs for the vertices of one mesh can give: *remeshed* has as many new, evenly spread vertices as \
         the mesh, *decimated* a quarter of them. Conformality is that of the map on the new triangles. The \
         distance is between the map at a new vertex and the map of the mesh itself, linear on its \
         triangles, in percent of the side of the UV square; vertices on torn triangles do not count.\n\n\
         {table}"
    )
}

/// The stress test, the failure case and the broken mesh.
pub fn hard(page: &Page) -> String {
    let mut table = Table::new(
        [
            "model",
            "layout",
            "triangles",
            "conformality",
            "area distortion",
            "self-intersection, %",
            "charts",
            "run",
        ],
        2,
    );
    for kind in [Kind::Stress, Kind::Failure, Kind::Broken] {
        for surface in page.surfaces(kind) {
            let name = surface.name;
            for (label, (trial, layout)) in [
                ("raw map", raw()),
                ("finished", finished()),
                ("direct", direct()),
            ] {
                let Some(conformality) = page.metric(name, (&trial, layout), conformality) else {
                    if let Some(reason) = page.failure(name, &trial) {
                        table.push(vec![title(surface), reason]);
                    }
                    continue;
                };
                let metric =
                    |value: fn(&Metrics) -> f64| page.metric(name, (&trial, layout), value);
                table.push(vec![
                    title(surface),
                    label.to_string(),
                    triangles(page, name),
                    cell(Some(conformality)),
                    cell(metric(|metrics| metrics.area_distortion)),
                    cell(metric(self_intersection_of)),
                    metric(|metrics| metrics.charts as f64)
                        .map_or(String::new(), |charts| format!("{:.0}", charts.mean)),
                    page.run(name),
                ]);
            }
        }
    }
    format!(
        "## Stress test, failure case, broken mesh\n\n\
         *hilbert-tube* is the paper's stress test, a tube along a space-filling curve. *assembly* is its \
         failure case: a model of many parts, some inside of others. *soup* is a double torus whose \
         triangles hang together nowhere: by geometry alone each is a chart of its own, while the networks \
         are trained on its corners as a cloud.\n\n{table}"
    )
}
