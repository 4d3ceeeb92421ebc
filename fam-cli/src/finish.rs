//! From the raw map of a surface to the UVs that are written.

use std::ops::ControlFlow;

use fam_io::Uvs;
use fam_layout::{
    CloudLayout, LayoutConfig, MeshInput, MeshLayout, Progress, lay_out, lay_out_cloud,
};
use fam_surface::seams::{SeamRule, SeamThreshold, Seams};
use fam_surface::{Components, PointCloud, Surface, SurfaceError, UvMap};

use crate::budget::Stop;
use crate::config::{FinishMode, Finishing};
use crate::failure::Failure;
use crate::flatten::Flattened;
use crate::marks::{Marked, MarksReport};
use crate::progress::FinishingProgress;

/// What to finish, and how.
pub struct Finish<'a> {
    pub settings: &'a Finishing,
    pub surface: &'a Surface,
    /// The UV square of every label.
    pub squares: &'a [u32],
    /// Where the mesh is to be cut and where not.
    pub marked: &'a Marked,
    pub seam_rule: SeamRule,
    pub quiet: bool,
    pub stop: Stop<'a>,
}

/// The UVs of a surface and where they cut it.
pub struct Layout {
    pub uvs: Uvs,
    pub seams: Seams,
    /// What counted as torn, where the seams are tears.
    pub thresholds: Vec<Option<SeamThreshold>>,
    /// None if the map was left as it is.
    pub finished: Option<Finished>,
}

/// How a surface was finished.
pub struct Finished {
    pub config: LayoutConfig,
    pub stopped: bool,
    /// What came of marks, if there were any.
    pub marks: Option<MarksReport>,
    pub outcome: Outcome,
}

/// What finishing came to.
pub enum Outcome {
    Mesh {
        raw: UvMap,
        atlas: MeshLayout,
    },
    Cloud {
        /// Points with the UVs of the raw map.
        unreached: usize,
        /// The surface that was found.
        atlas: MeshLayout,
    },
}

impl Finish<'_> {
    /// Finishes the raw map, or leaves it as it is.
    pub fn run(&self, flattened: &Flattened) -> Result<Layout, Failure> {
        let layout = match (self.surface, &flattened.components) {
            (Surface::Mesh(_), Some(components)) => self.mesh(flattened, components),
            (Surface::PointCloud(cloud), _) => self.cloud(flattened, cloud),
            _ => return Err(Failure::work("the mesh has no components")),
        };
        layout.map_err(Failure::work)
    }

    fn mesh(&self, flattened: &Flattened, components: &Components) -> Result<Layout, SurfaceError> {
        let raw = components.uv_map(&components.vertex_maps(&flattened.uvs)?)?;
        if self.settings.mode == FinishMode::None {
            return Ok(left(flattened, Uvs::Mesh(raw)));
        }
        let unfinished = MeshInput {
            components,
            map: Some(&flattened.uvs),
            squares: self.squares,
            marks: &self.marked.marks,
        };
        let watched = Watched::new(self.quiet, self.stop);
        let atlas = watched.mesh(&self.settings.config, &unfinished);
        let maps: Vec<UvMap> = atlas.components.iter().map(|c| c.uvs.clone()).collect();
        let seams = Seams::of_components(components, &maps, &flattened.cuts)?;
        let marks = self.marked.report(&seams.edges);
        Ok(Layout {
            uvs: Uvs::Mesh(components.uv_map(&maps)?),
            seams,
            thresholds: vec![None; maps.len()],
            finished: Some(Finished {
                marks,
                ..self.finished(Outcome::Mesh { raw, atlas })
            }),
        })
    }

    fn cloud(&self, flattened: &Flattened, cloud: &PointCloud) -> Result<Layout, SurfaceError> {
        let raw = &flattened.uvs[0];
        if self.settings.mode == FinishMode::None {
            return Ok(left(flattened, Uvs::Points(raw.clone())));
        }
        let points = cloud.points();
        let watched = Watched::new(self.quiet, self.stop);
        let CloudLayout {
            uvs,
            unreached,
            atlas,
        } = watched.cloud(&self.settings.config, points, raw);
        let normalization = self.surface.normalization()?;
        let placed: Vec<_> = points.iter().map(|&p| normalization.apply(p)).collect();
        let threshold = SeamThreshold::of(self.seam_rule, &placed, &uvs);
        let in_input_units = SeamThreshold {
            spacing: threshold.spacing.map(|s| s * normalization.radius),
            ..threshold
        };
        Ok(Layout {
            seams: Seams::of_points(&placed, &uvs, threshold),
            thresholds: vec![Some(in_input_units)],
            uvs: Uvs::Points(uvs),
            finished: Some(self.finished(Outcome::Cloud { unreached, atlas })),
        })
    }

    fn finished(&self, outcome: Outcome) -> Finished {
        Finished {
            config: self.settings.config.clone(),
            stopped: self.stop.now(),
            marks: None,
            outcome,
        }
    }
}

fn left(flattened: &Flattened, uvs: Uvs) -> Layout {
    Layout {
        uvs,
        seams: flattened.seams.clone(),
        thresholds: flattened.thresholds.clone(),
        finished: None,
    }
}

/// Finishing that the user sees and can stop.
pub struct Watched<'a> {
    progress: FinishingProgress,
    stop: Stop<'a>,
}

impl<'a> Watched<'a> {
    pub fn new(quiet: bool, stop: Stop<'a>) -> Self {
        Self {
            progress: FinishingProgress::new(quiet),
            stop,
        }
    }

    pub fn mesh(mut self, config: &LayoutConfig, unfinished: &MeshInput) -> MeshLayout {
        let atlas = lay_out(config, unfinished, &mut |now| self.observe(now));
        self.progress.finish();
        atlas
    }

    pub fn cloud(
        mut self,
        config: &LayoutConfig,
        points: &[[f64; 3]],
        raw: &[[f32; 2]],
    ) -> CloudLayout {
        let cloud = lay_out_cloud(config, points, raw, &mut |now| self.observe(now));
        self.progress.finish();
        cloud
    }

    fn observe(&mut self, now: Progress) -> ControlFlow<()> {
        self.progress.show(&now);
        match self.stop.now() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}
