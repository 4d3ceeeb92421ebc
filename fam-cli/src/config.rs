//! The configuration: a preset, overridden by a file, overridden by options.

use std::path::Path;

use clap::ValueEnum;
use fam_core::training::TrainingConfig;
use fam_layout::LayoutConfig;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::args::{Preset, Unwrap};
use crate::failure::Failure;

/// What a file with a configuration holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Config {
    #[serde(flatten)]
    pub training: TrainingConfig,
    pub finish: Finishing,
}

/// What becomes of the map that training ends with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finishing {
    pub mode: FinishMode,
    #[serde(flatten)]
    pub config: LayoutConfig,
}

/// Whether a map is finished.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum FinishMode {
    Full,
    None,
}

impl Config {
    /// The configuration of a preset.
    pub fn of(preset: Preset) -> Self {
        Self {
            training: match preset {
                Preset::Fast => TrainingConfig::fast(),
                Preset::Paper => TrainingConfig::paper(),
            },
            finish: Finishing {
                mode: FinishMode::Full,
                config: LayoutConfig::default(),
            },
        }
    }

    /// The configuration, unless it makes no sense.
    pub fn checked(self) -> Result<Self, Failure> {
        let problem = self.training.problem();
        match problem.or_else(|| self.finish.config.problem()) {
            Some(problem) => Err(Failure::input(problem)),
            None => Ok(self),
        }
    }

    /// The TOML text that `--config` reads.
    pub fn to_toml(&self) -> Result<String, Failure> {
        toml::to_string(self).map_err(Failure::input)
    }
}

/// The configuration that the command line asks for.
pub fn resolve(arguments: &Unwrap) -> Result<Config, Failure> {
    let mut all = Config::of(arguments.preset);
    if let Some(path) = &arguments.config {
        all = overridden(all, path)?;
    }
    let config = &mut all.training;
    if let Some(points) = arguments.points {
        config.points = points;
    }
    if let Some(iterations) = arguments.iterations {
        config.iterations = iterations;
    }
    if let Some(starts) = arguments.starts {
        config.starts = starts;
    }
    if let Some(seed) = arguments.seed {
        config.seed = seed;
    }
    if let Some(jacobian) = arguments.jacobian {
        config.jacobian = jacobian.into();
    }
    if let Some(objective) = arguments.objective {
        config.objective = objective.into();
    }
    if let Some(sampling) = arguments.sampling {
        config.sampling = sampling.into();
    }
    if let Some(part) = arguments.without {
        config.without = part.into();
    }
    if arguments.no_normals {
        config.normals = false;
    }
    let finish = &mut all.finish;
    if let Some(mode) = arguments.finish {
        finish.mode = mode;
    }
    if let Some(bound) = arguments.distortion_bound {
        finish.config.distortion_bound = bound;
    }
    if let Some(weight) = arguments.seam_weight {
        finish.config.seam_weight = weight;
    }
    if let Some(charts) = arguments.max_charts {
        finish.config.max_charts = charts;
    }
    if let Some(margin) = arguments.margin {
        finish.config.margin = margin;
    }
    if let Some(resolution) = arguments.resolution {
        finish.config.resolution = resolution;
    }
    all.checked()
}

fn overridden(config: Config, path: &Path) -> Result<Config, Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
    over(config, &text).map_err(fail)
}

/// A configuration with what a TOML text says. If the text is a whole configuration, what it leaves
/// out is not that of `config`: it was written before there was such a thing, and means without.
fn over(config: Config, text: &str) -> Result<Config, String> {
    // The parser's own display quotes the source over several lines.
    let plain = |error: toml::de::Error| one_line(error.message());
    let file: Table = toml::from_str(text).map_err(plain)?;
    let mut base = Table::try_from(&config).map_err(|error| error.to_string())?;
    let whole = file.clone().try_into::<Config>();
    merge(&mut base, file, "")?;
    match whole {
        Ok(whole) => Ok(whole),
        Err(_) => base.try_into().map_err(plain),
    }
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Puts the values of `overlay` in the place of those of `base`, which has every known key.
fn merge(base: &mut Table, overlay: Table, within: &str) -> Result<(), String> {
    for (key, value) in overlay {
        let name = format!("{within}{key}");
        match (base.get_mut(&key), value) {
            (None, _) => return Err(format!("unknown key {name}")),
            (Some(Value::Table(inner)), Value::Table(overlay)) => {
                merge(inner, overlay, &format!("{name}."))?;
            }
            (Some(slot), value) => *slot = value,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merged(text: &str) -> Result<Config, String> {
        let mut base = Table::try_from(Config::of(Preset::Fast)).unwrap();
        merge(&mut base, toml::from_str(text).unwrap(), "")?;
        base.try_into()
            .map_err(|error: toml::de::Error| error.message().to_string())
    }

    /// That of an earlier version means what it meant then, whatever the preset.
    #[test]
    fn a_whole_configuration_is_no_mixture_with_a_preset() {
        let text = Config::of(Preset::Paper).to_toml().unwrap();
        let later = [
            "opening",
            "starts",
            "optimizer",
            "flattening",
            "unwrap_factor",
        ];
        let is_later = |line: &&str| later.iter().any(|key| line.starts_with(key));
        let earlier: Vec<&str> = text.lines().filter(|line| !is_later(line)).collect();
        assert_eq!(earlier.len() + later.len(), text.lines().count());
        let fast = || Config::of(Preset::Fast);
        let mut paper = Config::of(Preset::Paper);
        paper.training.networks.unwrap_factor = None;
        assert_eq!(over(fast(), &earlier.join("\n")), Ok(paper));
        let written = Config::of(Preset::Fast).to_toml().unwrap();
        assert_eq!(over(Config::of(Preset::Paper), &written), Ok(fast()));
        let unknown = format!("none = 1\n{}", earlier.join("\n"));
        assert!(over(fast(), &unknown).is_err());
    }

    #[test]
    fn a_file_overrides_only_what_it_names() {
        let fast = Config::of(Preset::Fast);
        let text = "points = 77\n[networks]\nwidth = 32\n[finish]\nmargin = 2\n";
        let config = merged(text).unwrap();
        let training = &config.training;
        assert_eq!((training.points, training.networks.width), (77, 32));
        assert_eq!(training.iterations, fast.training.iterations);
        assert_eq!(training.networks.latent, fast.training.networks.latent);
        let finish = LayoutConfig {
            margin: 2.0,
            ..LayoutConfig::default()
        };
        assert_eq!(config.finish.config, finish);
    }

    #[test]
    fn unknown_keys_and_wrong_types_are_named() {
        assert_eq!(
            merged("[networks]\nwidht = 3\n"),
            Err("unknown key networks.widht".into())
        );
        assert_eq!(
            merged("[finish]\nbound = 5\n"),
            Err("unknown key finish.bound".into())
        );
        for text in ["jacobian = \"sideways\"", "finish.mode = \"sideways\""] {
            assert!(merged(text).unwrap_err().contains("sideways"));
        }
        assert!(merged("points = \"many\"").is_err());
        assert!(merged("finish = 3").is_err());
        assert!(merged("finish.max-charts = -1").is_err());
    }

    #[test]
    fn what_is_written_reads_back() {
        let mut config = Config::of(Preset::Paper);
        config.finish.mode = FinishMode::None;
        config.finish.config.distortion_bound = 4.03;
        let text = config.to_toml().unwrap();
        assert_eq!(toml::from_str::<Config>(&text).unwrap(), config);
    }
}
