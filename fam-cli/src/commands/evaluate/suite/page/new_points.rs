//! The map at points that training did not see.

use super::super::unseen::Unseen;
use super::markdown::Table;
use super::spread::Spread;
use super::tables::conformality;
use super::{Page, raw, title};

/// The map on other meshes of the same surfaces.
pub fn section(page: &Page) -> String {
    let titles = [
        "model",
        "own vertices",
        "remeshed",
        "interpolated",
        "distance, %",
        "95th percentile, %",
        "decimated",
        "interpolated",
        "distance, %",
        "95th percentile, %",
        "run",
    ];
    let mut table = Table::new(titles, 1);
    let (whole, kind) = raw();
    for surface in page.tried() {
        let mean = |version: &str, value: fn(&Unseen) -> f64| {
            let all = page
                .measured(surface.name, &whole)
                .flat_map(|measured| &measured.unseen);
            let own = all.filter(|unseen| unseen.version == version);
            Spread::of(own.map(value)).map(|spread| spread.mean)
        };
        let mut row = vec![title(surface)];
        let own = page.metric(surface.name, (&whole, kind), conformality);
        row.push(own.map_or(String::new(), |own| format!("{:.3}", own.mean)));
        for version in ["remeshed", "decimated"] {
            for (figure, digits) in [
                (mean(version, |unseen| unseen.conformality), 3),
                (mean(version, |unseen| unseen.interpolated), 3),
                (mean(version, |unseen| 100.0 * unseen.mean_distance), 2),
                (mean(version, |unseen| 100.0 * unseen.p95_distance), 2),
            ] {
                row.push(figure.map_or(String::new(), |figure| format!("{figure:.digits$}")));
            }
        }
        row.push(page.run(surface.name));
        if row[2..row.len() - 1].iter().any(|cell| !cell.is_empty()) {
            table.push(row);
        }
    }
    format!(
        "## Points that training did not see\n\n\
         The raw map on other meshes of the same surface: *remeshed* has about as many new, evenly spread \
         vertices as the mesh, *decimated* about a quarter (at least 200). The networks need the positions of \
         these vertices alone; *interpolated* are the UVs that the triangles of the mesh would give them. \
         Conformality is measured on the new triangles, all columns on the same. The distance is between the \
         networks' UVs and the interpolated ones, in percent of the side of the UV square; vertices on torn \
         triangles do not count. Surfaces of one component.\n\n{table}"
    )
}
