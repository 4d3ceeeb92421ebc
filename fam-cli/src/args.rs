//! The command line.

mod bench;
mod evaluate;
mod names;
mod pack;
mod unwrap;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub use bench::Bench;
pub use evaluate::{Evaluate, Suite};
#[cfg(test)]
pub use names::FinishName;
pub use names::{BackendName, Preset, PurposeName, name_of};
pub use pack::Pack;
pub use unwrap::Unwrap;

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
    Unwrap(Box<Unwrap>),
    Map(Map),
    Pack(Pack),
    Metrics(Metrics),
    Evaluate(Evaluate),
    Report(Report),
    Import(Import),
    Export(Export),
    Bench(Bench),
    /// The backends compiled in and the adapters found
    Backends,
}

/// UVs for any points or mesh from a trained model.
///
/// Points are taken in the units of the surface that the model was trained on. The UVs are
/// those of the raw map: a finished layout belongs to the mesh that it was made for.
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

/// What came of many files: manifests of `unwrap`, merged.
///
/// Of every file the latest entry counts, so the manifests of all shards and of runs that were
/// started again give one picture.
#[derive(Debug, Args)]
pub struct Report {
    /// Manifests, or folders that hold some
    #[arg(value_name = "MANIFEST", required = true)]
    pub manifests: Vec<PathBuf>,

    /// Print the merged manifest instead: JSON, an entry per line
    #[arg(long)]
    pub json: bool,
}

/// A model from the weights that the authors' PyTorch program trained.
///
/// FILE is what it saved by `torch.save`: a state dictionary, or a dictionary that holds one. The model
/// serves `fam map`.
#[derive(Debug, Args)]
pub struct Import {
    /// The PyTorch file (.pth, .pt), or a safetensors file with the same names
    #[arg(value_name = "FILE")]
    pub input: PathBuf,

    /// File to write: model.safetensors
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,

    /// The mesh or cloud that the networks were trained on: points are then in its units, and its UVs
    /// fill the unit square
    ///
    /// Without it, points are those of the unit ball, and UVs those of the networks.
    #[arg(long, value_name = "INPUT")]
    pub surface: Option<PathBuf>,
}

/// The weights of a model for the authors' PyTorch program.
///
/// OUT is a state dictionary with that program's names, for `torch.load` and `load_state_dict`. Points
/// have to be normalised by the caller, and UVs are those of the networks. The program must make its
/// networks as wide as these: the preset `paper` has the widths of that program.
#[derive(Debug, Args)]
pub struct Export {
    /// model.safetensors of an `unwrap`, with a single set of networks
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,

    /// File to write (.pth)
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,
}

/// Quality of the UVs that a mesh already has.
///
/// Exit codes: 0 measured, 1 an engine would bake or draw something wrong (with --for), 2 bad input or
/// usage.
#[derive(Debug, Args)]
pub struct Metrics {
    /// Mesh with UVs
    pub input: PathBuf,

    /// Also say what a game engine or baker would complain about: overlaps, charts too near to each
    /// other, outside of the square or too narrow, uneven texel density, mirrored charts
    ///
    /// `lightmap` takes 1024 texels and a margin of 2, and every triangle needs texels of its own.
    /// `texture` takes 2048 and 4; charts may be stacked and lie in UDIM tiles. Each finding is an error,
    /// a warning or a note.
    #[arg(long = "for", value_enum, value_name = "PURPOSE")]
    pub purpose: Option<PurposeName>,

    /// Texels along a side of the texture, for --for
    #[arg(long, value_name = "TEXELS", requires = "purpose")]
    pub resolution: Option<u32>,

    /// Texels that are to lie between charts, for --for
    #[arg(
        long,
        value_name = "TEXELS",
        requires = "purpose",
        allow_negative_numbers = true
    )]
    pub margin: Option<f64>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}
