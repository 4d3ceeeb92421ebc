use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::Atlas;
use fam_core::training::Strategies;
use fam_core::weights::NamedTensor;

use crate::args::{self, BackendName};
use crate::backend::{Backend, Job};
use crate::failure::{Failure, SUCCESS};
use crate::pytorch;

/// The weights of a model for the authors' program.
pub fn export(arguments: &args::Export) -> Result<u8, Failure> {
    let model = &arguments.model;
    let fail = |reason: String| Failure::input(format!("{}: {reason}", model.display()));
    let bytes = std::fs::read(model).map_err(|error| fail(error.to_string()))?;
    let backend = Backend::choose(BackendName::Flex)?;
    let tensors = backend.run(Weights { model: &bytes }).map_err(fail)?;
    pytorch::write(&arguments.out, &tensors)?;
    Ok(SUCCESS)
}

/// Reading the weights of a model.
struct Weights<'a> {
    model: &'a [u8],
}

impl Job for Weights<'_> {
    type Output = Result<Vec<NamedTensor>, String>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        _strategies: Strategies<B>,
    ) -> Self::Output {
        let atlas = Atlas::<B::InnerBackend>::from_safetensors(self.model, device);
        let atlas = atlas.map_err(|error| error.to_string())?;
        match &atlas.trained_maps()[..] {
            [map] => Ok(map.model().to_reference()),
            maps => Err(format!(
                "it holds {} sets of networks, and the PyTorch program has one",
                maps.len()
            )),
        }
    }
}
