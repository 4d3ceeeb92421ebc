//! Layouts of symmetric surfaces that are symmetric themselves.
//!
//! A component that is its own mirror image is laid out by its half (`halves`): seams and charts of the
//! other half are mirror images. A chart and its image that meet at the plane become one where they may
//! be joined without too much distortion (`hinge`); its axis is vertical then. A component that is the
//! mirror image of another gets the mirrored charts of that (`images`).
//!
//! Scans have no vertices that correspond. A component that is only nearly its own mirror image (`nearly`)
//! is laid out by the seams of an exactly symmetric surface close to it (`proxy`), which are `carried` over.

mod carried;
mod chart;
mod halves;
mod hinge;
mod images;
mod nearly;
mod places;
mod proxy;
mod roles;

use serde::{Deserialize, Serialize};

use fam_surface::symmetry::MirrorPlane;

pub use halves::{Symmetric, charts_of_both_halves};
pub use images::image_of;
pub use nearly::nearly_symmetric_charts;
pub use roles::{Role, roles};

/// Whether a layout is as symmetric as the surface, and at which plane.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// The layout does not go by it.
    #[default]
    Off,
    /// At the plane that is found, if there is one.
    Auto,
    /// At a plane across the x axis: at 0, in the middle or where the surface fits best.
    X,
    /// The same across the y axis.
    Y,
    /// The same across the z axis.
    Z,
    /// At the plane of the points `p` with `normal · p = offset`, in the units of the input.
    Plane {
        /// Its normal, of any length but 0.
        normal: [f64; 3],
        /// Where it is.
        offset: f64,
    },
}

impl Symmetry {
    /// Whether it is off.
    pub fn is_off(&self) -> bool {
        *self == Self::Off
    }

    /// Whether there is such a plane as is asked for.
    pub(super) fn is_plane(&self) -> bool {
        match *self {
            Self::Plane { normal, offset } => MirrorPlane::new(normal, offset).is_some(),
            Self::Off | Self::Auto | Self::X | Self::Y | Self::Z => true,
        }
    }
}

/// Which points of a chart are mirror images.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Mirror {
    /// None that are known.
    #[default]
    None,
    /// Its own: for every point the number of its image. The axis is vertical.
    Own(Vec<u32>),
    /// Those of another chart, point by point: of a component its number among the charts.
    Of {
        /// The component.
        component: usize,
        /// The number of its chart.
        chart: usize,
    },
    /// None, but the chart is turned so that it lies about as the mirror image of itself or another.
    Nearly,
}
