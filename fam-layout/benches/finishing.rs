//! Finishing, by the size of the mesh: `cargo bench -p fam-layout --bench finishing`.
//!
//! The largest takes minutes; name a size to run only that, for example
//! `cargo bench -p fam-layout --bench finishing -- 10000`.

use std::ops::ControlFlow;

use divan::Bencher;
use fam_layout::{FinishConfig, Guidance, Marks, Unfinished, finish};
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
    let raw: Vec<Vec<[f32; 2]>> = components
        .list
        .iter()
        .map(|component| vec![[0.0; 2]; component.mesh.positions().len()])
        .collect();
    let marks = Marks::default();
    let unfinished = Unfinished {
        components: &components,
        raw: &raw,
        guidance: Guidance::None,
        squares: &[],
        marks: &marks,
    };
    bencher.bench(|| {
        finish(&FinishConfig::default(), &unfinished, &mut |_| {
            ControlFlow::Continue(())
        })
    });
}
