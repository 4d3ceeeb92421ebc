//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use fam_core::jacobian::JacobianMode;
use fam_core::losses::Objective;
use fam_core::sampling::Sampling;
use fam_core::seams::SeamRule;
use fam_core::training::Ablation;
use fam_io::Format;

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
/// Reads GLB, glTF, OBJ, OFF, PLY, STL and XYZ, whatever the extension says; files without
/// faces are point clouds. Writes a folder with the input and its UVs, seams.json and
/// seams.obj, metrics.json, model.safetensors (for `fam map`), config.toml (for --config),
/// uv.png and preview.png. Ctrl-C stops training early and still writes all of them.
///
/// Several inputs, a folder or a pattern are a batch: every file is tried and gets a folder of
/// its own, and a table says what came of each. Started again, it skips what is done.
///
/// Exit codes: 0 done, 1 training or writing failed (or any file of a batch), 2 bad input or
/// usage, 130 interrupted.
#[derive(Debug, Args)]
pub struct Unwrap {
    /// Meshes and point clouds to flatten, folders of them, or patterns such as 'scans/*.ply';
    /// the built-in sample if left out
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,

    /// Folder for the results; for a batch, the folder that their folders are in [default: the
    /// current folder, and in it INPUT's stem with .fam]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Format of the mesh or cloud with UVs [default: that of the input; OBJ for STL]
    #[arg(long, value_enum)]
    pub format: Option<FormatName>,

    /// glTF: the texture coordinate set that takes the UVs; the others are kept
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=7))]
    pub uv_set: u32,

    /// glTF: give every mesh a checker texture, so that any viewer shows the result
    #[arg(long)]
    pub checker: bool,

    /// glTF: add the seams as lines
    #[arg(long)]
    pub seam_lines: bool,

    /// Give every material a UV square of its own; else all share one
    #[arg(long)]
    pub per_material: bool,

    /// Batch: also redo what is done
    #[arg(long)]
    pub force: bool,

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
            inputs: Vec::new(),
            out: None,
            format: None,
            uv_set: 0,
            checker: false,
            seam_lines: false,
            per_material: false,
            force: false,
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
/// Points are taken in the units of the surface that the model was trained on.
#[derive(Debug, Args)]
pub struct Map {
    /// model.safetensors of an `unwrap`
    #[arg(long, value_name = "FILE")]
    pub model: PathBuf,

    /// Mesh or point cloud
    pub input: PathBuf,

    /// File to write: the input with UVs, in the format of the extension
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,

    /// Keep the faces of different materials apart, as `unwrap --per-material` does
    #[arg(long)]
    pub per_material: bool,

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

names!(FormatName for Format { Glb, Gltf, Obj, Off, Ply, Xyz });
names!(JacobianName for JacobianMode { DoubleBackward, ForwardTangent });
names!(ObjectiveName for Objective { Paper, Reference });
names!(SamplingName for Sampling { PoissonDisk, Vertices });
names!(Part for Ablation { DeformBranch, UnwrapBranch, CutNet });
names!(SeamRuleName for SeamRule { Spacing, Paper });
