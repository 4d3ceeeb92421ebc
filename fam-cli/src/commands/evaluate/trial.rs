use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use burn::tensor::backend::AutodiffBackend;
use fam::{Parting, Progress, UnwrapError, train};
use fam_core::atlas::{Atlas, Part, Start};
use fam_core::training::{Strategies, TrainingConfig};
use fam_layout::{LayoutConfig, MeshInput, lay_out};
use fam_surface::metrics::Metrics;
use fam_surface::seams::SeamRule;
use fam_surface::{Components, Surface, TriangleMesh, UvMap};

use super::table::{Outcome, Row};
use crate::backend::{Backend, Job};
use crate::failure::Failure;
use crate::marks::Marked;
use crate::parting::{Squares, parting};
use crate::progress::{ProgressMode, UnwrapProgress};

/// The distortion bound of the last row.
const TIGHT_BOUND: f64 = 4.03;

/// What is tried on a mesh.
pub struct Trial<'a> {
    pub config: &'a TrainingConfig,
    pub backend: &'a Backend,
    pub source: Source,
    pub quiet: bool,
    pub stop: &'a AtomicBool,
}

/// Where the raw map is from.
pub enum Source {
    Training,
    /// A model that was trained before.
    Model(PathBuf),
}

/// A raw map: one UV for each vertex of each component.
struct Raw {
    components: Components,
    uvs: Vec<Vec<[f32; 2]>>,
    training_seconds: Option<f64>,
}

impl Trial<'_> {
    /// The raw map of a mesh and what finishing makes of it.
    pub fn run(&self, path: &Path) -> Result<Outcome, Failure> {
        let document = fam_io::read_surface(path).map_err(Failure::input)?;
        let name = path.display().to_string();
        let Surface::Mesh(mesh) = document.surface() else {
            let reason = "it is a point cloud; the table is of meshes";
            return Err(Failure::input(reason).of(&name));
        };
        let parting = parting(document.labels(), Squares::One);
        let raw = match &self.source {
            Source::Training => self.train(document.surface(), &parting),
            Source::Model(model) => self.load(model, mesh, &parting),
        };
        let raw = raw.map_err(|failure| failure.of(&name))?;
        let marked = Marked::by_polygons(&document, mesh).map_err(|failure| failure.of(&name))?;
        let rows = self.rows(mesh, &raw, &marked);
        Ok(Outcome::Done {
            training_seconds: raw.training_seconds,
            rows: rows.map_err(|failure| failure.of(&name))?,
        })
    }

    fn train(&self, surface: &Surface, parting: &Parting) -> Result<Raw, Failure> {
        let started = Instant::now();
        let mut progress = UnwrapProgress::new(ProgressMode::of_user(self.quiet), self.stop);
        let trained = self.backend.run(Train {
            config: self.config,
            surface,
            parting,
            progress: &mut progress,
        });
        progress.end();
        let (components, uvs, parts) = trained.map_err(|error| match error.is_input() {
            true => Failure::input(error),
            false => Failure::work(error),
        })?;
        if let Some(error) = parts.iter().find_map(|part| part.error.as_ref()) {
            return Err(Failure::work(error));
        }
        let no_components = || Failure::work("the mesh has no components");
        Ok(Raw {
            components: components.ok_or_else(no_components)?,
            uvs,
            training_seconds: Some(started.elapsed().as_secs_f64()),
        })
    }

    fn load(&self, path: &Path, mesh: &TriangleMesh, parting: &Parting) -> Result<Raw, Failure> {
        let fail = |reason: String| Failure::input(format!("{}: {reason}", path.display()));
        let model = std::fs::read(path).map_err(|error| fail(error.to_string()))?;
        let components = Components::of(mesh, &parting.labels).map_err(Failure::input)?;
        let load = Load {
            model: &model,
            components: &components,
        };
        let uvs = self.backend.run(load).map_err(fail)?;
        Ok(Raw {
            components,
            uvs,
            training_seconds: None,
        })
    }

    fn rows(&self, mesh: &TriangleMesh, raw: &Raw, marked: &Marked) -> Result<Vec<Row>, Failure> {
        let components = &raw.components;
        let measure = |maps: &[UvMap]| {
            let uvs = components.uv_map(maps).map_err(Failure::input)?;
            Metrics::measure(mesh, &uvs).map_err(Failure::input)
        };
        let mut rows = vec![Row {
            layout: "raw map".to_string(),
            finishing_seconds: None,
            metrics: measure(&components.vertex_maps(&raw.uvs).map_err(Failure::input)?)?,
        }];
        let default = LayoutConfig::default();
        let tight = LayoutConfig {
            distortion_bound: TIGHT_BOUND,
            ..default.clone()
        };
        let guided = Some(raw.uvs.as_slice());
        for (layout, config, map) in [
            ("finished".to_string(), &default, guided),
            ("direct".to_string(), &default, None),
            (format!("bound {TIGHT_BOUND}"), &tight, guided),
        ] {
            let mut progress = UnwrapProgress::new(ProgressMode::of_user(self.quiet), self.stop);
            let started = Instant::now();
            let input = MeshInput {
                map,
                marks: &marked.marks,
                ..MeshInput::of(components)
            };
            let atlas = lay_out(config, &input, &mut |now| {
                progress.show(Progress::Layout(now))
            });
            let seconds = started.elapsed().as_secs_f64();
            progress.end();
            let atlas = atlas.map_err(Failure::work)?;
            let maps: Vec<UvMap> = atlas.components.into_iter().map(|c| c.uvs).collect();
            rows.push(Row {
                layout,
                finishing_seconds: Some(seconds),
                metrics: measure(&maps)?,
            });
        }
        Ok(rows)
    }
}

/// The components of a mesh, the UVs of their vertices, and how each was trained.
type Learnt = (Option<Components>, Vec<Vec<[f32; 2]>>, Vec<Part>);

/// Training on any backend.
struct Train<'a, 'p> {
    config: &'a TrainingConfig,
    surface: &'a Surface,
    parting: &'a Parting,
    progress: &'a mut UnwrapProgress<'p>,
}

impl Job for Train<'_, '_> {
    type Output = Result<Learnt, UnwrapError>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let steps = self.config.steps();
        let trained = train::<B>(
            Start::Fresh(self.config),
            self.surface,
            self.parting,
            SeamRule::Spacing,
            device,
            strategies,
            |now| self.progress.show(Progress::Training { steps, now }),
        )?;
        let flattened = trained.flattened;
        Ok((flattened.components, flattened.uvs, flattened.parts))
    }
}

/// UVs of the vertices of components from a trained model.
struct Load<'a> {
    model: &'a [u8],
    components: &'a Components,
}

impl Job for Load<'_> {
    type Output = Result<Vec<Vec<[f32; 2]>>, String>;

    fn run<B: AutodiffBackend>(self, device: &B::Device, _: Strategies<B>) -> Self::Output {
        let atlas = Atlas::<B::InnerBackend>::from_safetensors(self.model, device);
        let atlas = atlas.map_err(|error| error.to_string())?;
        Ok(atlas.component_uvs(self.components))
    }
}
