//! Lays out a mesh and writes it with its UVs:
//! `cargo run --release -p fam-layout --example unwrap -- in.obj out.obj`
//!
//! Without an output file it only prints what the layout is like, one line per input.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fam_io::WriteOptions;
use fam_layout::{LayoutConfig, Marks, MeshInput, lay_out, lay_out_cloud};
use fam_surface::metrics::Metrics;
use fam_surface::plane::{Plane, frame};
use fam_surface::vector::{dot, sub};
use fam_surface::{Components, Edges, Surface, UvMap};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    match &paths[..] {
        [input] => unwrap(input, None),
        [input, output] => unwrap(input, Some(output)),
        _ => Err("usage: unwrap INPUT [OUTPUT]".into()),
    }
}

fn unwrap(input: &Path, output: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let document = fam_io::read_surface(input)?;
    let mesh = match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(cloud) => return unwrap_cloud(input, cloud.points()),
    };
    let started = Instant::now();
    let components = Components::of(mesh, &document.labels().objects)?;
    // Polygons stay whole.
    let marks = Marks::default().with_diagonals(&Edges::of(mesh), document.diagonals());
    let task = MeshInput {
        marks: &marks,
        ..MeshInput::of(&components)
    };
    let layout = lay_out(&LayoutConfig::default(), &task, &mut |_| {
        ControlFlow::Continue(())
    })?;
    let seconds = started.elapsed().as_secs_f64();
    let maps: Vec<UvMap> = layout.components.iter().map(|c| c.uvs.clone()).collect();
    let uvs = components.uv_map(&maps)?;
    let metrics = Metrics::measure(mesh, &uvs)?;
    println!(
        "{}: {} triangles in {} parts, {seconds:.2} s, {} charts, energy {:.4}, seams {:.2}, \
         conformality {:.4}, area {:.3}, {} flipped, {} overlapping, coverage {:.0} %",
        input.display(),
        metrics.triangles,
        components.list.len(),
        metrics.charts,
        metrics.symmetric_dirichlet,
        metrics.seam_length,
        metrics.conformality,
        metrics.area_distortion,
        metrics.flipped_triangles,
        metrics.overlapping_pairs,
        100.0 * metrics.uv_coverage,
    );
    if let Some(output) = output {
        document.write_mesh_uvs(&uvs, output, &WriteOptions::default())?;
    }
    Ok(())
}

/// Lays out a point cloud with its projection to a plane in the place of a trained map.
fn unwrap_cloud(input: &Path, points: &[[f64; 3]]) -> Result<(), Box<dyn Error>> {
    let plane = Plane::fit(points.iter().map(|&p| (p, 1.0)));
    let [u, v, _] = frame(plane.normal);
    let placed = points.iter().map(|&p| sub(p, plane.centre));
    let map: Vec<[f32; 2]> = placed
        .map(|p| [dot(u, p), dot(v, p)].map(|c| c as f32))
        .collect();
    let started = Instant::now();
    let layout = lay_out_cloud(&LayoutConfig::default(), points, &map, &mut |_| {
        ControlFlow::Continue(())
    })?;
    let seconds = started.elapsed().as_secs_f64();
    let components = &layout.atlas.components;
    let triangles = components.iter().map(|c| c.uvs.triangles().len());
    println!(
        "{}: {} points, {} without a place; {} triangles in {} parts, {seconds:.2} s, {} charts, \
         energy {:.4}, seams {:.2}",
        input.display(),
        points.len(),
        layout.unreached,
        triangles.sum::<usize>(),
        components.len(),
        components.iter().map(|c| c.charts).sum::<usize>(),
        layout.atlas.energy(),
        layout.atlas.relative_seam_length(),
    );
    Ok(())
}
