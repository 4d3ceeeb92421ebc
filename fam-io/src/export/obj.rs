//! Wavefront OBJ: the UVs, and then for each mesh at each of its places the vertices, the
//! normals and the faces.
//!
//! Meshes are objects (`o`) if there are several or if one has a name. Vertex colours are three
//! more numbers of a `v`; their opacity is lost. Faces without a material after others that
//! have one are of a material `none`, since `usemtl` cannot be taken back. The corners of a
//! face have a `vn` if the normals of all of them are known. A point cloud has one `vt` and, if
//! it has normals, one `vn` for each `v`.

use std::collections::HashMap;
use std::io::{self, Write};

use crate::color::srgb_text;
use crate::uvs::Uvs;

use super::job::Export;
use super::parts::Part;
use super::place::Place;
use super::{materials, names};

pub(super) fn write(export: &Export, parts: &[Part], out: &mut dyn Write) -> io::Result<()> {
    if let Some(stem) = &export.stem
        && !export.scene.materials.is_empty()
    {
        writeln!(out, "mtllib {}", materials::library_name(stem))?;
    }
    let (materials, no_material) = materials::names(&export.scene);
    let mut writer = Writer {
        out,
        materials,
        no_material,
        material: None,
        vertices: 0,
        normals: 0,
    };
    if let Uvs::Mesh(map) = export.uvs {
        writer.uvs(map.uvs())?;
    }
    let has_normals = parts.iter().any(|part| part.mesh.normals.is_some());
    for (name, part, place) in objects(parts) {
        if let Some(name) = name {
            writeln!(writer.out, "o {name}")?;
        }
        writer.vertices(part, place)?;
        match export.uvs {
            Uvs::Mesh(_) => writer.faces(part, place)?,
            Uvs::Points(_) => writer.point_uvs(part, place, has_normals)?,
        }
        writer.vertices += part.mesh.positions.len();
    }
    Ok(())
}

/// The meshes at their places, with names if they are needed to tell them apart.
fn objects<'a>(parts: &'a [Part]) -> Vec<(Option<String>, &'a Part<'a>, &'a Place)> {
    let at_places = |part: &'a Part<'a>| part.places.iter().map(move |place| (part, place));
    let instances: Vec<_> = parts.iter().flat_map(at_places).collect();
    let meshes = || instances.iter().map(|(part, _)| part.mesh);
    if meshes().count() == 1 && meshes().all(|mesh| mesh.name.is_empty()) {
        let unnamed = |(part, place)| (None, part, place);
        return instances.into_iter().map(unnamed).collect();
    }
    let names = names::distinct(meshes().map(|mesh| &*mesh.name), "object");
    let named = |(name, (part, place))| (Some(name), part, place);
    names.into_iter().zip(instances).map(named).collect()
}

struct Writer<'a> {
    out: &'a mut dyn Write,
    materials: Vec<String>,
    no_material: String,
    /// The one that `usemtl` names.
    material: Option<String>,
    /// How many `v` there are before this mesh.
    vertices: usize,
    /// How many `vn` there are so far.
    normals: usize,
}

impl Writer<'_> {
    fn uvs(&mut self, uvs: &[[f32; 2]]) -> io::Result<()> {
        uvs.iter()
            .try_for_each(|[u, v]| writeln!(self.out, "vt {u} {v}"))
    }

    fn vertices(&mut self, part: &Part, place: &Place) -> io::Result<()> {
        for (at, &position) in part.mesh.positions.iter().enumerate() {
            let [x, y, z] = place.position(position);
            write!(self.out, "v {x} {y} {z}")?;
            if let Some(color) = part.color(at) {
                write!(self.out, " {}", srgb_text(color))?;
            }
            writeln!(self.out)?;
        }
        Ok(())
    }

    fn normal(&mut self, normal: [f32; 3]) -> io::Result<()> {
        let [x, y, z] = normal;
        self.normals += 1;
        writeln!(self.out, "vn {x} {y} {z}")
    }

    fn point_uvs(&mut self, part: &Part, place: &Place, has_normals: bool) -> io::Result<()> {
        self.uvs(part.point_uvs)?;
        if has_normals {
            for at in 0..part.mesh.positions.len() {
                self.normal(place.normal(part.point_normal(at)))?;
            }
        }
        Ok(())
    }

    fn faces(&mut self, part: &Part, place: &Place) -> io::Result<()> {
        let normals = self.corner_normals(part, place)?;
        let mut first = 0;
        for face in part.faces.iter() {
            self.use_material(part.material(face.polygon))?;
            let of_face = &normals[first..first + face.corners.len()];
            first += face.corners.len();
            let with_normals = of_face.iter().all(Option::is_some);
            let corners = face.corners.iter().zip(of_face).collect();
            write!(self.out, "f")?;
            for (corner, normal) in place.wind(corners) {
                let vertex = self.vertices + corner.vertex as usize + 1;
                let uv = u64::from(corner.uv) + 1;
                match normal {
                    Some(normal) if with_normals => {
                        write!(self.out, " {vertex}/{uv}/{normal}")?;
                    }
                    _ => write!(self.out, " {vertex}/{uv}")?,
                }
            }
            writeln!(self.out)?;
        }
        Ok(())
    }

    /// Writes every normal once; for each corner of the faces the number of its own.
    fn corner_normals(&mut self, part: &Part, place: &Place) -> io::Result<Vec<Option<usize>>> {
        let mut numbers = HashMap::new();
        let mut of_corners = Vec::new();
        for corner in part.faces.corners() {
            let normal = place.normal(part.corner_normal(corner));
            if normal == [0.0; 3] {
                of_corners.push(None);
                continue;
            }
            let bits = normal.map(f32::to_bits);
            let number = match numbers.get(&bits) {
                Some(&number) => number,
                None => {
                    self.normal(normal)?;
                    numbers.insert(bits, self.normals);
                    self.normals
                }
            };
            of_corners.push(Some(number));
        }
        Ok(of_corners)
    }

    fn use_material(&mut self, material: Option<u32>) -> io::Result<()> {
        let name = match material.and_then(|at| self.materials.get(at as usize)) {
            None if self.material.is_none() => return Ok(()),
            None => &self.no_material,
            Some(name) => name,
        };
        if self.material.as_ref() != Some(name) {
            writeln!(self.out, "usemtl {name}")?;
            self.material = Some(name.clone());
        }
        Ok(())
    }
}
