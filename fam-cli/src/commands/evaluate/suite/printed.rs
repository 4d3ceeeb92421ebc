//! Figures that the paper prints.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

/// The figures, with their source in the file.
pub static PRINTED: LazyLock<Printed> =
    LazyLock::new(|| toml::from_str(include_str!("printed.toml")).expect("the figures are TOML"));

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Printed {
    pub conformality: Conformality,
    pub self_intersection: SelfIntersection,
    pub minutes: Minutes,
}

/// In radians, by the name of the model.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Conformality {
    pub fam: BTreeMap<String, f64>,
    pub slim: BTreeMap<String, f64>,
    pub fbcp_pc: BTreeMap<String, f64>,
}

/// Pairs of triangles that overlap, in percent of all, in the mean over the models.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SelfIntersection {
    pub fam_open: f64,
    pub slim_open: f64,
    pub fam_closed: f64,
}

/// How long one model took.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Minutes {
    /// On a GPU.
    pub fam: f64,
    pub slim: BTreeMap<String, f64>,
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::super::reference::Reference;
    use super::super::surfaces;
    use super::*;

    #[test]
    fn every_printed_figure_has_its_row() {
        let printed = &PRINTED.conformality;
        let figures = [
            &printed.fam,
            &printed.slim,
            &printed.fbcp_pc,
            &PRINTED.minutes.slim,
        ];
        for name in figures.into_iter().flat_map(BTreeMap::keys) {
            assert!(
                surfaces::all().iter().any(|surface| surface.name == name),
                "{name}"
            );
        }
    }

    /// The table of one's own meshes has the same figures from a file of the user's.
    #[test]
    fn the_file_of_reference_figures_agrees() {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../docs/reference-figures.toml"
        );
        let columns = Reference::read(Path::new(file)).unwrap().columns;
        let paper = &columns[0];
        assert_eq!(paper.title, "conformality, paper");
        for (name, figure) in &paper.figures {
            assert_eq!(PRINTED.conformality.fam.get(name), Some(figure), "{name}");
        }
    }
}
