use std::path::PathBuf;

use clap::Args;

use crate::weights::Weight;

use super::names::TurnsName;

/// Lay the charts of UVs that are there side by side anew.
///
/// Charts keep their shapes and, without --texel-density, their sizes relative to each other. They are
/// turned, but not mirrored. Those that are mirrored or overlap themselves are named on standard error
/// and packed as they are; charts that share edges in the plane stay together. Several files share one
/// square.
#[derive(Debug, Args)]
pub struct Pack {
    /// Meshes with UVs
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<PathBuf>,

    /// File to write, in the format of its extension; a folder for several inputs, in which they keep
    /// their names
    #[arg(short, long, value_name = "OUT")]
    pub out: PathBuf,

    /// Empty texels between charts
    #[arg(
        long,
        value_name = "TEXELS",
        default_value_t = 4.0,
        allow_negative_numbers = true
    )]
    pub margin: f64,

    /// Texels along a side of the square, or of each tile
    #[arg(long, value_name = "TEXELS", default_value_t = 2048)]
    pub resolution: u32,

    /// How charts may be turned: by any angle, by right angles, or not at all
    #[arg(long, value_enum, default_value_t = TurnsName::Free)]
    pub turns: TurnsName,

    /// Texels per unit of length: every chart gets this density. The texture is as large as it has to
    /// be then; with --udim as many tiles are filled as it takes
    #[arg(long, value_name = "TEXELS", allow_negative_numbers = true)]
    pub texel_density: Option<f64>,

    /// Spread the charts over N UDIM tiles; with --texel-density over N at most
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub udim: u32,

    /// Begin charts at corners of texels and leave whole texels between them, for lightmaps
    #[arg(long)]
    pub whole_texels: bool,

    /// Give the charts of a material or an object FACTOR times the length against others; may be repeated
    ///
    /// A triangle of a material and of an object that both have a factor gets the one that is named last, a
    /// chart the largest factor among its triangles, where those without any have 1. With several files, the
    /// materials and objects of that name of all of them count.
    #[arg(long, value_name = "NAME=FACTOR", value_parser = crate::weights::weight)]
    pub weight: Vec<Weight>,

    /// Pack every material into a UV square of its own; with --udim into a tile of its own
    #[arg(long)]
    pub per_material: bool,

    /// Print what came of it as JSON
    #[arg(long)]
    pub json: bool,
}
