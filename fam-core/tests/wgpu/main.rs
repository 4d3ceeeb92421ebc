//! The model and its losses against reference numbers, on wgpu.

#[path = "../reference_numbers/mod.rs"]
mod reference_numbers;

use burn_autodiff::Autodiff;
use burn_wgpu::{Wgpu, WgpuDevice};
use reference_numbers::{Reference, all_combinations};

/// A wgpu adapter, software ones included.
///
/// Without one the test is skipped aloud, except where `FAM_REQUIRE_WGPU` is set: there a
/// missing adapter is a failure.
fn adapter() -> Option<WgpuDevice> {
    let found = std::panic::catch_unwind(|| {
        let device = WgpuDevice::DefaultDevice;
        burn::tensor::Tensor::<Wgpu, 1>::zeros([1], &device).into_data();
        device
    });
    match found {
        Ok(device) => Some(device),
        Err(_) if std::env::var_os("FAM_REQUIRE_WGPU").is_some() => {
            panic!("no wgpu adapter, and FAM_REQUIRE_WGPU is set")
        }
        Err(_) => {
            eprintln!("SKIPPED: no wgpu adapter on this machine");
            None
        }
    }
}

#[test]
fn small_reference_on_wgpu() {
    if let Some(device) = adapter() {
        all_combinations::<Autodiff<Wgpu>>(&Reference::small(), &device);
    }
}
