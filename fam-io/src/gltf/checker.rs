//! A checker texture, to see UVs by.

use std::io::Cursor;

use ::gltf::json::mesh::{TRIANGLE_FAN, TRIANGLES};
use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};

use super::package::Package;

/// Fields along each side of the image, and pixels along each side of a field.
const FIELDS: u32 = 8;
const FIELD: u32 = 64;

/// The letter F, which looks different in every orientation: rows of three cells.
const LETTER: [[bool; 3]; 5] = [
    [true, true, true],
    [true, false, false],
    [true, true, false],
    [true, false, false],
    [true, false, false],
];
/// Pixels along each side of a cell of the letter, and around it.
const CELL: u32 = 6;
const MARGIN: u32 = 8;

impl Package {
    /// Gives all triangles that have a set of UVs a material with a checker texture that uses
    /// it. The materials they had stay in the document.
    pub fn add_checker(&mut self, uv_set: u32) {
        let source = self.checker_image();
        let sampler = self.find_or_push("samplers", json!({"wrapS": 10497, "wrapT": 10497}));
        let texture = json!({"name": "checker", "sampler": sampler, "source": source});
        let texture = self.find_or_push("textures", texture);
        let material = json!({
            "name": "checker",
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": texture, "texCoord": uv_set},
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
            "doubleSided": true,
        });
        let material = self.find_or_push("materials", material);
        let meshes = self.json.get_mut("meshes").and_then(Value::as_array_mut);
        let primitives = meshes
            .into_iter()
            .flatten()
            .filter_map(|mesh| mesh.get_mut("primitives")?.as_array_mut())
            .flatten();
        for primitive in primitives.filter(|primitive| is_textured(primitive, uv_set)) {
            primitive["material"] = material.into();
            drop_variants(primitive);
        }
    }

    /// The index of the checker image, which is there once even if it is asked for again.
    fn checker_image(&mut self) -> usize {
        let png = png();
        let is_checker = |image: &Value| {
            let view = image["bufferView"].as_u64();
            view.and_then(|view| self.view_bytes(view as usize)) == Some(&png)
        };
        let images = self.entries("images");
        let present = images.iter().position(is_checker);
        present.unwrap_or_else(|| {
            let view = self.add_view(&png, None, None);
            let image = json!({"name": "checker", "mimeType": "image/png", "bufferView": view});
            self.push("images", image)
        })
    }
}

fn is_textured(primitive: &Value, uv_set: u32) -> bool {
    let mode = primitive.get("mode").and_then(Value::as_u64);
    let uvs = &primitive["attributes"][format!("TEXCOORD_{uv_set}")];
    uvs.is_u64() && mode.is_none_or(|mode| (TRIANGLES.into()..=TRIANGLE_FAN.into()).contains(&mode))
}

/// Variants would replace the material.
fn drop_variants(primitive: &mut Value) {
    if let Some(extensions) = primitive
        .get_mut("extensions")
        .and_then(Value::as_object_mut)
    {
        extensions.shift_remove("KHR_materials_variants");
        if extensions.is_empty() {
            primitive
                .as_object_mut()
                .map(|all| all.shift_remove("extensions"));
        }
    }
}

/// The image: red grows to the right and green upwards; every field has an upright F.
fn png() -> Vec<u8> {
    let side = FIELDS * FIELD;
    let image = RgbImage::from_fn(side, side, |x, y| {
        let (column, row) = (x / FIELD, FIELDS - 1 - y / FIELD);
        let light = (column + row) % 2 == 1;
        let step = |field: u32| (96 + 20 * field) as u8;
        let color = [step(column), step(row), 160];
        Rgb(if light != in_letter(x % FIELD, y % FIELD) {
            color
        } else {
            color.map(|c| c / 3)
        })
    });
    let mut png = Cursor::new(Vec::new());
    image
        .write_to(&mut png, ImageFormat::Png)
        .expect("an image in memory can be encoded");
    png.into_inner()
}

fn in_letter(x: u32, y: u32) -> bool {
    let cell = |at: u32| at.checked_sub(MARGIN).map(|at| (at / CELL) as usize);
    let row = cell(y).and_then(|row| LETTER.get(row));
    row.zip(cell(x))
        .is_some_and(|(row, column)| row.get(column) == Some(&true))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_orientation_of_the_image_looks_different() {
        let image = image::load_from_memory(&png()).unwrap().to_rgb8();
        let side = FIELDS * FIELD;
        assert_eq!(image.dimensions(), (side, side));
        let corner = |x: u32, y: u32| image.get_pixel(x * (side - 1), y * (side - 1)).0;
        // The bottom left is dark; red grows to the right and green upwards.
        let [low, right, up] = [corner(0, 1), corner(1, 1), corner(0, 0)];
        assert!(right[0] > low[0] && right[1] / 2 <= low[1] * 2);
        assert!(up[1] > low[1]);
        let field = |x: u32, y: u32| image.get_pixel(x, side - FIELD + y).0;
        let (background, letter) = (field(1, 1), field(MARGIN, MARGIN));
        assert_ne!(background, letter);
        assert_eq!(field(MARGIN + 3 * CELL - 1, MARGIN), letter);
        assert_eq!(field(MARGIN, MARGIN + 5 * CELL - 1), letter);
        assert_eq!(
            field(MARGIN + 3 * CELL - 1, MARGIN + 5 * CELL - 1),
            background
        );
    }
}
