use std::borrow::Cow;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fam_surface::{Surface, UvMap};

use crate::atomic::{write_atomically, write_file};
use crate::color::COLOR;
use crate::content::Content;
use crate::error::{AttributeError, ReadError, ReadFault, WriteError, WriteFault};
use crate::export::Export;
use crate::format::Format;
use crate::labels::Labels;
use crate::options::WriteOptions;
use crate::parsed::Parsed;
use crate::scene::Scene;
use crate::shading::hard_edges_of_normals;
use crate::uvs::{Uvs, check_count, is_finite};
use crate::warning::Warning;
use crate::{detect, gltf, obj, off, ply, stl, xyz};

/// A surface with the file it came from.
#[derive(Debug, Clone)]
pub struct Document {
    surface: Surface,
    uvs: Option<Uvs>,
    labels: Labels,
    diagonals: Vec<[u32; 2]>,
    warnings: Vec<Warning>,
    source: Source,
}

/// What it takes to write the file back.
#[derive(Debug, Clone)]
enum Source {
    /// The surface comes from no file.
    None,
    Gltf(Box<gltf::Source>),
    Obj(obj::Source),
    Off(off::Source),
    Ply(ply::Source),
    Stl(stl::Source),
    Xyz(xyz::Source),
}

/// Reads a mesh or a point cloud.
///
/// The content tells the format, and the extension where the content leaves it open. A file
/// with vertices but without faces is a point cloud. Vertices keep the order of the file;
/// polygons are triangulated as fans around their first corner. The content of a pipe is held
/// in memory, and files that it refers to are not looked for.
///
/// # Errors
/// The file cannot be opened, its format is unknown, it breaks the rules of its format, or
/// it has no vertices.
pub fn read_surface(path: impl AsRef<Path>) -> Result<Document, ReadError> {
    let path = path.as_ref();
    detect::open_known(path)
        .and_then(|(format, content)| parse(format, content))
        .map_err(|fault| ReadError {
            path: path.to_owned(),
            fault,
        })
}

fn parse(format: Format, content: Content) -> Result<Document, ReadFault> {
    match format {
        Format::Glb | Format::Gltf => gltf::parse(content)
            .map(|parsed| parsed.document(|source| Source::Gltf(Box::new(source)))),
        Format::Obj => obj::parse(content).map(|parsed| parsed.document(Source::Obj)),
        Format::Off => off::parse(content.bytes()?).map(|parsed| parsed.document(Source::Off)),
        Format::Ply => ply::parse(content.bytes()?).map(|parsed| parsed.document(Source::Ply)),
        Format::Stl => stl::parse(&content.bytes()?).map(|parsed| parsed.document(Source::Stl)),
        Format::Xyz => xyz::parse(content.bytes()?).map(|parsed| parsed.document(Source::Xyz)),
    }
}

impl<S> Parsed<S> {
    fn document(self, source: impl Fn(S) -> Source) -> Document {
        Document {
            labels: self.labels.with_objects_apart(&self.surface),
            surface: self.surface,
            uvs: self.uvs,
            diagonals: self.diagonals,
            warnings: self.warnings,
            source: source(self.source),
        }
    }
}

impl Document {
    /// A surface that comes from no file; [`format`](Self::format) is OBJ.
    pub fn of_surface(surface: Surface) -> Self {
        Self {
            surface,
            uvs: None,
            labels: Labels::default(),
            diagonals: Vec::new(),
            warnings: Vec::new(),
            source: Source::None,
        }
    }

    /// The content of a file that is in memory. A glTF document must hold all of its buffers.
    ///
    /// # Errors
    /// As [`read_surface`].
    pub fn from_bytes(format: Format, bytes: Vec<u8>) -> Result<Self, ReadFault> {
        detect::check_encoding(&bytes)?;
        parse(format, Content::Bytes(bytes))
    }

    /// The mesh or the cloud, in the coordinates of the file.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The UVs that the mesh already has on all of its faces.
    pub fn uv_map(&self) -> Option<&UvMap> {
        match &self.uvs {
            Some(Uvs::Mesh(uvs)) => Some(uvs),
            _ => None,
        }
    }

    /// The UVs that the point cloud already has, one per point.
    pub fn point_uvs(&self) -> Option<&[[f32; 2]]> {
        match &self.uvs {
            Some(Uvs::Points(uvs)) => Some(uvs),
            _ => None,
        }
    }

    /// What the triangles of the mesh belong to.
    pub fn labels(&self) -> &Labels {
        &self.labels
    }

    /// The edges of triangles that are none in the file: there, what is on both sides is one
    /// polygon. Each by its vertices.
    pub fn diagonals(&self) -> &[[u32; 2]] {
        &self.diagonals
    }

    /// The edges of the mesh that the file itself shades hard. Each by the first vertices at the
    /// positions of its ends, the smaller before the larger, ascending;
    /// [`Edges`](fam_surface::Edges) has the same names.
    ///
    /// An edge is hard if the normals on its two sides differ by more than one degree, at both
    /// of its ends. Normals are those that the corners of OBJ faces refer to, and those of the
    /// vertices of glTF and PLY files, where vertices at the same position have different ones.
    /// Without normals nothing is hard in these; only an OBJ file with `s` statements has hard
    /// edges between faces of different smoothing groups, and around all faces that are in none.
    /// That holds between triangles without normals: where a triangle has a `vn`, the normals
    /// decide, not the groups.
    ///
    /// Borders are never hard, [`diagonals`](Self::diagonals) neither, nor an edge of more than
    /// two sides if each shades as another one there, nor one of more than 32 sides. OFF, STL and
    /// XYZ files have no hard edges. The edges are looked for at each call, for which an OBJ file
    /// with normals or groups is read again.
    ///
    /// # Errors
    /// The OBJ file cannot be read again, or it has changed.
    pub fn hard_edges(&self) -> io::Result<Vec<[u32; 2]>> {
        let Surface::Mesh(mesh) = &self.surface else {
            return Ok(Vec::new());
        };
        let normals = match &self.source {
            Source::Obj(source) => return source.hard_edges(mesh, &self.diagonals),
            Source::Gltf(source) if mesh.normals().is_none() => source.normals().map(Cow::Owned),
            Source::Gltf(_) | Source::Ply(_) => mesh.normals().map(Cow::Borrowed),
            Source::None | Source::Off(_) | Source::Stl(_) | Source::Xyz(_) => None,
        };
        Ok(normals.map_or_else(Vec::new, |normals| {
            hard_edges_of_normals(mesh, &self.diagonals, &normals)
        }))
    }

    /// One number for each vertex of the mesh or point of the cloud, such as a weight that
    /// somebody painted, by the name of the attribute in the file:
    ///
    /// - PLY: a scalar property of the vertices as it is; `red`, `green` and `blue` go from 0 to
    ///   1, integers by the largest of their type. `color` is the mean of the three.
    /// - glTF: a scalar attribute, or the mean of the first three channels of `COLOR_n` and of
    ///   attributes whose names start with `_`. Normalized integers go from 0 (or −1) to 1. In
    ///   primitives without the attribute, a colour is 1 and anything else 0.
    /// - OBJ: `color`, the mean of red, green and blue, each from 0 to 1; 1 for a vertex without
    ///   a colour. The file is read again.
    /// - XYZ: `color`, the same of bytes.
    ///
    /// Colours count as they are in the file; those in sRGB are not made linear.
    ///
    /// # Errors
    /// The file has nothing of that name, a number is not finite, or an OBJ file cannot be read
    /// again or has changed.
    pub fn vertex_attribute(&self, name: &str) -> Result<Vec<f64>, AttributeError> {
        let (numbers, known) = match &self.source {
            Source::Gltf(source) => (source.vertex_numbers(name), source.number_names()),
            Source::Ply(source) => (source.vertex_numbers(name), source.number_names()),
            Source::Obj(source) => of_color(name, source.vertex_colors()?),
            Source::Xyz(source) => of_color(name, source.vertex_colors()),
            Source::None | Source::Off(_) | Source::Stl(_) => (None, Vec::new()),
        };
        let name = name.to_owned();
        let Some(numbers) = numbers else {
            return Err(AttributeError::Missing { name, known });
        };
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(vertex) => Err(AttributeError::NonFinite { name, vertex }),
            None => Ok(numbers),
        }
    }

    /// What was left out of the file, for the user to know.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The files beside this one that what is written is made of as well: buffers and images
    /// of glTF, materials and textures of OBJ. They need not exist.
    pub fn companions(&self) -> Vec<PathBuf> {
        match &self.source {
            Source::Gltf(source) => source.files().to_vec(),
            Source::Obj(source) => source
                .companions()
                .map_or_else(Vec::new, |(folder, files)| {
                    files.iter().map(|file| folder.join(file)).collect()
                }),
            _ => Vec::new(),
        }
    }

    /// The format of the file.
    pub fn format(&self) -> Format {
        match &self.source {
            Source::Gltf(source) => source.format(),
            Source::Stl(_) => Format::Stl,
            Source::None | Source::Obj(_) => Format::Obj,
            Source::Off(_) => Format::Off,
            Source::Ply(_) => Format::Ply,
            Source::Xyz(_) => Format::Xyz,
        }
    }

    /// Writes the file again, with `uvs` in the place of any UVs it had; in another format if
    /// the extension of `path` is that of one. V points up.
    ///
    /// # Errors
    /// The surface is a point cloud, `uvs` has not one triangle for each of the mesh, the
    /// format has no place for UVs, or the file cannot be written.
    pub fn write_mesh_uvs(
        &self,
        uvs: &UvMap,
        path: impl AsRef<Path>,
        options: &WriteOptions,
    ) -> Result<(), WriteError> {
        self.write(Uvs::Mesh(uvs.clone()), path.as_ref(), options)
    }

    /// Writes the file again, with the UV of every point in the place of any UVs it had; in
    /// another format if the extension of `path` is that of one. V points up.
    ///
    /// # Errors
    /// The surface is a mesh, there is not one finite UV for each point, the format has no
    /// place for UVs, or the file cannot be written.
    pub fn write_point_uvs(
        &self,
        uvs: &[[f32; 2]],
        path: impl AsRef<Path>,
        options: &WriteOptions,
    ) -> Result<(), WriteError> {
        self.write(Uvs::Points(uvs.to_vec()), path.as_ref(), options)
    }

    /// Writes the file again to `out`, with UVs of the kind that the surface needs.
    ///
    /// # Errors
    /// As [`write_mesh_uvs`](Self::write_mesh_uvs) and
    /// [`write_point_uvs`](Self::write_point_uvs).
    pub fn write_to(
        &self,
        uvs: &Uvs,
        format: Format,
        options: &WriteOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteFault> {
        self.check(uvs)?;
        match (&self.source, format) {
            (Source::Gltf(source), Format::Glb | Format::Gltf) => {
                source.write(uvs, format, options, out)?;
            }
            (Source::Obj(source), Format::Obj) => source.write(uvs, out)?,
            (Source::Off(source), Format::Off) => source.write(uvs, out)?,
            (Source::Ply(source), Format::Ply) => source.write(uvs, out)?,
            (Source::Xyz(source), Format::Xyz) => source.write(uvs, out)?,
            _ => self
                .export(uvs, options, format, None)?
                .write(format, out)?,
        }
        Ok(())
    }

    fn write(&self, uvs: Uvs, path: &Path, options: &WriteOptions) -> Result<(), WriteError> {
        let format = Format::of_path(path).unwrap_or(self.format());
        match &self.source {
            Source::Obj(source) if format == Format::Obj => copy_companions(source, path)?,
            _ if format == Format::Obj => {
                return self.write_obj_with_materials(&uvs, path, options);
            }
            _ => {}
        }
        write_file(path, |out| self.write_to(&uvs, format, options, out))
    }

    /// Writes an OBJ file of a document of another format, after the files that it refers to.
    fn write_obj_with_materials(
        &self,
        uvs: &Uvs,
        path: &Path,
        options: &WriteOptions,
    ) -> Result<(), WriteError> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let export = self
            .check(uvs)
            .and_then(|()| self.export(uvs, options, Format::Obj, Some(&stem)))
            .map_err(|fault| fault.at(path))?;
        for (name, content) in export.companions() {
            write_atomically(path.with_file_name(name), |out| out.write_all(&content))?;
        }
        write_file(path, |out| export.write(Format::Obj, out))
    }

    /// The content with new UVs, for a format that is not its own. Objects are meshes if that
    /// format has several of them.
    fn export<'a>(
        &self,
        uvs: &'a Uvs,
        options: &'a WriteOptions,
        format: Format,
        stem: Option<&str>,
    ) -> Result<Export<'a>, WriteFault> {
        let positions = self.surface.positions();
        let seam_line = |ends: &[u32; 2]| -> Result<[[f64; 3]; 2], WriteFault> {
            let end = |index: u32| {
                let position = positions.get(index as usize).copied();
                position.ok_or(WriteFault::SeamOutOfRange {
                    index,
                    count: positions.len(),
                })
            };
            Ok([end(ends[0])?, end(ends[1])?])
        };
        let seam_lines = options.seam_lines.iter().map(seam_line);
        let scene = match format {
            Format::Glb | Format::Gltf | Format::Obj => self.scene()?.with_objects_as_meshes(),
            Format::Off | Format::Ply | Format::Stl | Format::Xyz => self.scene()?,
        };
        Ok(Export {
            scene,
            uvs,
            options,
            seam_lines: seam_lines.collect::<Result<_, _>>()?,
            stem: stem.map(str::to_owned),
        })
    }

    /// The content as all formats have it in common.
    pub(crate) fn scene(&self) -> io::Result<Scene> {
        match &self.source {
            Source::Gltf(source) => source.scene(),
            Source::Obj(source) => source.scene(),
            Source::Off(source) => source.scene(),
            Source::Ply(source) => source.scene(),
            Source::None | Source::Stl(_) => Ok(Scene::of_surface(&self.surface)),
            Source::Xyz(source) => Ok(source.scene(&self.surface)),
        }
    }

    fn check(&self, uvs: &Uvs) -> Result<(), WriteFault> {
        match uvs {
            Uvs::Mesh(uvs) => self.check_mesh(uvs),
            Uvs::Points(uvs) => self.check_points(uvs),
        }
    }

    fn check_mesh(&self, uvs: &UvMap) -> Result<(), WriteFault> {
        let Surface::Mesh(mesh) = &self.surface else {
            return Err(WriteFault::OtherKind {
                surface: "a point cloud",
                uvs: "a mesh",
            });
        };
        check_count("triangles", mesh.triangles().len(), uvs.triangles().len())
    }

    fn check_points(&self, uvs: &[[f32; 2]]) -> Result<(), WriteFault> {
        let Surface::PointCloud(cloud) = &self.surface else {
            return Err(WriteFault::OtherKind {
                surface: "a mesh",
                uvs: "a point cloud",
            });
        };
        check_count("points", cloud.points().len(), uvs.len())?;
        match uvs.iter().position(|uv| !is_finite(uv)) {
            Some(point) => Err(WriteFault::NonFiniteUv(point)),
            None => Ok(()),
        }
    }
}

/// What a file with colours, or without, has of a name, and the names it has.
fn of_color(name: &str, colors: Option<Vec<f64>>) -> (Option<Vec<f64>>, Vec<String>) {
    let known = colors.iter().map(|_| COLOR.to_owned()).collect();
    (colors.filter(|_| name == COLOR), known)
}

/// Copies the files that an OBJ file needs beside it to the folder of `target`; those that are
/// there already stay.
fn copy_companions(source: &obj::Source, target: &Path) -> Result<(), WriteError> {
    let Some((from, companions)) = source.companions() else {
        return Ok(());
    };
    let to = target.parent().unwrap_or(Path::new(""));
    for companion in companions {
        let (original, copy) = (from.join(&companion), to.join(&companion));
        if copy.exists() {
            continue;
        }
        let copied = fs::create_dir_all(copy.parent().unwrap_or(to)).and_then(|()| {
            let mut content = fs::File::open(original)?;
            write_atomically(&copy, |out| io::copy(&mut content, out).map(|_| ()))
                .map_err(|error| io::Error::other(error.to_string()))
        });
        copied.map_err(|error| WriteFault::from(error).at(&copy))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_pipe_is_read_once() {
        use std::io::Write;
        use std::os::fd::AsRawFd;
        let (line, uv) = ("v 1 2 3\n", [0.5, 1.0]);
        // Less and more than what tells the format.
        for count in [1, detect::LOOKED_AT as usize / line.len() + 9] {
            let (reader, mut writer) = std::io::pipe().unwrap();
            let thread =
                std::thread::spawn(move || writer.write_all(line.repeat(count).as_bytes()));
            let path = format!("/proc/self/fd/{}", reader.as_raw_fd());
            let document = read_surface(path).unwrap();
            thread.join().unwrap().unwrap();
            let uvs = Uvs::Points(vec![uv; count]);
            let mut out = Vec::new();
            document
                .write_to(&uvs, Format::Obj, &WriteOptions::default(), &mut out)
                .unwrap();
            let expected = line.repeat(count) + &"vt 0.5 1\n".repeat(count);
            assert!(out == expected.as_bytes(), "{count} points");
        }
    }

    #[test]
    fn objects_that_share_a_vertex_are_one() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 0\nv 1 0 1\nv 0 1 1\n";
        let faces = "o a\nf 1 2 3\no b\nf 2 4 3\no c\nf 5 6 7\n";
        let objects = |text: String| {
            let document = Document::from_bytes(Format::Obj, text.into_bytes()).unwrap();
            document.labels().objects.clone()
        };
        assert_eq!(objects(format!("{text}{faces}")), [0, 0, 2]);
        assert_eq!(
            objects(format!("{text}{faces}o d\nf 1 5 6\n")),
            [] as [u32; 0]
        );
    }
}
