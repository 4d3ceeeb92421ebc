use clap::Args;
use clap::builder::RangedU64ValueParser;

use super::names::{BackendName, JacobianName, Preset};

/// How fast each backend trains, where its time goes, and whether it trains right.
///
/// Every backend takes the same steps on the same surface (a torus) from the same weights, in a
/// process of its own. Times are medians over the steps. `forward` is the networks at the
/// points, `Jacobian` the derivatives of Wrap-Net (with forward tangents: and that network there),
/// `neighbours` the nearest neighbours that losses need, `losses` all else before the backward
/// pass, `backward` that pass, and `optimizer` the rest of a step. GFLOP/s counts the matrix
/// products of a step with forward tangents; `product` is the rate of one of 1024 × 1024
/// matrices. Losses that agree say that a backend computes what the others do.
#[derive(Debug, Args)]
pub struct Bench {
    /// Backends to compare [default: all that are compiled in and find a device]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAMES")]
    pub backends: Vec<BackendName>,

    /// What is trained: `fast`, or the paper's configuration (gigabytes, seconds a step)
    #[arg(long, value_enum, default_value_t = Preset::Fast)]
    pub preset: Preset,

    /// How the distortion term is differentiated [default: as the preset does]
    #[arg(long, value_enum)]
    pub jacobian: Option<JacobianName>,

    /// Steps that are measured, after one that is not
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = RangedU64ValueParser::<usize>::new().range(1..=100_000))]
    pub steps: usize,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}
