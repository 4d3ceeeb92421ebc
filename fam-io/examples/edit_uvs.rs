//! Moves the UVs of a file into the unit square; a file without UVs gets a planar projection.
//!
//! `cargo run --release -p fam-io --example edit_uvs -- INPUT OUTPUT`
//!
//! The extension of the output is its format: `edit_uvs spot.obj spot.glb`.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use fam_io::{WriteOptions, read_surface};
use fam_surface::{Surface, UvMap};

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        eprintln!("usage: edit_uvs INPUT OUTPUT");
        return ExitCode::from(2);
    };
    match edit(input.as_ref(), output.as_ref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn edit(input: &Path, output: &Path) -> Result<(), Box<dyn Error>> {
    let document = read_surface(input)?;
    let options = WriteOptions::default();
    match document.surface() {
        Surface::Mesh(mesh) => {
            // The UVs have triangles of their own: one for each of the mesh, in the same order.
            let (uvs, triangles) = match document.uv_map() {
                Some(map) => (wide(map.uvs()), map.triangles()),
                None => (project(mesh.positions()), mesh.triangles()),
            };
            let uvs = UvMap::new(fit(&uvs), triangles.to_vec())?;
            document.write_mesh_uvs(&uvs, output, &options)?;
        }
        Surface::PointCloud(cloud) => {
            let uvs = match document.point_uvs() {
                Some(uvs) => wide(uvs),
                None => project(cloud.points()),
            };
            document.write_point_uvs(&fit(&uvs), output, &options)?;
        }
    }
    Ok(())
}

fn wide(uvs: &[[f32; 2]]) -> Vec<[f64; 2]> {
    uvs.iter().map(|uv| uv.map(f64::from)).collect()
}

/// Leaves out the axis in which the positions extend least.
fn project(positions: &[[f64; 3]]) -> Vec<[f64; 2]> {
    let extents = [0, 1, 2].map(|axis| {
        let [min, max] = range(positions.iter().map(|p| p[axis]));
        max - min
    });
    let [u, v] = match extents {
        [x, y, z] if x <= y && x <= z => [1, 2],
        [_, y, z] if y <= z => [2, 0],
        _ => [0, 1],
    };
    positions.iter().map(|p| [p[u], p[v]]).collect()
}

/// Moves and scales UVs into the unit square, and keeps their proportions.
fn fit(uvs: &[[f64; 2]]) -> Vec<[f32; 2]> {
    let [left, right] = range(uvs.iter().map(|uv| uv[0]));
    let [bottom, top] = range(uvs.iter().map(|uv| uv[1]));
    let side = (right - left).max(top - bottom);
    let scale = if side > 0.0 { 1.0 / side } else { 1.0 };
    let moved = |&[u, v]: &[f64; 2]| [(u - left) * scale, (v - bottom) * scale];
    uvs.iter().map(|uv| moved(uv).map(|c| c as f32)).collect()
}

fn range(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let empty = [f64::INFINITY, f64::NEG_INFINITY];
    numbers.fold(empty, |[min, max], c| [min.min(c), max.max(c)])
}
