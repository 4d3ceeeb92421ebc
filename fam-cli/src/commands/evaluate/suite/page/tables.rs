//! The tables that the paper has, by surfaces.

use super::super::printed::PRINTED;
use super::super::record::LayoutKind;
use super::super::surfaces::Kind;
use super::markdown::Table;
use super::spread::Spread;
use super::{Page, cell, direct, finished, printed, raw, seconds, title};
use fam_surface::metrics::Metrics;

/// In radians.
pub fn conformality(metrics: &Metrics) -> f64 {
    metrics.conformality
}

/// In percent of all pairs of triangles.
pub fn self_intersection_of(metrics: &Metrics) -> f64 {
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
            let cut = if layout.report.cut { " †" } else { "" };
            format!("{:.3}{cut}", metrics.conformality)
        }
        None => layout.report.reason.clone().unwrap_or_default(),
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
         Mean absolute difference of angles, in radians. The spiral and the cloth are bent rectangles, which \
         a perfect map flattens without any.\n\n{}\n\
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
         points come from, which the program does not see. FBCP-PC was given the boundary of each cloud.\n\n\
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
        percent(figures.map(|figure| figure.mean).collect())
    };
    let by_slim = |kind: Kind| {
        let surfaces = page.surfaces(kind);
        let figures = surfaces.filter_map(|surface| {
            let metrics = page.peer("slim", surface.name)?.metrics.as_ref()?;
            Some(metrics.overlap_percentage)
        });
        percent(figures.collect())
    };
    let printed = &PRINTED.self_intersection;
    let titles = [
        "models",
        "raw map",
        "finished",
        "direct",
        "SLIM",
        "FAM, printed",
        "SLIM, printed",
    ];
    let mut table = Table::new(titles, 1);
    let open = (printed.fam_open, Some(printed.slim_open));
    for (title, kind, (fam, slim)) in [
        ("open", Kind::Open, open),
        ("closed", Kind::Closed, (printed.fam_closed, None)),
    ] {
        table.push(vec![
            title.to_string(),
            mean(kind, raw()),
            mean(kind, finished()),
            mean(kind, direct()),
            by_slim(kind),
            format!("*{fam:.3}*"),
            slim.map_or(String::new(), |slim| format!("*{slim:.3}*")),
        ]);
    }
    format!(
        "## Self-intersection (table 4)\n\n\
         Pairs of triangles whose interiors overlap, in percent of all pairs; the test is exact. Means over \
         as many of the models above as the parentheses say; the paper's are over its own models.\n\n{table}"
    )
}

/// The mean of percentages, and of how many.
fn percent(figures: Vec<f64>) -> String {
    let count = figures.len();
    match Spread::of(figures).map(|figure| figure.mean) {
        Some(0.0) => format!("0 ({count})"),
        Some(figure) if figure < 5e-4 => format!("{figure:.0e} ({count})"),
        Some(figure) => format!("{figure:.3} ({count})"),
        None => String::new(),
    }
}

/// How long everything took.
pub fn time(page: &Page) -> String {
    let peers = page.peer_names();
    let mut titles = vec!["model", "training", "finishing", "direct"];
    titles.extend(&peers);
    titles.extend(["SLIM, printed", "run"]);
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
        row.extend(peers.iter().map(|peer| match page.peer(peer, name) {
            Some(layout) => match &layout.report.reason {
                Some(reason) => reason.clone(),
                None => seconds(Spread::of(layout.report.seconds)),
            },
            None => String::new(),
        }));
        let slim = PRINTED.minutes.slim.get(name);
        row.push(slim.map_or(String::new(), |minutes| format!("*{:.0}*", 60.0 * minutes)));
        row.push(page.run(name));
        table.push(row);
    }
    format!(
        "## Time\n\n\
         Seconds, in the mean over the seeds whose time is known. *Training* ends with the raw map, \
         *finishing* makes a layout of it, *direct* is the layout without networks. The paper's training took \
         {:.0} minutes on a GPU for any model, and its SLIM ran on an Intel Core i7-9700.\n\n{table}",
        PRINTED.minutes.fam
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
         triangles share no edges: by geometry alone each is a chart of its own, while the networks are \
         trained on its corners as a cloud.\n\n{table}"
    )
}
