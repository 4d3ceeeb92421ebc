//! The pictures of a page.

use std::fmt::Write;
use std::path::Path;

use super::super::plan::{Trial, Variant};
use super::super::record::{Store, save};
use super::super::surfaces::SuiteSurface;
use super::{Page, title};
use crate::failure::Failure;
use fam_core::training::Ablation;

/// The seed whose maps are drawn.
const SEED: u64 = 0;

/// The trials of a surface that are drawn, with what the caption says of each.
fn drawn(page: &Page, surface: &SuiteSurface) -> Vec<(Trial, String)> {
    let variants = Variant::ablations().into_iter().chain(Variant::noises());
    let mut trials: Vec<Trial> = Vec::new();
    for variant in variants {
        let trial = Trial::Trained(variant, SEED);
        let is_known = trials.contains(&trial);
        let name = variant.name();
        let mut records = page.records(surface.name, &name);
        if !is_known && records.any(|record| record.seed == Some(SEED)) {
            trials.push(trial);
        }
    }
    let caption = |trial: Trial| {
        let of = title(surface);
        match trial {
            Trial::Trained(Variant::Without(Ablation::DeformBranch), _) => {
                format!("{of}, without 2D→3D→2D")
            }
            Trial::Trained(Variant::Without(Ablation::UnwrapBranch), _) => {
                format!("{of}, without 3D→2D→3D")
            }
            Trial::Trained(Variant::Without(Ablation::CutNet), _) => {
                format!("{of}, without Cut-Net")
            }
            Trial::Trained(Variant::Noise(percent), _) => format!("{of}, {percent} % of noise"),
            _ => of,
        }
    };
    trials
        .into_iter()
        .map(|trial| (trial, caption(trial)))
        .collect()
}

/// Copies the pictures of generated surfaces into the folder and makes the section that shows them.
pub fn copy(page: &Page, store: &Store, folder: &Path) -> Result<String, Failure> {
    let name = folder
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut text = String::new();
    for surface in page.tried().filter(|surface| surface.is_generated()) {
        for (trial, caption) in drawn(page, surface) {
            let picture = store.picture(surface.name, trial);
            let Ok(bytes) = std::fs::read(&picture) else {
                continue;
            };
            std::fs::create_dir_all(folder)
                .map_err(|error| Failure::work(format!("{}: {error}", folder.display())))?;
            let file = picture
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            save(&folder.join(&file), &bytes)?;
            let line = writeln!(text, "\n{caption}:\n\n![{caption}]({name}/{file})");
            line.map_err(Failure::work)?;
        }
    }
    Ok(match text.is_empty() {
        true => text,
        false => format!(
            "## Pictures\n\n\
             As the paper's figures: the surface, the UVs of the raw map coloured by the normal, a checker \
             texture laid on by them, and where the map is torn. Generated surfaces, seed {SEED}.\n{text}"
        ),
    })
}
