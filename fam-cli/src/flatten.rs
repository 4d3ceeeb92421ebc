//! Training on the chosen backend.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::{self, Division, Part};
use fam_core::training::{Strategies, TrainingConfig};
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};
use fam_surface::{Components, Surface};

use crate::backend::Job;
use crate::failure::Failure;
use crate::progress::TrainingProgress;
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

/// A flattened surface, off the backend: the raw map.
pub struct Flattened {
    /// Of a mesh.
    pub components: Option<Components>,
    /// The UVs of each component's vertices (of all points of a cloud).
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// The edges between components.
    pub cuts: Vec<[u32; 2]>,
    pub parts: Vec<Part>,
    /// Where the raw map is torn, and the cuts.
    pub seams: Seams,
    /// Of the trained components.
    pub thresholds: Vec<Option<SeamThreshold>>,
    pub model: Vec<u8>,
}

impl Job for Flatten<'_> {
    type Output = Result<Flattened, Failure>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let division = Division {
            labels: &self.parting.labels,
            squares: &self.parting.squares,
        };
        let mut progress = TrainingProgress::new(self.quiet, self.config.steps());
        let flattened = atlas::flatten::<B>(
            self.config,
            self.surface,
            division,
            device,
            strategies,
            |now| {
                progress.step(&now);
                if self.stop.load(Ordering::Relaxed) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        );
        progress.finish();
        let flattened = flattened.map_err(Failure::input)?;
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
        Ok(Flattened {
            seams,
            thresholds,
            model: flattened.atlas.to_safetensors().map_err(Failure::work)?,
            components: flattened.components,
            uvs: flattened.uvs,
            cuts: flattened.cuts,
            parts: flattened.parts,
        })
    }
}
