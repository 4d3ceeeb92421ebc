//! Lays the charts of a mesh's UVs side by side anew and writes it with these:
//! `cargo run --release -p fam-layout --example pack -- in.obj out.obj [MARGIN [RESOLUTION]]`
//!
//! It prints which share of the square the charts cover and how many seconds packing took.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use fam_io::WriteOptions;
use fam_layout::{PackOptions, Turns, repacked};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let usage = "usage: pack INPUT OUTPUT [MARGIN [RESOLUTION]]";
    let [input, output, numbers @ ..] = &arguments[..] else {
        return Err(usage.into());
    };
    let margin = numbers.first().map_or(Ok(4.0), |text| text.parse())?;
    let resolution = numbers.get(1).map_or(Ok(2048), |text| text.parse())?;
    let document = fam_io::read_surface(Path::new(input))?;
    let uvs = document.uv_map().ok_or("the mesh has no UVs")?;
    let started = Instant::now();
    let packed = repacked(
        uvs,
        &[],
        None,
        Turns::Free,
        &PackOptions::new(margin, resolution),
    )?;
    println!(
        "coverage {:.6}, {:.3} s, margin {}",
        packed.coverage,
        started.elapsed().as_secs_f64(),
        packed.margin
    );
    document.write_mesh_uvs(&packed.uvs, Path::new(output), &WriteOptions::default())?;
    Ok(())
}
