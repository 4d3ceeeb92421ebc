//! three.js shows the checker texture where the UVs put it: a board of 8 × 8 fields, on which
//! red grows to the right and green upwards, each with an upright F.

use std::path::PathBuf;

use fam_io::{Document, Format, Uvs, WriteOptions};
use fam_surface::{Surface, UvMap, shapes};
use image::{Rgb, RgbImage};

use crate::gltf::write_documents;
use crate::installed::{BACKGROUND, Consumers};
use crate::surfaces::{obj, real_models, write};

/// A cube with the whole UV square on each side.
const CUBE: &str = "\
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3 4/4
f 2/1 6/2 7/3 3/4
f 6/1 5/2 8/3 7/4
f 5/1 1/2 4/3 8/4
f 4/1 3/2 7/3 8/4
f 5/1 6/2 2/3 1/4
";

const FRONT: [i32; 3] = [0, 0, 1];
pub const ASLANT: [i32; 3] = [2, 3, 4];

fn checker() -> WriteOptions {
    WriteOptions {
        checker: true,
        ..WriteOptions::default()
    }
}

/// What a pixel of a board may be of.
#[derive(Clone, Copy, PartialEq)]
enum Tone {
    Light,
    Dark,
}

fn tone(pixel: [u8; 3]) -> Option<Tone> {
    let [r, g, b] = pixel;
    let near = |c: u8, of: u8| c.abs_diff(of) <= 12;
    let within = |c: u8, least: u8, most: u8| (least - 8..=most + 8).contains(&c);
    if near(b, 160) && within(r, 96, 236) && within(g, 96, 236) {
        Some(Tone::Light)
    } else if near(b, 53) && within(r, 32, 79) && within(g, 32, 79) {
        Some(Tone::Dark)
    } else {
        None
    }
}

/// Which parts of the object in a picture are light and dark fields.
pub fn shares(picture: &RgbImage) -> [f64; 2] {
    let object = || picture.pixels().filter(|pixel| pixel.0 != BACKGROUND);
    let share = |of| {
        let pixels = object().filter(|pixel| tone(pixel.0) == Some(of)).count();
        pixels as f64 / object().count() as f64
    };
    [share(Tone::Light), share(Tone::Dark)]
}

/// How often the tone changes along a row of pixels.
fn changes(picture: &RgbImage, row: u32) -> usize {
    let pixels = (0..picture.width()).filter_map(|x| tone(picture.get_pixel(x, row).0));
    let tones: Vec<_> = pixels.collect();
    tones.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

#[test]
fn a_square_shows_the_board_upright() {
    let Some(consumers) = Consumers::with_browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("square.glb");
    let square = shapes::rectangle(1.0, 1.0, 3, 5);
    let flat = square
        .positions()
        .iter()
        .map(|p| [p[0] as f32 + 0.5, p[1] as f32 + 0.5]);
    let uvs = UvMap::new(flat.collect(), square.triangles().to_vec()).unwrap();
    let document = Document::of_surface(Surface::Mesh(square));
    document.write_mesh_uvs(&uvs, &file, &checker()).unwrap();
    let picture = &consumers.pictures(FRONT, &[&file])[0];

    // The square takes nine tenths of the picture.
    let side = f64::from(picture.width());
    let pixel = |column: u32, row: u32, [x, y]: [f64; 2]| {
        let place = |field: u32, at: f64| 0.05 + 0.9 * (f64::from(field) + at) / 8.0;
        let (x, y) = (side * place(column, x), side * (1.0 - place(row, y)));
        picture.get_pixel(x as u32, y as u32).0
    };
    for (column, row) in (0..8).flat_map(|column| (0..8).map(move |row| (column, row))) {
        let light = [96 + 20 * column, 96 + 20 * row, 160].map(|c| c as u8);
        let dark = light.map(|c| c / 3);
        let (field, letter) = if (column + row) % 2 == 1 {
            (light, dark)
        } else {
            (dark, light)
        };
        let near = |at, expected: [u8; 3]| {
            let found: [u8; 3] = pixel(column, row, at);
            let near = found.iter().zip(expected).all(|(f, e)| f.abs_diff(e) <= 8);
            assert!(
                near,
                "field {column} {row} at {at:?}: {found:?} {expected:?}"
            );
        };
        // On the stem of the letter and the end of its upper arm; then mirrored in x and in y.
        near([0.17, 0.5], letter);
        near([0.36, 0.83], letter);
        near([0.83, 0.5], field);
        near([0.64, 0.83], field);
        near([0.36, 0.17], field);
    }
}

#[test]
fn a_cube_shows_boards_and_without_the_option_it_does_not() {
    let Some(consumers) = Consumers::with_browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let cube = obj(CUBE);
    let files = ["plain.glb", "checker.glb", "checker.gltf"].map(|name| folder.path().join(name));
    let uvs = cube.uv_map().unwrap();
    for (file, options) in files
        .iter()
        .zip([WriteOptions::default(), checker(), checker()])
    {
        cube.write_mesh_uvs(uvs, file, &options).unwrap();
    }
    let files = files.each_ref().map(|file| file.as_path());
    let pictures = consumers.pictures(ASLANT, &files);
    let [plain, glb, gltf] = &pictures[..] else {
        unreachable!()
    };
    assert_eq!(shares(plain), [0.0, 0.0]);
    assert_eq!(changes(plain, 256), 0);
    let [light, dark] = shares(glb);
    assert!(light > 0.3 && dark > 0.3, "{light} {dark}");
    assert!(changes(glb, 256) > 10, "{}", changes(glb, 256));
    assert!(glb == gltf, "the same document looks the same");
}

/// UVs as seen from the front, with the whole UV square over the surface.
fn planar(surface: &Surface) -> Uvs {
    let positions = surface.positions();
    let along = |axis: usize| {
        let values = || positions.iter().map(|p| p[axis]);
        let (min, max) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        move |p: &[f64; 3]| ((p[axis] - min) / (max - min)) as f32
    };
    let (u, v) = (along(0), along(1));
    let uvs = positions.iter().map(|p| [u(p), v(p)]).collect();
    match surface {
        Surface::Mesh(mesh) => Uvs::Mesh(UvMap::new(uvs, mesh.triangles().to_vec()).unwrap()),
        Surface::PointCloud(_) => Uvs::Points(uvs),
    }
}

#[test]
fn documents_of_all_kinds_show_the_board() {
    let Some(consumers) = Consumers::with_browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for input in write_documents(folder.path()) {
        let document = fam_io::read_surface(&input).unwrap();
        if let Surface::Mesh(_) = document.surface() {
            let file = input.with_extension("checker.glb");
            write(&document, &planar(document.surface()), &file, &checker());
            files.push(file);
        }
    }
    assert!(files.len() >= 4);
    let paths: Vec<_> = files.iter().map(PathBuf::as_path).collect();
    for (file, picture) in files.iter().zip(consumers.pictures(FRONT, &paths)) {
        let [light, dark] = shares(&picture);
        assert!(
            light > 0.2 && dark > 0.2,
            "{}: {light} {dark}",
            file.display()
        );
    }
}

#[test]
fn written_with_the_uvs_it_has_a_document_looks_the_same() {
    let Some(consumers) = Consumers::with_browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut pairs = Vec::new();
    let models = real_models(500_000).into_iter();
    for input in write_documents(folder.path()).into_iter().chain(models) {
        let Ok(document) = fam_io::read_surface(&input) else {
            continue;
        };
        let is_gltf = matches!(document.format(), Format::Glb | Format::Gltf);
        if let (true, Some(uvs)) = (is_gltf, document.uv_map()) {
            let name = input.file_stem().unwrap().to_string_lossy();
            let output = folder.path().join(format!("{name}.same.glb"));
            let options = WriteOptions::default();
            document.write_mesh_uvs(uvs, &output, &options).unwrap();
            pairs.extend([input, output]);
        }
    }
    assert!(pairs.len() >= 2 * 3);
    let paths: Vec<_> = pairs.iter().map(PathBuf::as_path).collect();
    let pictures = consumers.pictures(ASLANT, &paths);
    for (files, pictures) in pairs.chunks(2).zip(pictures.chunks(2)) {
        let different = differences(&pictures[0], &pictures[1]);
        assert!(different < 0.002, "{}: {different}", files[0].display());
        assert!(pictures[0].pixels().any(|pixel| pixel.0 != BACKGROUND));
    }
}

/// Which part of the pixels of two pictures differ.
fn differences(one: &RgbImage, other: &RgbImage) -> f64 {
    let differ =
        |(a, b): &(&Rgb<u8>, &Rgb<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 8);
    let different = one.pixels().zip(other.pixels()).filter(differ).count();
    different as f64 / one.pixels().len() as f64
}

#[test]
fn seam_lines_are_seen() {
    let Some(consumers) = Consumers::with_browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let cube = obj(CUBE);
    let files = ["plain.glb", "seams.glb"].map(|name| folder.path().join(name));
    let seam_lines = vec![[0, 1], [1, 2], [2, 3], [3, 0]];
    let seams = WriteOptions {
        seam_lines,
        ..WriteOptions::default()
    };
    for (file, options) in files.iter().zip([WriteOptions::default(), seams]) {
        cube.write_mesh_uvs(cube.uv_map().unwrap(), file, &options)
            .unwrap();
    }
    let pictures = consumers.pictures(ASLANT, &files.each_ref().map(|file| file.as_path()));
    let drawn = differences(&pictures[0], &pictures[1]);
    assert!(drawn > 0.001 && drawn < 0.02, "{drawn}");
}
