use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::names::{BackendName, Preset};

/// What the method makes of surfaces: a table of your meshes, or the paper's evaluation.
///
/// Without --suite, every mesh is trained on once and laid out three times: guided by the network's
/// tears, directly (as `--method direct` does), and guided with a distortion bound of 4.03. The table,
/// in Markdown, has a row for each and one for the raw map.
///
/// With --suite, the surfaces are generated ones of the kinds that the paper shows, and those files of
/// INPUT that have the names of the paper's models. The page has the paper's tables: conformality of
/// meshes and clouds, self-intersection, times, noise and ablations, with pictures. Beside the page
/// PAGE.md come PAGE.json, the pictures in PAGE/ and the folder PAGE.work/, from which the same command
/// goes on where it stopped.
///
/// Exit codes: 0 done, 1 a surface failed (its row has the reason), 2 bad input or usage, 130
/// interrupted (the table has what was done until then).
#[derive(Debug, Args)]
pub struct Evaluate {
    /// Meshes, folders of them, or patterns such as 'scans/*.ply'
    #[arg(value_name = "INPUT", required_unless_present = "suite")]
    pub inputs: Vec<PathBuf>,

    /// The paper's evaluation: `quick` has a few generated surfaces and one seed, `paper` all of them,
    /// three seeds, all ablations and levels of noise
    #[arg(long, value_enum)]
    pub suite: Option<Suite>,

    /// Of the suite, only the surfaces with these names
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', requires = "suite")]
    pub only: Vec<String>,

    /// Program that lays out the suite's surfaces by other tools, such as
    /// fam-layout/benches/peers/layouts; it is called with a folder of OBJ files and one for its results
    #[arg(long, value_name = "PROGRAM", requires = "suite")]
    pub peers: Option<PathBuf>,

    /// File for the table, written anew after every surface [default: standard output; with --suite:
    /// evaluation.md]
    #[arg(short, long, value_name = "PAGE.md")]
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
    #[arg(long, value_name = "DIR", conflicts_with_all = ["preset", "iterations", "suite"])]
    pub models: Option<PathBuf>,

    /// TOML file with columns of figures to compare with, such as docs/reference-figures.toml
    #[arg(long, value_name = "FILE.toml", conflicts_with = "suite")]
    pub reference: Option<PathBuf>,

    /// What computes: `auto` takes a real GPU if there is one, else the CPU
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,

    /// No progress on standard error; errors stay
    #[arg(short, long)]
    pub quiet: bool,
}

/// What is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Suite {
    Quick,
    Paper,
}
