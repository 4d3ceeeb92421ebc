//! The materials of an OBJ file: an MTL file and the textures it refers to.
//!
//! The MTL file has the base colour as `Kd`, as linear as the reader takes it, its opacity as
//! `d`, and the texture as `map_Kd`.
//! Textures of other types than PNG and JPEG are left out.

use std::collections::HashMap;
use std::fmt::Write;
use std::rc::Rc;

use crate::scene::{Image, Scene};

use super::color::unit;
use super::names;

/// The name of the MTL file of an OBJ file.
pub(super) fn library_name(stem: &str) -> String {
    format!("{}.mtl", names::word(stem))
}

/// The names of the materials in OBJ and MTL files, and one for faces without a material.
pub(super) fn names(scene: &Scene) -> (Vec<String>, String) {
    let materials = scene.materials.iter().map(|material| &*material.name);
    let mut names = names::distinct(materials.chain(["none"]), "material");
    let none = names.pop().unwrap_or_default();
    (names, none)
}

/// The textures and then the MTL file, by their names; nothing for a scene without materials.
pub(super) fn companions(scene: &Scene, stem: &str) -> Vec<(String, Vec<u8>)> {
    if scene.materials.is_empty() {
        return Vec::new();
    }
    let mut companions = Vec::new();
    let mut textures: HashMap<*const [u8], String> = HashMap::new();
    let mut text = String::new();
    for (material, name) in scene.materials.iter().zip(names(scene).0) {
        let [r, g, b, opacity] = material.base_color.map(unit);
        // Writing to a string cannot fail.
        let _ = write!(text, "newmtl {name}\nKd {r} {g} {b}\nd {opacity}\n");
        let Some((image, extension)) = material.texture.as_ref().and_then(usable) else {
            continue;
        };
        let number = textures.len() + 1;
        let file = textures.entry(Rc::as_ptr(&image.bytes)).or_insert_with(|| {
            let file = format!("{}-{number}.{extension}", names::word(stem));
            companions.push((file.clone(), image.bytes.to_vec()));
            file
        });
        let _ = writeln!(text, "map_Kd {file}");
    }
    companions.push((library_name(stem), text.into_bytes()));
    companions
}

fn usable(image: &Image) -> Option<(&Image, &'static str)> {
    let extension = match image_type(&image.bytes)? {
        "image/png" => "png",
        _ => "jpg",
    };
    Some((image, extension))
}

/// The media type of a PNG or JPEG image.
pub(super) fn image_type(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some("image/png")
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        Some("image/jpeg")
    } else {
        None
    }
}
