//! glTF 2.0: a mesh for each mesh, with one vertex list and a primitive for each material, and
//! a node for each of its places.
//!
//! - Polygons become triangles; those of one material are together. Vertices in no face are left
//!   out. A mesh without faces is a primitive of points.
//! - Normals are of unit length; an unknown one is that of its face, and 0 0 1 where the face has
//!   none. V points down. The sets of UVs up to that of the options are all the same, since a
//!   set needs those before it. Colours are bytes if those hold them exactly, else floats.
//! - Coordinates are of single precision. A mesh whose distance from the origin is more than
//!   1000 times its extent has its centre there, and its node moves it back.
//! - Materials are neither metallic nor smooth, and have two sides, as surfaces of the other
//!   formats do. One that is not opaque blends. Textures of other types than PNG and JPEG, which
//!   glTF does not have, are left out.

use std::collections::HashMap;
use std::io::Write;
use std::rc::Rc;

use ::gltf::json::accessor::UNSIGNED_BYTE;
use ::gltf::json::buffer::ARRAY_BUFFER;
use ::gltf::json::mesh::{POINTS, TRIANGLES};
use fam_surface::polygons::Division;
use fam_surface::vector::{add, cross, normalize, sub};
use serde_json::{Map, Value, json};

use crate::color::unit_color;
use crate::error::WriteFault;
use crate::format::Format;
use crate::gltf::{Package, center, check_uv_set};
use crate::scene::{Image, Material, Scene};

use super::job::Export;
use super::materials::image_type;
use super::parts::{Face, Part};
use super::place::Place;
use super::vertices::{Vertex, VertexTable};

pub(super) fn write(
    export: &Export,
    parts: &[Part],
    format: Format,
    out: &mut dyn Write,
) -> Result<(), WriteFault> {
    check_uv_set(export.options)?;
    let mut package = Package {
        json: json!({"asset": {"version": "2.0", "generator": "fam"}}),
        bin: Vec::new(),
    };
    add_materials(&mut package, &export.scene);
    let mut nodes = Vec::new();
    for part in parts {
        if part.mesh.positions.is_empty() {
            continue;
        }
        let content = Content::of(part);
        let center = center(&content.positions(part));
        let mesh = content.add_to(&mut package, part, center, export.options.uv_set, format)?;
        for place in &part.places {
            nodes.push(package.push("nodes", node(mesh, &part.mesh.name, place, center)));
        }
    }
    package.push("scenes", json!({"nodes": nodes}));
    package.json["scene"] = 0.into();
    if export.options.checker {
        package.add_checker(export.options.uv_set);
    }
    package.add_seam_lines(&export.seam_lines);
    Ok(package.write(format, out)?)
}

/// Adds all materials in order, and before each the image that it is the first to use.
fn add_materials(package: &mut Package, scene: &Scene) {
    let mut textures = HashMap::new();
    for material in &scene.materials {
        let image = material.texture.as_ref();
        let texture = image.and_then(|image| {
            let kind = image_type(&image.bytes)?;
            let added = || add_texture(package, image, kind);
            Some(
                *textures
                    .entry(Rc::as_ptr(&image.bytes))
                    .or_insert_with(added),
            )
        });
        package.push("materials", material_json(material, texture));
    }
}

fn add_texture(package: &mut Package, image: &Image, kind: &str) -> usize {
    let view = package.add_view(&image.bytes, None, None);
    let mut json = json!({"mimeType": kind, "bufferView": view});
    if !image.name.is_empty() {
        json["name"] = image.name.as_str().into();
    }
    let source = package.push("images", json);
    package.push("textures", json!({"source": source}))
}

fn material_json(material: &Material, texture: Option<usize>) -> Value {
    let mut json = plain_material();
    if !material.name.is_empty() {
        json["name"] = material.name.as_str().into();
    }
    let color = unit_color(material.base_color);
    if color[3] < 1.0 {
        json["alphaMode"] = "BLEND".into();
    }
    let surface = &mut json["pbrMetallicRoughness"];
    surface["baseColorFactor"] = json!(color);
    if let Some(texture) = texture {
        surface["baseColorTexture"] = json!({"index": texture});
    }
    json
}

/// That of faces without a material.
fn plain_material() -> Value {
    json!({
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
        "doubleSided": true,
    })
}

/// What the primitives of a mesh consist of.
struct Content {
    table: VertexTable,
    normals: bool,
    uvs: bool,
    /// Triangles, as corners of the table, by their materials; empty for points.
    triangles: Vec<(Option<u32>, Vec<u32>)>,
}

impl Content {
    fn of(part: &Part) -> Self {
        let normals = part.mesh.normals.is_some();
        if part.faces.len() == 0 {
            let mut table = VertexTable::of_points(part);
            for vertex in &mut table.vertices {
                vertex.normal = or_up(unit_normal(vertex.normal));
            }
            return Self {
                table,
                normals,
                uvs: !part.point_uvs.is_empty(),
                triangles: Vec::new(),
            };
        }
        let corner_normals = part.faces.iter().flat_map(|face| face_normals(part, face));
        let table = VertexTable::split(part, corner_normals).without_unused();
        Self {
            triangles: triangles(part, &table),
            table,
            normals,
            uvs: true,
        }
    }

    fn positions(&self, part: &Part) -> Vec<[f64; 3]> {
        let position = |vertex: &Vertex| part.mesh.positions[vertex.of as usize];
        self.table.vertices.iter().map(position).collect()
    }

    /// Adds the mesh and returns its index.
    fn add_to(
        &self,
        package: &mut Package,
        part: &Part,
        center: [f64; 3],
        uv_set: u32,
        format: Format,
    ) -> Result<usize, WriteFault> {
        let attributes = self.add_attributes(package, part, center, uv_set, format)?;
        let vertices = self.table.vertices.len();
        let mut primitives = Vec::new();
        for (material, corners) in &self.triangles {
            primitives.push(json!({
                "attributes": attributes,
                "indices": package.add_indices(corners, vertices),
                "material": material_index(package, *material),
                "mode": TRIANGLES,
            }));
        }
        if self.triangles.is_empty() {
            let material = material_index(package, None);
            primitives.push(json!({
                "attributes": attributes,
                "material": material,
                "mode": POINTS,
            }));
        }
        let mut mesh = json!({"primitives": primitives});
        if !part.mesh.name.is_empty() {
            mesh["name"] = part.mesh.name.as_str().into();
        }
        Ok(package.push("meshes", mesh))
    }

    fn add_attributes(
        &self,
        package: &mut Package,
        part: &Part,
        center: [f64; 3],
        uv_set: u32,
        format: Format,
    ) -> Result<Map<String, Value>, WriteFault> {
        let vertices = &self.table.vertices;
        let positions: Vec<_> = self
            .positions(part)
            .into_iter()
            .map(|p| sub(p, center).map(|c| c as f32))
            .collect();
        if !positions.iter().flatten().all(|c| c.is_finite()) {
            return Err(WriteFault::NoPlaceForSurface {
                format,
                surface: "coordinates beyond single precision",
            });
        }
        let mut attributes = Map::new();
        attributes.insert(
            "POSITION".to_owned(),
            package.add_vectors(&positions, true).into(),
        );
        if self.normals {
            let normals: Vec<_> = vertices.iter().map(|vertex| vertex.normal).collect();
            let normals = package.add_vectors(&normals, false);
            attributes.insert("NORMAL".to_owned(), normals.into());
        }
        if self.uvs {
            let down = |vertex: &Vertex| [vertex.uv[0], 1.0 - vertex.uv[1]];
            let uvs: Vec<_> = vertices.iter().map(down).collect();
            let uvs = package.add_vectors(&uvs, false);
            for set in 0..=uv_set {
                attributes.insert(format!("TEXCOORD_{set}"), uvs.into());
            }
        }
        if part.mesh.colors.is_some() {
            let color = |vertex: &Vertex| part.color(vertex.of as usize).unwrap_or([1.0; 4]);
            let colors: Vec<_> = vertices.iter().map(|v| unit_color(color(v))).collect();
            attributes.insert("COLOR_0".to_owned(), add_colors(package, &colors).into());
        }
        Ok(attributes)
    }
}

/// The triangles by their materials, in the order in which these occur.
fn triangles(part: &Part, table: &VertexTable) -> Vec<(Option<u32>, Vec<u32>)> {
    let mut triangles: Vec<(Option<u32>, Vec<u32>)> = Vec::new();
    let mut places: HashMap<Option<u32>, usize> = HashMap::new();
    let mut rest = table.corners.as_slice();
    for face in part.faces.iter() {
        let (corners, others) = rest.split_at(face.corners.len());
        rest = others;
        let material = part.material(face.polygon);
        let place = *places.entry(material).or_insert_with(|| {
            triangles.push((material, Vec::new()));
            triangles.len() - 1
        });
        let division = match corners.len() {
            // It may be one of the triangles of a polygon.
            3 => Division::TRIANGLE,
            all => part.mesh.polygons.divisions().of(face.polygon, all),
        };
        triangles[place].1.extend(division.of(corners).flatten());
    }
    triangles
}

/// The index of a material of the scene, or of the plain one.
fn material_index(package: &mut Package, material: Option<u32>) -> usize {
    match material {
        Some(material) => material as usize,
        None => package.find_or_push("materials", plain_material()),
    }
}

fn add_colors(package: &mut Package, colors: &[[f32; 4]]) -> usize {
    let byte = |c: f32| (c * 255.0).round();
    if !colors.iter().flatten().all(|&c| byte(c) / 255.0 == c) {
        return package.add_vectors(colors, false);
    }
    let bytes: Vec<u8> = colors.iter().flatten().map(|&c| byte(c) as u8).collect();
    let view = package.add_view(&bytes, Some(ARRAY_BUFFER), None);
    let accessor = package.add_accessor(view, UNSIGNED_BYTE, "VEC4", colors.len(), None);
    package.json["accessors"][accessor]["normalized"] = true.into();
    accessor
}

/// The normals of the corners of a face.
fn face_normals<'a>(part: &'a Part, face: Face<'a>) -> impl Iterator<Item = [f32; 3]> + 'a {
    let own = |corner| unit_normal(part.corner_normal(corner));
    let needed = part.mesh.normals.is_some() && face.corners.iter().any(|c| own(c) == [0.0; 3]);
    let of_face = if needed {
        plane_normal(part, &face)
    } else {
        [0.0; 3]
    };
    face.corners.iter().map(
        move |corner| match unit_normal(part.corner_normal(corner)) {
            [0.0, 0.0, 0.0] => or_up(of_face),
            normal => normal,
        },
    )
}

/// Newell's normal of a face; zero if it has no area.
fn plane_normal(part: &Part, face: &Face) -> [f32; 3] {
    let position = |at: usize| part.mesh.positions[face.corners[at].vertex as usize];
    let origin = position(0);
    let corners: Vec<_> = (0..face.corners.len())
        .map(|at| sub(position(at), origin))
        .collect();
    let sum = corners
        .windows(2)
        .fold([0.0; 3], |sum, pair| add(sum, cross(pair[0], pair[1])));
    normalize(sum).map(|c| c as f32)
}

fn unit_normal(normal: [f32; 3]) -> [f32; 3] {
    normalize(normal.map(f64::from)).map(|c| c as f32)
}

fn or_up(normal: [f32; 3]) -> [f32; 3] {
    if normal == [0.0; 3] {
        [0.0, 0.0, 1.0]
    } else {
        normal
    }
}

fn node(mesh: usize, name: &str, place: &Place, center: [f64; 3]) -> Value {
    let mut node = json!({"mesh": mesh});
    if !name.is_empty() {
        node["name"] = name.into();
    }
    match place.axes() {
        Some([x, y, z]) => {
            let rows = [x, y, z].map(|[a, b, c]| [a, b, c, 0.0]);
            let [a, b, c] = place.position(center);
            let matrix: Vec<f64> = rows.into_iter().flatten().chain([a, b, c, 1.0]).collect();
            node["matrix"] = json!(matrix);
        }
        None if center != [0.0; 3] => node["translation"] = json!(center),
        None => {}
    }
    node
}
