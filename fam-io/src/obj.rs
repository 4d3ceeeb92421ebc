//! Wavefront OBJ.
//!
//! Read are `v`, `vt`, `vn`, `f`, `o`, `s`, `usemtl` and `mtllib` statements, and `fo`, the old
//! name of `f`; all others, unknown ones too, are kept. A statement may go over several lines
//! with a backslash at the end of a line, and `#` starts a comment. Lines end in `\n`, `\r\n`
//! or `\r`; there may be a UTF-8 byte order mark. Faces may come before the vertices they refer
//! to. Corners are `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back from the last
//! `v`, `vt` or `vn` before the face. Faces of fewer than three corners are no part of the
//! surface.
//!
//! Files of any size are read and written statement by statement; the text is not held in
//! memory, unless it comes from a pipe. To be written, a file is read again, and must not have changed.
//!
//! The crate `tobj` reads the numbers of `v`, `vt` and `vn`. It reorders the vertices of
//! every group and forgets where a face was, so the faces are scanned here: their vertices
//! must keep the order of the file, and they are written back in place.
//!
//! - A fourth number of a `v` is a weight that divides the others, unless more follow: those
//!   are a colour, sRGB between 0 and 1, which matters only to other formats. In front of a
//!   colour, a weight does not divide.
//! - Points of a cloud with a coordinate that is NaN or infinite are left out of the surface,
//!   with a warning. In a mesh they are an error.
//! - Normals are those of the corners: if a vertex has several, their mean. In a cloud there
//!   are normals if there is one `vn` for every `v`.
//! - Smoothing groups (`s`) make edges hard, but only between triangles without normals.
//! - UVs are there if every corner of every face refers to an existing `vt` and all `vt` are
//!   finite. In a cloud there are UVs if there is one `vt` for every `v`. References to `vt`
//!   and `vn` that do not exist are passed over.
//! - The faces after an `o` are of the object of that name, wherever the name returns; those
//!   before the first are of an object without a name. The faces after a `usemtl` have the
//!   material of that name, or none if it names none. Names may have blanks and `#`; only a
//!   `#` between blanks starts a comment. Names that are not UTF-8 count as Latin-1.
//!
//! Writing keeps every byte but those of UVs: `vt` statements go, the new ones come before
//! the first face (in a cloud: at the end), and corners get their new `vt` index while `v`
//! and `vn` stay as written. A polygon with a seam inside becomes triangles. Lines (`l`),
//! free-form surfaces (`surf`) and faces of two corners lose their `vt` references. A point
//! that was left out stays, with NaN as its UV.
//!
//! In glTF, every run of faces of one object becomes a mesh of that name, with vertices of its
//! own; vertices in no face are left out if there are several. Formats without objects keep the
//! vertices as they are.
//!
//! For other formats, the material files (MTL) in the folder of the file and below give its
//! materials colours (`Kd`, as linear values, and `d`) and textures (`map_Kd`). What a file
//! refers to in other folders is not looked at.

mod colors;
mod corner;
mod faces;
mod lines;
mod materials;
mod model;
mod names;
mod numbers;
mod scene;
mod shading;
mod statements;
mod write;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fam_surface::polygons::Divisions;
use fam_surface::{Surface, SurfaceError, TriangleMesh};

use crate::color::mean;
use crate::content::Content;
use crate::error::ReadFault;
use crate::kept::Kept;
use crate::parsed::{Parsed, surface};
use crate::scene::Scene;
use crate::uvs::{Uvs, vertex_uvs};
use colors::Colors;
pub(crate) use lines::Lines;
use materials::Libraries;
use model::Model;
use statements::{Fingerprint, Statement, open};

/// An OBJ file, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    content: Content,
    fingerprint: Fingerprint,
    divisions: Divisions,
    libraries: Vec<String>,
    /// Which `v` the surface has.
    kept: Kept,
    /// Whether there are normals or smoothing groups.
    has_shading: bool,
}

pub(crate) fn parse(content: Content) -> Result<Parsed<Source>, ReadFault> {
    let model = Model::read(&content, |_| {})?;
    let warnings = model.kept.warnings()?;
    if model.numbers.positions.is_empty() {
        return Err(SurfaceError::NoVertices.into());
    }
    let labels = model.labels();
    let has_shading = model.has_groups || !model.numbers.normals.is_empty();
    let vertices = model.numbers.positions.len();
    let is_cloud = model.faces.vertices.is_empty();
    let normals = if is_cloud {
        model.point_normals().map(<[_]>::to_vec)
    } else {
        model.faces.vertex_normals(vertices, &model.numbers.normals)
    };
    let Model { numbers, faces, .. } = model;
    let surface = surface(numbers.positions, &faces.vertices, normals)?;
    let uvs = match &surface {
        Surface::Mesh(_) => faces.uv_map(numbers.uvs),
        Surface::PointCloud(_) if numbers.uvs.len() == vertices => {
            vertex_uvs(&surface, numbers.uvs)
        }
        Surface::PointCloud(_) => None,
    };
    Ok(Parsed {
        surface,
        uvs,
        labels,
        diagonals: faces.vertices.diagonals(),
        warnings,
        source: Source {
            content,
            fingerprint: model.fingerprint,
            divisions: faces.vertices.divisions().clone(),
            libraries: model.libraries,
            kept: model.kept,
            has_shading,
        },
    })
}

impl Source {
    pub fn write(&self, uvs: &Uvs, out: &mut dyn Write) -> io::Result<()> {
        let input = open(&self.content)?;
        let written = match uvs {
            Uvs::Mesh(uvs) => write::mesh(input, uvs, &self.divisions, out)?,
            Uvs::Points(uvs) => write::points(input, &self.kept.uvs_of_all(uvs), out)?,
        };
        if written == self.fingerprint {
            Ok(())
        } else {
            Err(write::changed())
        }
    }

    /// One mesh with all faces, as they are in the file, and its objects.
    pub fn scene(&self) -> io::Result<Scene> {
        let mut colors = Colors::default();
        let model = self.read_again(|statement| colors.push(statement))?;
        let names = model.material_names();
        let materials = match self.libraries() {
            Some(libraries) => libraries.materials(&names)?,
            None => names.iter().map(|name| materials::white(name)).collect(),
        };
        Ok(scene::scene(model, colors.finish(), materials))
    }

    /// The edges of its mesh that normals or smoothing groups make hard.
    pub fn hard_edges(
        &self,
        mesh: &TriangleMesh,
        diagonals: &[[u32; 2]],
    ) -> io::Result<Vec<[u32; 2]>> {
        if !self.has_shading {
            return Ok(Vec::new());
        }
        let model = self.read_again(|_| {})?;
        Ok(shading::edges(&model, mesh, diagonals))
    }

    /// The mean of red, green and blue of every vertex of the surface; `None` without colours.
    pub fn vertex_colors(&self) -> io::Result<Option<Vec<f64>>> {
        let mut colors = Colors::default();
        self.read_again(|statement| colors.push(statement))?;
        let colors = colors.into_written().map(|colors| {
            let means = colors.into_iter().map(|color| mean(color.map(f64::from)));
            self.kept.only(means.collect())
        });
        Ok(colors)
    }

    /// Reads the file once more and shows `each` of its statements.
    fn read_again(&self, each: impl FnMut(&Statement)) -> io::Result<Model> {
        let model = Model::read(&self.content, each).map_err(|fault| match fault {
            ReadFault::Io(error) => error,
            _ => write::changed(),
        })?;
        if model.fingerprint != self.fingerprint {
            return Err(write::changed());
        }
        Ok(model)
    }

    /// The folder of the file, and relative to it the material files that it names and the
    /// images that these name: they are needed wherever it goes.
    pub fn companions(&self) -> Option<(&Path, Vec<PathBuf>)> {
        let Content::File(path) = &self.content else {
            return None;
        };
        Some((path.parent()?, self.libraries()?.files()))
    }

    fn libraries(&self) -> Option<Libraries<'_>> {
        match &self.content {
            Content::File(path) => Some(Libraries::find(path.parent()?, &self.libraries)),
            Content::Bytes(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::scene::IDENTITY;

    fn scene(text: &str) -> Scene {
        let parsed = parse(Content::Bytes(text.as_bytes().to_vec())).unwrap();
        parsed.source.scene().unwrap()
    }

    #[test]
    fn the_scene_has_all_faces_and_what_is_on_them() {
        let scene = scene(
            "o house\nv 0 0 0 1 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0 0 0 nan\nv 0 0 2\nvn 0 0 -3\nvn 0 0 0\n\
             f 1//1 2 3//1 4//2\nusemtl b\nmtllib none.mtl\nf 1 2\nf 1 5 2\nusemtl a\nf 5 5 5\n",
        );
        assert_eq!(scene.nodes.len(), 1);
        assert_eq!(scene.nodes[0].transform, IDENTITY);
        let names: Vec<_> = scene.materials.iter().map(|m| m.name.as_str()).collect();
        assert_eq!(names, ["b", "a"]);
        assert!(
            scene
                .materials
                .iter()
                .all(|m| m.base_color == [1.0; 4] && m.texture.is_none())
        );
        let [mesh] = scene.meshes.as_slice() else {
            panic!("one mesh was expected");
        };
        assert_eq!(mesh.name, "house");
        assert_eq!(mesh.positions[1], [2.0, 0.0, 0.0]);
        let faces: Vec<_> = mesh.polygons.iter().collect();
        assert_eq!(faces, [&[0, 1, 2, 3][..], &[0, 4, 1], &[4, 4, 4]]);
        assert_eq!(mesh.materials, [None, Some(0), Some(1)]);
        assert!(mesh.objects.is_empty());
        let colors = mesh.colors.as_ref().unwrap();
        assert_eq!(colors[0], [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(colors[1..], [[1.0; 4]; 4]);
        let (given, up, back) = ([0., 0., -3.], [0., 0., 1.], [0., 1., 0.]);
        let expected = [
            given, up, given, up, back, back, back, [0.; 3], [0.; 3], [0.; 3],
        ];
        assert_eq!(mesh.normals.as_ref().unwrap(), &expected);
    }

    #[test]
    fn a_scene_has_no_more_than_its_file() {
        let scene_of_mesh = scene("v 0 0 0\nv 1 0 0\nv 0 1 0\no a\nf 1 2 3\no b\nf 3 2 1/7/7\n");
        let mesh = &scene_of_mesh.meshes[0];
        assert!(mesh.colors.is_none() && mesh.normals.is_none() && mesh.name.is_empty());
        assert!(mesh.materials.is_empty() && scene_of_mesh.materials.is_empty());
        assert_eq!(mesh.objects, [(0, "a".to_owned()), (1, "b".to_owned())]);
        let cloud = scene("v 0 0 0\nvn 0 0 1\nv 1 0 0\nvn 0 2 0\n");
        let mesh = &cloud.meshes[0];
        assert_eq!(
            mesh.normals.as_deref(),
            Some(&[[0., 0., 1.], [0., 2., 0.]][..])
        );
        assert!(mesh.polygons.is_empty() && mesh.positions.len() == 2);
    }

    #[test]
    fn material_files_are_looked_for_beside_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
        write("a.obj", text);
        write("a.mtl", "newmtl red\nKd 1 0 0\nmap_Kd a.png\n");
        write("a.png", "pixels");
        let path = folder.path().join("a.obj");
        let source = parse(Content::File(path)).unwrap().source;
        let (of, companions) = source.companions().unwrap();
        assert_eq!(of, folder.path());
        assert_eq!(companions, [Path::new("a.mtl"), Path::new("a.png")]);
        let material = &source.scene().unwrap().materials[0];
        assert_eq!(material.base_color, [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(&*material.texture.as_ref().unwrap().bytes, b"pixels");

        let bytes = Content::Bytes(text.as_bytes().to_vec());
        let source = parse(bytes).unwrap().source;
        assert!(source.companions().is_none());
        assert_eq!(source.scene().unwrap().materials, [materials::white("red")]);
    }

    #[test]
    fn a_scene_is_that_of_the_file_that_was_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        for changed in ["v 0 0 1\n", "v x\n", "v 0 0 0"] {
            fs::write(&path, "v 0 0 0\n").unwrap();
            let source = parse(Content::File(path.clone())).unwrap().source;
            fs::write(&path, changed).unwrap();
            let error = source.scene().unwrap_err();
            assert_eq!(error.to_string(), "the file changed since it was read");
        }
    }
}
