//! From a raw map to UVs that an artist can use.

mod diffusion;
pub mod layout;
pub mod patch;
mod peaks;
pub mod refine;
pub mod tears;
pub(crate) mod solve;
pub(crate) mod cut;
pub(crate) mod pack;
pub(crate) mod cloud;
pub(crate) mod topology;

/// What finishing is to reach, and what it may cost.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishConfig {
    /// Mean symmetric Dirichlet energy that a layout may have; 4 is that of an isometry.
    pub distortion_bound: f64,
    /// How much a seam costs against distortion: cuts that pay less are left out.
    pub seam_weight: f64,
    /// Most charts that a component is cut into.
    pub max_charts: usize,
    /// Empty texels between charts.
    pub margin: f64,
    /// Texels along the side of the UV square.
    pub resolution: u32,
}

impl Default for FinishConfig {
    fn default() -> Self {
        Self {
            distortion_bound: 4.1,
            seam_weight: 1.0,
            max_charts: 10,
            margin: 4.0,
            resolution: 2048,
        }
    }
}
