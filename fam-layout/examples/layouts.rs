//! What the options of layouts do, as pictures and figures:
//!
//! `cargo run --release -p fam-layout --example layouts -- docs/layouts` draws every feature before and
//! after on generated surfaces. `… --example layouts -- --figures MESH…` prints tables of the same
//! features on meshes.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fam_io::picture::{Flattened, Seams, encode_png, preview_picture};
use fam_layout::{
    LayoutConfig, Marks, MeshInput, MeshLayout, Stack, Symmetry, Turns, lay_out, repacked,
};
use fam_surface::metrics::{Metrics, seam_edges, seam_visibility};
use fam_surface::{Components, Edges, Surface, TriangleMesh, UvMap, shapes};
use image::{RgbImage, imageops};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Side of a panel of a picture, in pixels.
const PANEL: u32 = 320;

/// An option and what it is shown on.
struct Feature {
    /// Of its picture.
    name: &'static str,
    /// As a user sets it.
    option: &'static str,
    config: LayoutConfig,
    surface: fn() -> TriangleMesh,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments[..] {
        [flag, meshes @ ..] if flag == "--figures" && !meshes.is_empty() => {
            figures(&meshes.iter().map(PathBuf::from).collect::<Vec<_>>())
        }
        [folder] if folder != "--figures" => pictures(Path::new(folder)),
        _ => Err("usage: layouts FOLDER, or layouts --figures MESH...".into()),
    }
}

fn features() -> Vec<Feature> {
    let with = |change: fn(&mut LayoutConfig)| {
        let mut config = LayoutConfig::default();
        change(&mut config);
        config
    };
    vec![
        Feature {
            name: "hidden-seams",
            option: "--hide-seams",
            config: with(|c| c.hide_seams = 1.0),
            surface: || shapes::bucket(0.04),
        },
        Feature {
            name: "hard-angle",
            option: "--hard-angle 60",
            config: with(|c| c.hard_angle = Some(60.0)),
            surface: || shapes::cube(8),
        },
        Feature {
            name: "symmetry",
            option: "--symmetry auto",
            config: with(|c| c.symmetry = Symmetry::Auto),
            surface: head,
        },
        Feature {
            name: "stack",
            option: "--stack identical",
            config: with(|c| c.stack = Stack::Identical),
            surface: bolts,
        },
        Feature {
            name: "straighten",
            option: "--straighten",
            config: with(|c| c.straighten = true),
            surface: pipe,
        },
        Feature {
            name: "upright",
            option: "--upright=+z",
            config: with(|c| c.upright = Some([0.0, 0.0, 1.0])),
            surface: || shapes::assembly(3),
        },
        Feature {
            name: "coverage",
            option: "--coverage-weight",
            config: with(|c| c.coverage_weight = 1.0),
            surface: cable,
        },
        Feature {
            name: "tiles",
            option: "--udim 4",
            config: with(|c| c.tiles = 4),
            surface: || shapes::assembly(3),
        },
    ]
}

/// Twelve equal nails.
fn bolts() -> TriangleMesh {
    let nail = shapes::nail(0.12);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..12 {
        let first = positions.len() as u32;
        let (sin, cos) = (f64::from(k) * 0.7).sin_cos();
        let at = [f64::from(k % 4) * 1.5, f64::from(k / 4) * 1.5];
        positions.extend(nail.positions().iter().map(|&[x, y, z]| {
            let [x, y] = [cos * x - sin * y, sin * x + cos * y];
            [x + at[0], y + at[1], z]
        }));
        triangles.extend(nail.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    TriangleMesh::new(positions, triangles).unwrap_or(nail)
}

/// A ball with two ears and a nose, the same on both sides of x = 0 to the last bit.
fn head() -> TriangleMesh {
    let ball = shapes::sphere(14);
    let bump = |at: [f64; 3], [x, y, z]: [f64; 3], width: f64| {
        let squared = (x - at[0]).powi(2) + (y - at[1]).powi(2) + (z - at[2]).powi(2);
        (-squared / (width * width)).exp()
    };
    let place = |&[x, y, z]: &[f64; 3]| {
        let side = [x.abs(), y, z];
        let ears = 0.9 * bump([0.75, 0.1, 0.65], side, 0.3);
        let nose = 0.5 * bump([0.0, -1.0, 0.0], side, 0.25);
        [x, y, z].map(|c| c * (1.0 + ears + nose))
    };
    let positions = ball.positions().iter().map(place).collect();
    TriangleMesh::new(positions, ball.triangles().to_vec()).unwrap_or(ball)
}

/// An open pipe that is bent a little.
fn pipe() -> TriangleMesh {
    let straight = shapes::open_cylinder(0.15, 2.0, 24, 60);
    let place = |&[x, y, z]: &[f64; 3]| {
        let (sin, cos) = (z - 1.0).sin_cos();
        [(1.8 + x) * cos, y, (1.8 + x) * sin]
    };
    let positions = straight.positions().iter().map(place).collect();
    TriangleMesh::new(positions, straight.triangles().to_vec()).unwrap_or(straight)
}

/// A thin tube along a knot.
fn cable() -> TriangleMesh {
    shapes::knot(0.06, 0.05)
}

/// A mesh, laid out.
struct Outcome {
    uvs: UvMap,
    layout: MeshLayout,
    seconds: f64,
}

fn laid_out(
    mesh: &TriangleMesh,
    marks: &Marks,
    config: &LayoutConfig,
) -> Result<Outcome, Box<dyn Error>> {
    let started = Instant::now();
    let components = Components::of(mesh, &[])?;
    let input = MeshInput {
        marks,
        ..MeshInput::of(&components)
    };
    let layout = lay_out(config, &input, &mut |_| ControlFlow::Continue(()))?;
    let maps: Vec<UvMap> = layout.components.iter().map(|c| c.uvs.clone()).collect();
    Ok(Outcome {
        uvs: components.uv_map(&maps)?,
        seconds: started.elapsed().as_secs_f64(),
        layout,
    })
}

/// Writes one picture for each feature: above without it, below with it.
fn pictures(folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let default = LayoutConfig::default();
    for feature in features() {
        let mesh = (feature.surface)();
        let marks = Marks::default();
        let before = laid_out(&mesh, &marks, &default)?.uvs;
        let after = laid_out(&mesh, &marks, &feature.config)?.uvs;
        write(folder, feature.name, &mesh, &before, &after)?;
        println!("{} ({})", feature.name, feature.option);
    }
    // Charts that lie in rows, as many programs leave them, and packed.
    let mesh = shapes::assembly(3);
    let marks = Marks::default();
    let several = LayoutConfig {
        hard_angle: Some(50.0),
        ..default
    };
    let charts = laid_out(&mesh, &marks, &several)?.uvs;
    let rows = in_rows(&charts)?;
    let packed = repacked(
        &rows,
        &[],
        None,
        Turns::Free,
        &fam_layout::PackOptions::new(4.0, 1024),
    )?;
    write(folder, "pack", &mesh, &rows, &packed.uvs)?;
    println!("pack (fam pack)");
    Ok(())
}

/// The charts of a map in rows, by their bounding boxes.
fn in_rows(uvs: &UvMap) -> Result<UvMap, Box<dyn Error>> {
    let of_triangle = fam_surface::charts::charts(uvs);
    let count = of_triangle
        .iter()
        .max()
        .map_or(0, |&last| last as usize + 1);
    let mut boxes = vec![[[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]]; count];
    for (t, &chart) in of_triangle.iter().enumerate() {
        for q in uvs.corners(t) {
            let [low, high] = &mut boxes[chart as usize];
            *low = [0, 1].map(|k| low[k].min(q[k]));
            *high = [0, 1].map(|k| high[k].max(q[k]));
        }
    }
    let (mut at, mut tallest) = ([0.0_f32; 2], 0.0_f32);
    let mut corners = Vec::new();
    let places: Vec<[f32; 2]> = boxes
        .iter()
        .map(|[low, high]| {
            let size = [0, 1].map(|k| high[k] - low[k]);
            if at[0] + size[0] > 1.2 {
                at = [0.0, at[1] + tallest + 0.02];
                tallest = 0.0;
            }
            let place = at;
            at[0] += size[0] + 0.02;
            tallest = tallest.max(size[1]);
            place
        })
        .collect();
    for (t, &chart) in of_triangle.iter().enumerate() {
        let [low, _] = boxes[chart as usize];
        let place = places[chart as usize];
        let moved = |q: [f32; 2]| [0, 1].map(|k| q[k] - low[k] + place[k]);
        corners.extend(uvs.corners(t).map(moved));
    }
    Ok(UvMap::of_corners(&corners)?)
}

fn write(
    folder: &Path,
    name: &str,
    mesh: &TriangleMesh,
    before: &UvMap,
    after: &UvMap,
) -> Result<(), Box<dyn Error>> {
    let drawn = |uvs: &UvMap| -> Result<RgbImage, Box<dyn Error>> {
        let edges = seam_edges(mesh, uvs)?;
        let seams = Seams {
            points: &[],
            edges: &edges,
        };
        Ok(preview_picture(Flattened::Mesh(mesh, uvs), seams, PANEL))
    };
    let [above, below] = [drawn(before)?, drawn(after)?];
    let mut both = RgbImage::from_pixel(
        above.width(),
        above.height() + below.height() + 8,
        image::Rgb([255; 3]),
    );
    imageops::replace(&mut both, &above, 0, 0);
    imageops::replace(&mut both, &below, 0, i64::from(above.height()) + 8);
    std::fs::write(folder.join(format!("{name}.png")), encode_png(&both)?)?;
    Ok(())
}

/// Prints a table for every feature: meshes, without it and with it.
fn figures(paths: &[PathBuf]) -> Result<(), Box<dyn Error>> {
    let default = LayoutConfig::default();
    let mut rows: Vec<String> = Vec::new();
    for path in paths {
        let document = fam_io::read_surface(path)?;
        let Surface::Mesh(mesh) = document.surface() else {
            continue;
        };
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let marks = Marks::default().with_diagonals(&Edges::of(mesh), document.diagonals());
        let before = row(mesh, &laid_out(mesh, &marks, &default)?)?;
        rows.push(format!("| {name} | (default) | {before} |"));
        for feature in features() {
            let line = match laid_out(mesh, &marks, &feature.config) {
                Ok(outcome) => row(mesh, &outcome)?,
                Err(error) => error.to_string(),
            };
            rows.push(format!("| {name} | `{}` | {line} |", feature.option));
        }
    }
    println!(
        "| mesh | option | charts | energy | seam length | seam visibility | coverage, % | tiles | \
         flips | overlaps | seconds |\n\
         | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    );
    rows.iter().for_each(|row| println!("{row}"));
    Ok(())
}

fn row(mesh: &TriangleMesh, outcome: &Outcome) -> Result<String, Box<dyn Error>> {
    let metrics = Metrics::measure(mesh, &outcome.uvs)?;
    let visibility = seam_visibility(mesh, &outcome.uvs)?;
    let square = outcome.layout.squares.first();
    Ok(format!(
        "{} | {:.3} | {:.2} | {} | {:.0} | {} | {} | {} | {:.1}",
        metrics.charts,
        outcome.layout.energy(),
        metrics.seam_length,
        visibility.map_or("-".to_owned(), |v| format!("{v:.3}")),
        square.map_or(0.0, |square| 100.0 * square.coverage),
        square.map_or(1, |square| square.tiles),
        metrics.flipped_triangles,
        metrics.overlapping_pairs,
        outcome.seconds,
    ))
}
