use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use crate::failure::Failure;

/// Figures of others, by the names of meshes.
#[derive(Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    #[serde(default)]
    pub columns: Vec<Column>,
}

/// One column of the table.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    pub title: String,
    /// Where the figures are from.
    pub source: String,
    pub figures: BTreeMap<String, f64>,
}

impl Reference {
    /// The figures of a TOML file.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let fail = |reason: String| Failure::input(format!("{}: {reason}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
        toml::from_str(&text).map_err(|error| {
            fail(
                error
                    .message()
                    .split_whitespace()
                    .collect::<Vec<_>>()
                    .join(" "),
            )
        })
    }
}

impl Column {
    /// The figure of a mesh, whatever folder it is in.
    pub fn figure(&self, name: &str) -> Option<f64> {
        let own = Path::new(name).file_name()?.to_str()?;
        self.figures.get(own).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_found_by_the_name_of_the_mesh() {
        let text = "[[columns]]\ntitle = \"t\"\nsource = \"s\"\n[columns.figures]\ncow = 0.25\n";
        let reference: Reference = toml::from_str(text).unwrap();
        let column = &reference.columns[0];
        assert_eq!(column.figure("cow"), Some(0.25));
        assert_eq!(column.figure("farm/cow"), Some(0.25));
        assert_eq!(column.figure("cow/calf"), None);
        assert!(toml::from_str::<Reference>("[[column]]\n").is_err());
    }

    /// The figures beside the documentation have the form that is read.
    #[test]
    fn the_file_with_published_figures_is_read() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference-figures.toml");
        let columns = Reference::read(&docs).unwrap().columns;
        assert_eq!(columns.len(), 2);
        assert_eq!(columns[0].figure("cow"), Some(0.210));
        assert_eq!(columns[1].figure("cow"), Some(5.66));
    }
}
