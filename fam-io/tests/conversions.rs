//! A file of one format written as another says the same, as far as that format can.

mod common;
#[path = "common/ply.rs"]
mod foreign_ply;

use std::fs;

use common::Folder;
use fam_io::{Document, Format, Uvs, WriteFault, WriteOptions, read_surface};
use fam_surface::{Surface, TriangleMesh, UvMap, shapes};
use proptest::collection::vec;
use proptest::prelude::*;

/// The formats that meshes are read from, and written to and read again.
const MESHES: [Format; 5] = [
    Format::Glb,
    Format::Gltf,
    Format::Obj,
    Format::Off,
    Format::Ply,
];
/// The formats that point clouds are read from, and written to and read again.
const CLOUDS: [Format; 6] = [
    Format::Glb,
    Format::Gltf,
    Format::Obj,
    Format::Off,
    Format::Ply,
    Format::Xyz,
];

const MATERIALS: [&str; 3] = ["red", "shiny-1", "wood.002"];

/// A mesh, or a cloud if there are no faces.
#[derive(Debug, Clone)]
struct Model {
    vertices: Vec<Vertex>,
    faces: Vec<Face>,
}

#[derive(Debug, Clone)]
struct Vertex {
    position: [f64; 3],
    normal: [f64; 3],
    color: [u8; 3],
    /// Of a cloud.
    uv: [f32; 2],
}

#[derive(Debug, Clone)]
struct Face {
    /// An OBJ file starts an object before it.
    starts_object: bool,
    material: Option<usize>,
    corners: Vec<u32>,
    /// One for each corner, or three for each triangle of the fan if a seam crosses it.
    uvs: Vec<[f32; 2]>,
}

impl Face {
    fn is_torn(&self) -> bool {
        self.uvs.len() > self.corners.len()
    }

    fn uv_triangles(&self) -> Vec<[[f32; 2]; 3]> {
        if self.is_torn() {
            self.uvs.as_chunks().0.to_vec()
        } else {
            let pairs = self.uvs.windows(2).skip(1);
            pairs.map(|pair| [self.uvs[0], pair[0], pair[1]]).collect()
        }
    }
}

impl Model {
    fn uvs(&self) -> Uvs {
        if self.faces.is_empty() {
            return Uvs::Points(self.vertices.iter().map(|vertex| vertex.uv).collect());
        }
        let triangles = self.faces.iter().flat_map(Face::uv_triangles);
        let uvs: Vec<_> = triangles.flatten().collect();
        let triangles = (0..uvs.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Uvs::Mesh(UvMap::new(uvs, triangles.collect()).unwrap())
    }

    /// The file, with objects and materials if the format has them.
    fn document(&self, format: Format) -> Document {
        let file = match format {
            Format::Off => self.off().into_bytes(),
            Format::Ply => self.ply().into_bytes(),
            Format::Xyz => self.xyz().into_bytes(),
            Format::Obj => self.obj().into_bytes(),
            _ => written(&self.document(Format::Obj), &self.uvs(), format),
        };
        Document::from_bytes(format, file).unwrap()
    }

    fn obj(&self) -> String {
        let mut text = String::new();
        for vertex in &self.vertices {
            let color = vertex.color.map(|c| f64::from(c) / 255.0);
            text += &format!("v {} {}\n", words(vertex.position), words(color));
            text += &format!("vn {}\n", words(vertex.normal));
        }
        let mut material = None;
        for (number, face) in self.faces.iter().enumerate() {
            if face.starts_object {
                text += &format!("o object{number}\n");
            }
            if material != face.material {
                material = face.material;
                text += &format!("usemtl {}\n", MATERIALS[material.unwrap()]);
            }
            let corners = face.corners.iter().map(|v| format!(" {0}//{0}", v + 1));
            text += &format!("f{}\n", corners.collect::<String>());
        }
        text
    }

    fn off(&self) -> String {
        let mut text = format!("CNOFF\n{} {} 0\n", self.vertices.len(), self.faces.len());
        for vertex in &self.vertices {
            let [position, normal] = [vertex.position, vertex.normal].map(words);
            text += &format!("{position} {normal} {} 255\n", words(vertex.color));
        }
        text + &self.counted_faces()
    }

    fn ply(&self) -> String {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
             property double nx\nproperty double ny\nproperty double nz\nelement face {}\n\
             property list uchar int vertex_indices\nend_header\n",
            self.vertices.len(),
            self.faces.len()
        );
        for vertex in &self.vertices {
            let [position, normal] = [vertex.position, vertex.normal].map(words);
            text += &format!("{position} {} {normal}\n", words(vertex.color));
        }
        text + &self.counted_faces()
    }

    fn counted_faces(&self) -> String {
        let faces = self.faces.iter().map(|face| {
            let corners: Vec<_> = face.corners.iter().map(u32::to_string).collect();
            format!("{} {}\n", corners.len(), corners.join(" "))
        });
        faces.collect()
    }

    fn xyz(&self) -> String {
        let lines = self.vertices.iter().map(|vertex| {
            let [position, normal] = [vertex.position, vertex.normal].map(words);
            format!("{position} {normal} {}\n", words(vertex.color))
        });
        lines.collect()
    }

    /// What a file of a format says of each corner of each triangle, or of each point.
    fn corners(&self) -> Vec<Corner> {
        if self.faces.is_empty() {
            return self.vertices.iter().map(|v| v.corner(v.uv)).collect();
        }
        let triangles = self.faces.iter().flat_map(|face| {
            let pairs = face.corners.windows(2).skip(1);
            let triangles = pairs.map(|pair| [face.corners[0], pair[0], pair[1]]);
            triangles.zip(face.uv_triangles())
        });
        let corners = triangles.flat_map(|(vertices, uvs)| std::iter::zip(vertices, uvs));
        corners
            .map(|(vertex, uv)| self.vertices[vertex as usize].corner(uv))
            .collect()
    }

    /// How many faces a format has that keeps polygons.
    fn face_count(&self) -> usize {
        let pieces = |face: &Face| {
            if face.is_torn() {
                face.corners.len() - 2
            } else {
                1
            }
        };
        self.faces.iter().map(pieces).sum()
    }

    /// The object of every triangle; empty if there is only one.
    fn objects(&self) -> Vec<u32> {
        let mut object = 0;
        let mut objects = Vec::new();
        for (number, face) in self.faces.iter().enumerate() {
            object += u32::from(number > 0 && face.starts_object);
            objects.extend(vec![object; face.corners.len() - 2]);
        }
        if object == 0 { Vec::new() } else { objects }
    }

    /// The material of every triangle.
    fn materials(&self) -> Vec<Option<&str>> {
        let of_face = |face: &Face| {
            let name = face.material.map(|at| MATERIALS[at]);
            std::iter::repeat_n(name, face.corners.len() - 2)
        };
        self.faces.iter().flat_map(of_face).collect()
    }
}

impl Vertex {
    fn corner(&self, uv: [f32; 2]) -> Corner {
        Corner {
            position: self.position,
            normal: self.normal,
            color: self.color,
            uv,
        }
    }
}

fn words<T: ToString>(numbers: [T; 3]) -> String {
    numbers.map(|number| number.to_string()).join(" ")
}

#[derive(Debug, Clone)]
struct Corner {
    position: [f64; 3],
    normal: [f64; 3],
    color: [u8; 3],
    uv: [f32; 2],
}

/// The corners of a document. Its colours are those that it has as an OFF file.
fn corners(document: &Document) -> Vec<Corner> {
    let (indices, normals, uvs) = match document.surface() {
        Surface::Mesh(mesh) => (
            mesh.triangles().as_flattened().to_vec(),
            mesh.normals().unwrap(),
            uvs_of_corners(mesh, document.uv_map().unwrap()),
        ),
        Surface::PointCloud(cloud) => (
            (0..cloud.points().len() as u32).collect(),
            cloud.normals().unwrap(),
            document.point_uvs().unwrap().to_vec(),
        ),
    };
    let colors = colors(document);
    let positions = document.surface().positions();
    let each = indices.iter().zip(uvs).zip(colors);
    each.map(|((&vertex, uv), color)| Corner {
        position: positions[vertex as usize],
        normal: normals[vertex as usize],
        color,
        uv,
    })
    .collect()
}

fn uvs_of_corners(mesh: &TriangleMesh, uvs: &UvMap) -> Vec<[f32; 2]> {
    assert_eq!(mesh.triangles().len(), uvs.triangles().len());
    (0..uvs.triangles().len())
        .flat_map(|triangle| uvs.corners(triangle))
        .collect()
}

/// The colour of each corner of each triangle, or of each point.
fn colors(document: &Document) -> Vec<[u8; 3]> {
    let uvs = match document.uv_map() {
        Some(map) => Uvs::Mesh(map.clone()),
        None => Uvs::Points(document.point_uvs().unwrap().to_vec()),
    };
    let text = String::from_utf8(written(document, &uvs, Format::Off)).unwrap();
    let mut lines = text.lines();
    let keyword = lines.next().unwrap();
    assert!(keyword == "STCNOFF", "{keyword}");
    let counts: Vec<usize> = numbers(lines.next().unwrap());
    let vertices = lines.by_ref().take(counts[0]);
    let colors: Vec<[u8; 3]> = vertices
        .map(|line| {
            let columns: Vec<f64> = numbers(line);
            [6, 7, 8].map(|at| columns[at] as u8)
        })
        .collect();
    if counts[1] == 0 {
        return colors;
    }
    let corners = lines.flat_map(|line| {
        let face: Vec<usize> = numbers(line);
        let corners = face[1..].to_vec();
        (2..corners.len()).flat_map(move |at| [corners[0], corners[at - 1], corners[at]])
    });
    corners.map(|vertex| colors[vertex]).collect()
}

fn numbers<T: std::str::FromStr>(line: &str) -> Vec<T> {
    let words = line.split_whitespace();
    words.filter_map(|word| word.parse().ok()).collect()
}

fn written(document: &Document, uvs: &Uvs, format: Format) -> Vec<u8> {
    let mut out = Vec::new();
    let options = WriteOptions::default();
    document.write_to(uvs, format, &options, &mut out).unwrap();
    out
}

/// How many faces a file has; nothing for a format without polygons.
fn faces_in(format: Format, file: &[u8]) -> Option<usize> {
    let text = String::from_utf8_lossy(file);
    match format {
        Format::Obj => Some(text.lines().filter(|line| line.starts_with("f ")).count()),
        Format::Off => numbers(text.lines().nth(1)?).get(1).copied(),
        Format::Ply => {
            let count = |line: &str| line.strip_prefix("element face ")?.parse().ok();
            text.lines().find_map(count)
        }
        _ => None,
    }
}

fn is_gltf(format: Format) -> bool {
    matches!(format, Format::Glb | Format::Gltf)
}

fn same_corners(found: &[Corner], expected: &[Corner], tolerances: [f64; 2]) {
    let [of_positions, of_uvs] = tolerances;
    let close = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance;
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let same = (0..3).all(|c| {
            close(found.position[c], expected.position[c], of_positions)
                && close(found.normal[c], expected.normal[c], 1e-6)
                && found.color[c].abs_diff(expected.color[c]) <= 1
        });
        let same_uv = (0..2).all(|c| close(found.uv[c].into(), expected.uv[c].into(), of_uvs));
        assert!(same && same_uv, "{found:?} is not {expected:?}");
    }
}

fn check(model: &Model, formats: &[Format]) {
    let uvs = model.uvs();
    let expected = model.corners();
    for &input in formats {
        let document = model.document(input);
        for &output in formats {
            println!("{input} to {output}");
            let file = written(&document, &uvs, output);
            let again = Document::from_bytes(output, file.clone()).unwrap();
            // Single precision, and V that is turned round twice.
            let tolerances = if is_gltf(input) || is_gltf(output) {
                [2e-6, 2e-7]
            } else {
                [0.0; 2]
            };
            same_corners(&corners(&again), &expected, tolerances);
            if let Some(faces) = faces_in(output, &file)
                && !is_gltf(input)
            {
                assert_eq!(faces, model.face_count());
            }
            if output == Format::Ply {
                foreign_ply::check(&file, &again);
            }
            let has_materials = |format| format == Format::Obj || is_gltf(format);
            if has_materials(input) && has_materials(output) {
                let expected = model.materials();
                assert_eq!(materials(&again, expected.len()), expected);
                // Objects of an OBJ file that share vertices count as one.
                if (input, output) != (Format::Obj, Format::Obj) {
                    assert_eq!(again.labels().objects, model.objects());
                }
            }
        }
    }
}

/// The material of every triangle, if it is one of the model: from glTF on, a face without one
/// has one of its own.
fn materials(document: &Document, triangles: usize) -> Vec<Option<&str>> {
    let labels = document.labels();
    let name = |at: u32| &*labels.material_names[at as usize];
    let of_triangle = |triangle: usize| {
        let material = labels.materials.get(triangle).copied().flatten();
        material.map(name).filter(|name| MATERIALS.contains(name))
    };
    (0..triangles).map(of_triangle).collect()
}

fn uv() -> impl Strategy<Value = [f32; 2]> {
    // Multiples of 2⁻²⁰, so that different ones stay different where V points down.
    let number = || (-100_000..1_200_000).prop_map(|n| n as f32 / 1_048_576.0);
    [number(), number()]
}

/// Not far from the corner of this number of a regular polygon, so that faces are convex and
/// become fans.
fn place(number: usize, offset: [f64; 3]) -> [f64; 3] {
    let (y, x) = (number as f64 * std::f64::consts::TAU / 12.0).sin_cos();
    let [dx, dy, dz] = offset.map(|c| c / 100.0);
    [10.0 * x + dx, 10.0 * y + dy, dz]
}

fn vertex() -> impl Strategy<Value = Vertex> {
    let offset = [-700..700, -700..700, -700..700].prop_map(|p| p.map(|c| f64::from(c) / 70.0));
    let direction = [-9..9, -9..9, 1..9].prop_map(|n| n.map(f64::from));
    let color = [any::<u8>(), any::<u8>(), any::<u8>()];
    (offset, direction, color, uv()).prop_map(move |(p, n, color, uv)| Vertex {
        position: p,
        normal: n.map(|c| c / n.iter().map(|c| c * c).sum::<f64>().sqrt()),
        color,
        uv,
    })
}

fn vertices(least: usize) -> impl Strategy<Value = Vec<Vertex>> {
    let origins = vec![[0.0; 3], [665_187.522_077, 5_648_349.895_035, 241.767_693]];
    prop::sample::select(origins)
        .prop_flat_map(move |origin| (Just(origin), vec(vertex(), least..12)))
        .prop_map(|(origin, mut vertices)| {
            for (number, vertex) in vertices.iter_mut().enumerate() {
                let place = place(number, vertex.position);
                vertex.position = std::array::from_fn(|c| origin[c] + place[c]);
            }
            // At least one colour that can be told from numbers between 0 and 1.
            vertices[0].color[0] = 200;
            vertices
        })
}

fn face(vertices: usize) -> impl Strategy<Value = Face> {
    let all: Vec<u32> = (0..vertices as u32).collect();
    let corners = prop::sample::subsequence(all, 3..=vertices.min(6));
    let corners = (corners, 0..3_usize, any::<bool>()).prop_map(|(mut corners, first, turned)| {
        corners.rotate_left(first);
        if turned {
            corners.reverse();
        }
        corners
    });
    let material = prop::option::of(0..MATERIALS.len());
    (any::<bool>(), material, corners, any::<bool>()).prop_flat_map(
        |(starts_object, material, corners, torn)| {
            let triangles = corners.len() - 2;
            let torn = torn && triangles > 1;
            let count = if torn { 3 * triangles } else { corners.len() };
            vec(uv(), count).prop_map(move |uvs| Face {
                starts_object,
                material,
                corners: corners.clone(),
                uvs,
            })
        },
    )
}

fn mesh() -> impl Strategy<Value = Model> {
    vertices(3).prop_flat_map(|vertices| {
        vec(face(vertices.len()), 1..8).prop_map(move |mut faces| {
            // Faces of one material are together, as glTF has them.
            faces.sort_by_key(|face| face.material);
            Model {
                vertices: vertices.clone(),
                faces,
            }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn meshes_stay_the_same_in_every_format(model in mesh()) {
        check(&model, &MESHES);
    }

    #[test]
    fn clouds_stay_the_same_in_every_format(vertices in vertices(1)) {
        check(&Model { vertices, faces: Vec::new() }, &CLOUDS);
    }
}

#[test]
fn surfaces_from_no_file_and_from_stl_are_written_as_every_format() {
    let torus = shapes::torus(1.0, 0.4, 8, 6);
    let flat = torus.positions().iter().map(|p| [p[0] as f32, p[1] as f32]);
    let uvs = UvMap::new(flat.collect(), torus.triangles().to_vec()).unwrap();
    let document = Document::of_surface(Surface::Mesh(torus.clone()));
    assert_eq!(document.format(), Format::Obj);
    assert!(document.uv_map().is_none());

    let facet = |t: usize| {
        let vertices = torus.corners(t).map(|p| format!("vertex {}\n", words(p)));
        let vertices = vertices.concat();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let facets: String = (0..torus.triangles().len()).map(facet).collect();
    let stl = format!("solid torus\n{facets}endsolid torus\n");
    let stl = Document::from_bytes(Format::Stl, stl.into_bytes()).unwrap();

    let corners: Vec<_> = (0..torus.triangles().len())
        .flat_map(|t| torus.corners(t))
        .collect();
    let flat = uvs_of_corners(&torus, &uvs);
    let uvs = Uvs::Mesh(uvs);
    for document in [document, stl] {
        for output in MESHES {
            let again = Document::from_bytes(output, written(&document, &uvs, output)).unwrap();
            let Surface::Mesh(mesh) = again.surface() else {
                panic!("a mesh was expected");
            };
            let found = (0..mesh.triangles().len()).flat_map(|t| mesh.corners(t));
            for (found, expected) in std::iter::zip(found, &corners) {
                let close = (0..3).all(|c| (found[c] - expected[c]).abs() < 2e-7);
                assert!(close, "{output}: {found:?} is not {expected:?}");
            }
            let found = uvs_of_corners(mesh, again.uv_map().unwrap());
            assert_eq!(found.len(), flat.len());
            for (found, expected) in std::iter::zip(found, &flat) {
                let close = (0..2).all(|c| (found[c] - expected[c]).abs() < 2e-7);
                assert!(close, "{output}: {found:?} is not {expected:?}");
            }
        }
        let mut out = Vec::new();
        let refused = document.write_to(&uvs, Format::Stl, &WriteOptions::default(), &mut out);
        assert!(matches!(
            refused,
            Err(WriteFault::NoPlaceForUvs(Format::Stl))
        ));
    }
}

#[test]
fn obj_files_of_other_formats_have_their_materials_beside_them() {
    let folder = Folder::new();
    let png = b"\x89PNG\r\n\x1a\n and pixels";
    folder.file("wood.png", png);
    folder.file(
        "a.mtl",
        "newmtl red\nKd 0.25 0.5 1\nd 0.5\nmap_Kd wood.png\n",
    );
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    let document = folder.read("a.obj", obj);
    let uvs = UvMap::new(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], vec![[0, 1, 2]]).unwrap();
    let options = WriteOptions::default();
    let glb = folder.path("b.glb");
    document.write_mesh_uvs(&uvs, &glb, &options).unwrap();
    let document = read_surface(&glb).unwrap();

    let two = UvMap::new(vec![[0.0; 2]], vec![[0; 3]; 2]).unwrap();
    let out = folder.path("out.obj");
    document.write_mesh_uvs(&two, &out, &options).unwrap_err();
    assert!(!folder.path("out.mtl").exists(), "written although refused");

    document.write_mesh_uvs(&uvs, &out, &options).unwrap();
    assert_eq!(fs::read(folder.path("out-1.png")).unwrap(), png);
    assert_eq!(
        fs::read_to_string(folder.path("out.mtl")).unwrap(),
        "newmtl red\nKd 0.25 0.5 1\nd 0.5\nmap_Kd out-1.png\n"
    );
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.starts_with("mtllib out.mtl\n"), "{written}");
    let again = read_surface(&out).unwrap();
    assert_eq!(materials(&again, 1), [Some("red")]);
    let in_memory = self::written(&document, &Uvs::Mesh(uvs), Format::Obj);
    assert!(!String::from_utf8(in_memory).unwrap().contains("mtllib"));
}

#[test]
fn objects_of_an_obj_file_are_meshes_in_gltf() {
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 6 1 0\n\
                f 2 3 4\no house\nf 5 6 8 7\no roof\nf 7 6 5\no house\nf 2 4 3\n";
    let document = Document::from_bytes(Format::Obj, text.into()).unwrap();
    let uvs = vec![[0.0, 0.0], [0.5, 0.0], [0.25, 0.75]];
    let mut triangles = vec![[0, 1, 2]; 5];
    // No seam crosses the square.
    triangles[2] = [0, 2, 1];
    let uvs = Uvs::Mesh(UvMap::new(uvs, triangles).unwrap());
    let glb = written(&document, &uvs, Format::Glb);
    let document = Document::from_bytes(Format::Glb, glb).unwrap();
    assert_eq!(document.labels().objects, [0, 1, 1, 2, 3]);
    let uvs = Uvs::Mesh(document.uv_map().unwrap().clone());
    let obj = String::from_utf8(written(&document, &uvs, Format::Obj)).unwrap();
    let lines = |keywords: &[&str]| -> Vec<&str> {
        let is_one = |line: &&str| keywords.contains(&line.split(' ').next().unwrap());
        obj.lines().filter(is_one).collect()
    };
    assert_eq!(
        lines(&["o", "v"]),
        [
            "o object",
            "v 0 0 0",
            "v 1 0 0",
            "v 0 1 0",
            "o house",
            "v 5 0 0",
            "v 6 0 0",
            "v 6 1 0",
            "v 5 1 0",
            "o roof",
            "v 5 1 0",
            "v 6 0 0",
            "v 5 0 0",
            "o house-2",
            "v 0 0 0",
            "v 0 1 0",
            "v 1 0 0",
        ]
    );
    let again = Document::from_bytes(Format::Obj, obj.clone().into()).unwrap();
    assert_eq!(again.labels().objects, document.labels().objects);

    // In a format without objects, vertices stay shared.
    let uvs = Uvs::Mesh(UvMap::new(vec![[0.5; 2]], vec![[0; 3]; 5]).unwrap());
    let document = Document::from_bytes(Format::Obj, text.into()).unwrap();
    let off = String::from_utf8(written(&document, &uvs, Format::Off)).unwrap();
    assert!(
        off.starts_with("STOFF\n8 4 0\n9 9 9 0 0\n0 0 0 0.5 0.5\n"),
        "{off}"
    );
}
