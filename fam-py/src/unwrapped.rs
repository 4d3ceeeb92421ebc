//! What unwrapping a mesh and a cloud have in common.

use burn_autodiff::Autodiff;
use burn_flex::Flex;
use fam::{Options, Report, Unwrapped, unwrap};
use fam_core::atlas::Atlas;
use fam_core::training::Strategies;
use fam_surface::Surface;

use crate::failure::Failure;
use crate::job::Signal;

/// An unwrapped surface, and what is to be said of it.
pub struct Told {
    pub unwrapped: Unwrapped<Atlas<Flex>>,
    /// As JSON.
    pub report: String,
    pub warnings: Vec<String>,
}

impl Told {
    /// Unwraps a surface.
    pub fn of(surface: &Surface, options: &Options, signal: &Signal) -> Result<Self, Failure> {
        let unwrapped = unwrap::<Autodiff<Flex>>(
            surface,
            options,
            &Default::default(),
            Strategies::tiled(),
            &mut |now| signal.observe(&now),
        )?;
        let report = Report::new(surface, &options.parting, &unwrapped);
        let report = serde_json::to_string(&report);
        let warnings = unwrapped.warnings().into_iter();
        Ok(Self {
            report: report.map_err(|error| Failure::Internal(error.to_string()))?,
            warnings: warnings.map(|warning| warning.to_string()).collect(),
            unwrapped,
        })
    }
}
