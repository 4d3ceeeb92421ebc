use std::collections::BTreeMap;
use std::fmt;

use fam_surface::metrics::Metrics;
use serde::{Serialize, Serializer};
use serde_json::json;

use super::reference::Reference;

/// What came of every mesh; displayed as a Markdown table.
pub struct Table {
    /// How and on what it was made.
    circumstances: String,
    reference: Reference,
    meshes: Vec<(String, Outcome)>,
}

/// What came of one mesh.
pub enum Outcome {
    Done {
        /// None if the networks were trained before.
        training_seconds: Option<f64>,
        rows: Vec<Row>,
    },
    Failed {
        reason: String,
    },
}

/// One layout of a mesh.
#[derive(Debug, Serialize)]
pub struct Row {
    pub layout: String,
    /// None for the raw map.
    pub finishing_seconds: Option<f64>,
    pub metrics: Metrics,
}

impl Outcome {
    pub fn failed(reason: String) -> Self {
        Self::Failed { reason }
    }
}

impl Table {
    pub fn new(circumstances: String, reference: Reference) -> Self {
        Self {
            circumstances,
            reference,
            meshes: Vec::new(),
        }
    }

    pub fn push(&mut self, name: String, outcome: Outcome) {
        self.meshes.push((name, outcome));
    }

    /// How many meshes there are.
    pub fn len(&self) -> usize {
        self.meshes.len()
    }

    /// How many meshes failed.
    pub fn failed(&self) -> usize {
        let failed = |(_, outcome): &&(String, Outcome)| matches!(outcome, Outcome::Failed { .. });
        self.meshes.iter().filter(failed).count()
    }

    /// The figures of others for a mesh, one for each of their columns.
    fn figures(&self, name: &str) -> Vec<Option<f64>> {
        let columns = self.reference.columns.iter();
        columns.map(|column| column.figure(name)).collect()
    }
}

const COLUMNS: [&str; 13] = [
    "model",
    "layout",
    "triangles",
    "training, s",
    "finishing, s",
    "charts",
    "seam length",
    "conformality",
    "area distortion",
    "symmetric Dirichlet",
    "flips",
    "overlaps",
    "coverage, %",
];

impl Row {
    fn cells(&self, name: &str, training_seconds: Option<f64>) -> Vec<String> {
        let seconds = |s: Option<f64>| s.map_or(String::new(), |s| format!("{s:.1}"));
        let metrics = &self.metrics;
        vec![
            cell(name),
            cell(&self.layout),
            metrics.triangles.to_string(),
            seconds(training_seconds),
            seconds(self.finishing_seconds),
            metrics.charts.to_string(),
            format!("{:.2}", metrics.seam_length),
            format!("{:.3}", metrics.conformality),
            decimal(metrics.area_distortion),
            decimal(metrics.symmetric_dirichlet),
            metrics.flipped_triangles.to_string(),
            metrics.overlapping_pairs.to_string(),
            format!("{:.0}", 100.0 * metrics.uv_coverage),
        ]
    }
}

fn decimal(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.3}")
    } else {
        "∞".to_string()
    }
}

/// Text that keeps to its cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace(['\n', '\r'], " ")
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line =
            |f: &mut fmt::Formatter<'_>, cells: &[String]| writeln!(f, "| {} |", cells.join(" | "));
        let titles = self
            .reference
            .columns
            .iter()
            .map(|column| cell(&column.title));
        let titles: Vec<String> = COLUMNS
            .map(String::from)
            .into_iter()
            .chain(titles)
            .collect();
        line(f, &titles)?;
        let rule = |(i, _): (usize, &String)| if i < 2 { "---" } else { "---:" }.to_string();
        line(f, &titles.iter().enumerate().map(rule).collect::<Vec<_>>())?;
        for (name, outcome) in &self.meshes {
            match outcome {
                Outcome::Done {
                    training_seconds,
                    rows,
                } => {
                    let figures = self.figures(name).into_iter();
                    let figures: Vec<String> = figures
                        .map(|figure| figure.map_or(String::new(), |figure| figure.to_string()))
                        .collect();
                    for row in rows {
                        let mut cells = row.cells(name, *training_seconds);
                        cells.extend_from_slice(&figures);
                        line(f, &cells)?;
                    }
                }
                Outcome::Failed { reason } => {
                    let mut cells = vec![String::new(); titles.len()];
                    cells[0] = cell(name);
                    cells[1] = format!("failed: {}", cell(reason));
                    line(f, &cells)?;
                }
            }
        }
        writeln!(f, "\n{}", self.circumstances)?;
        for column in &self.reference.columns {
            writeln!(f, "\n*{}*: {}", column.title, column.source)?;
        }
        Ok(())
    }
}

impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mesh = |(name, outcome): &(String, Outcome)| match outcome {
            Outcome::Done {
                training_seconds,
                rows,
            } => {
                let titles = self.reference.columns.iter().map(|column| &column.title);
                let figures = titles.zip(self.figures(name));
                let figures: BTreeMap<&String, f64> = figures
                    .filter_map(|(t, figure)| Some((t, figure?)))
                    .collect();
                json!({
                    "model": name,
                    "training_seconds": training_seconds,
                    "rows": rows,
                    "reference": figures,
                })
            }
            Outcome::Failed { reason } => json!({"model": name, "reason": reason}),
        };
        let meshes: Vec<_> = self.meshes.iter().map(mesh).collect();
        json!({"circumstances": self.circumstances, "models": meshes}).serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::{UvMap, shapes};

    #[test]
    fn a_layout_has_a_line_and_a_failure_its_reason() {
        let sheet = shapes::rectangle(2.0, 1.0, 2, 1);
        let uvs = sheet.positions().iter();
        let uvs = uvs.map(|p| [p[0] as f32, p[1] as f32]).collect();
        let map = UvMap::new(uvs, sheet.triangles().to_vec()).unwrap();
        let text = "[[columns]]\ntitle = \"theirs\"\nsource = \"a book\"\nfigures.sheet = 0.5\n";
        let mut table = Table::new("Made here.".to_string(), toml::from_str(text).unwrap());
        let row = Row {
            layout: "finished".to_string(),
            finishing_seconds: Some(1.25),
            metrics: Metrics::measure(&sheet, &map).unwrap(),
        };
        let done = Outcome::Done {
            training_seconds: None,
            rows: vec![row],
        };
        table.push("sheet".to_string(), done);
        table.push("b".to_string(), Outcome::failed("it is | bad".to_string()));
        let text = table.to_string();
        let lines: Vec<&str> = text.lines().collect();
        let titles = format!("| {} | theirs |", COLUMNS.join(" | "));
        assert_eq!(lines[0], titles);
        assert_eq!(
            lines[2],
            "| sheet | finished | 4 |  | 1.2 | 1 | 0.00 | 0.000 | 1.000 | 4.000 | 0 | 0 | 50 | 0.5 |"
        );
        assert!(lines[3].starts_with("| b | failed: it is \\| bad |"));
        assert_eq!(lines[4..], ["", "Made here.", "", "*theirs*: a book"]);
        assert_eq!(table.failed(), 1);
        let json = serde_json::to_value(&table).unwrap();
        assert_eq!(json["models"][0]["reference"]["theirs"], 0.5);
        assert_eq!(json["models"][0]["rows"][0]["metrics"]["charts"], 1);
        assert_eq!(json["models"][1]["reason"], "it is | bad");
    }
}
