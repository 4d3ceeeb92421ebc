//! three.js shows the checker texture where the UVs put it: a board of 8 × 8 fields, on which
//! red grows to the right and green upwards, each with an upright F.

use std::path::Path;

use fam_core::surface::{Surface, UvMap, shapes};
use fam_io::{Document, WriteOptions};
use image::RgbImage;

use crate::installed::{BACKGROUND, Consumers};
use crate::surfaces::obj;

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
const ASLANT: [i32; 3] = [2, 3, 4];

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
fn shares(picture: &RgbImage) -> [f64; 2] {
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
