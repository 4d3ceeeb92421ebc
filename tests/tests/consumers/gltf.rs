//! glTF documents with all kinds of content.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Writes documents into a folder.
pub fn write_documents(folder: &Path) -> Vec<PathBuf> {
    let glb = |name: &str, parts: Parts| {
        let path = folder.join(name);
        fs::write(&path, parts.into_glb()).unwrap();
        path
    };
    vec![
        glb("character.glb", character()),
        glb("relief.glb", relief()),
        glb("modes.glb", modes()),
        glb("cloud.glb", cloud()),
        write_with_files(folder),
    ]
}

/// A document and its buffer.
struct Parts {
    json: Value,
    bin: Vec<u8>,
}

impl Parts {
    fn new() -> Self {
        Self {
            json: json!({
                "asset": {"version": "2.0", "copyright": "none", "extras": {"note": [1, 2.5]}},
            }),
            bin: Vec::new(),
        }
    }

    fn push(&mut self, array: &str, entry: Value) -> usize {
        let list = self.json[array].take();
        let mut list = match list {
            Value::Array(list) => list,
            _ => Vec::new(),
        };
        list.push(entry);
        self.json[array] = list.into();
        self.json[array].as_array().unwrap().len() - 1
    }

    fn view(&mut self, bytes: &[u8], more: Value) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({
            "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len(),
        });
        extend(&mut view, more);
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, view: usize, component: u32, kind: &str, count: usize) -> usize {
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": kind, "count": count}),
        )
    }

    /// Floats with their least and greatest values.
    fn floats<const N: usize>(&mut self, values: &[[f32; N]], view: Value) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flatten()
            .flat_map(|c| c.to_le_bytes())
            .collect();
        let view = self.view(&bytes, view);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"]
            .get(N - 1)
            .unwrap_or(&"MAT4");
        let accessor = self.accessor(view, FLOAT, kind, values.len());
        extend(&mut self.json["accessors"][accessor], bounds(values));
        accessor
    }

    fn attribute<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        self.floats(values, json!({"target": VERTICES}))
    }

    /// An attribute of bytes, four for each vertex.
    fn bytes(&mut self, values: &[[u8; 4]], normalized: bool) -> usize {
        let view = json!({"target": VERTICES});
        let view = self.view(values.as_flattened(), view);
        let accessor = self.accessor(view, UNSIGNED_BYTE, "VEC4", values.len());
        if normalized {
            self.json["accessors"][accessor]["normalized"] = true.into();
        }
        accessor
    }

    fn indices(&mut self, indices: &[u32], component: u32) -> usize {
        let size = match component {
            UNSIGNED_BYTE => 1,
            UNSIGNED_SHORT => 2,
            _ => 4,
        };
        let bytes = indices
            .iter()
            .flat_map(|i| i.to_le_bytes().into_iter().take(size));
        let bytes: Vec<u8> = bytes.collect();
        let view = self.view(&bytes, json!({"target": INDICES}));
        self.accessor(view, component, "SCALAR", indices.len())
    }

    /// Displacements of some of so many vertices; all others stay.
    fn sparse(&mut self, count: usize, moved: &[u32], by: [f32; 3]) -> usize {
        let indices: Vec<u8> = moved.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.view(&indices, json!({}));
        let values: Vec<u8> = moved
            .iter()
            .flat_map(|_| by)
            .flat_map(f32::to_le_bytes)
            .collect();
        let values = self.view(&values, json!({}));
        let mut accessor = json!({
            "componentType": FLOAT,
            "type": "VEC3",
            "count": count,
            "sparse": {
                "count": moved.len(),
                "indices": {"bufferView": indices, "componentType": UNSIGNED_INT},
                "values": {"bufferView": values},
            },
        });
        extend(&mut accessor, bounds(&[[0.0; 3], by]));
        self.push("accessors", accessor)
    }

    fn with_buffer(mut self, more: Value) -> Self {
        self.json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        extend(&mut self.json["buffers"][0], more);
        self
    }

    fn into_glb(self) -> Vec<u8> {
        let parts = self.with_buffer(json!({}));
        let mut json = serde_json::to_vec(&parts.json).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = parts.bin;
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + 8 + bin.len();
        let number = |n: usize| (n as u32).to_le_bytes();
        [
            &b"glTF"[..],
            &number(2),
            &number(length),
            &number(json.len()),
            b"JSON",
            &json,
            &number(bin.len()),
            b"BIN\0",
            &bin,
        ]
        .concat()
    }
}

fn extend(object: &mut Value, more: Value) {
    if let (Some(object), Value::Object(more)) = (object.as_object_mut(), more) {
        object.extend(more);
    }
}

fn bounds<const N: usize>(values: &[[f32; N]]) -> Value {
    let fold = |of: fn(f32, f32) -> f32| -> Vec<f32> {
        let column = |c: usize| values.iter().map(|value| value[c]).reduce(of).unwrap();
        (0..N).map(column).collect()
    };
    json!({"min": fold(f32::min), "max": fold(f32::max)})
}

/// A picture whose quarters have four colours.
fn png() -> Vec<u8> {
    let image = RgbImage::from_fn(16, 16, |x, y| match (x < 8, y < 8) {
        (true, true) => Rgb([200, 40, 40]),
        (false, true) => Rgb([40, 200, 40]),
        (true, false) => Rgb([40, 40, 200]),
        (false, false) => Rgb([200, 200, 40]),
    });
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).unwrap();
    png.into_inner()
}

const SIDE: u32 = 5;

/// Parameters of the vertices of a square grid, from 0 to 1.
fn grid() -> Vec<[f32; 2]> {
    let part = |n: u32| n as f32 / (SIDE - 1) as f32;
    let vertices = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
    vertices.map(|(x, y)| [part(x), part(y)]).collect()
}

fn grid_triangles() -> Vec<u32> {
    let cells = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| y * SIDE + x));
    cells
        .flat_map(|a| [a, a + 1, a + SIDE + 1, a, a + SIDE + 1, a + SIDE])
        .collect()
}

fn plane([s, t]: [f32; 2]) -> [f32; 3] {
    [s, t, 0.0]
}

/// A skinned mesh of two materials with all attributes and with morph targets, animated; beside
/// it a camera, a light, and extensions known and unknown.
fn character() -> Parts {
    let mut parts = Parts::new();
    let grid = grid();
    let count = grid.len();
    let positions: Vec<_> = grid.iter().copied().map(plane).collect();
    let to_16_bits = |c: &f32| ((c * 65535.0) as u16).to_le_bytes();
    let second: Vec<u8> = grid.iter().flatten().flat_map(to_16_bits).collect();
    let second = parts.view(&second, json!({"target": VERTICES}));
    let second = parts.accessor(second, UNSIGNED_SHORT, "VEC2", count);
    parts.json["accessors"][second]["normalized"] = true.into();
    // Close to white, so that the colours of textures are not lost.
    let shade = |c: f32| 255 - (4.0 * c) as u8;
    let color = |&[s, t]: &[f32; 2]| [shade(s), shade(t), 255, 255];
    let colors: Vec<_> = grid.iter().map(color).collect();
    let attributes = json!({
        "POSITION": parts.attribute(&positions),
        "NORMAL": parts.attribute(&vec![[0.0, 0.0, 1.0]; count]),
        "TANGENT": parts.attribute(&vec![[1.0, 0.0, 0.0, 1.0]; count]),
        "TEXCOORD_0": parts.attribute(&grid),
        "TEXCOORD_1": second,
        "COLOR_0": parts.bytes(&colors, true),
        "JOINTS_0": parts.bytes(&vec![[0, 1, 0, 0]; count], false),
        "WEIGHTS_0": parts.attribute(&vec![[0.5, 0.5, 0.0, 0.0]; count]),
        "_HEAT": parts.attribute(&grid.iter().map(|&[s, _]| [s]).collect::<Vec<_>>()),
    });
    let lifted: Vec<_> = grid.iter().map(|&[s, _]| [0.0, 0.0, s]).collect();
    let targets = json!([
        {
            "POSITION": parts.attribute(&lifted),
            "NORMAL": parts.attribute(&vec![[0.25, 0.0, 0.0]; count]),
            "TANGENT": parts.attribute(&vec![[0.0, 0.0, 0.25]; count]),
        },
        {"POSITION": parts.sparse(count, &[0, 3, 24], [0.25, 0.5, 0.0])},
    ]);
    let triangles = grid_triangles();
    let (lower, upper) = triangles.split_at(triangles.len() / 2);
    let mut primitive = |indices: &[u32], component, material: usize, variant: usize| {
        json!({
            "attributes": attributes,
            "indices": parts.indices(indices, component),
            "material": material,
            "targets": targets,
            "extras": {"half": material},
            "extensions": {
                "KHR_materials_variants": {
                    "mappings": [{"material": variant, "variants": [0]}],
                },
                "EXAMPLE_note": {"text": "primitive"},
            },
        })
    };
    let primitives = [
        primitive(lower, UNSIGNED_BYTE, 0, 1),
        primitive(upper, UNSIGNED_SHORT, 1, 0),
    ];
    parts.push(
        "meshes",
        json!({
            "name": "body",
            "primitives": primitives,
            "weights": [0.0, 0.5],
            "extras": {"targetNames": ["lift", "corner"]},
        }),
    );
    add_character_materials(&mut parts);
    add_character_nodes(&mut parts);
    add_animation(&mut parts);
    parts.json["extensionsUsed"] = json!([
        "KHR_lights_punctual",
        "KHR_materials_unlit",
        "KHR_materials_variants",
        "KHR_texture_transform",
        "EXAMPLE_note",
    ]);
    parts
}

fn add_character_materials(parts: &mut Parts) {
    let view = parts.view(&png(), json!({}));
    parts.json["images"] =
        json!([{"name": "quarters", "mimeType": "image/png", "bufferView": view}]);
    parts.json["samplers"] = json!([{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071}]);
    parts.json["textures"] = json!([{"source": 0, "sampler": 0}, {"source": 0}]);
    parts.json["materials"] = json!([
        {
            "name": "front",
            "pbrMetallicRoughness": {
                "baseColorTexture": {
                    "index": 0,
                    "extensions": {"KHR_texture_transform": {"offset": [0.25, 0.0]}},
                },
                "metallicFactor": 0.0,
            },
            "occlusionTexture": {"index": 1, "texCoord": 1},
            "doubleSided": true,
        },
        {
            "name": "flat",
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.75, 1.0, 1.0]},
            "extensions": {"KHR_materials_unlit": {}},
            "doubleSided": true,
            "extras": {"layer": 7},
        },
    ]);
}

fn add_character_nodes(parts: &mut Parts) {
    let mut identity = [0.0; 16];
    (0..4).for_each(|c| identity[5 * c] = 1.0);
    let binds = parts.floats(&[identity, identity], json!({}));
    parts.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": binds, "skeleton": 1}]);
    parts.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.75, "znear": 0.125}},
    ]);
    parts.json["nodes"] = json!([
        {"name": "body", "mesh": 0, "skin": 0, "extensions": {"EXAMPLE_note": {"text": "node"}}},
        {"name": "hip", "children": [2]},
        {"name": "knee", "rotation": [0.0, 0.0, 0.38268343, 0.92387953]},
        {"name": "view", "camera": 0, "translation": [0.0, 0.0, 5.0]},
        {
            "name": "lamp behind",
            "rotation": [0.0, 1.0, 0.0, 0.0],
            "extensions": {"KHR_lights_punctual": {"light": 0}},
        },
    ]);
    parts.json["extensions"] = json!({
        "KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 1.0}]},
        "KHR_materials_variants": {"variants": [{"name": "swapped"}]},
    });
    parts.json["scenes"] = json!([{"nodes": [0, 1, 3, 4], "name": "stage"}]);
    parts.json["scene"] = 0.into();
}

fn add_animation(parts: &mut Parts) {
    let times = parts.floats(&[[0.0], [1.0]], json!({}));
    let half = 0.5_f32.sqrt();
    let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, half, half]];
    let outputs = [
        parts.floats(&turns, json!({})),
        parts.floats(&[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], json!({})),
        parts.floats(&[[0.0], [0.5], [1.0], [0.0]], json!({})),
    ];
    parts.json["animations"] = json!([{
        "name": "walk",
        "samplers": outputs.map(|output| json!({"input": times, "output": output})),
        "channels": [
            {"sampler": 0, "target": {"node": 2, "path": "rotation"}},
            {"sampler": 1, "target": {"node": 1, "path": "translation"}},
            {"sampler": 2, "target": {"node": 0, "path": "weights"}},
        ],
    }]);
}

/// Bumps, with the tangents that they are relative to.
fn relief() -> Parts {
    let mut parts = Parts::new();
    let grid = grid();
    let positions: Vec<_> = grid.iter().copied().map(plane).collect();
    let uvs = parts.attribute(&grid);
    let attributes = json!({
        "POSITION": parts.attribute(&positions),
        "NORMAL": parts.attribute(&vec![[0.0, 0.0, 1.0]; grid.len()]),
        "TANGENT": parts.attribute(&vec![[1.0, 0.0, 0.0, 1.0]; grid.len()]),
        "TEXCOORD_0": uvs,
        "TEXCOORD_1": uvs,
    });
    let triangles = parts.indices(&grid_triangles(), UNSIGNED_SHORT);
    let view = parts.view(&png(), json!({}));
    parts.push(
        "images",
        json!({"mimeType": "image/png", "bufferView": view}),
    );
    parts.push("textures", json!({"source": 0}));
    let mut primitives = Vec::new();
    for set in 0..2 {
        let texture = json!({"index": 0, "texCoord": set});
        let matt = json!({"metallicFactor": 0.0});
        let material = json!({"normalTexture": texture, "pbrMetallicRoughness": matt});
        let material = parts.push("materials", material);
        primitives.push(json!({
            "attributes": attributes, "indices": triangles, "material": material,
        }));
    }
    parts.push("meshes", json!({"primitives": primitives}));
    parts.push("nodes", json!({"mesh": 0}));
    parts.push("scenes", json!({"nodes": [0]}));
    parts.json["scene"] = 0.into();
    parts
}

/// Triangles as lists, strips and fans, with indices of all widths and without, beside lines
/// and points; the mesh is there twice, once mirrored, and a second one is in no scene.
fn modes() -> Parts {
    let mut parts = Parts::new();
    let zigzag: Vec<_> = (0..6_u8)
        .map(|n| [f32::from(n / 2), f32::from(n % 2), 0.0])
        .collect();
    let shared = parts.attribute(&zigzag);
    let round: Vec<_> = [[0.0, 2.0], [2.0, 2.0], [2.0, 3.0], [1.0, 3.5], [0.0, 3.0]]
        .map(|[x, y]| [x, y, 0.5])
        .into();
    let round = parts.attribute(&round);
    let lone = parts.attribute(&[[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0]]);
    let primitive =
        |positions: usize, mode: u32| json!({"attributes": {"POSITION": positions}, "mode": mode});
    let mut indexed = |positions: usize, mode: u32, indices: &[u32], component| {
        let mut primitive = primitive(positions, mode);
        primitive["indices"] = parts.indices(indices, component).into();
        primitive
    };
    let primitives = [
        indexed(shared, 5, &[0, 2, 1, 3], UNSIGNED_BYTE),
        indexed(shared, 4, &[2, 4, 3, 3, 4, 5], UNSIGNED_INT),
        indexed(round, 6, &[3, 4, 0, 1, 2], UNSIGNED_SHORT),
        indexed(shared, 1, &[0, 1, 1, 3], UNSIGNED_BYTE),
        primitive(round, 6),
        primitive(lone, 4),
        primitive(shared, 5),
        primitive(round, 0),
    ];
    parts.push("meshes", json!({"primitives": primitives}));
    parts.push(
        "meshes",
        json!({"name": "spare", "primitives": [primitive(lone, 4)]}),
    );
    parts.json["nodes"] = json!([
        {"children": [1, 2], "scale": [2.0, 2.0, 2.0]},
        {"mesh": 0},
        {"mesh": 0, "translation": [-1.0, 0.0, 0.0], "scale": [-1.0, 1.0, 1.0]},
    ]);
    parts.json["scenes"] = json!([{"nodes": [0]}]);
    parts.json["scene"] = 0.into();
    parts
}

/// Points with normals and colours.
fn cloud() -> Parts {
    let mut parts = Parts::new();
    let grid = grid();
    let positions: Vec<_> = grid.iter().copied().map(plane).collect();
    let attributes = json!({
        "POSITION": parts.attribute(&positions),
        "NORMAL": parts.attribute(&vec![[0.0, 0.0, 1.0]; grid.len()]),
        "COLOR_0": parts.bytes(&vec![[20, 200, 90, 255]; grid.len()], true),
    });
    let primitive = json!({"attributes": attributes, "mode": 0});
    parts.push("meshes", json!({"primitives": [primitive]}));
    parts.push("nodes", json!({"mesh": 0}));
    parts.push("scenes", json!({"nodes": [0]}));
    parts.json["scene"] = 0.into();
    parts
}

/// Quantized and interleaved attributes in a buffer that is a file, as is the texture.
fn write_with_files(folder: &Path) -> PathBuf {
    let mut parts = Parts::new();
    let grid = grid();
    let count = grid.len();
    let mut vertices = Vec::new();
    for [s, t] in &grid {
        let short = |c: f32| ((c * 32767.0) as i16).to_le_bytes();
        vertices.extend([short(*s), short(*t), [0, 0], [0, 0]].concat());
        vertices.extend([0, 0, 127, 0]);
        vertices.extend([(s * 255.0) as u8, (t * 255.0) as u8, 0, 0]);
    }
    let view = parts.view(&vertices, json!({"byteStride": 16, "target": VERTICES}));
    let mut attribute = |component, kind, offset: u32, bounds: Value| {
        let accessor = parts.accessor(view, component, kind, count);
        let entry = &mut parts.json["accessors"][accessor];
        entry["normalized"] = true.into();
        entry["byteOffset"] = offset.into();
        extend(entry, bounds);
        accessor
    };
    let bounds = json!({"min": [0, 0, 0], "max": [32767, 32767, 0]});
    let attributes = json!({
        "POSITION": attribute(SHORT, "VEC3", 0, bounds),
        "NORMAL": attribute(BYTE, "VEC3", 8, json!({})),
        "TEXCOORD_0": attribute(UNSIGNED_BYTE, "VEC2", 12, json!({})),
    });
    let indices = parts.indices(&grid_triangles(), UNSIGNED_SHORT);
    let primitive = json!({"attributes": attributes, "indices": indices, "material": 0});
    parts.push("meshes", json!({"primitives": [primitive]}));
    parts.push("nodes", json!({"mesh": 0, "scale": [3.0, 2.0, 1.0]}));
    parts.push("scenes", json!({"nodes": [0]}));
    parts.push("images", json!({"uri": "four%20colours.png"}));
    parts.push("textures", json!({"source": 0}));
    let surface = json!({"baseColorTexture": {"index": 0}, "metallicFactor": 0.0});
    parts.push("materials", json!({"pbrMetallicRoughness": surface}));
    let used = json!(["KHR_mesh_quantization"]);
    parts.json["extensionsUsed"] = used.clone();
    parts.json["extensionsRequired"] = used;
    let parts = parts.with_buffer(json!({"uri": "packed.bin"}));
    let path = folder.join("packed.gltf");
    fs::write(folder.join("packed.bin"), parts.bin).unwrap();
    fs::write(folder.join("four colours.png"), png()).unwrap();
    fs::write(&path, parts.json.to_string()).unwrap();
    path
}
