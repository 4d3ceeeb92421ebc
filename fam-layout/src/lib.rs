//! UV layouts of meshes: cut, flattened, refined and packed, without a network.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use fam_layout::{LayoutConfig, MeshInput, PackError, lay_out};
//! use fam_surface::{Components, UvMap, shapes};
//!
//! # fn main() -> Result<(), PackError> {
//! let mesh = shapes::torus(1.0, 0.4, 24, 12);
//! let components = Components::of(&mesh, &[])?;
//! let input = MeshInput::of(&components);
//! let layout = lay_out(&LayoutConfig::default(), &input, &mut |_| ControlFlow::Continue(()))?;
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
//! 7. `shape`: if wanted, charts are straightened, turned upright, and divided where the square is used
//!    better for it.
//! 8. `pack`: all charts side by side in the unit square, at one texel density.
//!
//! With `stack`, only the first of equal components goes through them; the others share its place.
//!
//! With a [`Symmetry`] only half of a symmetric component goes through stages 1 to 6 (`symmetry`). One without
//! vertices that correspond goes through them once more, with seams like those of its half.
//!
//! [`lay_out_cloud`] finds a surface through the points of a cloud first (`cloud`).

#[cfg(test)]
mod checks;
mod cloud;
mod component;
mod config;
mod costs;
mod cut;
mod distortion;
mod divide;
mod flat;
mod flattening;
mod marks;
mod pace;
mod pack;
mod parallel;
mod part;
mod patch;
mod placing;
mod refine;
mod shape;
mod simplify;
mod solve;
mod stack;
mod surface;
mod symmetry;
mod unit;
mod watch;

pub use cloud::Reconstruction;
pub use config::LayoutConfig;
pub use distortion::{Distortion, Measure};
pub use marks::Marks;
pub use pack::options::{Fixed, MOST_TILES, PackError, PackOptions, Size, Turns};
pub use pack::repack::{Repacked, repacked};
pub use pack::{Chart, Packing, Placement, corner_of_tile, pack};
pub use placing::Square;
pub use stack::{Stack, Stacked};
pub use surface::{lay_out, lay_out_cloud};
pub use symmetry::Symmetry;

use placing::Belonging;

use fam_surface::{Components, UvMap};

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
    /// For every label how many times as large as others its charts are to be; empty if all are alike.
    pub weights: &'a [f64],
    /// Where somebody wants seams, and where not.
    pub marks: &'a Marks,
    /// Charts that stay where they are.
    pub beside: Option<Beside<'a>>,
}

impl<'a> MeshInput<'a> {
    /// A mesh of which nothing else is known.
    pub fn of(components: &'a Components) -> Self {
        Self {
            components,
            map: None,
            squares: &[],
            weights: &[],
            marks: &marks::NONE,
            beside: None,
        }
    }

    fn belonging(&self, label: u32) -> Belonging {
        let label = label as usize;
        Belonging {
            square: self.squares.get(label).copied().unwrap_or(0),
            weight: self.weights.get(label).copied().unwrap_or(1.0),
        }
    }
}

/// Charts that are there already and stay where they are. Others are placed around them.
#[derive(Debug, Clone, Copy)]
pub struct Beside<'a> {
    /// The UVs of their triangles.
    pub uvs: &'a UvMap,
    /// The UV square of every one of these; empty if all share one.
    pub squares: &'a [u32],
    /// Their size, in UV units per unit of length: the others get no larger. Infinite if that is not
    /// known.
    pub scale: f64,
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
    /// The component whose place it shares, if it does. All else is as there then, up to the
    /// [tolerance](fam_surface::congruence::TOLERANCE) within which the two are equal.
    pub stacked: Option<Stacked>,
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
    /// Its UV squares.
    pub squares: Vec<Square>,
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
        assert_eq!(of(|c| c.hide_seams = -0.1), Some("hide-seams"));
        assert_eq!(of(|c| c.hide_seams = f64::NAN), Some("hide-seams"));
        assert_eq!(of(|c| c.seen_from = Some([0.0; 3])), Some("seen-from"));
        assert_eq!(of(|c| c.paint_weight = -1.0), Some("paint-weight"));
        assert_eq!(of(|c| c.crease_weight = 9.1), Some("crease-weight"));
        assert_eq!(of(|c| c.tear_weight = f64::NAN), Some("tear-weight"));
        assert_eq!(of(|c| c.hard_angle = Some(0.5)), Some("hard-angle"));
        assert_eq!(of(|c| c.hard_angle = Some(f64::NAN)), Some("hard-angle"));
        let directions = [[f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]];
        for direction in directions {
            let config = LayoutConfig {
                seen_from: Some(direction),
                ..LayoutConfig::default()
            };
            assert!(config.problem().is_some(), "{direction:?}");
        }
        assert_eq!(of(|c| c.coverage_weight = -1.0), Some("coverage-weight"));
        assert_eq!(of(|c| c.upright = Some([0.0; 3])), Some("upright"));
        let plane = |normal: [f64; 3]| LayoutConfig {
            symmetry: Symmetry::Plane {
                normal,
                offset: 0.0,
            },
            ..LayoutConfig::default()
        };
        assert_eq!(plane([0.0, 2.0, 0.0]).problem(), None);
        assert!(plane([0.0; 3]).problem().is_some());
        assert!(plane([f64::NAN, 1.0, 0.0]).problem().is_some());
        assert_eq!(of(|c| c.max_charts = Some(0)), Some("max-charts"));
        assert_eq!(of(|c| c.margin = f64::NAN), Some("margin"));
        assert_eq!(of(|c| c.margin = 600.0), Some("margin"));
        assert_eq!(of(|c| c.resolution = 0), Some("resolution"));
    }
}
