//! The images of a document, wherever they are.

use std::collections::HashMap;
use std::path::Path;

use serde_json::{Value, json};

use super::package::Package;
use super::package::data_uri;
use super::uri::{self, Place};
use crate::format::Format;

/// The encoded image; `None` if it cannot be had.
pub(super) fn bytes(package: &Package, folder: Option<&Path>, image: &Value) -> Option<Vec<u8>> {
    match image["uri"].as_str() {
        Some(uri) => match Place::of(uri) {
            Place::Data(data) => uri::decode(data),
            Place::Relative(path) => uri::read(&folder?.join(path), u64::MAX).ok(),
            Place::Elsewhere => None,
        },
        None => {
            let view = image["bufferView"].as_u64()? as usize;
            package.view_bytes(view).map(<[u8]>::to_vec)
        }
    }
}

/// Takes the images that are files of their own into the document, and those in data URIs into
/// the buffer of a GLB; those that are missing or of a format that glTF does not know stay where
/// they are.
pub(super) fn embed(package: &mut Package, folder: Option<&Path>, format: Format) {
    let mut embedded: HashMap<String, Value> = HashMap::new();
    for index in 0..package.count("images") {
        let image = &package.json["images"][index];
        let Some(uri) = image["uri"].as_str().map(str::to_owned) else {
            continue;
        };
        let moves = match Place::of(&uri) {
            Place::Data(_) => format == Format::Glb,
            Place::Relative(_) => true,
            Place::Elsewhere => false,
        };
        if !moves {
            continue;
        }
        let place = match embedded.get(&uri) {
            Some(place) => place.clone(),
            None => {
                let bytes = bytes(package, folder, image).unwrap_or_default();
                let Some(media_type) = media_type(&bytes) else {
                    continue;
                };
                let place = match format {
                    Format::Gltf => data_uri(media_type, &bytes).into(),
                    _ => json!({
                        "bufferView": package.add_view(&bytes, None, None),
                        "mimeType": media_type,
                    }),
                };
                embedded.insert(uri, place.clone());
                place
            }
        };
        let image = &mut package.json["images"][index];
        match (image.as_object_mut(), place) {
            (Some(image), Value::Object(place)) => {
                image.shift_remove("uri");
                image.extend(place);
            }
            (_, uri) => image["uri"] = uri,
        }
    }
}

/// The media type of an image by its first bytes.
fn media_type(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some("image/png")
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        Some("image/jpeg")
    } else if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        Some("image/webp")
    } else if bytes.starts_with(b"\xabKTX 20\xbb\r\n\x1a\n") {
        Some("image/ktx2")
    } else {
        None
    }
}
