//! The model and its losses against reference numbers, on wgpu.

#[path = "../reference_numbers/mod.rs"]
mod reference_numbers;

use std::io::Write;

use burn_autodiff::Autodiff;
use burn_wgpu::graphics::{AutoGraphicsApi, GraphicsApi};
use burn_wgpu::{Wgpu, WgpuDevice};
use fam_core::evaluation::Plain;
use reference_numbers::{Reference, all_combinations};

/// A wgpu adapter, software ones included.
///
/// Without one the test is skipped aloud, except where `FAM_REQUIRE_WGPU` is set: there a
/// missing adapter is a failure.
fn adapter() -> Option<WgpuDevice> {
    let api = AutoGraphicsApi::backend();
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: api.into(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let found = burn::tensor::try_read_sync(instance.enumerate_adapters(api.into()));
    if found.is_some_and(|adapters| !adapters.is_empty()) {
        return Some(WgpuDevice::DefaultDevice);
    }
    assert!(
        std::env::var_os("FAM_REQUIRE_WGPU").is_none(),
        "no wgpu adapter, and FAM_REQUIRE_WGPU is set"
    );
    // Not by `eprintln`, which a passing test keeps to itself.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: no wgpu adapter on this machine"
    );
    None
}

#[test]
fn small_reference_on_wgpu() {
    if let Some(device) = adapter() {
        all_combinations::<Autodiff<Wgpu>>(&Reference::small(), &Plain, &device);
    }
}
