//! The page of a suite: its tables, what they say of the networks' worth, and pictures; beside it the
//! same as JSON.

mod ablations;
mod details;
mod markdown;
mod new_points;
mod pictures;
mod spread;
mod tables;
mod worth;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use fam_surface::metrics::Metrics;
use serde_json::json;

use super::peers::PeerLayout;
use super::plan::{Trial, Variant};
use super::record::{Circumstances, LayoutKind, Measured, Record, Store, save};
use super::surfaces::{self, Kind, SuiteSurface};
use crate::failure::Failure;
use spread::Spread;

/// What the page is made of.
pub struct Page<'a> {
    /// The name of the suite.
    pub suite: String,
    pub records: Vec<&'a Record>,
    pub peers: &'a [PeerLayout],
}

impl Page<'_> {
    /// Writes the page, its JSON, and the pictures in a folder of their own.
    pub fn write(&self, page: &Path, store: &Store) -> Result<(), Failure> {
        let folder = page.with_extension("");
        let pictures = pictures::copy(self, store, &folder)?;
        save(&page.with_extension("json"), self.json()?.as_bytes())?;
        save(page, self.markdown(&pictures)?.as_bytes())
    }

    /// All records and layouts of peers.
    pub fn json(&self) -> Result<String, Failure> {
        let all = json!({"suite": self.suite, "records": self.records, "peers": self.peers});
        let mut text = serde_json::to_string_pretty(&all).map_err(Failure::work)?;
        text.push('\n');
        Ok(text)
    }

    fn markdown(&self, pictures: &str) -> Result<String, Failure> {
        let mut text = String::new();
        let sections = [
            self.introduction(),
            tables::meshes(self),
            tables::clouds(self),
            tables::self_intersection(self),
            tables::time(self),
            ablations::noise(self),
            ablations::ablations(self),
            new_points::section(self),
            tables::hard(self),
            worth::section(self),
            details::section(self),
            pictures.to_string(),
        ];
        for section in sections {
            writeln!(text, "{}\n", section.trim_end()).map_err(Failure::work)?;
        }
        Ok(format!("{}\n", text.trim_end()))
    }

    fn introduction(&self) -> String {
        let mut text = format!(
            "# Evaluation\n\n\
             The tables of the paper, made again by `fam evaluate --suite {}`. A *raw map* is what training \
             ends with: one UV for each vertex, so that triangles are stretched where the map tears the \
             surface. A *finished* layout is cut where the map and the geometry say so, without flips and \
             overlaps; a *direct* one is cut by the geometry alone, without networks. Figures of the networks \
             are means over the seeds, where there are several with the range in parentheses. [Metrics](metrics.md) says \
             what is measured; lower is better, except for coverage.\n\n\
             *Printed* figures are the paper's. Models marked with ∘ are generated surfaces of the same \
             kind, not the paper's models; those without the mark are public models of the same name, which \
             need not be the same files. Empty cells were not run.\n\n",
            self.suite
        );
        let presets = self
            .records
            .iter()
            .filter_map(|r| r.circumstances.preset.as_deref());
        if presets.into_iter().any(|preset| preset.starts_with("fast")) {
            text.push_str(
                "The preset `fast` is not the training of the paper, which is `--preset paper`: 10,000 \
                 iterations of AdamW on 10,000 points, networks of width 512. `fast` has smaller networks, \
                 SOAP for AdamW, several starts of which the best goes on, and the loss ℓ_flat besides.\n\n",
            );
        }
        let titles = ["run", "machine", "commit", "preset", "backend"];
        let mut table = markdown::Table::new(titles, 5);
        for (key, circumstances) in self.keys() {
            let commit = circumstances.commit.clone();
            let (preset, backend) = match &circumstances.preset {
                Some(preset) => (preset.clone(), circumstances.backend.clone()),
                None => ("direct layouts".to_string(), String::new()),
            };
            table.push(vec![
                key,
                circumstances.machine.clone(),
                commit.unwrap_or_else(|| format!("version {}", circumstances.version)),
                preset,
                backend,
            ]);
        }
        text.push_str(&table.to_string());
        let versions = |peer: &str| {
            let mut layouts = self.peers.iter().filter(|layout| layout.peer == peer);
            layouts
                .find_map(|layout| layout.report.version.clone())
                .unwrap_or_default()
        };
        let peers: Vec<String> = self
            .peer_names()
            .into_iter()
            .map(|peer| format!("{peer} {}", versions(peer)).trim().to_string())
            .collect();
        if !peers.is_empty() {
            text.push_str(&format!(
                "\nOther tools, measured on the files that they wrote: {}. Their times are of the machine \
                 on which they were called.\n",
                peers.join(", ")
            ));
        }
        text
    }

    /// What the records were measured on, each with a letter.
    fn keys(&self) -> Vec<(String, &Circumstances)> {
        let all: BTreeSet<&Circumstances> = self.records.iter().map(|r| &r.circumstances).collect();
        let letter = |i: usize| match u8::try_from(i) {
            Ok(i) if i < 26 => char::from(b'a' + i).to_string(),
            _ => format!("{}", i + 1),
        };
        all.into_iter()
            .enumerate()
            .map(|(i, c)| (letter(i), c))
            .collect()
    }

    /// The letters of what a surface was measured on.
    fn run(&self, surface: &str) -> String {
        let of_surface = |circumstances: &Circumstances| {
            let mut records = self.records.iter();
            records.any(|r| r.surface == surface && r.circumstances == *circumstances)
        };
        let keys = self
            .keys()
            .into_iter()
            .filter(|(_, circumstances)| of_surface(circumstances));
        keys.map(|(key, _)| key).collect::<Vec<_>>().join(" ")
    }

    /// The surfaces of a kind that the page has rows for.
    fn surfaces(&self, kind: Kind) -> impl Iterator<Item = &'static SuiteSurface> {
        surfaces::all()
            .iter()
            .filter(move |surface| surface.kind == kind)
    }

    /// All surfaces of which there is a record.
    fn tried(&self) -> impl Iterator<Item = &'static SuiteSurface> {
        let tried = |name: &str| self.records.iter().any(|record| record.surface == name);
        surfaces::all()
            .iter()
            .filter(move |surface| tried(surface.name))
    }

    /// The records of a trial of a surface, one for each seed.
    fn records<'a>(&'a self, surface: &'a str, trial: &'a str) -> impl Iterator<Item = &'a Record> {
        let records = self.records.iter().copied();
        records.filter(move |record| record.surface == surface && record.trial == trial)
    }

    /// What was measured in them.
    fn measured<'a>(
        &'a self,
        surface: &'a str,
        trial: &'a str,
    ) -> impl Iterator<Item = &'a Measured> {
        self.records(surface, trial).filter_map(Record::measured)
    }

    /// A metric of a layout over the seeds.
    fn metric(
        &self,
        surface: &str,
        (trial, kind): (&str, LayoutKind),
        value: impl Fn(&Metrics) -> f64,
    ) -> Option<Spread> {
        let metrics = self
            .records(surface, trial)
            .filter_map(|record| record.metrics(kind));
        Spread::of(metrics.map(value))
    }

    /// The layout of a surface by a peer, if it was tried.
    fn peer(&self, peer: &str, surface: &str) -> Option<&PeerLayout> {
        self.peers
            .iter()
            .find(|layout| layout.peer == peer && layout.surface == surface)
    }

    /// The peers that were tried.
    fn peer_names(&self) -> BTreeSet<&str> {
        self.peers
            .iter()
            .map(|layout| layout.peer.as_str())
            .collect()
    }

    /// Why a trial failed, if it did.
    fn failure(&self, surface: &str, trial: &str) -> Option<String> {
        self.records(surface, trial)
            .find_map(|record| match &record.outcome {
                super::record::Outcome::Failed(reason) => Some(format!("failed: {reason}")),
                super::record::Outcome::Done(_) => None,
            })
    }
}

/// The raw map of the whole method.
fn raw() -> (String, LayoutKind) {
    (Variant::Whole.name(), LayoutKind::Raw)
}

/// The layout that it leads to.
fn finished() -> (String, LayoutKind) {
    (Variant::Whole.name(), LayoutKind::Finished)
}

/// The layout without networks.
fn direct() -> (String, LayoutKind) {
    (Trial::Direct.name(), LayoutKind::Direct)
}

/// The name of a surface in a table.
fn title(surface: &SuiteSurface) -> String {
    match surface.is_generated() {
        true => format!("{} ∘", surface.name),
        false => surface.name.to_string(),
    }
}

/// A figure with three digits; empty if there is none.
fn cell(figure: Option<Spread>) -> String {
    figure.map_or(String::new(), |figure| format!("{figure:.3}"))
}

/// Seconds with one digit; empty if there are none.
fn seconds(figure: Option<Spread>) -> String {
    figure.map_or(String::new(), |figure| format!("{:.1}", figure.mean))
}

/// A printed figure.
fn printed(figure: Option<&f64>) -> String {
    figure.map_or(String::new(), |figure| format!("*{figure:.3}*"))
}
