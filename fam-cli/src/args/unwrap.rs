use std::path::PathBuf;

use clap::Args;
use fam_layout::Symmetry;
use serde::{Deserialize, Serialize};

use crate::paint::Paint;
use crate::parting::Squares;
use crate::shard::Shard;
use crate::weights::Weight;

use super::names::{
    BackendName, FinishName, FormatName, JacobianName, MethodName, ObjectiveName, Part, Preset,
    SamplingName, SeamRuleName, StackName,
};

/// Time between checkpoints: what an end in the middle costs.
const CHECKPOINT_EVERY: std::time::Duration = std::time::Duration::from_secs(30);

/// Write a surface with UVs, its seams, pictures and metrics.
///
/// A mesh is cut along edges, flattened without flips and overlaps, cut further until the
/// distortion is within its bound, and packed. Networks are trained first where --method says so:
/// for point clouds, and for maps that give UVs to any point. Cuts follow the tears of their map.
///
/// Reads GLB, glTF, OBJ, OFF, PLY, STL and XYZ, whatever the extension says; files without
/// faces are point clouds. Writes a folder with the input and its UVs, seams.json and
/// seams.obj, metrics.json, config.toml (for --config), model.safetensors (trained networks),
/// uv.png and preview.png. Ctrl-C stops early and still writes all of them.
///
/// Several inputs, a folder or a pattern are a batch: every file is tried and gets a folder of
/// its own, and a table and manifest.jsonl say what came of each (see `fam report`). Started
/// again, it skips what is done.
///
/// Exit codes: 0 done, 1 training or writing failed (or any file of a batch), 2 bad input or
/// usage, 130 interrupted.
// Workers of a batch get these as JSON. The inputs, what only the batch needs and `config`, which is
// resolved, are left out.
#[derive(Debug, Args, Serialize, Deserialize)]
pub struct Unwrap {
    /// Meshes and point clouds to flatten, folders of them, or patterns such as 'scans/*.ply';
    /// the built-in sample if left out
    #[arg(value_name = "INPUT")]
    #[serde(skip)]
    pub inputs: Vec<PathBuf>,

    /// Folder for the results; for a batch, the folder that their folders are in [default: the
    /// current folder, and in it INPUT's stem with .fam]
    #[arg(short, long, value_name = "DIR")]
    #[serde(skip)]
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

    /// Give every object a UV square of its own
    #[arg(long, conflicts_with = "per_material")]
    pub per_object: bool,

    /// Give triangles that coincide with others room of their own, as lightmaps need; else they
    /// share UVs, as the two sides of a sheet do
    #[arg(long)]
    pub separate_duplicates: bool,

    /// Batch: also redo what is done
    #[arg(long)]
    pub force: bool,

    /// Batch: files at the same time, each in a process of its own, as far as memory allows
    /// [default: one per processor core; 1 where networks are trained for every file]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    #[serde(skip)]
    pub jobs: Option<u16>,

    /// Longest time for a file: `30s`, `2m`. It is given up when the time is over
    #[arg(long, value_name = "TIME", value_parser = crate::time::duration)]
    #[serde(skip)]
    pub timeout: Option<std::time::Duration>,

    /// Batch: only every N-th file, beginning with the K-th; together the shards 1/N to N/N have all
    ///
    /// For machines that see the same files, each with a shard of its own. `slurm` is the shard of
    /// the task in a Slurm array.
    #[arg(long, value_name = "K/N")]
    #[serde(skip)]
    pub shard: Option<Shard>,

    /// A file of a batch and the folder for its results: this process is a worker of another one
    #[arg(long, hide = true, num_args = 2, allow_hyphen_values = true)]
    #[serde(skip)]
    pub worker: Option<Vec<PathBuf>>,

    /// How UVs are made: `direct` lays a mesh out as it is, in seconds; `neural` trains the networks
    /// of the paper first, as point clouds need it
    ///
    /// `auto` is direct for meshes. It is neural for point clouds, and where an option asks for what
    /// only the networks have: --preset, --points, --iterations, --starts, --jacobian, --objective,
    /// --sampling, --without, --no-normals, --finish none, or a --config with training in it. Only
    /// with networks there is a model.safetensors, for `fam map`.
    #[arg(long, value_enum)]
    pub method: Option<MethodName>,

    /// How networks are trained: `fast` takes half a minute on a CPU, `paper` is the paper's
    /// configuration (hours on a CPU) [default: fast]
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,

    /// TOML file that overrides the preset; a config.toml of an earlier run serves
    #[arg(long, value_name = "FILE.toml")]
    #[serde(skip)]
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

    /// About how long a file may take: `30s`, `2m`. Seams are no longer shortened when it is over
    ///
    /// Training is planned for it: some steps are measured first, then the number of iterations is
    /// chosen. Where the most iterations of the preset `fast` leave time, its networks and points grow
    /// (others stay as they are). config.toml has all of it, and gives the same
    /// raw map again. Training takes at least 50 iterations, and the paper's 10,000 at most; where
    /// several starts would leave fewer than 200, there is a single one.
    #[arg(long, value_name = "TIME", value_parser = crate::time::duration, conflicts_with = "iterations")]
    pub time_budget: Option<std::time::Duration>,

    /// Go on with the training that an earlier run into the same folder left unfinished, if there is one
    ///
    /// A training saves itself in checkpoint.safetensors while it runs. On a CPU, one that goes on ends
    /// in the same files as one that was never ended. Input, options of training, backend and version
    /// must be the same.
    #[arg(long)]
    pub resume: bool,

    /// Time between two checkpoints of a training
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = crate::time::duration)]
    pub checkpoint_every: std::time::Duration,

    /// Fresh weights to start from; once they have opened the surface, the best two go on, and one
    /// of them to the end
    ///
    /// The preset `fast` has 6, and 10 % of the iterations for opening. The preset `paper` has one
    /// and no opening, which several would need: `opening = 0.1` in a file for --config.
    #[arg(long, value_name = "N")]
    pub starts: Option<usize>,

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

    /// What counts as torn in a cloud or a raw map: `spacing` adapts the paper's threshold to
    /// the density of points, `paper` takes 2 % of the UV square as it is
    #[arg(long, value_enum, default_value_t = SeamRuleName::Spacing)]
    pub seam_rule: SeamRuleName,

    /// What becomes of the map that training ends with: `full` finishes it, `none` leaves it as
    /// it is, with triangles smeared across its tears [default: full]
    #[arg(long, value_enum, help_heading = "Finishing")]
    pub finish: Option<FinishName>,

    /// Distortion up to which seams are added: the mean symmetric Dirichlet energy, 4 for none at
    /// all [default: 4.1]
    #[arg(
        long,
        value_name = "ENERGY",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub distortion_bound: Option<f64>,

    /// What seams cost against distortion: the higher, the fewer above the bound [default: 1]
    #[arg(
        long,
        value_name = "WEIGHT",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub seam_weight: Option<f64>,

    /// Cut where little is seen: in folds, behind parts that lie before others, inside
    ///
    /// What is seen is found by ambient occlusion, with the mesh itself in the way. At the weight of
    /// 1, which is that of the option alone, a seam costs thirty-one times as much where nothing hides it
    /// as where nothing is seen. A lower weight makes shorter seams [default: 0]
    #[arg(
        long,
        value_name = "WEIGHT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "1",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub hide_seams: Option<f64>,

    /// Hide seams from one side only: x, y or z with a sign, or a vector X,Y,Z
    ///
    /// With `+z` seams go to undersides, with `-y` behind what faces the negative y axis. The weight
    /// is that of --hide-seams, or 1.
    #[arg(
        long,
        value_name = "DIRECTION",
        value_parser = crate::direction::direction,
        help_heading = "Finishing",
        allow_hyphen_values = true
    )]
    pub seen_from: Option<[f64; 3]>,

    /// Lay out mirror images as mirror images: seams and charts of both sides are the same
    ///
    /// `auto` finds the plane, `x` is across the x axis; four numbers are a plane of your own, its
    /// normal and its offset along that: 1,0,0,0.5. Parts without such a symmetry are laid out as
    /// usual. Seams may be longer for it. [default: off]
    #[arg(
        long,
        value_name = "PLANE",
        value_parser = crate::symmetry::symmetry,
        help_heading = "Finishing",
        allow_hyphen_values = true
    )]
    pub symmetry: Option<Symmetry>,

    /// Let equal parts share their place in the square, on purpose: `identical` ones, or `mirrored` ones
    /// as well, whose triangles are clockwise then
    ///
    /// With --symmetry, `mirrored` also lays one half of a symmetric part upon the other, if their
    /// vertices correspond.
    #[arg(long, value_enum, value_name = "PARTS", help_heading = "Finishing")]
    pub stack: Option<StackName>,

    /// Straighten charts that are nearly rectangles or strips, such as pipes and frames, along the axes
    ///
    /// Only within --distortion-bound.
    #[arg(long, help_heading = "Finishing")]
    pub straighten: bool,

    /// Turn every chart so that what is up in the world is up in the texture; +y is up, or another
    /// direction as for --seen-from
    #[arg(
        long,
        value_name = "DIRECTION",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "+y",
        value_parser = crate::direction::direction,
        help_heading = "Finishing",
        allow_hyphen_values = true
    )]
    pub upright: Option<[f64; 3]>,

    /// Divide long and hooked charts where the square is filled so much better that it pays for the
    /// seam [default: 0]
    ///
    /// Without a weight it is 1: a seam as long as the root of the surface's area is worth it where 1 over
    /// the root of the share of the square that charts cover falls by a half.
    #[arg(
        long,
        value_name = "WEIGHT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "1",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub coverage_weight: Option<f64>,

    /// Most charts for each connected piece of a mesh [default: as many as the bound takes]
    #[arg(long, value_name = "N", help_heading = "Finishing")]
    pub max_charts: Option<usize>,

    /// Empty texels between charts [default: 4]
    #[arg(
        long,
        value_name = "TEXELS",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub margin: Option<f64>,

    /// Texels along a side of the texture that the margin is meant for [default: 2048]
    #[arg(long, value_name = "TEXELS", help_heading = "Finishing")]
    pub resolution: Option<u32>,

    /// Texels per unit of length; without it charts become as large as they fit
    ///
    /// The texture is as large as it has to be then, which metrics.json tells; with --udim as many tiles
    /// of --resolution are filled as it takes.
    #[arg(
        long,
        value_name = "TEXELS",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub texel_density: Option<f64>,

    /// Spread the charts over N UDIM tiles; with --texel-density over N at most
    ///
    /// Tile 1001 is the unit square, 1002 the next to the right, 1011 the one above. With --per-material
    /// or --per-object, every material or object has a tile.
    #[arg(long, value_name = "N", help_heading = "Finishing")]
    pub udim: Option<u32>,

    /// Begin charts at corners of texels and leave whole texels between them, for lightmaps
    #[arg(long, help_heading = "Finishing")]
    pub whole_texels: bool,

    /// Give a material or an object FACTOR times as many texels along every length as others; may be
    /// repeated
    ///
    /// A triangle of a material and of an object that both have a factor gets the one that is named last.
    #[arg(
        long,
        value_name = "NAME=FACTOR",
        value_parser = crate::weights::weight,
        help_heading = "Finishing"
    )]
    pub weight: Vec<Weight>,

    /// Cut along all edges that FILE marks, before looking for other cuts
    ///
    /// FILE is the seams.json of an earlier run, edited or not, or an OBJ file with lines (`l`)
    /// along edges of the mesh, as Blender exports selected edges that were separated. Lines are
    /// matched by position, edges in JSON by vertex numbers.
    ///
    /// All of these edges become seams. Lines that divide a piece of the mesh make several charts
    /// of it, even more than --max-charts. Needs a single input, which must be a mesh.
    #[arg(long, value_name = "FILE", help_heading = "Finishing")]
    pub seams: Option<PathBuf>,

    /// Do not cut along the edges that FILE marks, unless there is no other way
    ///
    /// FILE is as for --seams. Such an edge is cut only where a valid layout needs it, as on a
    /// closed surface that is forbidden all over, or where --seams marks it too; a warning says
    /// how many were. The distortion may stay above --distortion-bound for it.
    #[arg(long, value_name = "FILE", help_heading = "Finishing")]
    pub no_seams: Option<PathBuf>,

    /// Keep the seams of the UVs that the mesh has, and flatten its charts anew
    ///
    /// No other edges are cut, unless there is no other way to a valid layout; a warning says how many
    /// were. The distortion may stay above --distortion-bound for it. `fam pack` keeps the charts
    /// themselves.
    #[arg(long, help_heading = "Finishing")]
    pub keep_seams: bool,

    /// Lower the distortion of the UVs that the mesh has, without new seams
    ///
    /// Charts within --distortion-bound that neither overlap nor have flipped triangles stay byte for
    /// byte. The others are flattened anew, as with --keep-seams, and placed beside those, at the size of
    /// these at most.
    #[arg(
        long,
        conflicts_with_all = ["keep_seams", "only", "selected", "seams", "no_seams"],
        help_heading = "Finishing"
    )]
    pub improve: bool,

    /// Unwrap only a material or an object; the UVs of all others stay byte for byte; may be repeated
    ///
    /// What is new is placed beside them, at their size at most.
    #[arg(long, value_name = "NAME", help_heading = "Finishing")]
    pub only: Vec<String>,

    /// Unwrap only faces whose vertices have a value of more than 0.5 of an attribute of the file
    ///
    /// A property of PLY, an attribute of glTF such as _SELECTED or COLOR_0, or `color` in OBJ. The UVs of
    /// all others stay.
    #[arg(long, value_name = "ATTRIBUTE", help_heading = "Finishing")]
    pub selected: Option<String>,

    /// Cut along all edges at which the surface turns by DEGREES or more, as baked normal maps like it
    ///
    /// Edges of --no-seams and diagonals of polygons are left out.
    #[arg(
        long,
        value_name = "DEGREES",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub hard_angle: Option<f64>,

    /// Avoid seams where an attribute of the vertices says so: from 0, where seams are welcome, to 1
    ///
    /// A property of PLY, an attribute of glTF such as _SEAMS or COLOR_0, or `color` in OBJ. At the weight
    /// of 1, a seam costs eleven times as much at 1 as at 0.
    #[arg(
        long,
        value_name = "ATTRIBUTE[=WEIGHT]",
        value_parser = crate::paint::paint,
        help_heading = "Finishing"
    )]
    pub paint: Option<Paint>,

    /// How much cheaper seams are along creases, by tenths: at a right angle, and where the file has hard
    /// edges or the border of a material [default: 1]
    ///
    /// Hard edges of a file are those at which its normals or its smoothing groups change. At 0 creases
    /// do not count; at 9 a seam along one costs a tenth.
    #[arg(
        long,
        value_name = "WEIGHT",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub crease_weight: Option<f64>,

    /// How much cheaper seams are along the tears of a trained map, by tenths [default: 1]
    #[arg(
        long,
        value_name = "WEIGHT",
        help_heading = "Finishing",
        allow_negative_numbers = true
    )]
    pub tear_weight: Option<f64>,

    /// No progress on standard error; warnings and errors stay
    #[arg(short, long)]
    pub quiet: bool,

    /// Print a summary as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

impl Unwrap {
    /// Which triangles share a UV square.
    pub fn squares(&self) -> Squares {
        Squares::of(self.per_material, self.per_object)
    }
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
            per_object: false,
            separate_duplicates: false,
            force: false,
            jobs: None,
            timeout: None,
            shard: None,
            worker: None,
            method: None,
            preset: None,
            config: None,
            backend: BackendName::Auto,
            points: None,
            iterations: None,
            time_budget: None,
            resume: false,
            checkpoint_every: CHECKPOINT_EVERY,
            starts: None,
            seed: None,
            jacobian: None,
            objective: None,
            sampling: None,
            without: None,
            no_normals: false,
            seam_rule: SeamRuleName::Spacing,
            finish: None,
            distortion_bound: None,
            seam_weight: None,
            hide_seams: None,
            seen_from: None,
            symmetry: None,
            stack: None,
            straighten: false,
            upright: None,
            coverage_weight: None,
            max_charts: None,
            margin: None,
            resolution: None,
            texel_density: None,
            udim: None,
            whole_texels: false,
            weight: Vec::new(),
            seams: None,
            no_seams: None,
            keep_seams: false,
            improve: false,
            only: Vec::new(),
            selected: None,
            hard_angle: None,
            paint: None,
            crease_weight: None,
            tear_weight: None,
            quiet: false,
            json: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Arguments, Command};
    use clap::Parser;

    /// `fam` alone is `fam unwrap`.
    #[test]
    fn without_options_all_are_as_by_default() {
        let parsed = Arguments::try_parse_from(["fam", "unwrap"]).unwrap();
        let Some(Command::Unwrap(parsed)) = parsed.command else {
            panic!("it is another command");
        };
        assert_eq!(format!("{parsed:?}"), format!("{:?}", Unwrap::default()));
    }
}
