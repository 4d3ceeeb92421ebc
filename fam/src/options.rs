use std::time::Duration;

use fam_core::atlas::Checkpoint;
use fam_core::training::TrainingConfig;
use fam_layout::{LayoutConfig, Marks};
use fam_surface::seams::SeamRule;

use crate::kept::Kept;
use crate::method::{FinishMode, Method};
use crate::parting::Parting;

/// How a surface is to be unwrapped. The default lays out meshes directly.
#[derive(Debug, Clone)]
pub struct Options {
    /// With or without networks.
    pub method: Method,
    /// How networks are trained, where any are.
    pub training: TrainingConfig,
    /// Whether the map that training ends with becomes a layout.
    pub finish: FinishMode,
    /// What the layout is to reach.
    pub layout: LayoutConfig,
    /// Which triangles belong together.
    pub parting: Parting,
    /// Edges to cut along, and not to.
    pub marks: Marks,
    /// UVs that are there and stay, for the direct method: what is new is laid out beside them.
    pub kept: Option<Kept>,
    /// What counts as torn in a cloud or a raw map.
    pub seam_rule: SeamRule,
    /// About how long it may take. Training is planned for it; the layout is no longer refined
    /// when it is over. None: as long as it takes.
    pub time_budget: Option<Duration>,
    /// The training to resume, if any. The surface and the parting must be those of the checkpoint, and
    /// so must `training`, unless it was planned for a time budget.
    pub resume: Option<Checkpoint>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            training: TrainingConfig::fast(),
            finish: FinishMode::Full,
            layout: LayoutConfig::default(),
            parting: Parting::default(),
            marks: Marks::default(),
            kept: None,
            seam_rule: SeamRule::Spacing,
            time_budget: None,
            resume: None,
        }
    }
}
