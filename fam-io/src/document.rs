use std::fmt;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use fam_core::surface::{PointCloud, Surface, SurfaceError, TriangleMesh, UvMap};

use crate::atomic::write_atomically;
use crate::polygons::Polygons;
use crate::{ReadError, ReadFault, WriteError, WriteFault, obj, off, ply, xyz};

/// The file formats that are read and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// Object File Format.
    Off,
    /// Polygon File Format.
    Ply,
    /// Columns of numbers.
    Xyz,
}

impl Format {
    /// The format that the extension of `path` stands for, in upper or lower case.
    pub fn of_path(path: impl AsRef<Path>) -> Option<Self> {
        let extension = path.as_ref().extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(Self::Obj),
            "off" => Some(Self::Off),
            "ply" => Some(Self::Ply),
            "xyz" => Some(Self::Xyz),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Off => "OFF",
            Self::Ply => "PLY",
            Self::Xyz => "XYZ",
        })
    }
}

/// A surface with the file it came from.
#[derive(Debug, Clone)]
pub struct Document {
    surface: Surface,
    uvs: Option<Uvs>,
    source: Source,
}

/// The UVs a file already has.
#[derive(Debug, Clone)]
pub(crate) enum Uvs {
    Mesh(UvMap),
    Points(Vec<[f32; 2]>),
}

/// What a reader makes of a file: `S` is what its writer needs.
pub(crate) struct Parsed<S> {
    pub surface: Surface,
    pub uvs: Option<Uvs>,
    pub source: S,
}

/// What it takes to write the file back.
#[derive(Debug, Clone)]
enum Source {
    Obj(obj::Source),
    Off(off::Source),
    Ply(ply::Source),
    Xyz(xyz::Source),
}

/// Reads a mesh or a point cloud; the extension tells the format.
///
/// A file with vertices but without faces is a point cloud. Vertices keep the order of the
/// file; polygons are triangulated as fans around their first corner.
///
/// # Errors
/// The file cannot be opened, its format is unknown, it breaks the rules of its format, or
/// it has no vertices.
pub fn read_surface(path: impl AsRef<Path>) -> Result<Document, ReadError> {
    let path = path.as_ref();
    read(path).map_err(|fault| ReadError {
        path: path.to_owned(),
        fault,
    })
}

fn read(path: &Path) -> Result<Document, ReadFault> {
    let format = Format::of_path(path).ok_or_else(|| {
        ReadFault::UnknownFormat(match path.extension() {
            Some(extension) => format!("`.{}`", extension.display()),
            None => "a file without an extension".to_owned(),
        })
    })?;
    parse(format, fs::read(path)?)
}

pub(crate) fn parse(format: Format, bytes: Vec<u8>) -> Result<Document, ReadFault> {
    match format {
        Format::Obj => obj::parse(bytes).map(|parsed| parsed.document(Source::Obj)),
        Format::Off => off::parse(bytes).map(|parsed| parsed.document(Source::Off)),
        Format::Ply => ply::parse(&bytes).map(|parsed| parsed.document(Source::Ply)),
        Format::Xyz => xyz::parse(bytes).map(|parsed| parsed.document(Source::Xyz)),
    }
}

impl<S> Parsed<S> {
    fn document(self, source: impl Fn(S) -> Source) -> Document {
        Document {
            surface: self.surface,
            uvs: self.uvs,
            source: source(self.source),
        }
    }
}

impl Document {
    /// A mesh that comes from no file, as an OBJ document.
    ///
    /// # Errors
    /// Never for a valid mesh; the signature is that of the reader it goes through.
    pub fn of_mesh(mesh: &TriangleMesh) -> Result<Self, ReadFault> {
        let mut text = String::new();
        for [x, y, z] in mesh.positions() {
            text.push_str(&format!("v {x} {y} {z}\n"));
        }
        for [a, b, c] in mesh.triangles().iter().map(|t| t.map(|v| v + 1)) {
            text.push_str(&format!("f {a} {b} {c}\n"));
        }
        parse(Format::Obj, text.into_bytes())
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

    /// The format of the file, which is also that of what is written.
    pub fn format(&self) -> Format {
        match self.source {
            Source::Obj(_) => Format::Obj,
            Source::Off(_) => Format::Off,
            Source::Ply(_) => Format::Ply,
            Source::Xyz(_) => Format::Xyz,
        }
    }

    /// Writes the file again, with `uvs` in the place of any UVs it had.
    ///
    /// # Errors
    /// The surface is a point cloud, `uvs` has not one triangle for each of the mesh, the
    /// extension of `path` is that of another format, or the file cannot be written.
    pub fn write_mesh_uvs(&self, uvs: &UvMap, path: impl AsRef<Path>) -> Result<(), WriteError> {
        let path = path.as_ref();
        self.check_output(path)
            .and_then(|()| self.check_mesh(uvs))
            .map_err(|fault| fault.at(path))?;
        write_atomically(path, |out| self.mesh_to(uvs, out))
    }

    /// Writes the file again, with the UV of every point in the place of any UVs it had.
    ///
    /// # Errors
    /// The surface is a mesh, there is not one finite UV for each point, the extension of
    /// `path` is that of another format, or the file cannot be written.
    pub fn write_point_uvs(
        &self,
        uvs: &[[f32; 2]],
        path: impl AsRef<Path>,
    ) -> Result<(), WriteError> {
        let path = path.as_ref();
        self.check_output(path)
            .and_then(|()| self.check_points(uvs))
            .map_err(|fault| fault.at(path))?;
        write_atomically(path, |out| self.points_to(uvs, out))
    }

    pub(crate) fn mesh_to(&self, uvs: &UvMap, out: &mut dyn Write) -> io::Result<()> {
        match &self.source {
            Source::Obj(source) => source.write_mesh(uvs, out),
            Source::Off(source) => source.write_mesh(uvs, out),
            Source::Ply(source) => source.write_mesh(uvs, out),
            // Never a mesh.
            Source::Xyz(_) => Ok(()),
        }
    }

    pub(crate) fn points_to(&self, uvs: &[[f32; 2]], out: &mut dyn Write) -> io::Result<()> {
        match &self.source {
            Source::Obj(source) => source.write_points(uvs, out),
            Source::Off(source) => source.write_points(uvs, out),
            Source::Ply(source) => source.write_points(uvs, out),
            Source::Xyz(source) => source.write_points(uvs, out),
        }
    }

    fn check_output(&self, path: &Path) -> Result<(), WriteFault> {
        let input = self.format();
        match Format::of_path(path) {
            Some(output) if output != input => Err(WriteFault::OtherFormat { input, output }),
            _ => Ok(()),
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

fn check_count(of: &'static str, expected: usize, found: usize) -> Result<(), WriteFault> {
    if expected == found {
        Ok(())
    } else {
        Err(WriteFault::CountMismatch {
            of,
            expected,
            found,
        })
    }
}

fn is_finite(uv: &[f32; 2]) -> bool {
    uv.iter().all(|c| c.is_finite())
}

/// The surface of a file: a cloud if no face is left. Normals that are not finite count as
/// unknown.
pub(crate) fn surface(
    positions: Vec<[f64; 3]>,
    polygons: &Polygons,
    normals: Option<Vec<[f64; 3]>>,
) -> Result<Surface, SurfaceError> {
    let known = |n: [f64; 3]| {
        if n.iter().all(|c| c.is_finite()) {
            n
        } else {
            [0.0; 3]
        }
    };
    let normals = normals.map(|normals| normals.into_iter().map(known).collect::<Vec<_>>());
    let triangles = polygons.triangles();
    if triangles.is_empty() {
        return PointCloud::new(positions, normals).map(Surface::PointCloud);
    }
    let mesh = TriangleMesh::new(positions, triangles)?;
    Ok(Surface::Mesh(match normals {
        Some(normals) => mesh.with_normals(normals)?,
        None => mesh,
    }))
}

/// UVs per vertex as those of the surface; `None` unless all are finite.
pub(crate) fn vertex_uvs(surface: &Surface, uvs: Vec<[f32; 2]>) -> Option<Uvs> {
    match surface {
        Surface::Mesh(mesh) => {
            let map = UvMap::new(uvs, mesh.triangles().to_vec()).ok()?;
            Some(Uvs::Mesh(map))
        }
        Surface::PointCloud(_) => uvs.iter().all(is_finite).then_some(Uvs::Points(uvs)),
    }
}
