//! PLY, the polygon file format: ASCII and binary of either byte order, by the crate
//! `ply-rs-bw`.
//!
//! - The element `vertex` has the scalars `x`, `y`, `z`, possibly `nx`, `ny`, `nz`, and UVs as
//!   `s`, `t`, as `u`, `v` or as `texture_u`, `texture_v`. Infinite or NaN UVs count as none.
//! - The element `face` has a list of zero-based vertices, `vertex_indices` or `vertex_index`.
//!   Faces of fewer than three corners are no part of the surface. Without faces it is a
//!   point cloud. Triangle strips are not read.
//! - The numbers of entries that the header announces must fit in the file, where every entry
//!   takes a byte at least.
//!
//! Writing keeps the encoding, comments (moved to the top of the header), all elements and all
//! properties, except that UVs are the last two properties of a vertex, `float s` and
//! `float t`, and the only ones: older ones go, and so does a list `texcoord` of the faces. A
//! vertex with several UVs is split, its copies come after the last vertex. A vertex in no
//! face has the UV 0 0. A polygon with a seam inside becomes triangles.

use std::io::{self, Write};

use fam_core::surface::{SurfaceError, UvMap};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Header, Property, PropertyAccess,
    PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

use crate::document::{Parsed, surface, vertex_uvs};
use crate::polygons::{Polygons, Split};
use crate::scene::Scene;
use crate::{Labels, ReadFault, Uvs};

const UV_NAMES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
const FACE_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// A PLY file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    header: Header,
    /// The entries of every element, in the order of the header.
    rows: Vec<Vec<Row>>,
    polygons: Polygons,
}

/// The properties of an entry, in the order of the header.
#[derive(Debug, Clone)]
struct Row(Vec<Property>);

impl PropertyAccess for Row {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, _: &str, property: Property) -> PropertyAccessResult {
        self.0.push(property);
        PropertyAccessResult::Set
    }
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Parsed<Source>, ReadFault> {
    let parser = Parser::<Row>::new();
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(rejected)?;
    check_counts(&header, reader.get_ref().len())?;
    let mut rows = Vec::with_capacity(header.elements.len());
    for definition in header.elements.values() {
        let read = parser.read_payload_for_element(&mut reader, definition, &header);
        rows.push(read.map_err(rejected)?);
    }

    let entries = |name: &str| {
        let index = header.elements.get_index_of(name)?;
        Some((&header.elements[index], rows[index].as_slice()))
    };
    let (vertex, vertices) = entries("vertex").ok_or(SurfaceError::NoVertices)?;
    let positions = scalars(vertex, vertices, ["x", "y", "z"])
        .ok_or_else(|| ReadFault::Malformed("the vertices have no x, y and z".to_owned()))?;
    let normals = scalars(vertex, vertices, ["nx", "ny", "nz"]);
    let uvs = UV_NAMES
        .into_iter()
        .find_map(|names| scalars(vertex, vertices, names))
        .map(|uvs| uvs.into_iter().map(|uv| uv.map(|c| c as f32)).collect());
    if entries("tristrips").is_some_and(|(_, strips)| !strips.is_empty()) {
        return Err(ReadFault::Unsupported("triangle strips are".to_owned()));
    }
    let polygons = match entries("face") {
        Some((face, faces)) => polygons(face, faces, positions.len())?,
        None => Polygons::default(),
    };

    let surface = surface(positions, &polygons, normals)?;
    let uvs = uvs.and_then(|uvs| vertex_uvs(&surface, uvs));
    Ok(Parsed {
        surface,
        uvs,
        labels: Labels::default(),
        source: Source {
            header,
            rows,
            polygons,
        },
    })
}

/// The message of the parser on one line.
fn rejected(error: ply_rs_bw::parser::ParseError) -> ReadFault {
    const LONGEST: usize = 200;
    let message = error.to_string();
    let words: Vec<&str> = message.split_whitespace().collect();
    let line: String = words.join(" ");
    let shown = line.chars().filter(|c| !c.is_control()).take(LONGEST);
    ReadFault::Malformed(shown.collect())
}

/// Refuses a header that announces more entries than `available` bytes can hold.
fn check_counts(header: &Header, available: usize) -> Result<(), ReadFault> {
    let mut left = available as u64;
    for definition in header.elements.values() {
        let size = match header.encoding {
            Encoding::Ascii => 1,
            _ => definition
                .properties
                .values()
                .map(smallest_size)
                .sum::<u64>()
                .max(1),
        };
        let announced = definition.count as u64;
        // The last line of an ASCII file may lack its line end.
        let found = left.div_ceil(size);
        if announced > found {
            return Err(ReadFault::Truncated {
                element: definition.name.clone(),
                announced,
                found,
            });
        }
        left = left.saturating_sub(announced * size);
    }
    Ok(())
}

/// The bytes that a property takes at least in a binary file.
fn smallest_size(property: &PropertyDef) -> u64 {
    match &property.data_type {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

/// The named scalars of every row; `None` unless the element has them all.
fn scalars<const N: usize>(
    definition: &ElementDef,
    rows: &[Row],
    names: [&str; N],
) -> Option<Vec<[f64; N]>> {
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = definition.properties.get_index_of(name)?;
    }
    rows.iter()
        .map(|row| {
            let mut values = [0.0; N];
            for (value, &column) in values.iter_mut().zip(&columns) {
                *value = scalar(row.0.get(column)?)?;
            }
            Some(values)
        })
        .collect()
}

fn scalar(property: &Property) -> Option<f64> {
    match *property {
        Property::Char(x) => Some(x.into()),
        Property::UChar(x) => Some(x.into()),
        Property::Short(x) => Some(x.into()),
        Property::UShort(x) => Some(x.into()),
        Property::Int(x) => Some(x.into()),
        Property::UInt(x) => Some(x.into()),
        Property::Float(x) => Some(x.into()),
        Property::Double(x) => Some(x),
        _ => None,
    }
}

/// The list of vertices among the properties of a face.
fn indices_column(face: &ElementDef) -> Option<usize> {
    FACE_NAMES
        .iter()
        .find_map(|&name| face.properties.get_index_of(name))
}

fn polygons(face: &ElementDef, rows: &[Row], count: usize) -> Result<Polygons, ReadFault> {
    let mut polygons = Polygons::default();
    if rows.is_empty() {
        return Ok(polygons);
    }
    let column = indices_column(face)
        .ok_or_else(|| ReadFault::Malformed("the faces have no list vertex_indices".to_owned()))?;
    for (number, row) in rows.iter().enumerate() {
        let indices = row.0.get(column).and_then(indices).ok_or_else(|| {
            ReadFault::Malformed("the vertex indices of the faces are not integers".to_owned())
        })?;
        let corners = indices.iter().map(|&index| {
            let exists = usize::try_from(index).is_ok_and(|index| index < count);
            let vertex = u32::try_from(index).ok().filter(|_| exists);
            vertex.ok_or(ReadFault::VertexOutOfRange {
                face: number + 1,
                index,
                count,
                numbering: ", numbered from 0",
            })
        });
        let corners: Vec<u32> = corners.collect::<Result<_, _>>()?;
        if corners.len() >= 3 {
            polygons.push(corners);
        }
    }
    Ok(polygons)
}

fn indices(list: &Property) -> Option<Vec<i64>> {
    fn widened<T: Copy + Into<i64>>(list: &[T]) -> Option<Vec<i64>> {
        Some(list.iter().map(|&index| index.into()).collect())
    }
    match list {
        Property::ListChar(list) => widened(list),
        Property::ListUChar(list) => widened(list),
        Property::ListShort(list) => widened(list),
        Property::ListUShort(list) => widened(list),
        Property::ListInt(list) => widened(list),
        Property::ListUInt(list) => widened(list),
        _ => None,
    }
}

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        match uvs {
            Uvs::Mesh(uvs) => self.write_mesh(uvs, out),
            Uvs::Points(uvs) => self.write_points(uvs, out),
        }
    }

    pub fn scene(&self) -> io::Result<Scene> {
        Ok(Scene::default())
    }

    fn write_mesh(&self, uvs: &UvMap, out: &mut dyn Write) -> io::Result<()> {
        let vertices = self.element("vertex").map_or(0, |at| self.rows[at].len());
        let split = Split::at_seams(vertices, &self.polygons, uvs);
        let mut output = self.clone();
        output.set_vertex_uvs(&split.added, &split.uvs);
        output.set_faces(&split.faces, split.uvs.len());
        output.write_rows(out)
    }

    fn write_points(&self, uvs: &[[f32; 2]], out: &mut dyn Write) -> io::Result<()> {
        let mut output = self.clone();
        output.set_vertex_uvs(&[], uvs);
        output.write_rows(out)
    }

    fn element(&self, name: &str) -> Option<usize> {
        self.header.elements.get_index_of(name)
    }

    /// Adds copies of vertices and gives all vertices these UVs.
    fn set_vertex_uvs(&mut self, added: &[u32], uvs: &[[f32; 2]]) {
        let Some(element) = self.element("vertex") else {
            return;
        };
        for names in UV_NAMES {
            let properties = &self.header.elements[element].properties;
            if names.iter().all(|&name| properties.contains_key(name)) {
                names.iter().for_each(|name| self.remove(element, name));
            }
        }
        // Anything else of that name would be lost under the new property.
        UV_NAMES[0]
            .iter()
            .for_each(|name| self.remove(element, name));
        let rows = &mut self.rows[element];
        for &vertex in added {
            let copy = rows[vertex as usize].clone();
            rows.push(copy);
        }
        for (row, uv) in rows.iter_mut().zip(uvs) {
            row.0.extend(uv.map(Property::Float));
        }
        for name in UV_NAMES[0] {
            let data_type = PropertyType::Scalar(ScalarType::Float);
            let property = PropertyDef::new(name.to_owned(), data_type);
            self.header.elements[element].properties.add(property);
        }
    }

    /// Replaces the polygons by their pieces, which refer to so many vertices.
    fn set_faces(&mut self, faces: &[Vec<Vec<u32>>], vertices: usize) {
        let Some(element) = self.element("face") else {
            return;
        };
        self.remove(element, "texcoord");
        let definition = &mut self.header.elements[element];
        let Some(column) = indices_column(definition) else {
            return;
        };
        let data_type = &mut definition.properties[column].data_type;
        if let PropertyType::List(_, index) = data_type
            && vertices as u64 > most_vertices(index)
        {
            *index = ScalarType::UInt;
        }
        let PropertyType::List(_, index) = data_type.clone() else {
            return;
        };
        let mut faces = faces.iter();
        let old = std::mem::take(&mut self.rows[element]);
        for mut row in old {
            let corners = row.0.get(column).and_then(indices).unwrap_or_default();
            if corners.len() < 3 {
                row.0[column] = list(&index, corners);
                self.rows[element].push(row);
                continue;
            }
            for piece in faces.next().into_iter().flatten() {
                let mut row = row.clone();
                row.0[column] = list(&index, piece.iter().map(|&v| v.into()).collect());
                self.rows[element].push(row);
            }
        }
    }

    /// Removes a property of an element, if it has it.
    fn remove(&mut self, element: usize, name: &str) {
        let properties = &mut self.header.elements[element].properties;
        if let Some((column, _, _)) = properties.shift_remove_full(name) {
            for row in &mut self.rows[element] {
                row.0.remove(column);
            }
        }
    }

    fn write_rows(mut self, out: &mut dyn Write) -> io::Result<()> {
        let writer = Writer::<DefaultElement>::new();
        for (definition, rows) in self.header.elements.values_mut().zip(&self.rows) {
            definition.count = rows.len();
        }
        let out = &mut &mut *out;
        writer.write_header(out, &self.header)?;
        for (definition, rows) in self.header.elements.values().zip(&self.rows) {
            let mut entry = vec![DefaultElement::new()];
            for row in rows {
                for (name, value) in definition.properties.keys().zip(&row.0) {
                    match entry[0].get_mut(name) {
                        Some(slot) => slot.clone_from(value),
                        None => {
                            entry[0].insert(name.clone(), value.clone());
                        }
                    }
                }
                writer.write_payload_of_element(out, &entry, definition, &self.header)?;
            }
        }
        Ok(())
    }
}

/// How many vertices a list of such indices can tell apart.
fn most_vertices(index: &ScalarType) -> u64 {
    match index {
        ScalarType::Char => 1 << 7,
        ScalarType::UChar => 1 << 8,
        ScalarType::Short => 1 << 15,
        ScalarType::UShort => 1 << 16,
        ScalarType::Int => 1 << 31,
        _ => 1 << 32,
    }
}

/// Indices as a list of a type that can hold them.
fn list(index: &ScalarType, indices: Vec<i64>) -> Property {
    let indices = indices.into_iter();
    match index {
        ScalarType::Char => Property::ListChar(indices.map(|i| i as i8).collect()),
        ScalarType::UChar => Property::ListUChar(indices.map(|i| i as u8).collect()),
        ScalarType::Short => Property::ListShort(indices.map(|i| i as i16).collect()),
        ScalarType::UShort => Property::ListUShort(indices.map(|i| i as u16).collect()),
        ScalarType::Int => Property::ListInt(indices.map(|i| i as i32).collect()),
        _ => Property::ListUInt(indices.map(|i| i as u32).collect()),
    }
}
