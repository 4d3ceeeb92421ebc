//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use fam_core::jacobian::JacobianMode;
use fam_core::losses::Objective;
use fam_core::sampling::Sampling;
use fam_core::seams::SeamRule;
use fam_core::training::Ablation;

/// UVs for any mesh or point cloud, by training the Flatten Anything Model on it.
///
/// Without a command it flattens a built-in sample surface into sample.fam/.
#[derive(Debug, Parser)]
#[command(name = "fam", version, max_term_width = 90)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Unwrap(Unwrap),
    Map(Map),
    Metrics(Metrics),
    /// The backends compiled in and the adapters found
    Backends,
}

/// Train on a surface and write its UVs, seams, pictures and metrics.
///
/// Reads OBJ, OFF, PLY and XYZ; files without faces are point clouds. Writes a folder with the
/// input and its UVs in the same format, seams.json and seams.obj, metrics.json,
/// model.safetensors (for `fam map`), config.toml (for --config), uv.png and preview.png.
/// Ctrl-C stops training early and still writes all of them.
///
/// Exit codes: 0 done, 1 training or writing failed, 2 bad input or usage, 130 interrupted.
#[derive(Debug, Args)]
pub struct Unwrap {
    /// Mesh or point cloud to flatten; the built-in sample if left out
    pub input: Option<PathBuf>,

    /// Folder for the results [default: INPUT's stem with .fam, in the current folder]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Where the configuration starts from: `fast` takes minutes on a CPU, `paper` is the
    /// paper's (hours on a CPU)
    #[arg(long, value_enum, default_value_t = Preset::Fast)]
    pub preset: Preset,

    /// TOML file that overrides the preset; a config.toml of an earlier run serves
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,

    /// What computes: `auto` takes a real GPU if there is one, else the CPU
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,

    /// Points per iteration
    #[arg(long, value_name = "N")]
    pub points: Option<usize>,

    /// Training iterations
    #[arg(long, value_name = "N")]
    pub iterations: Option<usize>,

    /// Seed; the same seed on the same CPU gives the same files
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// How the distortion term is differentiated; both give the same result
    #[arg(long, value_enum)]
    pub jacobian: Option<JacobianName>,

    /// Loss formulation: the paper's, or that of the authors' program
    #[arg(long, value_enum)]
    pub objective: Option<ObjectiveName>,

    /// Points of a mesh: spread over its area, or its vertices drawn anew each iteration
    #[arg(long, value_enum)]
    pub sampling: Option<SamplingName>,

    /// Leave a part of the method out (the paper's ablations)
    #[arg(long, value_enum, value_name = "PART")]
    pub without: Option<Part>,

    /// Ignore the normals of the input
    #[arg(long)]
    pub no_normals: bool,

    /// What counts as torn: `spacing` adapts the paper's threshold to the density of points,
    /// `paper` takes 2 % of the UV square as it is
    #[arg(long, value_enum, default_value_t = SeamRuleName::Spacing)]
    pub seam_rule: SeamRuleName,

    /// No progress on standard error
    #[arg(short, long)]
    pub quiet: bool,

    /// Print a summary as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

impl Default for Unwrap {
    fn default() -> Self {
        Self {
            input: None,
            out: None,
            preset: Preset::Fast,
            config: None,
            backend: BackendName::Auto,
            points: None,
            iterations: None,
            seed: None,
            jacobian: None,
            objective: None,
            sampling: None,
            without: None,
            no_normals: false,
            seam_rule: SeamRuleName::Spacing,
            quiet: false,
            json: false,
        }
    }
}

/// UVs for any points or mesh from a trained model.
///
/// The input keeps its format; its points are taken in the units of the surface that the
/// model was trained on.
#[derive(Debug, Args)]
pub struct Map {
    /// model.safetensors of an `unwrap`
    #[arg(long, value_name = "FILE")]
    pub model: PathBuf,

    /// Mesh or point cloud
    pub input: PathBuf,

    /// File to write: the input with UVs, in the input's format
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,

    /// What computes
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,
}

/// Quality of the UVs that a mesh already has.
#[derive(Debug, Args)]
pub struct Metrics {
    /// Mesh with UVs
    pub input: PathBuf,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    Fast,
    Paper,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    Auto,
    Ndarray,
    Wgpu,
}

/// Command-line names for a type of the library.
macro_rules! names {
    ($name:ident for $of:ident { $($variant:ident),+ }) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
        pub enum $name { $($variant),+ }

        impl From<$name> for $of {
            fn from(name: $name) -> Self {
                match name { $($name::$variant => $of::$variant),+ }
            }
        }
    };
}

names!(JacobianName for JacobianMode { DoubleBackward, ForwardTangent });
names!(ObjectiveName for Objective { Paper, Reference });
names!(SamplingName for Sampling { PoissonDisk, Vertices });
names!(Part for Ablation { DeformBranch, UnwrapBranch, CutNet });
names!(SeamRuleName for SeamRule { Spacing, Paper });
