//! trimesh and meshio see the UVs that were written.
//!
//! trimesh reads the UVs of meshes from OBJ, PLY and glTF files, but none of point clouds, no
//! binary PLY files with polygons of different sizes, and no negative indices of OBJ files that
//! are followed by more vertices. meshio reads the UVs of PLY files, and those of OBJ files if
//! there is one for each vertex, in their order.

use std::path::Path;

use fam_core::surface::{Surface, UvMap, shapes};
use fam_io::{Document, Uvs, WriteOptions};

use crate::installed::{Consumers, Seen};
use crate::surfaces::{CLOUD, HOUSE, documents, obj, per_corner, per_vertex, write};

/// A position and a UV, in single precision, which all of the files have at least.
type Corner = [u32; 5];

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

fn expected(surface: &Surface, uvs: &UvMap) -> Vec<[Corner; 3]> {
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
fn seen_triangles(seen: &Seen) -> Vec<[Corner; 3]> {
    let corners = |face: &Vec<Vec<f64>>| face.iter().map(|c| corner(c.clone())).collect();
    let faces: Vec<Vec<Corner>> = seen.faces.iter().map(corners).collect();
    let fans = faces.iter().flat_map(|face| {
        let others = face[1..].windows(2);
        others.map(|pair| [face[0], pair[0], pair[1]])
    });
    sorted(fans)
}

#[track_caller]
fn assert_sees(consumers: &Consumers, tool: &str, file: &Path, surface: &Surface, uvs: &Uvs) {
    let seen = consumers.read(tool, file);
    match uvs {
        Uvs::Mesh(uvs) => {
            assert!(
                seen_triangles(&seen) == expected(surface, uvs),
                "{tool} sees other UVs in {}",
                file.display()
            );
        }
        Uvs::Points(uvs) => {
            let points = surface.positions().iter().zip(uvs);
            let points = points.map(|(p, uv)| corner(p.iter().copied().chain(uv.map(f64::from))));
            let seen = seen.points.into_iter().map(corner);
            assert_eq!(seen.collect::<Vec<_>>(), points.collect::<Vec<_>>());
        }
    }
}

fn is_mesh(document: &Document) -> bool {
    matches!(document.surface(), Surface::Mesh(_))
}

fn has_faces_of_one_size(consumers: &Consumers, file: &Path) -> bool {
    let faces = consumers.read("meshio", file).faces;
    faces.windows(2).all(|pair| pair[0].len() == pair[1].len())
}

#[test]
fn trimesh_sees_the_uvs_of_meshes() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut compared = 0;
    for (name, document) in documents().into_iter().filter(|(_, d)| is_mesh(d)) {
        for uvs in [per_vertex, per_corner] {
            let uvs = uvs(document.surface());
            for extension in ["obj", "ply", "glb", "gltf"] {
                let file = folder.path().join(format!("{name}.{extension}"));
                write(&document, &uvs, &file, &WriteOptions::default());
                if extension != "ply" || has_faces_of_one_size(&consumers, &file) {
                    assert_sees(&consumers, "trimesh", &file, document.surface(), &uvs);
                    compared += 1;
                }
            }
        }
    }
    assert_eq!(
        compared,
        5 * 2 * 4 - 3,
        "only the house has faces of several sizes"
    );
}

#[test]
fn a_mirrored_layout_is_told_apart() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("house.obj");
    let document = obj(HOUSE);
    let Uvs::Mesh(uvs) = per_vertex(document.surface()) else {
        unreachable!()
    };
    let mirrored = uvs.uvs().iter().map(|[u, v]| [*u, 1.0 - v]).collect();
    let mirrored = UvMap::new(mirrored, uvs.triangles().to_vec()).unwrap();
    let options = WriteOptions::default();
    document.write_mesh_uvs(&mirrored, &file, &options).unwrap();
    let seen = seen_triangles(&consumers.read("trimesh", &file));
    assert!(seen == expected(document.surface(), &mirrored));
    assert!(seen != expected(document.surface(), &uvs));
}

#[test]
fn meshio_sees_the_uvs_of_ply_files() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for (name, document) in documents() {
        for uvs in [per_vertex, per_corner] {
            let uvs = uvs(document.surface());
            let file = folder.path().join(format!("{name}.ply"));
            write(&document, &uvs, &file, &WriteOptions::default());
            assert_sees(&consumers, "meshio", &file, document.surface(), &uvs);
        }
    }
}

#[test]
fn meshio_sees_the_uvs_of_obj_files_without_seams() {
    let Some(consumers) = Consumers::with_mesh_readers() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let moebius = shapes::moebius_strip(0.5, 40, 4);
    for (name, document) in [
        ("moebius", Document::of_surface(Surface::Mesh(moebius))),
        ("cloud", obj(CLOUD)),
    ] {
        let uvs = per_vertex(document.surface());
        let file = folder.path().join(format!("{name}.obj"));
        write(&document, &uvs, &file, &WriteOptions::default());
        assert_sees(&consumers, "meshio", &file, document.surface(), &uvs);
    }
}
