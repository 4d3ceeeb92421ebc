//! All metrics of all layouts: each of them alone is easy to win.

use super::super::record::LayoutKind;
use super::super::surfaces::Kind;
use super::markdown::Table;
use super::spread::{Spread, median};
use super::{Page, direct, finished, raw, title};
use fam_surface::metrics::Metrics;

/// A figure for each column.
type Figures = [f64; COLUMNS.len()];

/// A column of the tables.
struct Column {
    title: &'static str,
    value: fn(&Metrics) -> f64,
    digits: usize,
}

const COLUMNS: [Column; 10] = [
    Column {
        title: "charts",
        value: |metrics| metrics.charts as f64,
        digits: 0,
    },
    Column {
        title: "seam length",
        value: |metrics| metrics.seam_length,
        digits: 2,
    },
    Column {
        title: "conformality",
        value: |metrics| metrics.conformality,
        digits: 3,
    },
    Column {
        title: "area distortion",
        value: |metrics| metrics.area_distortion,
        digits: 3,
    },
    Column {
        title: "symmetric Dirichlet",
        value: |metrics| metrics.symmetric_dirichlet,
        digits: 3,
    },
    Column {
        title: "flips",
        value: |metrics| metrics.flipped_triangles as f64,
        digits: 0,
    },
    Column {
        title: "collapsed",
        value: |metrics| metrics.collapsed_triangles as f64,
        digits: 0,
    },
    Column {
        title: "overlaps",
        value: |metrics| metrics.overlapping_pairs as f64,
        digits: 0,
    },
    Column {
        title: "self-intersection, %",
        value: |metrics| metrics.overlap_percentage,
        digits: 4,
    },
    Column {
        title: "coverage, %",
        value: |metrics| 100.0 * metrics.uv_coverage,
        digits: 0,
    },
];

impl Column {
    fn cell(&self, figure: f64) -> String {
        match figure.is_finite() {
            true => format!("{figure:.digits$}", digits = self.digits),
            false => "∞".to_string(),
        }
    }
}

/// The layouts of a surface, each with its metrics in the mean over the seeds: the cells' figures.
fn layouts(page: &Page, surface: &str) -> Vec<(String, Figures)> {
    let ours = [
        ("raw map", raw()),
        ("finished", finished()),
        ("direct", direct()),
    ];
    let ours = ours.into_iter().filter_map(|(label, (trial, kind))| {
        let figures = own(page, surface, &trial, kind)?;
        Some((label.to_string(), figures))
    });
    let peers = page.peers.iter().filter(|layout| layout.surface == surface);
    let peers = peers.filter_map(|layout| {
        let metrics = layout.metrics.as_ref()?;
        Some((
            layout.peer.clone(),
            COLUMNS.map(|column| (column.value)(metrics)),
        ))
    });
    ours.chain(peers).collect()
}

fn own(page: &Page, surface: &str, trial: &str, kind: LayoutKind) -> Option<Figures> {
    let mut figures = [0.0; COLUMNS.len()];
    for (figure, column) in figures.iter_mut().zip(&COLUMNS) {
        let metrics = page
            .records(surface, trial)
            .filter_map(|record| record.metrics(kind));
        *figure = Spread::of(metrics.map(column.value))?.mean;
    }
    Some(figures)
}

/// The medians of each way to lay out, and all figures of each surface.
pub fn section(page: &Page) -> String {
    let mut all: Vec<(String, Vec<Figures>)> = Vec::new();
    let titles = COLUMNS.iter().map(|column| column.title);
    let mut each = Table::new(
        ["model", "layout"]
            .into_iter()
            .chain(titles.clone())
            .chain(["run"]),
        2,
    );
    for surface in page.tried() {
        for (label, figures) in layouts(page, surface.name) {
            let cells = COLUMNS
                .iter()
                .zip(figures)
                .map(|(column, figure)| column.cell(figure));
            let row = [title(surface), label.clone()].into_iter().chain(cells);
            each.push(row.chain([page.run(surface.name)]).collect());
            if matches!(surface.kind, Kind::Open | Kind::Closed) {
                match all.iter_mut().find(|(known, _)| *known == label) {
                    Some((_, rows)) => rows.push(figures),
                    None => all.push((label, vec![figures])),
                }
            }
        }
    }
    let mut medians = Table::new(["layout", "models"].into_iter().chain(titles), 1);
    for (label, rows) in all {
        let mut row = vec![label, rows.len().to_string()];
        for (i, column) in COLUMNS.iter().enumerate() {
            let figure = median(rows.iter().map(|figures| figures[i]));
            row.push(figure.map_or(String::new(), |figure| column.cell(figure)));
        }
        medians.push(row);
    }
    format!(
        "## Beside conformality\n\n\
         Each metric alone is easy to win: with many charts nothing is distorted, and with overlaps nothing \
         need be cut. Medians over the open and closed models, as many as each way laid out:\n\n{medians}\n\
         <details><summary>All layouts of all models</summary>\n\n{each}\n</details>"
    )
}
