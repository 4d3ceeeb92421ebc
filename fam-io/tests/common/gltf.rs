//! Small glTF documents of all kinds, and a plain reader to compare them by.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::random::Random;

/// A document in parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    pub json: Value,
    pub bin: Vec<u8>,
}

const FLOAT: u32 = 5126;

impl Parts {
    pub fn of_glb(bytes: &[u8]) -> Self {
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(&bytes[..4], b"glTF");
        assert_eq!((number(4), number(8)), (2, bytes.len()));
        let length = number(12);
        assert_eq!((&bytes[16..20], length % 4), (&b"JSON"[..], 0));
        let text = &bytes[20..20 + length];
        let json: Value = serde_json::from_slice(text).unwrap();
        let padding = text.iter().rev().take_while(|&&b| b == b' ').count();
        assert!(padding < 4);
        let rest = 20 + length;
        if rest == bytes.len() {
            return Self {
                json,
                bin: Vec::new(),
            };
        }
        assert_eq!(&bytes[rest + 4..rest + 8], b"BIN\0");
        assert_eq!(
            (number(rest) % 4, rest + 8 + number(rest)),
            (0, bytes.len())
        );
        let announced = json["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
        assert_eq!(announced.next_multiple_of(4), number(rest));
        let bin = bytes[rest + 8..][..announced].to_vec();
        assert_eq!(json["buffers"].as_array().unwrap().len(), 1);
        Self { json, bin }
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let length = 28 + text.len() + bin.len();
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        for (kind, content) in [("JSON", text), ("BIN\0", bin)] {
            if kind == "JSON" {
                bytes.extend((length as u32).to_le_bytes());
            }
            bytes.extend((content.len() as u32).to_le_bytes());
            bytes.extend(kind.as_bytes());
            bytes.extend(content);
        }
        bytes
    }

    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8], more: Value) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteLength": bytes.len()});
        if !self.bin.is_empty() {
            view["byteOffset"] = self.bin.len().into();
        }
        view.as_object_mut()
            .unwrap()
            .extend(more.as_object().unwrap().clone());
        self.bin.extend(bytes);
        self.json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        self.push("bufferViews", view)
    }

    /// The elements of an accessor, as bytes.
    pub fn elements(&self, accessor: &Value) -> Vec<Vec<u8>> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let component = component_size(accessor["componentType"].as_u64().unwrap() as u32);
        let size = element_size(accessor["type"].as_str().unwrap(), component);
        let count = number(&accessor["count"]);
        let read = |view: &Value, offset: &Value, size: usize, k: usize| {
            let view = &self.json["bufferViews"][number(view)];
            let stride = view["byteStride"]
                .as_u64()
                .map_or(size, |stride| stride as usize);
            let at = number(offset) + k * stride;
            assert!(at + size <= number(&view["byteLength"]));
            self.bin[number(&view["byteOffset"]) + at..][..size].to_vec()
        };
        let mut elements: Vec<_> = match &accessor["bufferView"] {
            Value::Null => vec![vec![0; size]; count],
            view => (0..count)
                .map(|k| read(view, &accessor["byteOffset"], size, k))
                .collect(),
        };
        let sparse = &accessor["sparse"];
        for k in 0..number(&sparse["count"]) {
            let (indices, values) = (&sparse["indices"], &sparse["values"]);
            let width = component_size(indices["componentType"].as_u64().unwrap() as u32);
            let index = read(&indices["bufferView"], &indices["byteOffset"], width, k);
            elements[unsigned(&index)] =
                read(&values["bufferView"], &values["byteOffset"], size, k);
        }
        elements
    }

    /// The indices of a primitive.
    pub fn indices(&self, primitive: &Value) -> Vec<usize> {
        match &primitive["indices"] {
            Value::Null => (0..self.elements(&primitive["attributes"]["POSITION"]).len()).collect(),
            accessor => self
                .elements(accessor)
                .iter()
                .map(|bytes| unsigned(bytes))
                .collect(),
        }
    }

    /// What is drawn of a primitive, corner by corner: the bytes of all attributes, those of
    /// morph target `k` with a name that starts with `k`.
    pub fn corners(&self, primitive: &Value) -> Vec<BTreeMap<String, Vec<u8>>> {
        let mut attributes = BTreeMap::new();
        let mut add = |prefix: &str, names: &Value| {
            for (name, accessor) in names.as_object().unwrap() {
                attributes.insert(format!("{prefix}{name}"), self.elements(accessor));
            }
        };
        add("", &primitive["attributes"]);
        for (k, target) in primitive["targets"]
            .as_array()
            .into_iter()
            .flatten()
            .enumerate()
        {
            add(&format!("{k} "), target);
        }
        let corner = |&vertex: &usize| {
            let values = attributes.iter();
            values
                .map(|(name, values)| (name.clone(), values[vertex].clone()))
                .collect()
        };
        self.drawn(primitive).iter().map(corner).collect()
    }

    fn drawn(&self, primitive: &Value) -> Vec<usize> {
        let indices = self.indices(primitive);
        let triangle = |i: usize| match primitive["mode"].as_u64() {
            Some(5) if i % 2 == 1 => [indices[i], indices[i + 2], indices[i + 1]],
            Some(5) => [indices[i], indices[i + 1], indices[i + 2]],
            _ => [indices[i + 1], indices[i + 2], indices[0]],
        };
        match primitive["mode"].as_u64() {
            Some(5 | 6) => (0..indices.len() - 2)
                .map(triangle)
                .filter(|[a, b, c]| a != b && b != c && c != a)
                .flatten()
                .collect(),
            _ => indices,
        }
    }
}

pub fn unsigned(bytes: &[u8]) -> usize {
    bytes
        .iter()
        .rev()
        .fold(0, |number, &byte| number << 8 | usize::from(byte))
}

fn component_size(component_type: u32) -> usize {
    match component_type {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        _ => 4,
    }
}

fn element_size(kind: &str, component: usize) -> usize {
    match (kind, component) {
        ("SCALAR", _) => component,
        ("VEC2", _) => 2 * component,
        ("VEC3", _) => 3 * component,
        ("VEC4", _) => 4 * component,
        ("MAT2", 1) => 6,
        ("MAT2", _) => 4 * component,
        ("MAT4", _) => 16 * component,
        _ => panic!("{kind} of {component} bytes is not used here"),
    }
}

/// Whether a primitive is of triangles.
pub fn has_triangles(primitive: &Value) -> bool {
    primitive["mode"].as_u64().is_none_or(|mode| mode > 3)
}

/// A valid document with some of everything that there can be.
pub fn random_document(random: &mut Random) -> Parts {
    let mut parts = Parts {
        json: json!({
            "extras": {"a": [1, 2.50, "x"]},
            "asset": {"version": "2.0", "generator": "a test", "copyright": "none"},
            "extensionsUsed": ["EXT_vendor_thing", "KHR_mesh_quantization", "KHR_materials_variants"],
            "extensionsRequired": ["KHR_mesh_quantization"],
            "extensions": {"KHR_materials_variants": {"variants": [{"name": "v"}]}},
            "materials": [
                {"name": "plain", "extras": {"b": null}},
                {"name": "relief", "normalTexture": {"index": 0}},
                {"normalTexture": {"index": 0, "texCoord": 1, "scale": 0.5}},
            ],
            "textures": [{"source": 0}],
            "images": [{"uri": "missing.png"}],
            "cameras": [{"type": "orthographic", "orthographic":
                {"xmag": 1.0, "ymag": 1.0, "zfar": 2.0, "znear": 0.1}}],
            "nodes": [{"camera": 0, "name": "camera", "extras": {"c": 1e-3}}],
        }),
        bin: Vec::new(),
    };
    let mut shared = None;
    for mesh in 0..1 + random.below(3) {
        add_mesh(&mut parts, random, mesh, &mut shared);
    }
    if random.below(2) == 0 {
        animate(&mut parts, random);
    }
    let nodes: Vec<_> = (0..parts.json["nodes"].as_array().unwrap().len()).collect();
    parts.json["scenes"] = json!([{"name": "first"}, {"nodes": nodes, "name": "second"}]);
    parts.json["scene"] = 1.into();
    parts
}

fn add_mesh(parts: &mut Parts, random: &mut Random, mesh: usize, shared: &mut Option<Vertices>) {
    let target_count = random.below(3);
    let skinned = random.below(4) == 0;
    let mut primitives = Vec::new();
    let mut indices = None;
    for _ in 0..1 + random.below(2) {
        let vertices = match shared.take() {
            Some(vertices)
                if vertices.targets.len() == target_count && vertices.skinned == skinned =>
            {
                vertices
            }
            _ => add_vertices(parts, random, target_count, skinned),
        };
        for _ in 0..1 + random.below(2) {
            primitives.push(primitive(parts, random, &vertices, &mut indices));
        }
        if random.below(2) == 0 {
            *shared = Some(vertices);
        }
    }
    let mut entry = json!({"name": format!("mesh {mesh}"), "primitives": primitives});
    if target_count > 0 {
        entry["weights"] = json!(vec![0.25; target_count]);
        entry["extras"] = json!({"targetNames": ["x", "y"]});
    }
    let mesh = parts.push("meshes", entry);
    let mut node = json!({"mesh": mesh, "translation": [0.5, random.below(9) as f64, -0.25]});
    if skinned {
        let identity = |k: usize| if k.is_multiple_of(5) { 1.0_f32 } else { 0.0 };
        let matrix: Vec<u8> = (0..16).flat_map(|k| identity(k).to_le_bytes()).collect();
        let view = parts.view(&matrix, json!({}));
        let accessor =
            json!({"bufferView": view, "componentType": FLOAT, "count": 1, "type": "MAT4"});
        let matrices = parts.push("accessors", accessor);
        node["skin"] = parts
            .push(
                "skins",
                json!({"joints": [0], "inverseBindMatrices": matrices}),
            )
            .into();
    } else if random.below(2) == 0 {
        node["scale"] = json!([2.0, 2.0, -2.0]);
        node["rotation"] = json!([0.0, 0.6, 0.0, 0.8]);
    }
    let node = parts.push("nodes", node);
    if random.below(2) == 0 {
        parts.push(
            "nodes",
            json!({"mesh": mesh, "name": "again", "translation": [node as f64, 9.5, 0.0]}),
        );
        if skinned {
            let skin = parts.json["nodes"][node]["skin"].clone();
            parts.json["nodes"][node + 1]["skin"] = skin;
        }
    }
}

/// The attributes of some vertices.
struct Vertices {
    count: usize,
    attributes: Map<String, Value>,
    targets: Vec<Value>,
    skinned: bool,
}

/// An attribute that is not yet in a document.
struct Column {
    name: String,
    kind: &'static str,
    component_type: u32,
    normalized: bool,
    values: Vec<Vec<u8>>,
}

fn add_vertices(parts: &mut Parts, random: &mut Random, targets: usize, skinned: bool) -> Vertices {
    let count = if random.below(12) == 0 {
        252
    } else {
        3 + random.below(9)
    };
    let has_normals = random.below(2) == 0;
    let mut columns = vec![positions(random, count)];
    if has_normals {
        columns.push(normals(count));
        if random.below(2) == 0 {
            columns.push(tangents(count));
        }
    }
    let sets = random.below(3);
    for set in 0..sets {
        let name = format!("TEXCOORD_{set}");
        columns.push(match random.below(3) {
            0 => floats(random, &name, "VEC2", count),
            1 => integers(random, &name, "VEC2", 5121, true, count),
            _ => integers(random, &name, "VEC2", 5123, true, count),
        });
    }
    match random.below(5) {
        0 => columns.push(integers(random, "COLOR_0", "VEC3", 5121, true, count)),
        1 => columns.push(integers(random, "COLOR_0", "VEC4", 5121, true, count)),
        2 => columns.push(integers(random, "COLOR_0", "VEC3", 5123, true, count)),
        _ => {}
    }
    match random.below(5) {
        0 => columns.push(integers(random, "_WEIGHT", "SCALAR", 5121, false, count)),
        1 => columns.push(integers(random, "_FRAME", "MAT2", 5121, false, count)),
        2 => columns.push(floats(random, "_THING", "SCALAR", count)),
        _ => {}
    }
    if skinned {
        columns.push(constant("JOINTS_0", "VEC4", 5121, vec![0; 4], count));
        let weights = [1.0_f32, 0.0, 0.0, 0.0].map(f32::to_le_bytes).concat();
        columns.push(constant("WEIGHTS_0", "VEC4", FLOAT, weights, count));
    }
    let attributes = if random.below(3) == 0 {
        interleaved(parts, columns)
    } else {
        let columns = columns.into_iter();
        columns
            .map(|column| (column.name.clone(), single(parts, random, &column).into()))
            .collect()
    };
    let targets = (0..targets).map(|_| {
        let mut target = Map::new();
        let displacement = floats(random, "POSITION", "VEC3", count);
        target.insert(
            "POSITION".into(),
            single(parts, random, &displacement).into(),
        );
        if attributes.contains_key("TANGENT") {
            let displacement = floats(random, "TANGENT", "VEC3", count);
            target.insert(
                "TANGENT".into(),
                single(parts, random, &displacement).into(),
            );
        }
        target.into()
    });
    let targets = targets.collect();
    Vertices {
        count,
        attributes,
        targets,
        skinned,
    }
}

fn positions(random: &mut Random, count: usize) -> Column {
    if random.below(4) == 0 {
        let normalized = random.below(2) == 0;
        integers(random, "POSITION", "VEC3", 5122, normalized, count)
    } else {
        floats(random, "POSITION", "VEC3", count)
    }
}

fn normals(count: usize) -> Column {
    let normal = [0.0_f32, 0.6, 0.8].map(f32::to_le_bytes).concat();
    constant("NORMAL", "VEC3", FLOAT, normal, count)
}

fn tangents(count: usize) -> Column {
    let tangent = [1.0_f32, 0.0, 0.0, -1.0].map(f32::to_le_bytes).concat();
    constant("TANGENT", "VEC4", FLOAT, tangent, count)
}

fn constant(
    name: &str,
    kind: &'static str,
    component_type: u32,
    value: Vec<u8>,
    count: usize,
) -> Column {
    Column {
        name: name.to_owned(),
        kind,
        component_type,
        normalized: false,
        values: vec![value; count],
    }
}

fn floats(random: &mut Random, name: &str, kind: &'static str, count: usize) -> Column {
    let mut value = || {
        let numbers = (0..element_size(kind, 1)).map(|_| random.below(64) as f32 / 8.0 - 4.0);
        numbers.flat_map(f32::to_le_bytes).collect()
    };
    let values = (0..count).map(|_| value()).collect();
    Column {
        values,
        ..constant(name, kind, FLOAT, Vec::new(), 0)
    }
}

fn integers(
    random: &mut Random,
    name: &str,
    kind: &'static str,
    component_type: u32,
    normalized: bool,
    count: usize,
) -> Column {
    let size = element_size(kind, component_size(component_type));
    let mut value = || (0..size).map(|_| random.below(256) as u8).collect();
    let values = (0..count).map(|_| value()).collect();
    Column {
        normalized,
        values,
        ..constant(name, kind, component_type, Vec::new(), 0)
    }
}

fn accessor(column: &Column) -> Value {
    let mut accessor = json!({
        "componentType": column.component_type,
        "count": column.values.len(),
        "type": column.kind,
        "name": format!("of {}", column.name),
        "extras": {"kept": true},
    });
    if column.normalized {
        accessor["normalized"] = true.into();
    }
    if column.name == "POSITION" {
        let size = component_size(column.component_type);
        let number = |value: &Vec<u8>, c: usize| match &value[c * size..][..size] {
            &[a, b] => f64::from(i16::from_le_bytes([a, b])),
            bytes => f32::from_le_bytes(bytes.try_into().unwrap()).into(),
        };
        let bound = |pick: fn(f64, f64) -> f64| {
            let of = |c: usize| column.values.iter().map(|v| number(v, c)).reduce(pick);
            json!([of(0), of(1), of(2)])
        };
        accessor["min"] = bound(f64::min);
        accessor["max"] = bound(f64::max);
    }
    accessor
}

fn interleaved(parts: &mut Parts, columns: Vec<Column>) -> Map<String, Value> {
    let size = |column: &Column| column.values[0].len().next_multiple_of(4);
    let stride: usize = columns.iter().map(size).sum();
    let mut bytes = Vec::new();
    for k in 0..columns[0].values.len() {
        for column in &columns {
            bytes.extend(&column.values[k]);
            bytes.resize(bytes.len().next_multiple_of(4), 0xee);
        }
    }
    let view = parts.view(&bytes, json!({"byteStride": stride, "target": 34962}));
    let mut offset = 0;
    let mut attributes = Map::new();
    for column in columns {
        let mut accessor = accessor(&column);
        accessor["bufferView"] = view.into();
        accessor["byteOffset"] = offset.into();
        offset += size(&column);
        attributes.insert(column.name, parts.push("accessors", accessor).into());
    }
    attributes
}

fn single(parts: &mut Parts, random: &mut Random, column: &Column) -> usize {
    let mut accessor = accessor(column);
    let width = column.values[0].len();
    let zero = vec![0; width];
    // A matrix of bytes has padding between its columns that is no zero.
    if random.below(5) == 0 && width.is_multiple_of(4) {
        let differing = (0..column.values.len()).filter(|&k| column.values[k] != zero);
        let differing: Vec<_> = differing.collect();
        if !differing.is_empty() {
            let indices: Vec<u8> = differing
                .iter()
                .flat_map(|&k| (k as u16).to_le_bytes())
                .collect();
            let values: Vec<u8> = differing
                .iter()
                .flat_map(|&k| column.values[k].clone())
                .collect();
            accessor["sparse"] = json!({
                "count": differing.len(),
                "indices": {"bufferView": parts.view(&indices, json!({})), "componentType": 5123},
                "values": {"bufferView": parts.view(&values, json!({}))},
            });
            return parts.push("accessors", accessor);
        }
    }
    let stride = width.next_multiple_of(4);
    let mut bytes = Vec::new();
    for value in &column.values {
        bytes.extend(value);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    let mut more = json!({"target": 34962});
    if stride != width || random.below(3) == 0 {
        more["byteStride"] = stride.into();
    }
    accessor["bufferView"] = parts.view(&bytes, more).into();
    parts.push("accessors", accessor)
}

fn primitive(
    parts: &mut Parts,
    random: &mut Random,
    vertices: &Vertices,
    shared_indices: &mut Option<(usize, usize)>,
) -> Value {
    let mut primitive = json!({"extras": {"d": 1}, "attributes": vertices.attributes});
    let mode = [4, 4, 4, 5, 6, 1][random.below(6)];
    if mode != 4 || random.below(2) == 0 {
        primitive["mode"] = mode.into();
    }
    if !vertices.targets.is_empty() {
        primitive["targets"] = vertices.targets.clone().into();
    }
    if random.below(3) > 0 {
        primitive["material"] = random.below(3).into();
    }
    if random.below(6) == 0 {
        let mapping = json!({"material": 0, "variants": [0]});
        primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": [mapping]}});
    }
    if random.below(8) == 0 {
        primitive["extensions"]["EXT_vendor_thing"] = json!({"number": random.below(9)});
    }
    let whole = if mode == 4 {
        3
    } else if mode == 1 {
        2
    } else {
        1
    };
    match shared_indices {
        Some((count, indices)) if *count <= vertices.count && mode == 4 && random.below(2) == 0 => {
            primitive["indices"] = (*indices).into();
        }
        _ if vertices.count.is_multiple_of(whole) && random.below(4) == 0 => {}
        _ => {
            let length = 6 * (1 + random.below(4));
            let indices: Vec<_> = (0..length)
                .map(|_| random.below(vertices.count) as u32)
                .collect();
            let component_type = [5121, 5123, 5125][random.below(3)];
            let size = component_size(component_type);
            let bytes: Vec<u8> = indices
                .iter()
                .flat_map(|i| i.to_le_bytes()[..size].to_vec())
                .collect();
            let view = parts.view(&bytes, json!({"target": 34963}));
            let bound = |bound: Option<&u32>| json!([bound]);
            let accessor = parts.push(
                "accessors",
                json!({
                    "max": bound(indices.iter().max()),
                    "min": bound(indices.iter().min()),
                    "bufferView": view,
                    "componentType": component_type,
                    "count": length,
                    "type": "SCALAR",
                    "name": "indices",
                }),
            );
            primitive["indices"] = accessor.into();
            if mode == 4 {
                *shared_indices = Some((vertices.count, accessor));
            }
        }
    }
    primitive
}

fn animate(parts: &mut Parts, random: &mut Random) {
    let times: Vec<u8> = [0.0_f32, 1.0]
        .iter()
        .flat_map(|t| t.to_le_bytes())
        .collect();
    let values = floats(random, "translation", "VEC3", 2).values.concat();
    let input = parts.view(&times, json!({}));
    let output = parts.view(&values, json!({}));
    let input = parts.push(
        "accessors",
        json!({"bufferView": input, "componentType": FLOAT, "count": 2, "type": "SCALAR",
            "min": [0.0], "max": [1.0]}),
    );
    let output = parts.push(
        "accessors",
        json!({"bufferView": output, "componentType": FLOAT, "count": 2, "type": "VEC3"}),
    );
    let animation = json!({
        "name": "move",
        "samplers": [{"input": input, "output": output, "interpolation": "STEP"}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
    });
    parts.push("animations", animation);
}
