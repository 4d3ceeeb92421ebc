//! Laying out, by the size of the mesh: `cargo bench -p fam-layout --bench layout`.
//!
//! The largest takes minutes; name a size to run only that, for example
//! `cargo bench -p fam-layout --bench layout -- 10000`.

use std::ops::ControlFlow;

use divan::Bencher;
use fam_layout::{LayoutConfig, MeshInput, lay_out};
use fam_surface::{Components, shapes};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() {
    divan::main();
}

/// A bust of about so many triangles.
#[divan::bench(args = [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000], sample_count = 1, sample_size = 1)]
fn bust(bencher: Bencher, triangles: u32) {
    // One of spacing 0.05 has 11,588 triangles.
    let spacing = 0.05 * (11_588.0 / f64::from(triangles)).sqrt();
    let components = Components::of(&shapes::bust(spacing), &[]).expect("a bust is a valid mesh");
    let unfinished = MeshInput::of(&components);
    bencher.bench(|| {
        lay_out(&LayoutConfig::default(), &unfinished, &mut |_| {
            ControlFlow::Continue(())
        })
    });
}
