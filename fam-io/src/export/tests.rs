//! Scenes that no single format can read, written as every format.

use ::gltf::Gltf;
use ::gltf::mesh::Mode;
use fam_surface::polygons::Polygons;
use fam_surface::{Surface, UvMap};

use super::*;
use crate::document::Document;
use crate::options::WriteOptions;
use crate::scene::{IDENTITY, Image, Material, Mesh, Node, Scene};
use crate::uvs::Uvs;

const PNG: &[u8] = b"\x89PNG\r\n\x1a\n, or at least its signature";

fn exported(export: &Export, format: Format) -> Vec<u8> {
    let mut out = Vec::new();
    export.write(format, &mut out).unwrap();
    out
}

fn text(export: &Export, format: Format) -> String {
    String::from_utf8(exported(export, format)).unwrap()
}

fn export<'a>(scene: Scene, uvs: &'a Uvs, options: &'a WriteOptions) -> Export<'a> {
    Export {
        scene,
        uvs,
        options,
        seam_lines: Vec::new(),
        stem: None,
    }
}

fn polygons(faces: &[&[u32]]) -> Polygons {
    let mut polygons = Polygons::default();
    for face in faces {
        polygons.push(face.iter().copied());
    }
    polygons
}

/// A square and a triangle on it.
fn sheet() -> Mesh {
    Mesh {
        name: "a sheet".to_owned(),
        positions: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 2.0, 0.0],
        ],
        polygons: polygons(&[&[0, 1, 2, 3], &[3, 2, 4]]),
        ..Mesh::default()
    }
}

/// UVs of the sheet: those of its vertices, but the triangle is elsewhere.
fn torn_above_the_square() -> Uvs {
    let uvs = vec![
        [0.0, 0.0],
        [0.5, 0.0],
        [0.5, 0.5],
        [0.0, 0.5],
        [0.75, 1.0],
        [1.0, 0.75],
    ];
    Uvs::Mesh(UvMap::new(uvs, vec![[0, 1, 2], [0, 2, 3], [4, 5, 2]]).unwrap())
}

/// UVs of the sheet that tear it along the diagonal of the square.
fn torn_within_the_square() -> Uvs {
    let uvs = vec![[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [1.0, 1.0]];
    Uvs::Mesh(UvMap::new(uvs, vec![[0, 1, 2], [3, 2, 0], [0, 2, 3]]).unwrap())
}

fn mirrored_and_moved() -> [[f64; 4]; 4] {
    let mut matrix = IDENTITY;
    matrix[0][0] = -1.0;
    matrix[3] = [10.0, 0.0, 0.5, 1.0];
    matrix
}

fn at(mesh: usize, transform: [[f64; 4]; 4]) -> Node {
    Node { mesh, transform }
}

#[test]
fn obj_has_polygons_objects_materials_and_shared_uvs() {
    let mut mesh = sheet();
    mesh.normals = Some([vec![[0.0, 0.0, 1.0]; 6], vec![[0.0; 3]]].concat());
    mesh.materials = vec![Some(1), None];
    let scene = Scene {
        materials: ["dull", "red # 1"]
            .map(|name| Material {
                name: name.to_owned(),
                ..Material::default()
            })
            .into(),
        meshes: vec![mesh],
        nodes: vec![at(0, IDENTITY), at(0, mirrored_and_moved())],
    };
    let (uvs, options) = (torn_above_the_square(), WriteOptions::default());
    let mut export = export(scene, &uvs, &options);
    export.stem = Some("my sheet".to_owned());
    let expected = "mtllib my_sheet.mtl\n\
        vt 0 0\nvt 0.5 0\nvt 0.5 0.5\nvt 0 0.5\nvt 0.75 1\nvt 1 0.75\n\
        o a_sheet\n\
        v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 2 0\n\
        vn 0 0 1\n\
        usemtl red___1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n\
        usemtl none\nf 4/5 3/6 5/3\n\
        o a_sheet-2\n\
        v 10 0 0.5\nv 9 0 0.5\nv 9 1 0.5\nv 10 1 0.5\nv 9.5 2 0.5\n\
        vn 0 0 1\n\
        usemtl red___1\nf 6/1/2 9/4/2 8/3/2 7/2/2\n\
        usemtl none\nf 9/5 10/3 8/6\n";
    assert_eq!(text(&export, Format::Obj), expected);
}

#[test]
fn obj_of_one_unnamed_mesh_is_plain() {
    let mut mesh = sheet();
    mesh.name.clear();
    mesh.colors = Some(vec![[0.0, 1.0, 0.001, 0.5]; 5]);
    let (uvs, options) = (torn_within_the_square(), WriteOptions::default());
    let export = export(Scene::of_mesh(mesh), &uvs, &options);
    let expected = "vt 0 0\nvt 0.5 0\nvt 0.5 0.5\nvt 1 1\n\
        v 0 0 0 0 1 0.01292\nv 1 0 0 0 1 0.01292\nv 1 1 0 0 1 0.01292\n\
        v 0 1 0 0 1 0.01292\nv 0.5 2 0 0 1 0.01292\n\
        f 1/1 2/2 3/3\nf 1/4 3/3 4/1\nf 4/1 3/3 5/4\n";
    assert_eq!(text(&export, Format::Obj), expected);
    assert!(export.companions().is_empty());
}

#[test]
fn companions_are_the_textures_and_the_library() {
    let image = |bytes: &[u8]| {
        Some(Image {
            name: String::new(),
            bytes: bytes.into(),
        })
    };
    let shared = image(PNG);
    let material = |name: &str, texture| Material {
        name: name.to_owned(),
        base_color: [0.0, 1.0, 0.001, 0.5],
        texture,
    };
    let scene = Scene {
        materials: vec![
            material("none", shared.clone()),
            material("", image(b"\xff\xd8\xff\xe0")),
            material("a", shared),
            material("a", image(b"RIFF....WEBP")),
        ],
        meshes: vec![sheet()],
        ..Scene::default()
    };
    let (uvs, options) = (torn_above_the_square(), WriteOptions::default());
    let mut export = export(scene, &uvs, &options);
    export.stem = Some("x".to_owned());
    let material = |name: &str| format!("newmtl {name}\nKd 0 1 0.001\nd 0.5\n");
    let library = format!(
        "{}map_Kd x-1.png\n{}map_Kd x-2.jpg\n{}map_Kd x-1.png\n{}",
        material("none"),
        material("material"),
        material("a"),
        material("a-2"),
    );
    let expected = [
        ("x-1.png".to_owned(), PNG.to_vec()),
        ("x-2.jpg".to_owned(), b"\xff\xd8\xff\xe0".to_vec()),
        ("x.mtl".to_owned(), library.into_bytes()),
    ];
    assert_eq!(export.companions(), expected);
}

#[test]
fn off_splits_vertices_and_keeps_polygons() {
    let (uvs, options) = (torn_above_the_square(), WriteOptions::default());
    let scene = Scene {
        meshes: vec![sheet()],
        nodes: vec![at(0, mirrored_and_moved())],
        ..Scene::default()
    };
    let expected = "STOFF\n7 2 0\n10 0 0.5 0 0\n9 0 0.5 0.5 0\n9 1 0.5 0.5 0.5\n10 1 0.5 0 0.5\n\
        9.5 2 0.5 0.5 0.5\n10 1 0.5 0.75 1\n9 1 0.5 1 0.75\n4 0 3 2 1\n3 5 4 6\n";
    assert_eq!(text(&export(scene, &uvs, &options), Format::Off), expected);

    let mut mesh = sheet();
    mesh.polygons = polygons(&[&[3, 2, 4]]);
    mesh.normals = Some(vec![[0.0, 0.0, 1.0], [0.0; 3], [0.0, 1.0, 0.0]]);
    mesh.colors = Some(vec![[1.0, 0.0, 0.0, 0.5]; 5]);
    let map = UvMap::new(vec![[1.0, 0.0]], vec![[0; 3]]).unwrap();
    let uvs = Uvs::Mesh(map);
    let expected = "STCNOFF\n5 1 0\n0 0 0 0 0 0 255 0 0 128 0 0\n1 0 0 0 0 0 255 0 0 128 0 0\n\
        1 1 0 0 0 0 255 0 0 128 1 0\n0 1 0 0 0 1 255 0 0 128 1 0\n\
        0.5 2 0 0 1 0 255 0 0 128 1 0\n3 3 2 4\n";
    let export = export(Scene::of_mesh(mesh), &uvs, &options);
    assert_eq!(text(&export, Format::Off), expected);
}

#[test]
fn ply_has_the_shortest_exact_coordinates_and_long_lists() {
    let (uvs, options) = (torn_above_the_square(), WriteOptions::default());
    let mut mesh = sheet();
    let single = exported(
        &export(Scene::of_mesh(mesh.clone()), &uvs, &options),
        Format::Ply,
    );
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 7\nproperty float x\n\
        property float y\nproperty float z\nproperty float s\nproperty float t\n\
        element face 2\nproperty list uchar uint vertex_indices\nend_header\n";
    assert!(single.starts_with(header.as_bytes()));
    assert_eq!(single.len(), header.len() + 7 * 20 + 17 + 13);
    mesh.positions[0][0] = 0.1;
    mesh.colors = Some(vec![[1.0, 0.0, 1.0, 0.5]; 5]);
    let double = exported(&export(Scene::of_mesh(mesh), &uvs, &options), Format::Ply);
    let header = header
        .replace("float x", "double x")
        .replace("float y", "double y")
        .replace("float z", "double z")
        .replace(
            "float t\n",
            "float t\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
             property uchar alpha\n",
        );
    assert!(double.starts_with(header.as_bytes()));
    let first = &double[header.len()..][..36];
    assert_eq!(first[..8], 0.1_f64.to_le_bytes());
    assert_eq!(first[32..], [255, 0, 255, 128]);

    let corners = 300;
    let disk = Mesh {
        positions: (0..corners).map(|k| [f64::from(k), 0.0, 0.0]).collect(),
        polygons: polygons(&[&(0..corners).collect::<Vec<_>>()]),
        ..Mesh::default()
    };
    let map = UvMap::new(vec![[0.0; 2]], vec![[0; 3]; corners as usize - 2]).unwrap();
    let uvs = Uvs::Mesh(map);
    let disk = exported(&export(Scene::of_mesh(disk), &uvs, &options), Format::Ply);
    let again = Document::from_bytes(Format::Ply, disk).unwrap();
    let Surface::Mesh(mesh) = again.surface() else {
        panic!("a mesh was expected");
    };
    assert_eq!(mesh.triangles().last(), Some(&[0, 298, 299]));
}

#[test]
fn points_in_several_places_have_their_uvs_in_each() {
    let cloud = Mesh {
        positions: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        normals: Some(vec![[0.0, 2.0, 0.0], [1.0, 0.0, 0.0]]),
        colors: Some(vec![[1.0, 0.0, 0.0, 1.0]; 2]),
        ..Mesh::default()
    };
    let scene = Scene {
        meshes: vec![cloud],
        nodes: vec![at(0, IDENTITY), at(0, mirrored_and_moved())],
        ..Scene::default()
    };
    let (uvs, options) = (
        Uvs::Points(vec![[0.0, 1.0], [0.5, 0.25]]),
        WriteOptions::default(),
    );
    let export = export(scene, &uvs, &options);
    let expected = "# x y z nx ny nz r g b u v\n1 2 3 0 1 0 255 0 0 0 1\n\
        4 5 6 1 0 0 255 0 0 0.5 0.25\n9 2 3.5 0 1 0 255 0 0 0 1\n\
        6 5 6.5 -1 0 0 255 0 0 0.5 0.25\n";
    assert_eq!(text(&export, Format::Xyz), expected);
    let expected = "o object\nv 1 2 3 1 0 0\nv 4 5 6 1 0 0\nvt 0 1\nvt 0.5 0.25\nvn 0 2 0\n\
        vn 1 0 0\no object-2\nv 9 2 3.5 1 0 0\nv 6 5 6.5 1 0 0\nvt 0 1\nvt 0.5 0.25\nvn 0 1 0\n\
        vn -1 0 0\n";
    assert_eq!(text(&export, Format::Obj), expected);
    let ply = Document::from_bytes(Format::Ply, exported(&export, Format::Ply)).unwrap();
    let expected = [[0.0, 1.0], [0.5, 0.25], [0.0, 1.0], [0.5, 0.25]];
    assert_eq!(ply.point_uvs(), Some(&expected[..]));
    assert_eq!(ply.surface().positions()[2], [9.0, 2.0, 3.5]);
}

#[test]
fn what_does_not_fit_is_refused() {
    let options = WriteOptions::default();
    let uvs = torn_above_the_square();
    let points = Uvs::Points(vec![[0.0; 2]]);
    let mut far = sheet();
    far.positions[0][0] = 1e300;
    let mut endless = Scene::of_mesh(far.clone());
    endless.nodes[0].transform[0][0] = 1e300;
    let cases = [
        (
            Scene::of_mesh(sheet()),
            Format::Stl,
            &uvs,
            "STL has no place for UVs",
        ),
        (
            Scene::of_mesh(sheet()),
            Format::Xyz,
            &uvs,
            "XYZ has no place for a mesh",
        ),
        (
            Scene::of_mesh(far),
            Format::Glb,
            &uvs,
            "GLB has no place for coordinates beyond single precision",
        ),
        (
            endless,
            Format::Off,
            &uvs,
            "OFF has no place for coordinates that are not finite",
        ),
        (
            Scene::default(),
            Format::Ply,
            &uvs,
            "0 triangles need as many UVs, found 3",
        ),
        (
            Scene::of_mesh(sheet()),
            Format::Ply,
            &points,
            "5 points need as many UVs, found 1",
        ),
    ];
    for (scene, format, uvs, expected) in cases {
        let fault = export(scene, uvs, &options)
            .write(format, &mut Vec::new())
            .unwrap_err();
        assert_eq!(fault.to_string(), expected);
    }
}

/// A GLB file as an independent reader sees it.
struct Glb {
    gltf: Gltf,
}

impl Glb {
    fn of(export: &Export) -> Self {
        let gltf = Gltf::from_slice(&exported(export, Format::Glb)).unwrap();
        Self { gltf }
    }

    fn primitives(&self) -> Vec<::gltf::Primitive<'_>> {
        self.gltf
            .meshes()
            .flat_map(|mesh| mesh.primitives())
            .collect()
    }

    fn reader<'a>(
        &'a self,
        primitive: &'a ::gltf::Primitive<'a>,
    ) -> ::gltf::mesh::Reader<'a, 'a, impl Clone + Fn(::gltf::Buffer<'a>) -> Option<&'a [u8]>> {
        primitive.reader(|_| self.gltf.blob.as_deref())
    }

    /// Position and UV set of every corner of every triangle, with V up again.
    fn corners(&self, primitive: &::gltf::Primitive<'_>, set: u32) -> Vec<([f32; 3], [f32; 2])> {
        let reader = primitive.reader(|_| self.gltf.blob.as_deref());
        let positions: Vec<_> = reader.read_positions().unwrap().collect();
        let uvs: Vec<_> = reader.read_tex_coords(set).unwrap().into_f32().collect();
        let indices = reader.read_indices().unwrap().into_u32();
        indices
            .map(|i| i as usize)
            .map(|i| (positions[i], [uvs[i][0], 1.0 - uvs[i][1]]))
            .collect()
    }
}

#[test]
fn gltf_has_triangles_by_material() {
    let mut mesh = sheet();
    mesh.positions.push([99.0; 3]);
    mesh.materials = vec![Some(0), None];
    mesh.colors = Some(vec![[1.0, 0.0, 0.2, 0.5]; 6]);
    let image = Image {
        name: "wood".to_owned(),
        bytes: PNG.into(),
    };
    let material = Material {
        name: "red".to_owned(),
        base_color: [0.5, 0.25, 7.0, 0.5],
        texture: Some(image),
    };
    let scene = Scene {
        materials: vec![material],
        meshes: vec![mesh],
        nodes: vec![at(0, IDENTITY), at(0, mirrored_and_moved())],
    };
    let uvs = torn_within_the_square();
    let options = WriteOptions {
        uv_set: 2,
        ..WriteOptions::default()
    };
    let glb = Glb::of(&export(scene, &uvs, &options));
    let primitives = glb.primitives();
    let [square, triangle] = primitives.as_slice() else {
        panic!("{} primitives", primitives.len());
    };
    for set in 0..3 {
        let expected = [
            ([0.0, 0.0, 0.0], [0.0, 0.0]),
            ([1.0, 0.0, 0.0], [0.5, 0.0]),
            ([1.0, 1.0, 0.0], [0.5, 0.5]),
            ([0.0, 0.0, 0.0], [1.0, 1.0]),
            ([1.0, 1.0, 0.0], [0.5, 0.5]),
            ([0.0, 1.0, 0.0], [0.0, 0.0]),
        ];
        assert_eq!(glb.corners(square, set), expected);
        let expected = [
            ([0.0, 1.0, 0.0], [0.0, 0.0]),
            ([1.0, 1.0, 0.0], [0.5, 0.5]),
            ([0.5, 2.0, 0.0], [1.0, 1.0]),
        ];
        assert_eq!(glb.corners(triangle, set), expected);
    }
    // The vertex in no face is not there, the one at the seam is there twice.
    assert_eq!(square.get(&::gltf::Semantic::Positions).unwrap().count(), 6);
    assert_eq!(square.bounding_box().max, [1.0, 2.0, 0.0]);
    let reader = glb.reader(square);
    let colors = reader.read_colors(0).unwrap().into_rgba_f32();
    assert!(colors.into_iter().all(|c| c == [1.0, 0.0, 0.2, 0.5]));

    let red = square.material();
    assert_eq!(red.name(), Some("red"));
    assert!(red.double_sided() && triangle.material().double_sided());
    let surface = red.pbr_metallic_roughness();
    assert_eq!(surface.base_color_factor(), [0.5, 0.25, 1.0, 0.5]);
    assert_eq!(surface.metallic_factor(), 0.0);
    assert_eq!(red.alpha_mode(), ::gltf::material::AlphaMode::Blend);
    assert!(triangle.material().index().is_some());
    let texture = surface.base_color_texture().unwrap().texture();
    let ::gltf::image::Source::View { view, mime_type } = texture.source().source() else {
        panic!("the image is not embedded");
    };
    let bytes = &glb.gltf.blob.as_ref().unwrap()[view.offset()..][..view.length()];
    assert_eq!((mime_type, bytes), ("image/png", PNG));

    let nodes: Vec<_> = glb.gltf.default_scene().unwrap().nodes().collect();
    assert_eq!(
        nodes[0].transform().matrix(),
        IDENTITY.map(|c| c.map(|x| x as f32))
    );
    let expected = mirrored_and_moved().map(|c| c.map(|x| x as f32));
    assert_eq!(nodes[1].transform().matrix(), expected);
}

#[test]
fn gltf_normals_are_of_unit_length() {
    let mut mesh = sheet();
    // Beside the known ones, one of the square, and all of a triangle without area.
    mesh.positions[4] = [0.5, 1.0, 0.0];
    let up = [0.0, 0.0, 4.0];
    let none = [0.0; 3];
    mesh.normals = Some(vec![[0.0, 3.0, 4.0], up, none, up, none, none, none]);
    let uvs = Uvs::Mesh(UvMap::new(vec![[0.0; 2]], vec![[0; 3]; 3]).unwrap());
    let options = WriteOptions::default();
    mesh.positions.iter_mut().for_each(|p| p.swap(1, 2));
    let glb = Glb::of(&export(Scene::of_mesh(mesh), &uvs, &options));
    let primitive = &glb.primitives()[0];
    let reader = glb.reader(primitive);
    let normals: Vec<_> = reader.read_normals().unwrap().collect();
    let corners: Vec<_> = reader.read_indices().unwrap().into_u32().collect();
    let of_corners: Vec<_> = corners.iter().map(|&i| normals[i as usize]).collect();
    let (slanted, up, down) = ([0.0, 0.6, 0.8], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]);
    let expected = [slanted, up, down, slanted, down, up, up, up, up];
    assert_eq!(of_corners, expected);
}

#[test]
fn gltf_far_from_the_origin_keeps_its_precision() {
    let origin = [665_187.522_077, 5_648_349.895_035, 241.767_693];
    let mut mesh = sheet();
    for p in &mut mesh.positions {
        *p = fam_surface::vector::add(*p, origin);
    }
    let expected = mesh.positions.clone();
    let (uvs, options) = (torn_above_the_square(), WriteOptions::default());
    let mut export = export(Scene::of_mesh(mesh), &uvs, &options);
    export.seam_lines = vec![[expected[0], expected[4]]];
    let glb = Glb::of(&export);
    let world = |mesh: usize| -> Vec<[f64; 3]> {
        let node = glb.gltf.nodes().nth(mesh).unwrap();
        let (translation, _, _) = node.transform().decomposed();
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let positions = glb.reader(&primitive).read_positions().unwrap();
        let moved =
            positions.map(|p| std::array::from_fn(|c| f64::from(p[c]) + f64::from(translation[c])));
        moved.collect()
    };
    let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-6);
    // The seam is at vertices 3 and 2.
    for (p, vertex) in std::iter::zip(world(0), [0, 1, 2, 3, 3, 2, 4]) {
        assert!(close(p, expected[vertex]), "{p:?} {expected:?}");
    }
    let ends = world(1);
    assert!(
        close(ends[0], expected[0]) && close(ends[1], expected[4]),
        "{ends:?}"
    );
}

#[test]
fn gltf_clouds_are_points() {
    let cloud = Mesh {
        positions: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        normals: Some(vec![[0.0, 2.0, 0.0], [0.0; 3]]),
        colors: Some(vec![[0.123, 1.5, 0.0, 1.0], [f32::NAN, -1.0, 0.0, 1.0]]),
        ..Mesh::default()
    };
    let uvs = Uvs::Points(vec![[0.0, 1.0], [0.5, 0.25]]);
    let options = WriteOptions {
        checker: true,
        ..WriteOptions::default()
    };
    let glb = Glb::of(&export(Scene::of_mesh(cloud), &uvs, &options));
    let primitive = &glb.primitives()[0];
    assert_eq!(primitive.mode(), Mode::Points);
    let reader = glb.reader(primitive);
    let normals: Vec<_> = reader.read_normals().unwrap().collect();
    assert_eq!(normals, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let uvs: Vec<_> = reader.read_tex_coords(0).unwrap().into_f32().collect();
    assert_eq!(uvs, [[0.0, 0.0], [0.5, 0.75]]);
    let colors: Vec<_> = reader.read_colors(0).unwrap().into_rgba_f32().collect();
    assert_eq!(colors, [[0.123, 1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]);
}
