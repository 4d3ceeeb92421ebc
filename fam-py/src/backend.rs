//! Where networks are trained. Maps are evaluated on the CPU.

use burn::tensor::backend::Backend;
use burn_flex::Flex;
use fam_cli::BackendName;
use fam_core::atlas::Atlas;

use crate::failure::Failure;

/// What an option names.
pub fn named(option: &str) -> Result<BackendName, Failure> {
    match option {
        "auto" => Ok(BackendName::Auto),
        "flex" => Ok(BackendName::Flex),
        "wgpu" => Ok(BackendName::Wgpu),
        other => Err(Failure::Input(format!("there is no backend {other:?}"))),
    }
}

/// The backend of a name, if it is compiled in and has a device.
pub fn backend(name: BackendName) -> Result<fam_cli::Backend, Failure> {
    fam_cli::Backend::choose(name).map_err(|failure| Failure::Input(failure.to_string()))
}

/// A map on the CPU, wherever it was trained.
pub fn on_cpu<B: Backend>(atlas: &Atlas<B>) -> Result<Atlas<Flex>, Failure> {
    let bytes = atlas.to_safetensors()?;
    Ok(Atlas::from_safetensors(&bytes, &Default::default())?)
}
