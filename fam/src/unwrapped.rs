use std::time::Duration;

use fam_core::atlas::Part;
use fam_core::training::{TrainingConfig, TrainingError};
use fam_surface::Components;
use fam_surface::metrics::Metrics;
use fam_surface::seams::{SeamThreshold, Seams};

use crate::layout::{LaidOut, Uvs};
use crate::method::Used;
use crate::warnings::{Warning, warnings};

/// An unwrapped surface. `M` is its trained map: [`Atlas`](fam_core::atlas::Atlas), or whatever a
/// caller makes of it.
#[derive(Debug, Clone)]
pub struct Unwrapped<M> {
    /// How it was made.
    pub method: Used,
    /// The trained map, which gives UVs to any point; none of the direct method.
    pub map: Option<M>,
    /// How the networks were trained; none of the direct method.
    pub training: Option<Training>,
    /// What a mesh was taken apart into; none of a cloud.
    pub components: Option<Components>,
    /// The UVs.
    pub uvs: Uvs,
    /// The layout that they are of; none if they are a raw map's.
    pub layout: Option<LaidOut>,
    /// Where the UVs cut the surface, or where the raw map is torn.
    pub seams: Seams,
    /// What counts as torn in each component, where seams are tears.
    pub thresholds: Vec<Option<SeamThreshold>>,
    /// Of a mesh: the metrics of the UVs, its UV squares side by side.
    pub metrics: Option<Metrics>,
    /// Of a mesh: those of the raw map, if that is another.
    pub raw_metrics: Option<Metrics>,
    /// Whether the observer broke off.
    pub interrupted: bool,
    /// How long cutting, flattening and packing took.
    pub layout_time: Duration,
}

/// How networks were trained.
#[derive(Debug, Clone)]
pub struct Training {
    /// The configuration, as it was planned for a time budget.
    pub config: TrainingConfig,
    /// Every component.
    pub parts: Vec<Part>,
    /// How long it took.
    pub time: Duration,
}

impl<M> Unwrapped<M> {
    /// The same with another form of the map.
    ///
    /// # Errors
    /// Those of `change`.
    pub fn try_map<N, E>(self, change: impl FnOnce(M) -> Result<N, E>) -> Result<Unwrapped<N>, E> {
        Ok(Unwrapped {
            map: self.map.map(change).transpose()?,
            method: self.method,
            training: self.training,
            components: self.components,
            uvs: self.uvs,
            layout: self.layout,
            seams: self.seams,
            thresholds: self.thresholds,
            metrics: self.metrics,
            raw_metrics: self.raw_metrics,
            interrupted: self.interrupted,
            layout_time: self.layout_time,
        })
    }

    /// Where the layout falls short of what was asked for.
    pub fn warnings(&self) -> Vec<Warning> {
        let layout = self.layout.as_ref();
        layout.map_or_else(Vec::new, |layout| warnings(layout, self.metrics.as_ref()))
    }

    /// Why training broke off, if it did; the map is that of the last good weights.
    pub fn training_error(&self) -> Option<&TrainingError> {
        let parts = self.training.iter().flat_map(|training| &training.parts);
        parts.filter_map(|part| part.error.as_ref()).next()
    }
}
