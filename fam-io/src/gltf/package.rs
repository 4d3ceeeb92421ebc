//! A glTF document in memory: its JSON and one buffer.

use std::io::{self, Write};

use ::gltf::json::accessor::{FLOAT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT};
use ::gltf::json::buffer::{ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use super::glb;
use crate::format::Format;

/// New views start at multiples of this, which is enough for all component types.
pub(super) const ALIGNMENT: usize = 8;

/// A document whose views are all of buffer 0, which is `bin`. The entry of `buffers` itself
/// is brought up to date on writing.
#[derive(Debug, Clone)]
pub(crate) struct Package {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Package {
    /// Appends to one of the top-level arrays, and returns the index.
    pub fn push(&mut self, array: &str, value: Value) -> usize {
        let list = &mut self.json[array];
        match list {
            Value::Array(list) => list.push(value),
            _ => *list = json!([value]),
        }
        self.count(array) - 1
    }

    /// The index of an entry of a top-level array that equals `value`, appended if need be.
    pub fn find_or_push(&mut self, array: &str, value: Value) -> usize {
        let equal = self.entries(array).iter().position(|entry| *entry == value);
        equal.unwrap_or_else(|| self.push(array, value))
    }

    /// A top-level array; empty if it is missing.
    pub fn entries(&self, array: &str) -> &[Value] {
        self.json[array].as_array().map_or(&[], Vec::as_slice)
    }

    /// How many entries a top-level array has.
    pub fn count(&self, array: &str) -> usize {
        self.entries(array).len()
    }

    /// The bytes of a buffer view; `None` if there is no such view.
    pub fn view_bytes(&self, view: usize) -> Option<&[u8]> {
        let view = self.entries("bufferViews").get(view)?;
        let start = usize::try_from(view["byteOffset"].as_u64().unwrap_or(0)).ok()?;
        let length = usize::try_from(view["byteLength"].as_u64()?).ok()?;
        self.bin.get(start..start.checked_add(length)?)
    }

    /// Appends bytes as a buffer view.
    pub fn add_view(&mut self, bytes: &[u8], target: Option<u32>, stride: Option<u32>) -> usize {
        self.bin
            .resize(self.bin.len().next_multiple_of(ALIGNMENT), 0);
        let mut view = json!({
            "buffer": 0,
            "byteOffset": self.bin.len(),
            "byteLength": bytes.len(),
        });
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// Appends an accessor of a whole view; `bounds` are the least and greatest value of each
    /// component.
    pub fn add_accessor(
        &mut self,
        view: usize,
        component_type: u32,
        kind: &str,
        count: usize,
        bounds: Option<[&[f32]; 2]>,
    ) -> usize {
        let mut accessor = json!({
            "bufferView": view,
            "componentType": component_type,
            "count": count,
            "type": kind,
        });
        if let Some([min, max]) = bounds {
            accessor["min"] = json!(min);
            accessor["max"] = json!(max);
        }
        self.push("accessors", accessor)
    }

    /// Appends a vertex attribute of floats: `VEC2`, `VEC3` or `VEC4`. There is at least one.
    pub fn add_vectors<const N: usize>(&mut self, values: &[[f32; N]], bounded: bool) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flatten()
            .flat_map(|c| c.to_le_bytes())
            .collect();
        let view = self.add_view(&bytes, Some(ARRAY_BUFFER), None);
        let [min, max] = bounds(values);
        let bounds = bounded.then_some([&min[..], &max[..]]);
        self.add_accessor(view, FLOAT, &format!("VEC{N}"), values.len(), bounds)
    }

    /// Appends indices into so many vertices, in 16 bits if that is enough, else in 32.
    pub fn add_indices(&mut self, indices: &[u32], vertices: usize) -> usize {
        // The greatest number of a type is no index.
        let component_type = if vertices <= usize::from(u16::MAX) {
            UNSIGNED_SHORT
        } else {
            UNSIGNED_INT
        };
        self.add_indices_as(indices, component_type)
    }

    /// Appends indices as numbers of a component type that holds them.
    pub(super) fn add_indices_as(&mut self, indices: &[u32], component_type: u32) -> usize {
        let bytes: Vec<u8> = match component_type {
            UNSIGNED_BYTE => indices.iter().map(|&i| i as u8).collect(),
            UNSIGNED_SHORT => {
                let narrow = indices.iter().map(|&i| i as u16);
                narrow.flat_map(u16::to_le_bytes).collect()
            }
            _ => indices.iter().flat_map(|i| i.to_le_bytes()).collect(),
        };
        let view = self.add_view(&bytes, Some(ELEMENT_ARRAY_BUFFER), None);
        self.add_accessor(view, component_type, "SCALAR", indices.len(), None)
    }

    /// Writes the document so that it stands alone: the buffer is the binary chunk of a GLB,
    /// and a data URI in JSON.
    pub fn write(&self, format: Format, out: &mut dyn Write) -> io::Result<()> {
        let mut json = self.json.clone();
        if !self.bin.is_empty() {
            let buffers = &mut json["buffers"];
            if buffers.get(0).is_none_or(|buffer| !buffer.is_object()) {
                *buffers = json!([{}]);
            }
            buffers[0]["byteLength"] = self.bin.len().into();
            if format == Format::Gltf {
                buffers[0]["uri"] = data_uri("application/octet-stream", &self.bin).into();
            }
        }
        match format {
            Format::Gltf => serde_json::to_writer_pretty(&mut *out, &json)?,
            _ => glb::write(&serde_json::to_vec(&json)?, &self.bin, out)?,
        }
        Ok(())
    }
}

/// Bytes as a data URI.
pub(super) fn data_uri(media_type: &str, bytes: &[u8]) -> String {
    format!("data:{media_type};base64,{}", BASE64_STANDARD.encode(bytes))
}

/// The least and the greatest value of each component.
fn bounds<const N: usize>(values: &[[f32; N]]) -> [[f32; N]; 2] {
    let start = [[f32::INFINITY; N], [f32::NEG_INFINITY; N]];
    values.iter().fold(start, |[min, max], value| {
        [
            std::array::from_fn(|c| min[c].min(value[c])),
            std::array::from_fn(|c| max[c].max(value[c])),
        ]
    })
}
