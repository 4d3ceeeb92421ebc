//! The raw map of a surface.

use std::ops::ControlFlow;

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::{self, Flattened, Start};
use fam_core::training::Strategies;
use fam_surface::Surface;
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};

use crate::error::UnwrapError;
use crate::parting::Parting;

/// Trained networks, and where their map is torn.
#[derive(Debug)]
pub struct Trained<B: AutodiffBackend> {
    /// The raw map.
    pub flattened: Flattened<B::InnerBackend>,
    /// Where the raw map is torn, and the cuts between components.
    pub seams: Seams,
    /// What counted as torn in each component; none where no network was trained.
    pub thresholds: Vec<Option<SeamThreshold>>,
}

/// Trains the networks on a surface.
///
/// # Errors
/// The surface or the configuration cannot be trained on, or already the first step failed.
pub fn train<B: AutodiffBackend>(
    start: Start,
    surface: &Surface,
    parting: &Parting,
    seam_rule: SeamRule,
    device: &B::Device,
    strategies: Strategies<B>,
    observe: impl FnMut(atlas::Progress) -> ControlFlow<()>,
) -> Result<Trained<B>, UnwrapError> {
    let division = parting.division();
    let flattened = atlas::flatten::<B>(start, surface, division, device, strategies, observe)
        .map_err(UnwrapError::Training)?;
    let mut hopeless = flattened.parts.iter().filter(|part| part.last.is_none());
    if let Some(error) = hopeless.find_map(|part| part.error.clone()) {
        return Err(UnwrapError::NothingLearnt(error));
    }
    let (seams, thresholds) = flattened.seams(surface, seam_rule)?;
    Ok(Trained {
        flattened,
        seams,
        thresholds,
    })
}
