//! trimesh and meshio see the UVs that were written.
//!
//! trimesh reads the UVs of meshes from OBJ, PLY and glTF files, but none of point clouds, no
//! binary PLY files with polygons of different sizes, and no negative indices of OBJ files that
//! are followed by more vertices. meshio reads the UVs of PLY files, and those of OBJ files if
//! there is one for each vertex, in their order.

use std::path::{Path, PathBuf};

use fam_io::{Document, Format, Uvs, WriteOptions};
use fam_surface::{Surface, UvMap, shapes};
use tempfile::TempDir;

use crate::installed::{Consumers, Seen};
use crate::surfaces::{CLOUD, HOUSE, documents, obj, per_corner, per_vertex, real_models, write};

/// A position and a UV, in single precision, which all of the files have at least.
pub type Corner = [u32; 5];

fn corner(numbers: impl IntoIterator<Item = f64>) -> Corner {
    // Adding zero makes −0 and 0 one.
    let bits = numbers.into_iter().map(|c| (c as f32 + 0.0).to_bits());
    let bits: Vec<_> = bits.collect();
    bits.try_into().expect("a position with a UV")
}

/// Triangles in an order that does not depend on that of the file, nor on which of their
/// corners is the first.
fn sorted(triangles: impl IntoIterator<Item = [Corner; 3]>) -> Vec<[Corner; 3]> {
    let mut triangles: Vec<_> = triangles
        .into_iter()
        .map(|mut corners| {
            let first = (0..3).min_by_key(|&at| corners[at]).unwrap_or_default();
            corners.rotate_left(first);
            corners
        })
        .collect();
    triangles.sort_unstable();
    triangles
}

pub fn expected(surface: &Surface, uvs: &UvMap) -> Vec<[Corner; 3]> {
    let Surface::Mesh(mesh) = surface else {
        panic!("UVs of a mesh for a cloud")
    };
    sorted((0..mesh.triangles().len()).map(|t| {
        let (positions, uvs) = (mesh.corners(t), uvs.corners(t));
        let at = |k: usize| corner(positions[k].into_iter().chain(uvs[k].map(f64::from)));
        [at(0), at(1), at(2)]
    }))
}

/// The triangles of a mesh, polygons as fans.
pub fn seen_triangles(seen: &Seen) -> Vec<[Corner; 3]> {
    let corners = |face: &Vec<Vec<f64>>| face.iter().map(|c| corner(c.clone())).collect();
    let faces: Vec<Vec<Corner>> = seen.faces.iter().map(corners).collect();
    let fans = faces.iter().flat_map(|face| {
        let others = face[1..].windows(2);
        others.map(|pair| [face[0], pair[0], pair[1]])
    });
    sorted(fans)
}

/// Files with the UVs that were written to them.
struct Written {
    folder: TempDir,
    files: Vec<(PathBuf, Surface, Uvs)>,
}

impl Written {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
            files: Vec::new(),
        }
    }

    fn add(&mut self, document: &Document, uvs: Uvs, format: Format) {
        let name = format!("{}.{}", self.files.len(), format.extension());
        let path = self.folder.path().join(name);
        write(document, &uvs, &path, &WriteOptions::default());
        self.files.push((path, document.surface().clone(), uvs));
    }

    fn paths(&self) -> Vec<PathBuf> {
        self.files.iter().map(|(path, ..)| path.clone()).collect()
    }

    /// Leaves out PLY files with faces of different sizes.
    fn without_mixed_ply(mut self, consumers: &Consumers) -> Self {
        let is_ply = |path: &PathBuf| Format::of_path(path) == Some(Format::Ply);
        let paths: Vec<_> = self.paths().into_iter().filter(is_ply).collect();
        let seen = consumers.read("meshio", &paths);
        let is_mixed = |path: &Path| {
            let faces = seen.get(path).map_or(&[][..], |seen| &seen.faces);
            faces.windows(2).any(|pair| pair[0].len() != pair[1].len())
        };
        self.files.retain(|(path, ..)| !is_mixed(path));
        self
    }

    fn check(&self, consumers: &Consumers, tool: &str) {
        let seen = consumers.read(tool, &self.paths());
        for (path, surface, uvs) in &self.files {
            let seen = &seen[path];
            let same = match uvs {
                Uvs::Mesh(uvs) => seen_triangles(seen) == expected(surface, uvs),
                Uvs::Points(uvs) => {
                    let points = surface.positions().iter().zip(uvs);
                    let points =
                        points.map(|(p, uv)| corner(p.iter().copied().chain(uv.map(f64::from))));
                    let seen = seen.points.iter().map(|c| corner(c.iter().copied()));
                    seen.eq(points)
                }
            };
            assert!(same, "{tool} sees other UVs in {}", path.display());
        }
    }
}

fn is_mesh(document: &Document) -> bool {
    matches!(document.surface(), Surface::Mesh(_))
}

#[test]
fn trimesh_sees_the_uvs_of_meshes() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let mut written = Written::new();
    for (_, document) in documents().into_iter().filter(|(_, d)| is_mesh(d)) {
        for uvs in [per_vertex, per_corner] {
            for format in [Format::Obj, Format::Ply, Format::Glb, Format::Gltf] {
                written.add(&document, uvs(document.surface()), format);
            }
        }
    }
    let all = written.files.len();
    let written = written.without_mixed_ply(&consumers);
    // The house, from three formats.
    assert_eq!(written.files.len(), all - 3);
    written.check(&consumers, "trimesh");
}

#[test]
fn a_mirrored_layout_is_told_apart() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let document = obj(HOUSE);
    let Uvs::Mesh(uvs) = per_vertex(document.surface()) else {
        unreachable!()
    };
    let mirrored = uvs.uvs().iter().map(|[u, v]| [*u, 1.0 - v]).collect();
    let mirrored = UvMap::new(mirrored, uvs.triangles().to_vec()).unwrap();
    for format in [Format::Obj, Format::Glb] {
        let mut written = Written::new();
        written.add(&document, Uvs::Mesh(mirrored.clone()), format);
        let path = &written.files[0].0;
        let seen = consumers.read("trimesh", std::slice::from_ref(path));
        let seen = seen_triangles(&seen[path]);
        assert!(seen == expected(document.surface(), &mirrored));
        assert!(seen != expected(document.surface(), &uvs));
    }
}

#[test]
fn meshio_sees_the_uvs_of_ply_files() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let mut written = Written::new();
    for (_, document) in documents() {
        for uvs in [per_vertex, per_corner] {
            written.add(&document, uvs(document.surface()), Format::Ply);
        }
    }
    written.check(&consumers, "meshio");
}

#[test]
fn meshio_sees_the_uvs_of_obj_files_without_seams() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let moebius = shapes::moebius_strip(0.5, 40, 4);
    let mut written = Written::new();
    for document in [Document::of_surface(Surface::Mesh(moebius)), obj(CLOUD)] {
        written.add(&document, per_vertex(document.surface()), Format::Obj);
    }
    written.check(&consumers, "meshio");
}

#[test]
fn trimesh_sees_the_uvs_of_real_models() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let mut written = Written::new();
    for path in real_models(300_000) {
        let Ok(document) = fam_io::read_surface(&path) else {
            continue;
        };
        let has_places = matches!(document.format(), Format::Glb | Format::Gltf);
        if is_mesh(&document) && !has_places {
            let uvs = per_corner(document.surface());
            for format in [Format::Obj, Format::Ply, Format::Glb] {
                written.add(&document, uvs.clone(), format);
            }
        }
    }
    written.check(&consumers, "trimesh");
}
