use std::path::PathBuf;

use clap::Args;

use super::names::{BackendName, Preset};

/// A table of what training and finishing make of meshes.
///
/// Every mesh is trained on once and laid out three times: guided by the network's tears, directly
/// (as `--method direct` does), and guided with a distortion bound of 4.03. The table, in Markdown,
/// has a row for each and one for the raw map.
///
/// Exit codes: 0 done, 1 a mesh failed (its row has the reason), 2 bad input or usage, 130
/// interrupted (the table has what was done until then).
#[derive(Debug, Args)]
pub struct Evaluate {
    /// Meshes, folders of them, or patterns such as 'scans/*.ply'
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<PathBuf>,

    /// File for the table, written anew after every mesh [default: standard output]
    #[arg(short, long, value_name = "TABLE.md")]
    pub out: Option<PathBuf>,

    /// Print JSON on standard output instead of the table
    #[arg(long)]
    pub json: bool,

    /// How to train: `fast` takes half a minute on a CPU, `paper` is the paper's (hours on a CPU)
    #[arg(long, value_enum, default_value_t = Preset::Fast)]
    pub preset: Preset,

    /// Training iterations
    #[arg(long, value_name = "N")]
    pub iterations: Option<usize>,

    /// Do not train: take the model NAME.fam/model.safetensors in this folder for the mesh NAME,
    /// as `fam unwrap -o DIR` writes it
    #[arg(long, value_name = "DIR", conflicts_with_all = ["preset", "iterations"])]
    pub models: Option<PathBuf>,

    /// TOML file with columns of figures to compare with, such as docs/reference-figures.toml
    #[arg(long, value_name = "FILE.toml")]
    pub reference: Option<PathBuf>,

    /// What computes: `auto` takes a real GPU if there is one, else the CPU
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,

    /// No progress on standard error; errors stay
    #[arg(short, long)]
    pub quiet: bool,
}
