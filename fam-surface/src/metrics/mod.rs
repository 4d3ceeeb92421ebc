//! How good a UV map is: distortion, overlaps and cuts.
//!
//! All metrics are invariant under uniform scaling, rotation, reflection and
//! translation of the surface and (but for rounding to `f32`) of the UV map;
//! `docs/metrics.md` defines each of them.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::{Edges, SurfaceError, TriangleMesh, UvMap};

mod area_distortion;
mod charts;
mod conformality;
mod edges;
pub mod engine;
mod flipped_triangles;
mod layout;
mod mirrored;
mod overlaps;
mod places;
mod repeats;
mod seam_length;
mod seam_visibility;
mod stacks;
mod symmetric_dirichlet;
#[cfg(test)]
mod tests;
mod uv_coverage;

pub use mirrored::mirrored_share;
pub use overlaps::for_each_overlapping_pair;
pub use seam_visibility::seam_visibility;

use charts::Charts;
use layout::Layout;
use places::Places;
use stacks::Stacks;

/// The metrics of a UV map of a mesh.
///
/// No field is ever NaN. [`area_distortion`](Self::area_distortion) and
/// [`symmetric_dirichlet`](Self::symmetric_dirichlet) are infinite where a triangle is
/// collapsed; JSON has no infinity and holds `null` instead, which is read back as infinity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Vertices of the mesh, as stored.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Triangles without area in 3D, which the distortion metrics leave out.
    pub degenerate_triangles: usize,
    /// Triangles with area in 3D but none in UV space.
    pub collapsed_triangles: usize,
    /// Triangles oriented in UV space against the majority of their chart, by number. One that
    /// repeats another, in space and in the plane, does not count.
    pub flipped_triangles: usize,
    /// Pairs of triangles whose interiors intersect in UV space, without those that are one
    /// triangle twice, in space and in the plane.
    pub overlapping_pairs: u64,
    /// Overlapping pairs, in percent of all pairs of triangles.
    pub overlap_percentage: f64,
    /// How many of the overlapping pairs are of two charts that are stacked on purpose: all their
    /// triangles lie at the same places, bit for bit.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub stacked_pairs: u64,
    /// Charts that are stacked on an earlier one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub stacked_charts: u64,
    /// Charts that are mirrored in UV space: most of their triangles are clockwise. They are not
    /// flipped for that.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mirrored_charts: u64,
    /// Mean absolute difference between 3D and UV angles over all corners, in radians;
    /// 0 is perfect.
    pub conformality: f64,
    /// Mean factor between the 3D and the UV area share of a triangle; 1 is perfect.
    #[serde(deserialize_with = "finite_or_infinity")]
    pub area_distortion: f64,
    /// Mean symmetric Dirichlet energy at the best uniform scale; 4 is perfect.
    #[serde(deserialize_with = "finite_or_infinity")]
    pub symmetric_dirichlet: f64,
    /// Connected pieces of the layout.
    pub charts: usize,
    /// 3D length of the seams, over the square root of the surface area.
    pub seam_length: f64,
    /// Total UV area, over the area of the bounding square; more than 1 is possible
    /// where triangles overlap.
    pub uv_coverage: f64,
}

impl Metrics {
    /// Overlapping pairs but those of stacked charts: what was not meant to overlap.
    pub fn unintended_overlaps(&self) -> u64 {
        self.overlapping_pairs - self.stacked_pairs.min(self.overlapping_pairs)
    }

    /// Measures a UV map of a mesh.
    ///
    /// Time grows as `T log T` in the number of triangles plus the number of pairs whose
    /// bounding boxes intersect in UV space.
    ///
    /// # Errors
    /// The map has another number of triangles than the mesh, or the mesh has no area.
    pub fn measure(mesh: &TriangleMesh, uv: &UvMap) -> Result<Self, SurfaceError> {
        let layout = Layout::new(mesh, uv)?;
        let sides = edges::sides(mesh, uv);
        let first_alike = repeats::first_alike(mesh, uv);
        let charts = Charts::new(&layout, uv, &sides, &first_alike);
        let stacks = Stacks::new(&layout, uv, &charts, &first_alike);
        let places = Places::new(uv, &stacks, &first_alike);
        let pairs = overlaps::overlapping_pairs(uv, &places);
        Ok(Self {
            vertices: mesh.positions().len(),
            triangles: layout.len(),
            degenerate_triangles: layout.len() - layout.measured().count(),
            collapsed_triangles: layout.collapsed_triangles(),
            flipped_triangles: flipped_triangles::flipped_triangles(&layout, &charts, &first_alike),
            overlapping_pairs: pairs.overlapping,
            overlap_percentage: overlaps::overlap_percentage(pairs.overlapping, layout.len()),
            stacked_pairs: pairs.stacked,
            stacked_charts: stacks.stacked() as u64,
            mirrored_charts: stacks.mirrored(&layout, &first_alike) as u64,
            conformality: conformality::conformality(&layout),
            area_distortion: area_distortion::area_distortion(&layout),
            symmetric_dirichlet: symmetric_dirichlet::symmetric_dirichlet(&layout),
            charts: charts.count(&layout),
            seam_length: seam_length::seam_length(&layout, &sides),
            uv_coverage: uv_coverage::uv_coverage(&layout),
        })
    }
}

/// The edges at which a UV map cuts a mesh: of two or more triangles, one of which has the UV
/// coordinates of no other at both ends. By the first vertices at the positions of their ends,
/// the smaller first, ascending.
///
/// # Errors
/// The map has another number of triangles than the mesh.
pub fn seam_edges(mesh: &TriangleMesh, uv: &UvMap) -> Result<Vec<[u32; 2]>, SurfaceError> {
    layout::check_lengths(mesh, uv)?;
    let mut seams: Vec<[u32; 2]> = seam_length::seam_edges(&edges::sides(mesh, uv)).collect();
    // Edges of parts that touch may lie at one position.
    seams.dedup();
    Ok(seams)
}

/// The edges at which a UV map cuts a mesh, as [`seam_edges`] has them, and all others. Where the first are
/// wanted seams and the others forbidden ones, a layout keeps the seams that are there.
///
/// # Errors
/// The map has another number of triangles than the mesh.
pub fn present_seams(mesh: &TriangleMesh, uv: &UvMap) -> Result<[Vec<[u32; 2]>; 2], SurfaceError> {
    let seams = seam_edges(mesh, uv)?;
    let mut others = Edges::of(mesh).all();
    others.retain(|edge| seams.binary_search(edge).is_err());
    Ok([seams, others])
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Reads the infinity that JSON writes as `null`.
fn finite_or_infinity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

impl fmt::Display for Metrics {
    /// A table of one line per metric: name, value, unit.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = [
            ("vertices", self.vertices.to_string(), ""),
            ("triangles", self.triangles.to_string(), ""),
            (
                "degenerate triangles",
                self.degenerate_triangles.to_string(),
                "",
            ),
            (
                "collapsed triangles",
                self.collapsed_triangles.to_string(),
                "",
            ),
            ("flipped triangles", self.flipped_triangles.to_string(), ""),
            ("overlapping pairs", self.overlapping_pairs.to_string(), ""),
            ("overlap percentage", decimal(self.overlap_percentage), " %"),
            ("conformality", decimal(self.conformality), " rad"),
            ("area distortion", decimal(self.area_distortion), ""),
            ("symmetric Dirichlet", decimal(self.symmetric_dirichlet), ""),
            ("charts", self.charts.to_string(), ""),
            ("seam length", decimal(self.seam_length), ""),
            ("UV coverage", decimal(self.uv_coverage), ""),
        ];
        for (line, (name, value, unit)) in rows.iter().enumerate() {
            if line > 0 {
                writeln!(f)?;
            }
            write!(f, "{name:<20} {value:>14}{unit}")?;
        }
        // What few maps have.
        for (name, count) in [
            ("stacked pairs", self.stacked_pairs),
            ("stacked charts", self.stacked_charts),
            ("mirrored charts", self.mirrored_charts),
        ] {
            if count > 0 {
                write!(f, "\n{name:<20} {count:>14}")?;
            }
        }
        Ok(())
    }
}

/// Six decimals; scientific notation where they would hide the value or overflow the table.
fn decimal(value: f64) -> String {
    if value == 0.0 || (1e-4..1e6).contains(&value) || value.is_infinite() {
        format!("{value:.6}")
    } else {
        format!("{value:.6e}")
    }
}
