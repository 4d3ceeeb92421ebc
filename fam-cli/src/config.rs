//! The training configuration: a preset, overridden by a file, overridden by options.

use std::path::Path;

use fam_core::training::TrainingConfig;
use toml::{Table, Value};

use crate::args::{Preset, Unwrap};
use crate::failure::Failure;

/// The configuration that the command line asks for.
pub fn resolve(arguments: &Unwrap) -> Result<TrainingConfig, Failure> {
    let mut config = match arguments.preset {
        Preset::Fast => TrainingConfig::fast(),
        Preset::Paper => TrainingConfig::paper(),
    };
    if let Some(path) = &arguments.config {
        config = overridden(config, path)?;
    }
    if let Some(points) = arguments.points {
        config.points = points;
    }
    if let Some(iterations) = arguments.iterations {
        config.iterations = iterations;
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
    match config.problem() {
        Some(problem) => Err(Failure::input(problem)),
        None => Ok(config),
    }
}

/// The configuration as the TOML text that `--config` reads.
pub fn to_toml(config: &TrainingConfig) -> Result<String, Failure> {
    toml::to_string(config).map_err(Failure::input)
}

fn overridden(config: TrainingConfig, path: &Path) -> Result<TrainingConfig, Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
    // The parser's own display quotes the source over several lines.
    let file: Table = toml::from_str(&text).map_err(|error| fail(one_line(error.message())))?;
    let mut base = Table::try_from(&config).map_err(|error| fail(error.to_string()))?;
    merge(&mut base, file, "").map_err(fail)?;
    base.try_into()
        .map_err(|error: toml::de::Error| fail(one_line(error.message())))
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

    fn merged(text: &str) -> Result<TrainingConfig, String> {
        let mut base = Table::try_from(TrainingConfig::fast()).unwrap();
        merge(&mut base, toml::from_str(text).unwrap(), "")?;
        base.try_into()
            .map_err(|error: toml::de::Error| error.message().to_string())
    }

    #[test]
    fn a_file_overrides_only_what_it_names() {
        let config = merged("points = 77\n[networks]\nwidth = 32\n").unwrap();
        assert_eq!((config.points, config.networks.width), (77, 32));
        assert_eq!(config.iterations, TrainingConfig::fast().iterations);
        assert_eq!(
            config.networks.latent,
            TrainingConfig::fast().networks.latent
        );
    }

    #[test]
    fn unknown_keys_and_wrong_types_are_named() {
        assert_eq!(
            merged("[networks]\nwidht = 3\n"),
            Err("unknown key networks.widht".into())
        );
        assert!(
            merged("jacobian = \"sideways\"")
                .unwrap_err()
                .contains("sideways")
        );
        assert!(merged("points = \"many\"").is_err());
    }

    #[test]
    fn what_is_written_reads_back() {
        let config = TrainingConfig::paper();
        let text = to_toml(&config).unwrap();
        assert_eq!(toml::from_str::<TrainingConfig>(&text).unwrap(), config);
    }
}
