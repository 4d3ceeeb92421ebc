//! The configuration: a preset, overridden by a file, overridden by options.

use std::path::Path;

use fam::{FinishMode, Method, Unwrapped, Used};
use fam_core::training::TrainingConfig;
use fam_layout::LayoutConfig;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::args::{Preset, Unwrap};
use crate::failure::Failure;

/// What a file with a configuration holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Config {
    pub method: Method,
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

impl Config {
    /// The configuration of a preset.
    pub fn of(preset: Preset) -> Self {
        Self {
            method: Method::Auto,
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

    /// The configuration with training as it was planned.
    pub fn as_used<M>(&self, unwrapped: &Unwrapped<M>) -> Self {
        let training = unwrapped.training.as_ref();
        Self {
            training: training.map_or(&self.training, |one| &one.config).clone(),
            ..self.clone()
        }
    }

    /// The TOML text that `--config` reads, of what a method made use of.
    pub fn to_toml(&self, used: Used) -> Result<String, Failure> {
        match used {
            Used::Neural => toml::to_string(&Self {
                method: Method::Neural,
                ..self.clone()
            }),
            Used::Direct => toml::to_string(&Untrained {
                method: Method::Direct,
                finish: &self.finish,
            }),
        }
        .map_err(Failure::input)
    }
}

/// A configuration without training.
#[derive(Serialize)]
struct Untrained<'a> {
    method: Method,
    finish: &'a Finishing,
}

/// The configuration that the command line asks for.
pub fn resolve(arguments: &Unwrap) -> Result<Config, Failure> {
    let mut all = Config::of(arguments.preset.unwrap_or(Preset::Fast));
    let mut asks_for_networks = asks_for_networks(arguments);
    if let Some(path) = &arguments.config {
        let (config, has_training) = overridden(all, path)?;
        all = config;
        asks_for_networks |= has_training;
    }
    if let Some(method) = arguments.method {
        all.method = method.into();
    } else if all.method == Method::Auto && asks_for_networks {
        all.method = Method::Neural;
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
        finish.mode = mode.into();
    }
    if let Some(bound) = arguments.distortion_bound {
        finish.config.distortion_bound = bound;
    }
    if let Some(weight) = arguments.seam_weight {
        finish.config.seam_weight = weight;
    }
    if let Some(weight) = arguments.hide_seams {
        finish.config.hide_seams = weight;
    }
    if let Some(direction) = arguments.seen_from {
        finish.config.seen_from = Some(direction);
        if arguments.hide_seams.is_none() && finish.config.hide_seams == 0.0 {
            finish.config.hide_seams = 1.0;
        }
    }
    if let Some(weight) = arguments.paint.as_ref().and_then(|paint| paint.weight) {
        finish.config.paint_weight = weight;
    }
    if let Some(weight) = arguments.crease_weight {
        finish.config.crease_weight = weight;
    }
    if let Some(weight) = arguments.tear_weight {
        finish.config.tear_weight = weight;
    }
    if arguments.hard_angle.is_some() {
        finish.config.hard_angle = arguments.hard_angle;
    }
    if let Some(symmetry) = arguments.symmetry {
        finish.config.symmetry = symmetry;
    }
    if let Some(stack) = arguments.stack {
        finish.config.stack = stack.into();
    }
    finish.config.straighten |= arguments.straighten;
    if arguments.upright.is_some() {
        finish.config.upright = arguments.upright;
    }
    if let Some(weight) = arguments.coverage_weight {
        finish.config.coverage_weight = weight;
    }
    if let Some(charts) = arguments.max_charts {
        finish.config.max_charts = Some(charts);
    }
    if let Some(margin) = arguments.margin {
        finish.config.margin = margin;
    }
    if let Some(resolution) = arguments.resolution {
        finish.config.resolution = resolution;
    }
    if arguments.texel_density.is_some() {
        finish.config.texel_density = arguments.texel_density;
    }
    if let Some(tiles) = arguments.udim {
        finish.config.tiles = tiles;
    }
    finish.config.whole_texels |= arguments.whole_texels;
    all.checked()
}

/// Whether an option asks for what only networks have.
fn asks_for_networks(arguments: &Unwrap) -> bool {
    arguments.preset.is_some()
        || arguments.points.is_some()
        || arguments.iterations.is_some()
        || arguments.starts.is_some()
        || arguments.jacobian.is_some()
        || arguments.objective.is_some()
        || arguments.sampling.is_some()
        || arguments.without.is_some()
        || arguments.no_normals
        || arguments.finish.map(FinishMode::from) == Some(FinishMode::None)
}

/// A configuration with what a file says, and whether that has training in it.
fn overridden(config: Config, path: &Path) -> Result<(Config, bool), Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
    over(config, &text).map_err(fail)
}

/// A configuration with what a TOML text says, and whether the text has training in it. If the text
/// is a whole configuration, what it leaves out is not that of `config`: it was written before
/// there was such a thing, and means without.
fn over(config: Config, text: &str) -> Result<(Config, bool), String> {
    // The parser's own display quotes the source over several lines.
    let plain = |error: toml::de::Error| one_line(error.message());
    let file: Table = toml::from_str(text).map_err(plain)?;
    let mut base = Table::try_from(&config).map_err(|error| error.to_string())?;
    // Those written before there were methods are of trained networks.
    let mut named = file.clone();
    named.entry("method").or_insert_with(|| "neural".into());
    let whole = named.try_into::<Config>();
    let has_training = file.keys().any(|key| key != "method" && key != "finish");
    merge(&mut base, file, "")?;
    let config = match whole {
        Ok(whole) => whole,
        Err(_) => base.try_into().map_err(plain)?,
    };
    Ok((config, has_training))
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Keys that a configuration may lack.
const OPTIONAL: [&str; 16] = [
    "finish.coverage-weight",
    "finish.crease-weight",
    "finish.hard-angle",
    "finish.hide-seams",
    "finish.max-charts",
    "finish.paint-weight",
    "finish.seen-from",
    "finish.stack",
    "finish.straighten",
    "finish.symmetry",
    "finish.tear-weight",
    "finish.texel-density",
    "finish.tiles",
    "finish.upright",
    "finish.whole-texels",
    "terms",
];

/// Puts the values of `overlay` in the place of those of `base`, which has every known key.
fn merge(base: &mut Table, overlay: Table, within: &str) -> Result<(), String> {
    for (key, value) in overlay {
        let name = format!("{within}{key}");
        match (base.get_mut(&key), value) {
            (None, value) if OPTIONAL.contains(&name.as_str()) => {
                base.insert(key, value);
            }
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
    use fam_core::losses::{Landmarks, TermConfig, TermKind};

    fn merged(text: &str) -> Result<Config, String> {
        let mut base = Table::try_from(Config::of(Preset::Fast)).unwrap();
        merge(&mut base, toml::from_str(text).unwrap(), "")?;
        base.try_into()
            .map_err(|error: toml::de::Error| error.message().to_string())
    }

    /// That of an earlier version means what it meant then, whatever the preset.
    #[test]
    fn a_whole_configuration_is_no_mixture_with_a_preset() {
        let text = Config::of(Preset::Paper).to_toml(Used::Neural).unwrap();
        let later = [
            "method",
            "opening",
            "starts",
            "optimizer",
            "flattening",
            "unwrap_factor",
        ];
        let is_later = |line: &&str| later.iter().any(|key| line.starts_with(key));
        let earlier: Vec<&str> = text.lines().filter(|line| !is_later(line)).collect();
        assert_eq!(earlier.len() + later.len(), text.lines().count());
        let neural = |preset| Config {
            method: Method::Neural,
            ..Config::of(preset)
        };
        let fast = || neural(Preset::Fast);
        let mut paper = neural(Preset::Paper);
        paper.training.networks.unwrap_factor = None;
        assert_eq!(over(fast(), &earlier.join("\n")), Ok((paper, true)));
        let written = Config::of(Preset::Fast).to_toml(Used::Neural).unwrap();
        assert_eq!(
            over(Config::of(Preset::Paper), &written),
            Ok((fast(), true))
        );
        let unknown = format!("none = 1\n{}", earlier.join("\n"));
        assert!(over(fast(), &unknown).is_err());
    }

    #[test]
    fn only_training_asks_for_networks() {
        let has_training = |text| over(Config::of(Preset::Fast), text).unwrap().1;
        assert!(!has_training("[finish]\nmargin = 2\n"));
        assert!(!has_training("method = \"auto\"\n"));
        assert!(has_training("points = 77\n"));
        assert!(has_training("[networks]\nwidth = 32\n"));
        let resolved = |arguments: Unwrap| resolve(&arguments).unwrap().method;
        assert_eq!(resolved(Unwrap::default()), Method::Auto);
        let seeded = Unwrap {
            seed: Some(3),
            distortion_bound: Some(4.2),
            ..Unwrap::default()
        };
        assert_eq!(resolved(seeded), Method::Auto);
        let shorter = Unwrap {
            iterations: Some(3),
            ..Unwrap::default()
        };
        assert_eq!(resolved(shorter), Method::Neural);
        let raw = Unwrap {
            finish: Some(crate::args::FinishName::None),
            ..Unwrap::default()
        };
        assert_eq!(resolved(raw), Method::Neural);
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
    fn terms_are_added_by_name() {
        let text = "[[terms]]\nkind = \"mips\"\nweight = 1\n\n[[terms]]\nkind = \"landmarks\"\n\
                    weight = 0.5\npoints = [[0, 0.1, 1e3]]\nuvs = [[0.5, 1]]\n";
        let (config, has_training) = over(Config::of(Preset::Fast), text).unwrap();
        assert!(has_training);
        let landmarks = Landmarks::new(vec![[0.0, 0.1, 1e3]], vec![[0.5, 1.0]]);
        let expected = [(1.0, TermKind::Mips), (0.5, TermKind::Landmarks(landmarks))];
        let expected = expected.map(|(weight, kind)| TermConfig { weight, kind });
        assert_eq!(config.training.terms, expected);
        assert_eq!(config.clone().checked().unwrap(), config);
        let written = config.to_toml(Used::Neural).unwrap();
        let (read, _) = over(Config::of(Preset::Fast), &written).unwrap();
        assert_eq!(read.training, config.training);
        for (text, word) in [
            ("[[terms]]\nkind = \"sideways\"\nweight = 1\n", "sideways"),
            ("[[terms]]\nkind = \"mips\"\n", "weight"),
        ] {
            let error = over(Config::of(Preset::Fast), text).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
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
        let text = config.to_toml(Used::Neural).unwrap();
        config.method = Method::Neural;
        assert_eq!(toml::from_str::<Config>(&text).unwrap(), config);
        let text = config.to_toml(Used::Direct).unwrap();
        let (read, has_training) = over(Config::of(Preset::Fast), &text).unwrap();
        assert!(!has_training && read.method == Method::Direct && read.finish == config.finish);
    }
}
