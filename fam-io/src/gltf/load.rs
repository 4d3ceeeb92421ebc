//! A file as a [`Package`]: all of its buffers in one.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use ::gltf::json::Buffer;
use ::gltf::json::buffer::View;
use serde_json::Value;

use super::glb;
use super::package::ALIGNMENT;
use super::package::Package;
use super::uri::{self, Place};
use super::value::{list, malformed, typed};
use crate::content::Content;
use crate::error::ReadFault;
use crate::format::Format;
use crate::text::excerpt;

/// A file in memory.
#[derive(Debug, Clone)]
pub(super) struct Loaded {
    pub format: Format,
    /// Where relative URIs start.
    pub folder: Option<PathBuf>,
    pub package: Package,
    /// The bytes of the JSON and of all buffers.
    pub size: usize,
    /// The buffers and images that are files of their own.
    pub files: Vec<PathBuf>,
}

/// The top-level lists that are read or added to.
const LISTS: [&str; 9] = [
    "accessors",
    "bufferViews",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scenes",
    "textures",
];

pub(super) fn load(content: Content) -> Result<Loaded, ReadFault> {
    let folder = match &content {
        Content::File(path) => Some(path.parent().unwrap_or(Path::new("")).to_owned()),
        Content::Bytes(_) => None,
    };
    let bytes = content.bytes()?;
    let (format, text, chunk) = if bytes.starts_with(glb::MAGIC) {
        let (text, chunk) = glb::split(&bytes)?;
        (Format::Glb, text, chunk)
    } else {
        (Format::Gltf, &bytes[..], None)
    };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut json: Value = serde_json::from_slice(text)
        .map_err(|error| malformed(format!("its JSON is broken: {error}")))?;
    check_version(&json)?;
    for key in LISTS {
        list(&json, key)?;
    }
    check_compression(&json)?;
    let files = files(&json, folder.as_deref());
    let bin = merge_buffers(&mut json, format, chunk, folder.as_deref())?;
    Ok(Loaded {
        format,
        folder,
        size: text.len() + bin.len(),
        package: Package { json, bin },
        files,
    })
}

fn check_version(json: &Value) -> Result<(), ReadFault> {
    let asset = &json["asset"];
    let version = match &asset["minVersion"] {
        Value::Null => &asset["version"],
        minimum => minimum,
    };
    match version.as_str() {
        Some("2.0") => Ok(()),
        Some(other) if other.starts_with("2.") && asset["minVersion"].is_null() => Ok(()),
        Some(other) => {
            let version = excerpt(other.as_bytes());
            Err(ReadFault::Unsupported(format!("glTF {version} is")))
        }
        None => Err(malformed("it does not say which version of glTF it is")),
    }
}

/// Refuses what has its vertices or indices in a compressed form.
fn check_compression(json: &Value) -> Result<(), ReadFault> {
    let primitives = list(json, "meshes")?
        .iter()
        .filter_map(|mesh| mesh["primitives"].as_array())
        .flatten();
    let views = list(json, "bufferViews")?;
    let uses = primitives
        .map(|primitive| (primitive, "KHR_draco_mesh_compression"))
        .chain(views.iter().map(|view| (view, "EXT_meshopt_compression")))
        .chain(views.iter().map(|view| (view, "KHR_meshopt_compression")));
    for (user, name) in uses {
        if user
            .get("extensions")
            .is_some_and(|all| all.get(name).is_some())
        {
            return Err(ReadFault::Unsupported(format!("the compression {name} is")));
        }
    }
    Ok(())
}

/// The files that buffers and images refer to.
fn files(json: &Value, folder: Option<&Path>) -> Vec<PathBuf> {
    let entries = ["buffers", "images"]
        .into_iter()
        .flat_map(|key| json[key].as_array());
    let uris = entries.flatten().filter_map(|entry| entry["uri"].as_str());
    let paths = uris.filter_map(|uri| match Place::of(uri) {
        Place::Relative(path) => Some(folder?.join(path)),
        _ => None,
    });
    paths.collect()
}

/// Puts all buffers one after the other, and the views where their bytes are then.
fn merge_buffers(
    json: &mut Value,
    format: Format,
    chunk: Option<&[u8]>,
    folder: Option<&Path>,
) -> Result<Vec<u8>, ReadFault> {
    let buffers: Vec<Buffer> = typed(json, "buffers")?;
    let views: Vec<View> = typed(json, "bufferViews")?;
    let mut bin = Vec::new();
    // Where the buffers are; one file may be several of them.
    let mut places: Vec<(usize, u64)> = Vec::new();
    let mut files: HashMap<(&str, u64), usize> = HashMap::new();
    for (index, buffer) in buffers.iter().enumerate() {
        let length = buffer.byte_length.0;
        let file = buffer.uri.as_deref().map(|uri| (uri, length));
        if let Some(&start) = file.and_then(|file| files.get(&file)) {
            places.push((start, length));
            continue;
        }
        let content = match &buffer.uri {
            Some(uri) => Cow::Owned(bytes_of(uri, length, folder)?),
            None if index == 0 && format == Format::Glb => {
                Cow::Borrowed(chunk.ok_or_else(|| malformed("its binary chunk is missing"))?)
            }
            None => return Err(malformed(format!("buffer {index} has no URI"))),
        };
        let announced = usize::try_from(length)
            .ok()
            .and_then(|length| content.get(..length));
        let content = announced.ok_or_else(|| {
            malformed(format!(
                "buffer {index} announces {length} bytes, but there are only {}",
                content.len()
            ))
        })?;
        bin.resize(bin.len().next_multiple_of(ALIGNMENT), 0);
        places.push((bin.len(), length));
        files.extend(file.map(|file| (file, bin.len())));
        bin.extend_from_slice(content);
    }
    for (index, view) in views.iter().enumerate() {
        let buffer = view.buffer.value();
        let &(start, length) = places.get(buffer).ok_or_else(|| {
            malformed(format!(
                "buffer view {index} refers to buffer {buffer}, which is missing"
            ))
        })?;
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        if offset
            .checked_add(view.byte_length.0)
            .is_none_or(|end| end > length)
        {
            return Err(malformed(format!(
                "buffer view {index} reaches beyond its buffer"
            )));
        }
        if buffer > 0 {
            json["bufferViews"][index]["buffer"] = 0.into();
            json["bufferViews"][index]["byteOffset"] = (start as u64 + offset).into();
        }
    }
    if let Some(first) = json["buffers"].as_array_mut().and_then(|list| {
        list.truncate(1);
        list.first_mut()?.as_object_mut()
    }) {
        first.shift_remove("uri");
    }
    Ok(bin)
}

fn bytes_of(uri: &str, length: u64, folder: Option<&Path>) -> Result<Vec<u8>, ReadFault> {
    let name = || excerpt(uri.as_bytes());
    match (Place::of(uri), folder) {
        (Place::Data(data), _) => {
            uri::decode(data).ok_or_else(|| malformed("the data URI of a buffer is broken"))
        }
        (Place::Relative(path), Some(folder)) => uri::read(&folder.join(path), length)
            .map_err(|error| malformed(format!("its buffer `{}`: {error}", name()))),
        (Place::Relative(_), None) => Err(malformed(format!(
            "its buffer `{}` is another file, and there is no folder to look in",
            name()
        ))),
        (Place::Elsewhere, _) => Err(malformed(format!(
            "its buffer `{}` is not a file beside it",
            name()
        ))),
    }
}
