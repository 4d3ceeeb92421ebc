//! What the options of layouts do, as pictures and figures:
//!
//! `cargo run --release -p fam-layout --example layouts -- docs/layouts` draws every feature before and
//! after on generated surfaces. `… --example layouts -- --figures MESH…` prints tables of the same
//! features on meshes.

use std::collections::{HashMap, HashSet};
use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fam_io::picture::{Flattened, Seams, encode_png, preview_picture};
use fam_layout::{
    Beside, LayoutConfig, Marks, MeshInput, MeshLayout, Stack, Symmetry, Turns, lay_out, repacked,
};
use fam_surface::metrics::{Metrics, mirrored_share, present_seams, seam_edges, seam_visibility};
use fam_surface::occlusion::Occluders;
use fam_surface::{Component, Components, Edges, Surface, TriangleMesh, UvMap, shapes, symmetry};
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
            name: "symmetry-scan",
            option: "--symmetry auto",
            config: with(|c| c.symmetry = Symmetry::Auto),
            surface: || shapes::shirt(0.04),
        },
        Feature {
            name: "stack",
            option: "--stack identical",
            config: with(|c| c.stack = Stack::Identical),
            surface: bolts,
        },
        Feature {
            name: "stack-halves",
            option: "--symmetry auto --stack mirrored",
            config: with(|c| (c.symmetry, c.stack) = (Symmetry::Auto, Stack::Mirrored)),
            surface: head,
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
    laid_out_weighted(mesh, &[], &[], marks, config)
}

/// The same, where every triangle has a label and every label a weight.
fn laid_out_weighted(
    mesh: &TriangleMesh,
    labels: &[u32],
    weights: &[f64],
    marks: &Marks,
    config: &LayoutConfig,
) -> Result<Outcome, Box<dyn Error>> {
    let started = Instant::now();
    let components = Components::of(mesh, labels)?;
    let input = MeshInput {
        marks,
        weights,
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
    let head = head();
    let plain = laid_out(&head, &Marks::default(), &default)?.uvs;
    let painted = Marks::default().with_paint(head.positions().iter().map(face).collect());
    let after = laid_out(&head, &painted, &default)?.uvs;
    write(folder, "paint", &head, &plain, &after)?;
    println!("paint (--paint ATTRIBUTE)");
    weighted(folder)?;
    kept_seams(folder)?;
    improved(folder)?;
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

/// 1 in the face of the [`head`], 0 behind.
fn face(&[_, y, _]: &[f64; 3]) -> f64 {
    (0.2 - 2.0 * y).clamp(0.0, 1.0)
}

/// Parts, the largest of which gets twice as many texels along every length as the others.
fn weighted(folder: &Path) -> Result<(), Box<dyn Error>> {
    let mesh = shapes::assembly(3);
    let (marks, config) = (Marks::default(), LayoutConfig::default());
    let labels = parts(&mesh)?;
    let before = laid_out_weighted(&mesh, &labels, &[], &marks, &config)?.uvs;
    let after = laid_out_weighted(&mesh, &labels, &[2.0, 1.0], &marks, &config)?.uvs;
    write(folder, "weight", &mesh, &before, &after)?;
    println!("weight (--weight NAME=2)");
    Ok(())
}

/// For every triangle 0 if it is in the largest connected part, otherwise 1.
fn parts(mesh: &TriangleMesh) -> Result<Vec<u32>, Box<dyn Error>> {
    let components = Components::of(mesh, &[])?;
    let size = |one: &&Component| one.mesh.triangles().len();
    let largest = components.list.iter().max_by_key(size);
    let inside: HashSet<u32> = largest
        .iter()
        .flat_map(|one| one.vertices.clone())
        .collect();
    let label = |t: &[u32; 3]| u32::from(!inside.contains(&t[0]));
    Ok(mesh.triangles().iter().map(label).collect())
}

/// A layout with its upper half stretched, and the same seams flattened anew.
fn kept_seams(folder: &Path) -> Result<(), Box<dyn Error>> {
    let (mesh, config) = (head(), LayoutConfig::default());
    let good = laid_out(&mesh, &Marks::default(), &config)?.uvs;
    let stretched = |[u, v]: [f32; 2]| [u, 0.3 * v + 0.7 * v * v];
    let before = mapped(&good, &mesh, |_, q| stretched(q))?;
    let marks = as_cut(&mesh, &before)?;
    let after = laid_out(&mesh, &marks, &config)?.uvs;
    write(folder, "keep-seams", &mesh, &before, &after)?;
    println!("keep-seams (--keep-seams)");
    Ok(())
}

/// Marks by which a mesh is cut where a map cuts it, and nowhere else.
fn as_cut(mesh: &TriangleMesh, uvs: &UvMap) -> Result<Marks, Box<dyn Error>> {
    let [seams, others] = present_seams(mesh, uvs)?;
    Ok(Marks::new(&Edges::of(mesh), &seams, &others))
}

/// Parts, the largest of which is stretched, and this flattened anew beside the others, which stay.
fn improved(folder: &Path) -> Result<(), Box<dyn Error>> {
    let (mesh, config) = (shapes::assembly(3), LayoutConfig::default());
    let labels = parts(&mesh)?;
    let good = laid_out(&mesh, &Marks::default(), &config)?.uvs;
    let squeeze = |t: usize, [u, v]: [f32; 2]| match labels[t] {
        0 => [u, 0.4 * v],
        _ => [u, v],
    };
    let before = mapped(&good, &mesh, squeeze)?;
    let labels = &labels;
    let of = |label: u32| (0..labels.len()).filter(move |&t| labels[t] == label);
    let there: Vec<[f32; 2]> = of(1).flat_map(|t| before.corners(t)).collect();
    let there = UvMap::of_corners(&there)?;
    let anew = of(0).map(|t| mesh.triangles()[t]).collect();
    let anew = TriangleMesh::new(mesh.positions().to_vec(), anew)?;
    let components = Components::of(&anew, &[])?;
    let stretched: Vec<[f32; 2]> = of(0).flat_map(|t| before.corners(t)).collect();
    let marks = as_cut(&anew, &UvMap::of_corners(&stretched)?)?;
    let input = MeshInput {
        marks: &marks,
        beside: Some(Beside {
            uvs: &there,
            squares: &[],
            scale: f64::INFINITY,
        }),
        ..MeshInput::of(&components)
    };
    let layout = lay_out(&config, &input, &mut |_| ControlFlow::Continue(()))?;
    let maps: Vec<UvMap> = layout.components.iter().map(|c| c.uvs.clone()).collect();
    let flat = components.uv_map(&maps)?;
    let mut next = 0..;
    let corners: Vec<[f32; 2]> = (0..labels.len())
        .flat_map(|t| match labels[t] {
            0 => flat.corners(next.next().unwrap_or_default()),
            _ => before.corners(t),
        })
        .collect();
    write(
        folder,
        "improve",
        &mesh,
        &before,
        &UvMap::of_corners(&corners)?,
    )?;
    println!("improve (--improve)");
    Ok(())
}

/// A map with its UVs elsewhere: `place` has the triangle and the UV of a corner.
fn mapped(
    uvs: &UvMap,
    mesh: &TriangleMesh,
    place: impl Fn(usize, [f32; 2]) -> [f32; 2],
) -> Result<UvMap, Box<dyn Error>> {
    let corners: Vec<[f32; 2]> = (0..mesh.triangles().len())
        .flat_map(|t| uvs.corners(t).map(|q| place(t, q)))
        .collect();
    Ok(UvMap::of_corners(&corners)?)
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

/// Prints a table for every feature that changes charts, of those meshes in which it does, without it and
/// with it; and one of what visibility and the mirror plane take to find.
fn figures(paths: &[PathBuf]) -> Result<(), Box<dyn Error>> {
    let mut features = features();
    // These change no charts, or are others with another surface.
    let left_out = ["upright", "tiles", "symmetry-scan"];
    features.retain(|feature| !left_out.contains(&feature.name));
    let mut tables: Vec<Vec<String>> = features.iter().map(|_| Vec::new()).collect();
    let mut costs = Vec::new();
    for path in paths {
        let document = fam_io::read_surface(path)?;
        let Surface::Mesh(mesh) = document.surface() else {
            continue;
        };
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let marks = Marks::default().with_diagonals(&Edges::of(mesh), document.diagonals());
        let before = Figures::of(mesh, &laid_out(mesh, &marks, &LayoutConfig::default())?)?;
        let mut started = Instant::now();
        let plane = symmetry::find(mesh);
        let finding_plane = started.elapsed().as_secs_f64();
        let mut mirrored = None;
        for (feature, table) in features.iter().zip(&mut tables) {
            let outcome = laid_out(mesh, &marks, &feature.config)?;
            if feature.name == "symmetry" {
                mirrored = plane.map(|plane| mirrored_share(mesh, &outcome.uvs, &plane));
            }
            let after = Figures::of(mesh, &outcome)?;
            if before.changes_to(&after) {
                table.push(format!("| {name} | {} |", before.row(&after)));
            }
        }
        let components = Components::of(mesh, &[])?;
        started = Instant::now();
        let occluders = Occluders::of(components.list.iter().map(|one| &one.mesh));
        for component in &components.list {
            occluders.visibility(&component.mesh, None, &|| true);
        }
        let visibility = started.elapsed().as_secs_f64();
        let mirrored = mirrored.map_or("no plane".to_owned(), |m| format!("{:.0}", 100.0 * m));
        costs.push(format!(
            "| {name} | {} | {visibility:.2} | {finding_plane:.2} | {mirrored} |",
            mesh.triangles().len(),
        ));
    }
    for (feature, table) in features.iter().zip(tables) {
        println!(
            "\n`{}`\n\n| mesh | charts | seams | visibility | straight, % | energy | coverage, % | seconds |\n\
             | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
            feature.option
        );
        table.iter().for_each(|row| println!("{row}"));
    }
    println!(
        "\n| mesh | triangles | visibility, s | mirror plane, s | mirrored with --symmetry, % |\n\
         | --- | ---: | ---: | ---: | ---: |"
    );
    costs.iter().for_each(|row| println!("{row}"));
    Ok(())
}

/// What is told of a layout.
struct Figures {
    charts: usize,
    seams: f64,
    /// Of the seams; without any there is none.
    visibility: Option<f64>,
    /// Share of the length of charts' borders that runs along the axes.
    straight: f64,
    energy: f64,
    coverage: f64,
    seconds: f64,
}

impl Figures {
    /// Fails if a triangle is flipped or two overlap that do not share their place on purpose.
    fn of(mesh: &TriangleMesh, outcome: &Outcome) -> Result<Self, Box<dyn Error>> {
        let metrics = Metrics::measure(mesh, &outcome.uvs)?;
        if metrics.flipped_triangles > 0 || metrics.unintended_overlaps() > 0 {
            return Err(format!("flips or overlaps: {metrics:?}").into());
        }
        let squares = &outcome.layout.squares;
        let coverage: f64 = squares.iter().map(|square| square.coverage).sum();
        Ok(Self {
            charts: metrics.charts,
            seams: metrics.seam_length,
            visibility: seam_visibility(mesh, &outcome.uvs)?,
            straight: 100.0 * straight_share(&outcome.uvs),
            energy: outcome.layout.energy(),
            coverage: 100.0 * coverage,
            seconds: outcome.seconds,
        })
    }

    fn changes_to(&self, other: &Self) -> bool {
        let differs = |a: f64, b: f64| (a - b).abs() > 0.005 * a.abs();
        self.charts != other.charts
            || differs(self.seams, other.seams)
            || differs(self.energy, other.energy)
            || differs(self.coverage, other.coverage)
    }

    fn row(&self, after: &Self) -> String {
        let told = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.3}"));
        let both = |of: fn(&Self) -> f64, digits: usize| {
            format!("{:.digits$} → {:.digits$}", of(self), of(after))
        };
        [
            format!("{} → {}", self.charts, after.charts),
            both(|f| f.seams, 2),
            format!("{} → {}", told(self.visibility), told(after.visibility)),
            both(|f| f.straight, 0),
            both(|f| f.energy, 3),
            both(|f| f.coverage, 0),
            both(|f| f.seconds, 1),
        ]
        .join(" | ")
    }
}

/// Share of the length of charts' borders that is within a degree of an axis.
fn straight_share(uvs: &UvMap) -> f64 {
    let mut sides: HashMap<[u32; 2], u32> = HashMap::new();
    for &[a, b, c] in uvs.triangles() {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let (mut straight, mut all) = (0.0, 0.0);
    for ([a, b], _) in sides.into_iter().filter(|(_, count)| *count == 1) {
        let [p, q] = [a, b].map(|v| uvs.uvs()[v as usize].map(f64::from));
        let (x, y) = ((p[0] - q[0]).abs(), (p[1] - q[1]).abs());
        all += x.hypot(y);
        if x.min(y) <= 1_f64.to_radians().tan() * x.max(y) {
            straight += x.hypot(y);
        }
    }
    if all > 0.0 { straight / all } else { 0.0 }
}
