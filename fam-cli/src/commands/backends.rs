use crate::args::BackendName;
use crate::backend::Backend;
use crate::failure::{Failure, SUCCESS};

/// Prints the backends compiled in, the adapters found, and what `auto` takes.
pub fn backends() -> Result<u8, Failure> {
    #[cfg(feature = "flex")]
    println!("flex     the CPU");
    #[cfg(feature = "ndarray")]
    println!("ndarray  the CPU, slower");
    #[cfg(feature = "wgpu")]
    {
        let adapters = crate::backend::adapters::find();
        if adapters.is_empty() {
            println!("wgpu     no adapter found");
        }
        for adapter in adapters {
            println!(
                "wgpu     {} ({}, {})",
                adapter.name,
                adapter.kind.label(),
                adapter.api
            );
        }
    }
    #[cfg(feature = "cuda")]
    match crate::backend::cuda() {
        Some(_) => println!("cuda     the first device"),
        None => println!("cuda     no device found"),
    }
    println!("auto     takes {}", Backend::choose(BackendName::Auto)?);
    Ok(SUCCESS)
}
