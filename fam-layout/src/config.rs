//! What a layout is to reach.

use serde::{Deserialize, Serialize};

use crate::pack::options::MOST_TILES;
use crate::{Stack, Symmetry};

/// What finishing is to reach, and what it may cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct LayoutConfig {
    /// Mean symmetric Dirichlet energy that a layout may have; 4 is that of an isometry.
    pub distortion_bound: f64,
    /// How much a seam costs against distortion: cuts that pay less are left out.
    pub seam_weight: f64,
    /// How much more a seam costs where the surface is seen than where it is hidden, by the third power
    /// of what ambient occlusion says: at 1 thirty-one times as much in full view as where nothing is
    /// seen; at 0 the same.
    ///
    /// In 0..=1e6; 0 by default.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub hide_seams: f64,
    /// The direction from which the surface is seen, of any length: for seams what lies on its far
    /// side is hidden. If `None`, it is seen from all sides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen_from: Option<[f64; 3]>,
    /// How much a seam costs where it is painted not to be, by
    /// [`Marks::with_paint`](crate::Marks::with_paint): at 1, eleven times as much at a paint of 1 as at 0.
    /// In 0..=1e6; 1 by default.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub paint_weight: f64,
    /// How much less a seam costs along creases: by so many tenths where the surface turns by a right
    /// angle or more, and along [hard edges](crate::Marks::with_hard_edges). In 0..=9; 1 by default.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub crease_weight: f64,
    /// How much less a seam costs along the tears of a map: by so many tenths. In 0..=9; 1 by default.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub tear_weight: f64,
    /// Seams are wanted along all edges at which the surface turns by at least so many degrees, except
    /// forbidden ones. In 1..=180.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hard_angle: Option<f64>,
    /// Whether the layout is as symmetric as the surface: seams and charts on one side of a mirror plane
    /// are mirror images of those on the other. It is off by default.
    ///
    /// Where vertices are mirror images of each other, to the last bit or nearly, so are UVs, to the
    /// last bit: `u' = 2a − u` within a chart that lies on the plane, and up to a shift between two
    /// charts or components. Where only the surface is its own mirror image, such as that of a scan, seams and
    /// charts are mirror images as nearly as its edges allow. All else is laid out as if this were off.
    #[serde(default, skip_serializing_if = "Symmetry::is_off")]
    pub symmetry: Symmetry,
    /// Most charts that a component is cut into to come within the bound, or to fill the square; if
    /// `None`, as many as that takes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_charts: Option<usize>,
    /// How much better the square must be used for a seam: charts are divided where their pieces fill
    /// it so much more that it pays. A seam as long as the side of a square of the surface's area is
    /// worth it where `2 · coverage_weight / √coverage` falls by 1, with the share of the square that charts
    /// cover: texels are `1 / √coverage` times as large as if all of it were used. At 0 none is divided.
    ///
    /// In 0..=1e6; 0 by default.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub coverage_weight: f64,
    /// Whether charts that are nearly rectangles or strips get straight sides, along the axes, as far as
    /// their energy stays within the bound.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub straighten: bool,
    /// The direction, of any length, that is up in the surface's space. Every chart is turned so that it
    /// is up in the square too, except symmetric ones. If `None`, charts are turned as they fit best.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upright: Option<[f64; 3]>,
    /// Empty texels between charts.
    pub margin: f64,
    /// Texels along the side of the UV square, or of each of its tiles. Of no use with a texel density
    /// and a single tile: the side follows from the density then.
    pub resolution: u32,
    /// Texels per unit of length of the input. If `None`, charts become as large as found possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texel_density: Option<f64>,
    /// Most UDIM tiles, in 1..=100: charts are spread over all of them, or over as many as the texel
    /// density takes. With several UV squares each is a tile.
    #[serde(default = "one_tile", skip_serializing_if = "is_one_tile")]
    pub tiles: u32,
    /// Whether charts begin at corners of texels and the margin counts whole ones, as lightmaps need.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub whole_texels: bool,
    /// Which components share their place in the square.
    #[serde(default, skip_serializing_if = "is_none")]
    pub stack: Stack,
}

fn is_direction(vector: [f64; 3]) -> bool {
    vector.iter().all(|c| c.is_finite()) && vector != [0.0; 3]
}

fn is_none(stack: &Stack) -> bool {
    *stack == Stack::None
}

fn is_zero(weight: &f64) -> bool {
    *weight == 0.0
}

fn one_tile() -> u32 {
    1
}

fn is_one_tile(tiles: &u32) -> bool {
    *tiles == 1
}

fn one() -> f64 {
    1.0
}

fn is_one(weight: &f64) -> bool {
    *weight == 1.0
}

impl Default for LayoutConfig {
    fn default() -> Self {
        Self {
            distortion_bound: 4.1,
            seam_weight: 1.0,
            hide_seams: 0.0,
            seen_from: None,
            paint_weight: 1.0,
            crease_weight: 1.0,
            tear_weight: 1.0,
            hard_angle: None,
            symmetry: Symmetry::Off,
            max_charts: None,
            coverage_weight: 0.0,
            straighten: false,
            upright: None,
            margin: 4.0,
            resolution: 2048,
            texel_density: None,
            tiles: 1,
            whole_texels: false,
            stack: Stack::None,
        }
    }
}

impl LayoutConfig {
    /// What keeps a surface from being finished with this configuration, if anything: a
    /// message that names the field.
    pub fn problem(&self) -> Option<&'static str> {
        if !(self.distortion_bound.is_finite() && self.distortion_bound > 4.0) {
            Some("distortion-bound must be a number above 4, the energy of an isometry")
        } else if !(0.0..=1e6).contains(&self.seam_weight) {
            Some("seam-weight must lie in 0..=1e6")
        } else if !(0.0..=1e6).contains(&self.hide_seams) {
            Some("hide-seams must lie in 0..=1e6")
        } else if self.seen_from.is_some_and(|d| !is_direction(d)) {
            Some("seen-from must be a direction: three finite numbers, not all of them 0")
        } else if !(0.0..=1e6).contains(&self.paint_weight) {
            Some("paint-weight must lie in 0..=1e6")
        } else if !(0.0..=9.0).contains(&self.crease_weight) {
            Some("crease-weight must lie in 0..=9")
        } else if !(0.0..=9.0).contains(&self.tear_weight) {
            Some("tear-weight must lie in 0..=9")
        } else if self
            .hard_angle
            .is_some_and(|angle| !(1.0..=180.0).contains(&angle))
        {
            Some("hard-angle must lie in 1..=180 degrees")
        } else if !(0.0..=1e6).contains(&self.coverage_weight) {
            Some("coverage-weight must lie in 0..=1e6")
        } else if self.upright.is_some_and(|d| !is_direction(d)) {
            Some("upright must be a direction: three finite numbers, not all of them 0")
        } else if !self.symmetry.is_plane() {
            Some("symmetry must be a plane: a normal of finite numbers, not all 0, and an offset")
        } else if self.max_charts == Some(0) {
            Some("max-charts must be at least 1")
        } else if !(16..=65_536).contains(&self.resolution) {
            Some("resolution must lie in 16..=65536")
        } else if !(0.0..=f64::from(self.resolution) / 4.0).contains(&self.margin) {
            Some("margin must lie between 0 and a quarter of the resolution")
        } else if self
            .texel_density
            .is_some_and(|d| !(d > 0.0 && d.is_finite()))
        {
            Some("texel-density must be a positive number")
        } else if !(1..=MOST_TILES).contains(&self.tiles) {
            Some("tiles must lie in 1..=100")
        } else {
            None
        }
    }
}
