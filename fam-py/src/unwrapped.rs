//! What unwrapping a mesh and a cloud have in common.

use burn::tensor::backend::AutodiffBackend;
use burn_flex::Flex;
use fam::{Options, Report, Unwrapped, Used, unwrap, unwrap_direct};
use fam_cli::BackendName;
use fam_core::atlas::Atlas;
use fam_core::training::Strategies;
use fam_surface::Surface;

use crate::backend::{backend, on_cpu};
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
    /// Unwraps a surface; what networks it takes are trained on a backend.
    pub fn of(
        surface: &Surface,
        options: &Options,
        name: BackendName,
        signal: &Signal,
    ) -> Result<Self, Failure> {
        let unwrapped = match options.method.on(surface, options.finish) {
            Used::Direct => unwrap_direct(surface, options, &mut |now| signal.observe(&now))?,
            Used::Neural => backend(name)?.run(Neural {
                surface,
                options,
                signal,
            })?,
        };
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

/// Unwrapping with networks, on any backend.
struct Neural<'a> {
    surface: &'a Surface,
    options: &'a Options,
    signal: &'a Signal,
}

impl fam_cli::Job for Neural<'_> {
    type Output = Result<Unwrapped<Atlas<Flex>>, Failure>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        strategies: Strategies<B>,
    ) -> Self::Output {
        let mut observe = |now: fam::Progress<'_>| self.signal.observe(&now);
        let unwrapped = unwrap::<B>(self.surface, self.options, device, strategies, &mut observe)?;
        unwrapped.try_map(|atlas| on_cpu(&atlas))
    }
}
