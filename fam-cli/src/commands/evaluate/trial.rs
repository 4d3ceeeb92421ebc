use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::Atlas;
use fam_core::training::{Strategies, TrainingConfig};
use fam_layout::{LayoutConfig, MeshInput};
use fam_surface::metrics::Metrics;
use fam_surface::seams::SeamRule;
use fam_surface::{Components, Surface, SurfaceError, TriangleMesh, UvMap};

use super::{Outcome, Row};
use crate::backend::{Backend, Job};
use crate::budget::Stop;
use crate::failure::Failure;
use crate::finish::Watched;
use crate::flatten::Flatten;
use crate::marks::Marked;
use crate::surface::Parting;

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
        let parting = Parting::of(document.labels(), false);
        let raw = match &self.source {
            Source::Training => self.train(document.surface(), &parting),
            Source::Model(model) => self.load(model, mesh, &parting),
        };
        let raw = raw.map_err(|failure| failure.of(&name))?;
        let marked = Marked::by_polygons(&document, mesh);
        let rows = self.rows(mesh, &raw, &marked);
        Ok(Outcome::Done {
            training_seconds: raw.training_seconds,
            rows: rows.map_err(|error| Failure::input(error).of(&name))?,
        })
    }

    fn train(&self, surface: &Surface, parting: &Parting) -> Result<Raw, Failure> {
        let started = Instant::now();
        let flattened = self.backend.run(Flatten {
            config: self.config,
            surface,
            parting,
            seam_rule: SeamRule::Spacing,
            quiet: self.quiet,
            stop: self.stop,
        })?;
        if let Some(error) = flattened.parts.iter().find_map(|part| part.error.as_ref()) {
            return Err(Failure::work(error));
        }
        let no_components = || Failure::work("the mesh has no components");
        Ok(Raw {
            components: flattened.components.ok_or_else(no_components)?,
            uvs: flattened.uvs,
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

    fn rows(
        &self,
        mesh: &TriangleMesh,
        raw: &Raw,
        marked: &Marked,
    ) -> Result<Vec<Row>, SurfaceError> {
        let components = &raw.components;
        let measure = |maps: &[UvMap]| Metrics::measure(mesh, &components.uv_map(maps)?);
        let mut rows = vec![Row {
            layout: "raw map".to_string(),
            finishing_seconds: None,
            metrics: measure(&components.vertex_maps(&raw.uvs)?)?,
        }];
        let default = LayoutConfig::default();
        let tight = LayoutConfig {
            distortion_bound: TIGHT_BOUND,
            ..default.clone()
        };
        let guided = Some(raw.uvs.as_slice());
        for (layout, config, map) in [
            ("finished".to_string(), &default, guided),
            ("without guidance".to_string(), &default, None),
            (format!("bound {TIGHT_BOUND}"), &tight, guided),
        ] {
            let stop = Stop {
                interrupt: self.stop,
                deadline: None,
            };
            let watched = Watched::new(self.quiet, stop);
            let started = Instant::now();
            let unfinished = MeshInput {
                components,
                map,
                squares: &[],
                marks: &marked.marks,
            };
            let atlas = watched.mesh(config, &unfinished);
            let seconds = started.elapsed().as_secs_f64();
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
