use burn::tensor::backend::AutodiffBackend;
use fam_core::atlas::Atlas;
use fam_core::map::TrainedMap;
use fam_core::training::Strategies;
use fam_core::weights::{NamedTensor, safetensors};
use fam_io::atomic::write_atomically;
use fam_surface::Surface;

use crate::args::{self, BackendName};
use crate::backend::{Backend, Job};
use crate::failure::{Failure, SUCCESS};
use crate::pytorch;

/// A weight that every model of the authors' program has.
const SOME_WEIGHT: &str = "grid_deforming.mlp_1.0.conv.weight";

/// A model from weights of the authors' program.
pub fn import(arguments: &args::Import) -> Result<u8, Failure> {
    let input = &arguments.input;
    let fail = |reason: String| Failure::input(format!("{}: {reason}", input.display()));
    let is_safetensors = input.extension() == Some("safetensors".as_ref());
    let weights = match is_safetensors {
        true => std::fs::read(input).map_err(|error| fail(error.to_string()))?,
        false => {
            let tensors = without_prefix(pytorch::read(input)?);
            safetensors(&tensors).map_err(|error| fail(error.to_string()))?
        }
    };
    let document = arguments.surface.as_deref().map(fam_io::read_surface);
    let document = document.transpose().map_err(Failure::input)?;
    if let (Some(document), Some(path)) = (&document, &arguments.surface) {
        let fail = |error| Failure::input(format!("{}: {error}", path.display()));
        document.surface().normalization().map_err(fail)?;
    }
    let read = Read {
        weights: &weights,
        surface: document.as_ref().map(|document| document.surface()),
    };
    let model = Backend::choose(BackendName::Flex)?
        .run(read)
        .map_err(fail)?;
    write_atomically(&arguments.out, |out| out.write_all(&model)).map_err(Failure::work)?;
    Ok(SUCCESS)
}

/// Drops what is in front of the names of the authors' program, as `model.` or `module.`, and other
/// tensors.
fn without_prefix(tensors: Vec<NamedTensor>) -> Vec<NamedTensor> {
    let prefix = tensors
        .iter()
        .find_map(|(name, ..)| name.strip_suffix(SOME_WEIGHT));
    let Some(prefix) = prefix.map(str::to_owned) else {
        return tensors;
    };
    let own = |(name, shape, bytes): NamedTensor| {
        let name = name.strip_prefix(&prefix)?.to_owned();
        Some((name, shape, bytes))
    };
    tensors.into_iter().filter_map(own).collect()
}

/// Reading weights.
struct Read<'a> {
    weights: &'a [u8],
    surface: Option<&'a Surface>,
}

impl Job for Read<'_> {
    type Output = Result<Vec<u8>, String>;

    fn run<B: AutodiffBackend>(
        self,
        device: &B::Device,
        _strategies: Strategies<B>,
    ) -> Self::Output {
        let map = TrainedMap::<B::InnerBackend>::from_reference(self.weights, self.surface, device);
        let map = map.map_err(|error| error.to_string())?;
        let model = Atlas::of_map(map).to_safetensors();
        model.map_err(|error| error.to_string())
    }
}
