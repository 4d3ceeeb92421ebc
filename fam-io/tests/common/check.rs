//! What holds for any bytes that are read as a file.

use std::io::{self, Write};

use fam_io::{AttributeError, Document, Format, Uvs, WriteFault, WriteOptions};
use fam_surface::{Surface, UvMap};

/// One mesh may be in so many places that a format without places gets out of proportion.
const LONGEST_OUTPUT: usize = 1 << 24;

/// Panics unless the bytes are refused in one line, or are read, written with made-up UVs, and
/// read again as the same surface with these UVs. The last byte chooses another format, which
/// then must either refuse the surface or be readable too. Returns whether they are read.
pub fn check(format: Format, bytes: &[u8]) -> bool {
    let document = match Document::from_bytes(format, bytes.to_vec()) {
        Ok(document) => document,
        Err(fault) => {
            check_message(&fault.to_string());
            return false;
        }
    };
    check_vertices(&document);
    let uvs = made_up_uvs(document.surface());
    let own = match format {
        Format::Stl => Format::Obj,
        _ => format,
    };
    let written = write(&document, &uvs, own).unwrap();
    let again = Document::from_bytes(own, written).unwrap();
    assert!(corners(&again) == corners(&document), "it is not the same");
    assert_eq!(uvs_of(&again), Some(corner_uvs(&uvs)), "its UVs are not");

    let last = bytes.last().copied().unwrap_or_default();
    let other = Format::ALL[usize::from(last) % Format::ALL.len()];
    match write(&document, &uvs, other) {
        Ok(written) => {
            let again = Document::from_bytes(other, written).unwrap();
            let (found, expected) = (corners(&again).len(), corners(&document).len());
            // A glTF mesh may be in several places.
            let several = matches!(document.format(), Format::Glb | Format::Gltf);
            assert!(found == expected || several && found > expected);
        }
        Err(WriteFault::Io(error)) => assert_eq!(error.kind(), io::ErrorKind::FileTooLarge),
        Err(fault @ (WriteFault::NoPlaceForUvs(_) | WriteFault::NoPlaceForSurface { .. })) => {
            check_message(&fault.to_string());
        }
        Err(fault) => panic!("{fault}"),
    }
    true
}

/// What is asked of the vertices: hard edges, and numbers by name.
fn check_vertices(document: &Document) {
    let count = document.surface().positions().len();
    let edges = document.hard_edges().unwrap();
    let is_edge = |[a, b]: &[u32; 2]| a < b && (*b as usize) < count;
    assert!(edges.iter().all(is_edge) && edges.is_sorted());
    let mut names = vec!["color".to_owned()];
    if let Err(AttributeError::Missing { known, .. }) = document.vertex_attribute("") {
        names.extend(known);
    }
    for name in names {
        match document.vertex_attribute(&name) {
            Ok(numbers) => assert_eq!(numbers.len(), count),
            Err(fault) => assert!(!fault.to_string().contains(char::is_control)),
        }
    }
}

fn check_message(message: &str) {
    assert!(!message.contains(char::is_control), "{message:?}");
    assert!(message.len() < 500, "{message:?}");
}

/// UVs with seams between some triangles, and one UV for each corner.
fn made_up_uvs(surface: &Surface) -> Uvs {
    match surface {
        Surface::Mesh(mesh) => {
            let patch = |t: usize| (t / 3 % 2) as f32;
            let corners = mesh.triangles().iter().enumerate();
            let uvs = corners.flat_map(|(t, corners)| corners.map(|v| [v as f32, patch(t)]));
            let triangles = (0..).step_by(3).map(|first| [first, first + 1, first + 2]);
            let triangles = triangles.take(mesh.triangles().len()).collect();
            Uvs::Mesh(UvMap::new(uvs.collect(), triangles).unwrap())
        }
        Surface::PointCloud(cloud) => {
            let uvs = (0..cloud.points().len()).map(|point| [point as f32, 0.25]);
            Uvs::Points(uvs.collect())
        }
    }
}

/// The positions of the corners of all triangles, or those of the points.
fn corners(document: &Document) -> Vec<[f64; 3]> {
    match document.surface() {
        Surface::Mesh(mesh) => {
            let vertices = mesh.triangles().as_flattened().iter();
            vertices.map(|&v| mesh.positions()[v as usize]).collect()
        }
        Surface::PointCloud(cloud) => cloud.points().to_vec(),
    }
}

fn uvs_of(document: &Document) -> Option<Vec<[f32; 2]>> {
    let points = document.point_uvs().map(<[_]>::to_vec);
    points.or_else(|| document.uv_map().map(uvs_of_corners))
}

fn corner_uvs(uvs: &Uvs) -> Vec<[f32; 2]> {
    match uvs {
        Uvs::Mesh(map) => uvs_of_corners(map),
        Uvs::Points(uvs) => uvs.clone(),
    }
}

fn uvs_of_corners(map: &UvMap) -> Vec<[f32; 2]> {
    let triangles = 0..map.triangles().len();
    triangles.flat_map(|t| map.corners(t)).collect()
}

fn write(document: &Document, uvs: &Uvs, format: Format) -> Result<Vec<u8>, WriteFault> {
    let mut out = Limited(Vec::new());
    document.write_to(uvs, format, &WriteOptions::default(), &mut out)?;
    Ok(out.0)
}

/// Output that is refused once it is too long.
struct Limited(Vec<u8>);

impl Write for Limited {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.len() + bytes.len() > LONGEST_OUTPUT {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
