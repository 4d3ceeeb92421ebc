//! Options from Python.

use std::time::Duration;

use fam::{Method, Options, Parting};
use fam_cli::BackendName;
use fam_core::training::TrainingConfig;
use fam_layout::{LayoutConfig, Stack, Symmetry};
use fam_surface::Duplicates;
use pyo3::prelude::*;

use crate::backend;
use crate::failure::Failure;

/// The options that all calls share, as the Python modules name them.
#[derive(Debug, Clone, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    method: String,
    distortion_bound: f64,
    seam_weight: f64,
    hide_seams: f64,
    seen_from: Option<[f64; 3]>,
    hard_angle: Option<f64>,
    paint_weight: f64,
    crease_weight: f64,
    tear_weight: f64,
    symmetry: String,
    stack: String,
    straighten: bool,
    upright: Option<[f64; 3]>,
    coverage_weight: f64,
    max_charts: Option<usize>,
    margin: f64,
    resolution: u32,
    texel_density: Option<f64>,
    tiles: u32,
    whole_texels: bool,
    separate_duplicates: bool,
    /// In seconds.
    time_budget: Option<f64>,
    preset: String,
    iterations: Option<usize>,
    seed: Option<u64>,
    backend: String,
}

impl Settings {
    /// What layouts are to reach.
    pub fn layout(&self) -> Result<LayoutConfig, Failure> {
        let config = LayoutConfig {
            distortion_bound: self.distortion_bound,
            seam_weight: self.seam_weight,
            hide_seams: self.hide_seams,
            seen_from: self.seen_from,
            hard_angle: self.hard_angle,
            paint_weight: self.paint_weight,
            crease_weight: self.crease_weight,
            tear_weight: self.tear_weight,
            symmetry: self.symmetry()?,
            stack: self.stack()?,
            straighten: self.straighten,
            upright: self.upright,
            coverage_weight: self.coverage_weight,
            max_charts: self.max_charts,
            margin: self.margin,
            resolution: self.resolution,
            texel_density: self.texel_density,
            tiles: self.tiles,
            whole_texels: self.whole_texels,
        };
        match config.problem() {
            None => Ok(config),
            Some(problem) => Err(Failure::Input(in_python(problem))),
        }
    }

    fn symmetry(&self) -> Result<Symmetry, Failure> {
        match self.symmetry.as_str() {
            "off" => Ok(Symmetry::Off),
            "auto" => Ok(Symmetry::Auto),
            "x" => Ok(Symmetry::X),
            "y" => Ok(Symmetry::Y),
            "z" => Ok(Symmetry::Z),
            other => Err(Failure::Input(format!("there is no symmetry {other:?}"))),
        }
    }

    fn stack(&self) -> Result<Stack, Failure> {
        match self.stack.as_str() {
            "none" => Ok(Stack::None),
            "identical" => Ok(Stack::Identical),
            "mirrored" => Ok(Stack::Mirrored),
            other => Err(Failure::Input(format!("there is no stack {other:?}"))),
        }
    }

    /// How networks are trained.
    pub fn training(&self) -> Result<TrainingConfig, Failure> {
        let mut config = match self.preset.as_str() {
            "fast" => TrainingConfig::fast(),
            "paper" => TrainingConfig::paper(),
            other => return Err(Failure::Input(format!("there is no preset {other:?}"))),
        };
        config.iterations = self.iterations.unwrap_or(config.iterations);
        config.seed = self.seed.unwrap_or(config.seed);
        match config.problem() {
            None => Ok(config),
            Some(problem) => Err(Failure::Input(in_python(problem))),
        }
    }

    /// Where they are trained.
    pub fn backend(&self) -> Result<BackendName, Failure> {
        backend::named(&self.backend)
    }

    /// The options of an unwrapping without marks.
    pub fn options(&self, parting: Parting) -> Result<Options, Failure> {
        let duplicates = match self.separate_duplicates {
            true => Duplicates::Separate,
            false => Duplicates::Share,
        };
        let method = match self.method.as_str() {
            "auto" => Method::Auto,
            "direct" => Method::Direct,
            "neural" => Method::Neural,
            other => return Err(Failure::Input(format!("there is no method {other:?}"))),
        };
        let time_budget = match self.time_budget {
            None => None,
            Some(seconds) => Some(Duration::try_from_secs_f64(seconds).map_err(|_| {
                Failure::Input("time_budget must be a number of seconds".to_owned())
            })?),
        };
        Ok(Options {
            method,
            training: self.training()?,
            layout: self.layout()?,
            parting: Parting {
                duplicates,
                ..parting
            },
            time_budget,
            ..Options::default()
        })
    }
}

/// A message that begins with the name of an option, which has underscores in Python.
pub fn in_python(problem: &str) -> String {
    match problem.split_once(' ') {
        Some((option, rest)) => format!("{} {rest}", option.replace('-', "_")),
        None => problem.to_owned(),
    }
}
