//! UV layouts of meshes: cut, flattened, refined and packed, without a network.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use fam_layout::{LayoutConfig, Marks, MeshInput, lay_out};
//! use fam_surface::{Components, UvMap, shapes};
//!
//! # fn main() -> Result<(), fam_surface::SurfaceError> {
//! let mesh = shapes::torus(1.0, 0.4, 24, 12);
//! let components = Components::of(&mesh, &[])?;
//! let marks = Marks::default();
//! let input = MeshInput { components: &components, map: None, squares: &[], marks: &marks };
//! let layout = lay_out(&LayoutConfig::default(), &input, &mut |_| ControlFlow::Continue(()));
//! let maps: Vec<UvMap> = layout.components.iter().map(|c| c.uvs.clone()).collect();
//! let uvs = components.uv_map(&maps)?; // a UV for every corner of the mesh, in the unit square
//! assert!(layout.energy() <= 4.1 && uvs.triangles().len() == mesh.triangles().len());
//! # Ok(())
//! # }
//! ```
//!
//! # The pipeline
//!
//! Every component goes through these stages, in folders of their names; those that are flat
//! already skip all but the last.
//!
//! 1. `patch`: a component, coherently oriented, as half-edges that keep their numbers when it is
//!    cut; `marks`: it is opened along the edges where somebody wants seams.
//! 2. `costs`: what a seam along an edge costs: its length, less at creases and tears.
//! 3. `cut`: the cheapest cuts that open it to a disk.
//! 4. `solve`: flattened without flipped or overlapping triangles, with as little symmetric
//!    Dirichlet energy as its boundary allows.
//! 5. `refine`: cut further until its distortion is within the bound; seams that are not needed
//!    for that are closed. Large ones are cut on simpler surfaces (`simplify`) first.
//! 6. `divide`: what cannot be had in one piece becomes several charts.
//! 7. `pack`: all charts side by side in the unit square, at one texel density.
//!
//! [`lay_out_cloud`] finds a surface through the points of a cloud first (`cloud`).

#[cfg(test)]
mod checks;
mod cloud;
mod component;
mod costs;
mod cut;
mod distortion;
mod divide;
mod flat;
mod marks;
mod pace;
mod pack;
mod parallel;
mod part;
mod patch;
mod refine;
mod simplify;
mod solve;
mod surface;
mod watch;

use serde::{Deserialize, Serialize};

pub use cloud::Reconstruction;
pub use distortion::{Distortion, Measure};
pub use marks::Marks;
pub use pack::repack::{Repacked, repacked};
pub use surface::{lay_out, lay_out_cloud};

use fam_surface::{Components, UvMap};

/// What finishing is to reach, and what it may cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct LayoutConfig {
    /// Mean symmetric Dirichlet energy that a layout may have; 4 is that of an isometry.
    pub distortion_bound: f64,
    /// How much a seam costs against distortion: cuts that pay less are left out.
    pub seam_weight: f64,
    /// Most charts that a component is cut into to come within the bound; if `None`, as many as
    /// that takes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_charts: Option<usize>,
    /// Empty texels between charts.
    pub margin: f64,
    /// Texels along the side of the UV square.
    pub resolution: u32,
}

impl Default for LayoutConfig {
    fn default() -> Self {
        Self {
            distortion_bound: 4.1,
            seam_weight: 1.0,
            max_charts: None,
            margin: 4.0,
            resolution: 2048,
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
        } else if self.max_charts == Some(0) {
            Some("max-charts must be at least 1")
        } else if !(16..=65_536).contains(&self.resolution) {
            Some("resolution must lie in 16..=65536")
        } else if !(0.0..=f64::from(self.resolution) / 4.0).contains(&self.margin) {
            Some("margin must lie between 0 and a quarter of the resolution")
        } else {
            None
        }
    }
}

/// A mesh to lay out.
#[derive(Debug, Clone, Copy)]
pub struct MeshInput<'a> {
    /// What the mesh was taken apart into.
    pub components: &'a Components,
    /// A map of the mesh that says where to cut: one UV for each vertex of every component.
    /// Edges near its tears cost less. It may be torn, folded and overlapping.
    pub map: Option<&'a [Vec<[f32; 2]>]>,
    /// The UV square of every label; empty if all share one.
    pub squares: &'a [u32],
    /// Where somebody wants seams, and where not.
    pub marks: &'a Marks,
}

/// A step of finishing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// A surface through the points of a cloud is looked for.
    Reconstruct,
    /// Components are cut and flattened.
    Refine,
    /// All charts are laid side by side.
    Pack,
}

/// Where finishing is. Several components are cut and flattened at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is done.
    pub stage: Stage,
    /// How many components there are.
    pub components: usize,
    /// How many of them are flat.
    pub done: usize,
    /// Estimated fraction of the time for cutting and flattening that is over, from 0 to 1: it goes
    /// by the triangles of flat components and by the Newton steps over those of others.
    pub fraction: f64,
    /// The component that reached something last, counting from 0.
    pub component: usize,
    /// The mean symmetric Dirichlet energy that it reached; infinite before the first does.
    pub energy: f64,
    /// The length of its seams then, over the square root of its area.
    pub seam_length: f64,
}

/// A finished component.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentLayout {
    /// Its UVs, their triangles in the order of its mesh's.
    pub uvs: UvMap,
    /// Pieces that it lies in.
    pub charts: usize,
    /// Its mean distortion, each chart at its best scale; the energy is infinite if it has no
    /// area.
    pub distortion: Distortion,
    /// The square root of its area, in input units (whose squares may be out of range).
    pub root_area: f64,
    /// Length of its seams in input units.
    pub seam_length: f64,
}

impl ComponentLayout {
    /// Length of its seams over the square root of its area; 0 if it has none.
    pub fn relative_seam_length(&self) -> f64 {
        ratio(self.seam_length, self.root_area)
    }
}

/// A finished mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshLayout {
    /// Its components.
    pub components: Vec<ComponentLayout>,
    /// Share of each UV square that charts cover.
    pub coverage: Vec<f64>,
    /// Least number of texels between charts of each UV square: less than the margin that was
    /// asked for where so many charts have no room for it.
    pub margin: Vec<f64>,
}

impl MeshLayout {
    /// Mean energy over the area of all components, each at its best scale.
    pub fn energy(&self) -> f64 {
        let total = self.root_area();
        let share = |one: &ComponentLayout| ratio(one.root_area, total).powi(2);
        self.components
            .iter()
            .filter(|one| one.root_area > 0.0)
            .map(|one| share(one) * one.distortion.energy)
            .sum()
    }

    /// Length of the seams inside of components, over the square root of the area of all.
    pub fn relative_seam_length(&self) -> f64 {
        let seams: f64 = self.components.iter().map(|one| one.seam_length).sum();
        ratio(seams, self.root_area())
    }

    fn root_area(&self) -> f64 {
        let roots = self.components.iter().map(|one| one.root_area);
        roots.fold(0.0, f64::hypot)
    }
}

/// A quotient that is 0 where there is nothing to divide by.
fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// A finished point cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudLayout {
    /// One UV for each point.
    pub uvs: Vec<[f32; 2]>,
    /// Points that have no place in the surface that was found; they keep the raw map's UVs.
    pub unreached: usize,
    /// The surface that was found; without components if none was.
    pub atlas: MeshLayout,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_without_sense_are_named() {
        let config = LayoutConfig::default();
        assert_eq!(config.problem(), None);
        let of = |change: fn(&mut LayoutConfig)| {
            let mut config = LayoutConfig::default();
            change(&mut config);
            config.problem().unwrap_or("").split(' ').next()
        };
        for bound in [4.0, 3.9, -5.0, f64::NAN, f64::INFINITY] {
            let config = LayoutConfig {
                distortion_bound: bound,
                ..LayoutConfig::default()
            };
            assert!(config.problem().is_some(), "{bound}");
        }
        assert_eq!(of(|c| c.seam_weight = -0.1), Some("seam-weight"));
        assert_eq!(of(|c| c.seam_weight = f64::NAN), Some("seam-weight"));
        assert_eq!(of(|c| c.max_charts = Some(0)), Some("max-charts"));
        assert_eq!(of(|c| c.margin = f64::NAN), Some("margin"));
        assert_eq!(of(|c| c.margin = 600.0), Some("margin"));
        assert_eq!(of(|c| c.resolution = 0), Some("resolution"));
    }
}
