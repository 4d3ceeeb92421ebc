//! Surfaces to write, and UVs for them.

use std::fs;
use std::path::{Path, PathBuf};

use fam_io::{Document, Format, Uvs, WriteOptions};
use fam_surface::{Surface, UvMap, shapes};

use crate::installed::skipped;

/// Triangles, quads and a hexagon in three objects and of three materials, which alternate; some
/// with normals and UVs.
pub const HOUSE: &str = "\
mtllib house.mtl
o walls
v 0 0 0
v 2 0 0
v 2 1.5 0
v 0 1.5 0
v 0 0 -3
v 2 0 -3
v 2 1.5 -3
v 0 1.5 -3
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
vn 1 0 0
usemtl brick
f 1/1/1 2/2/1 3/3/1 4/4/1
usemtl glass
f 2/1/2 6/2/2 7/3/2 3/4/2
usemtl brick
f 6/1 5/2 8/3 7/4
f 5 1 4 8
o roof
v 1 2.5 0
v 1 2.5 -3
usemtl tiles
f 10 9 4 8
f 3 7 10
f 3 10 9
usemtl glass
f 4 3 9
f 7 8 10
o tower
v 5 0 0
v 6 0 0.5
v 6 0 1.5
v 5 0 2
v 4 0 1.5
v 4 0 0.5
usemtl brick
f 16 15 14 13 12 11
";

/// Quads in groups; vertices with colours, one of them in no face.
pub const PAINTED: &str = "\
g left
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 0.2 0.4 0.6
v 9 9 9 0 0 0
g right
v 2 0 0.25 1 1 1
v 2 1 0.25 0 0 0
f 1 2 3 4
g right
f 2 6 7 3
";

pub const CLOUD: &str = "\
v 0 0 0
v 1 0 0
v 0.5 1 0
v 0.25 0.75 1
vn 0 0 1
vn 0 1 0
vn 1 0 0
vn 0 0 1
";

pub fn obj(text: &str) -> Document {
    Document::from_bytes(Format::Obj, text.into()).unwrap()
}

/// Documents of several formats, with names for files.
pub fn documents() -> Vec<(&'static str, Document)> {
    let torus = shapes::torus(1.0, 0.4, 24, 12);
    let normals = torus.vertex_normals();
    let torus = torus.with_normals(normals).unwrap();
    let torus = Document::of_surface(Surface::Mesh(torus));
    let house = obj(HOUSE);
    let again = |document: &Document, format| {
        let mut bytes = Vec::new();
        let options = WriteOptions::default();
        let uvs = per_vertex(document.surface());
        document
            .write_to(&uvs, format, &options, &mut bytes)
            .unwrap();
        Document::from_bytes(format, bytes).unwrap()
    };
    vec![
        ("house-ply", again(&house, Format::Ply)),
        ("house-off", again(&house, Format::Off)),
        ("cloud-xyz", again(&obj(CLOUD), Format::Xyz)),
        ("cloud-ply", again(&obj(CLOUD), Format::Ply)),
        ("house", house),
        ("painted", obj(PAINTED)),
        ("cloud", obj(CLOUD)),
        ("torus", torus),
    ]
}

/// Numbers that stay the same when subtracted from 1; no two of the first million are equal.
fn uv(index: usize) -> [f32; 2] {
    let part = |step: usize, prime: usize| ((index * step) % prime) as f32 / 1024.0;
    [part(389, 1021), part(577, 1019)]
}

/// UVs without a seam.
pub fn per_vertex(surface: &Surface) -> Uvs {
    let uvs = (0..surface.positions().len()).map(uv).collect();
    match surface {
        Surface::Mesh(mesh) => Uvs::Mesh(UvMap::new(uvs, mesh.triangles().to_vec()).unwrap()),
        Surface::PointCloud(_) => Uvs::Points(uvs),
    }
}

/// UVs with a seam along every edge; those of a cloud are per point.
pub fn per_corner(surface: &Surface) -> Uvs {
    let Surface::Mesh(mesh) = surface else {
        return per_vertex(surface);
    };
    let corners = 3 * mesh.triangles().len();
    let triangles = (0..corners as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Uvs::Mesh(UvMap::new((0..corners).map(uv).collect(), triangles.collect()).unwrap())
}

pub fn write(document: &Document, uvs: &Uvs, path: &Path, options: &WriteOptions) {
    match uvs {
        Uvs::Mesh(uvs) => document.write_mesh_uvs(uvs, path, options),
        Uvs::Points(uvs) => document.write_point_uvs(uvs, path, options),
    }
    .unwrap();
}

/// The files of at most so many bytes in the folder of real models beside the repository; none
/// if it is not there.
pub fn real_models(most: u64) -> Vec<PathBuf> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/models");
    if !models.is_dir() {
        skipped("the real models are not present");
        return Vec::new();
    }
    let folders = [models.join("formats"), models.join("hostile"), models];
    let entries = folders
        .iter()
        .flat_map(|folder| fs::read_dir(folder).unwrap());
    let is_wanted = |path: &PathBuf| {
        let metadata = fs::metadata(path).unwrap();
        metadata.is_file() && metadata.len() <= most
    };
    let files = entries.map(|entry| entry.unwrap().path()).filter(is_wanted);
    let files: Vec<_> = files.collect();
    assert!(files.len() > 30);
    files
}
