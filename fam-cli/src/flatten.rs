//! Flattening on the chosen backend.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::{self, Division, Part};
use fam_core::seams::{SeamRule, SeamThreshold, Seams};
use fam_core::surface::{Components, Surface};
use fam_core::training::TrainingConfig;
use fam_io::Uvs;

use crate::backend::Job;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::surface::Parting;

/// What to flatten, and how.
pub struct Flatten<'a> {
    pub config: &'a TrainingConfig,
    pub surface: &'a Surface,
    pub parting: &'a Parting,
    pub seam_rule: SeamRule,
    pub quiet: bool,
    pub stop: &'a AtomicBool,
}

/// A flattened surface, off the backend.
pub struct Flattened {
    pub uvs: Uvs,
    /// Of a mesh.
    pub components: Option<Components>,
    pub parts: Vec<Part>,
    pub seams: Seams,
    /// Of the trained components.
    pub thresholds: Vec<Option<SeamThreshold>>,
    pub model: Vec<u8>,
}

impl Job for Flatten<'_> {
    type Output = Result<Flattened, Failure>;

    fn run<B: AutodiffBackend>(self, device: &B::Device) -> Self::Output {
        let division = Division {
            labels: &self.parting.labels,
            squares: &self.parting.squares,
        };
        let mut progress = Progress::new(self.quiet, self.config.iterations);
        let flattened = atlas::flatten::<B>(self.config, self.surface, division, device, |now| {
            progress.step(&now);
            if self.stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        progress.finish();
        let mut flattened = flattened.map_err(Failure::input)?;
        // Nothing was learnt where already the first step failed.
        let hopeless = |part: &Part| part.last.is_none() && part.error.is_some();
        if let Some(error) = flattened
            .parts
            .iter()
            .find(|part| hopeless(part))
            .and_then(|part| part.error.clone())
        {
            return Err(Failure::work(error));
        }
        let (seams, thresholds) = flattened
            .seams(self.surface, self.seam_rule)
            .map_err(Failure::work)?;
        let uvs = match (self.surface, &flattened.components) {
            (Surface::Mesh(mesh), Some(components)) => {
                let uvs = components.uv_map(mesh, &flattened.uvs);
                Uvs::Mesh(uvs.map_err(Failure::work)?)
            }
            _ => Uvs::Points(flattened.uvs.swap_remove(0)),
        };
        Ok(Flattened {
            uvs,
            seams,
            thresholds,
            model: flattened.atlas.to_safetensors().map_err(Failure::work)?,
            components: flattened.components,
            parts: flattened.parts,
        })
    }
}
