//! OBJ files of many dialects, made up at random, come back as they were but for their UVs.

mod common;
#[path = "obj/single_files.rs"]
mod single_files;

use std::collections::HashMap;
use std::fs;

use common::Folder;
use fam_io::{Document, Format, Labels, Uvs, WriteOptions, read_surface};
use fam_surface::{Surface, TriangleMesh, UvMap};
use proptest::collection::vec;
use proptest::prelude::*;

/// A file: its statements and how they are written.
#[derive(Debug, Clone)]
struct File {
    statements: Vec<Statement>,
    line_end: &'static str,
    has_mark: bool,
    ends_with_line_end: bool,
}

#[derive(Debug, Clone)]
struct Statement {
    content: Content,
    /// What is between words; there may be fewer than words.
    blanks: Vec<&'static str>,
    tail: &'static str,
}

#[derive(Debug, Clone)]
enum Content {
    Vertex([Number; 3], Vec<Number>),
    Uv(Vec<Number>),
    Normal([Number; 3]),
    Face(&'static str, Vec<Corner>),
    Line(Vec<Corner>),
    Name(&'static str, &'static [u8]),
    Other(&'static [u8]),
}

#[derive(Debug, Clone)]
struct Number {
    value: f64,
    style: u8,
}

impl Number {
    fn text(&self) -> String {
        let value = self.value;
        match self.style {
            0 => format!("{value:e}"),
            1 => format!("{value:E}"),
            2 if value.is_sign_positive() => format!("+{value}"),
            3 if value.fract() == 0.0 => format!("{value}."),
            4 => format!("{value}").replacen("0.", ".", usize::from(value.abs() < 1.0)),
            _ => format!("{value}"),
        }
    }
}

/// What a corner refers to: entries of the three tables by any number, counted from the start
/// or, if negative, from where the face is.
#[derive(Debug, Clone)]
struct Corner {
    vertex: Reference,
    uv: Option<Reference>,
    normal: Option<Reference>,
    trailing: usize,
}

#[derive(Debug, Clone)]
struct Reference {
    any: usize,
    is_negative: bool,
}

impl Reference {
    /// The entry and how it is written.
    fn resolve(&self, seen: usize, count: usize) -> (usize, String) {
        if self.is_negative && seen > 0 {
            let back = self.any % seen + 1;
            (seen - back, format!("-{back}"))
        } else {
            let entry = self.any % count;
            (entry, (entry + 1).to_string())
        }
    }
}

fn number() -> impl Strategy<Value = Number> {
    let value = prop_oneof![
        (-2000i32..2000).prop_map(|n| f64::from(n) / 1000.0),
        (-9i32..9).prop_map(f64::from),
        -1e9..1e9,
        -1e-9..1e-9,
    ];
    (value, 0u8..6).prop_map(|(value, style)| Number { value, style })
}

fn reference() -> impl Strategy<Value = Reference> {
    (0usize..1000, any::<bool>()).prop_map(|(any, is_negative)| Reference { any, is_negative })
}

fn corner() -> impl Strategy<Value = Corner> {
    let some = || prop::option::weighted(0.7, reference());
    (reference(), some(), some(), 0usize..3).prop_map(|(vertex, uv, normal, trailing)| Corner {
        vertex,
        uv,
        normal,
        trailing,
    })
}

/// Statements that everybody reads, or those of the dialects too.
fn content(is_plain: bool) -> impl Strategy<Value = Content> {
    let weight = (1i32..9, 0u8..6).prop_map(|(n, style)| Number {
        value: f64::from(n) / 4.0,
        style,
    });
    let extra = if is_plain {
        Just(Vec::new()).boxed()
    } else {
        prop_oneof![
            3 => Just(Vec::new()),
            1 => weight.prop_map(|w| vec![w]),
            1 => vec(number(), 3..6),
        ]
        .boxed()
    };
    let uvs = if is_plain { 2..3 } else { 1..4 };
    let corners = if is_plain { 3..9 } else { 1..9 };
    // For `tobj`, a line of more corners is a face.
    let line = if is_plain { 2..3 } else { 2..5 };
    let keywords: &[&str] = if is_plain {
        &["f"]
    } else {
        &["f", "f", "f", "fo"]
    };
    let names: &[(&str, &[u8])] = &[
        ("o", b"a"),
        ("o", b"f 1 2 3"),
        ("g", b"v 1 2"),
        ("usemtl", b"red"),
        ("usemtl", b"two words"),
        ("o", b""),
        ("o", b"a#1"),
        ("o", b"#2 \xe4"),
        ("usemtl", b"\xe4\0"),
        ("usemtl", b""),
    ];
    let names = if is_plain { &names[..5] } else { names };
    let others: &[&[u8]] = &[
        b"",
        b"# v 1 2 3",
        b"s off",
        b"mtllib none.mtl",
        b"vp 0.5 0.5",
        b"# \xff \\",
        b"F 1 2 3",
        b"call x.obj \xe9 \0",
        b"   \t",
    ];
    let others = if is_plain { &others[..5] } else { others };
    prop_oneof![
        // On one line, so that faces have no area and become fans.
        8 => (number(), number(), number(), extra).prop_map(|(x, mut y, mut z, more)| {
            (y.value, z.value) = (-x.value, 2.0 * x.value);
            Content::Vertex([x, y, z], more)
        }),
        3 => vec(number(), uvs).prop_map(Content::Uv),
        3 => (number(), number(), number()).prop_map(|(x, y, z)| Content::Normal([x, y, z])),
        6 => (prop::sample::select(keywords), vec(corner(), corners))
            .prop_map(|(keyword, corners)| Content::Face(keyword, corners)),
        1 => vec(corner(), line).prop_map(Content::Line),
        2 => prop::sample::select(names).prop_map(|(keyword, name)| Content::Name(keyword, name)),
        1 => prop::sample::select(others).prop_map(Content::Other),
    ]
}

fn statement(is_plain: bool) -> impl Strategy<Value = Statement> {
    let blanks: &[&str] = &[" ", " ", "  ", "\t", "\\"];
    let tails: &[&str] = &["", "", " ", " # f 1 2 3", "# x", "\t#\\"];
    let known = |all: &'static [&'static str], plain| if is_plain { &all[..plain] } else { all };
    let blanks = vec(prop::sample::select(known(blanks, 4)), 0..9);
    let tail = prop::sample::select(known(tails, 3));
    (content(is_plain), blanks, tail).prop_map(|(content, blanks, tail)| Statement {
        content,
        blanks,
        tail,
    })
}

fn file(is_plain: bool) -> impl Strategy<Value = File> {
    let line_ends: &[&str] = &["\n", "\r\n", "\r"];
    let line_ends = if is_plain { &line_ends[..2] } else { line_ends };
    let form = (
        prop::sample::select(line_ends),
        any::<bool>(),
        any::<bool>(),
    );
    (vec(statement(is_plain), 1..40), form).prop_map(move |(mut statements, form)| {
        let number = |value| Number { value, style: 9 };
        let vertex = Content::Vertex([0.5, -0.5, 1.0].map(number), Vec::new());
        statements.push(Statement {
            content: vertex,
            blanks: Vec::new(),
            tail: "",
        });
        if is_plain {
            statements.sort_by_key(|statement| match statement.content {
                Content::Vertex(..) | Content::Uv(_) | Content::Normal(_) => 0,
                _ => 1,
            });
        }
        File {
            statements,
            line_end: form.0,
            has_mark: form.1 && !is_plain,
            ends_with_line_end: form.2,
        }
    })
}

/// What is in a file.
#[derive(Debug, Default)]
struct Expected {
    positions: Vec<[f64; 3]>,
    uvs: Vec<[f32; 2]>,
    /// Vertices and UVs of the faces.
    faces: Vec<Vec<(usize, Option<usize>)>>,
    labels: Labels,
}

impl File {
    fn counts(&self) -> [usize; 3] {
        let count = |is: fn(&Content) -> bool| {
            let statements = self.statements.iter();
            statements
                .filter(|statement| is(&statement.content))
                .count()
        };
        [
            count(|content| matches!(content, Content::Vertex(..))),
            count(|content| matches!(content, Content::Uv(_))),
            count(|content| matches!(content, Content::Normal(_))),
        ]
    }

    fn expected(&self) -> Expected {
        let mut expected = Expected::default();
        let counts = self.counts();
        let mut names: [HashMap<Vec<u8>, u32>; 2] = Default::default();
        let mut current: [Option<&[u8]>; 2] = [Some(b""), None];
        let mut labels: [Vec<Option<u32>>; 2] = Default::default();
        for statement in &self.statements {
            let seen = [expected.positions.len(), expected.uvs.len()];
            match &statement.content {
                Content::Vertex(position, more) => {
                    let weight = if more.len() == 1 { more[0].value } else { 1.0 };
                    expected
                        .positions
                        .push([0, 1, 2].map(|axis| position[axis].value / weight));
                }
                Content::Uv(uv) => expected.uvs.push([
                    uv[0].value as f32,
                    uv.get(1).map_or(0.0, |v| v.value as f32),
                ]),
                Content::Face(_, corners) if corners.len() >= 3 => {
                    for (kind, labels) in labels.iter_mut().enumerate() {
                        let next = names[kind].len() as u32;
                        let index = current[kind].map(|name| {
                            *names[kind].entry(name.to_vec()).or_insert_with(|| {
                                let latin = name.iter().map(|&byte| char::from(byte)).collect();
                                match kind {
                                    0 => expected.labels.object_names.push(latin),
                                    _ => expected.labels.material_names.push(latin),
                                }
                                next
                            })
                        });
                        labels.extend(vec![index; corners.len() - 2]);
                    }
                    let corners = corners.iter().map(|corner| {
                        let uv = corner.uv.as_ref().filter(|_| counts[1] > 0);
                        (
                            corner.vertex.resolve(seen[0], counts[0]).0,
                            uv.map(|uv| uv.resolve(seen[1], counts[1]).0),
                        )
                    });
                    expected.faces.push(corners.collect());
                }
                Content::Name("o", name) => current[0] = Some(name),
                Content::Name("usemtl", name) => {
                    current[1] = Some(*name).filter(|name| !name.is_empty());
                }
                _ => {}
            }
        }
        let [objects, materials] = labels;
        let mut objects: Vec<u32> = objects.into_iter().flatten().collect();
        if names[0].len() > 1 {
            expected.labels.named_objects = objects.clone();
        }
        unite_at_vertices(&mut objects, &expected.faces);
        if objects.iter().any(|&object| object != objects[0]) {
            expected.labels.objects = objects;
        }
        if !names[1].is_empty() {
            expected.labels.materials = materials;
        }
        expected
    }

    /// The text of the file or, with UVs, what it should become.
    fn text(&self, new: Option<&UvMap>) -> Vec<u8> {
        let counts = self.counts();
        let mut text = Vec::new();
        if self.has_mark {
            text.extend(b"\xef\xbb\xbf");
        }
        let mut seen = [0; 3];
        let mut triangles = new.map_or(&[][..], UvMap::triangles);
        let mut are_uvs_due = new.is_some();
        for (number, statement) in self.statements.iter().enumerate() {
            let is_last = number + 1 == self.statements.len();
            let end = if is_last && !self.ends_with_line_end {
                ""
            } else {
                self.line_end
            };
            let written = |corner: &Corner, uv: Option<u32>| {
                let part = |reference: &Option<Reference>, table: usize| match reference {
                    Some(reference) if counts[table] > 0 => {
                        reference.resolve(seen[table], counts[table]).1
                    }
                    _ => String::new(),
                };
                let vertex = corner.vertex.resolve(seen[0], counts[0]).1;
                let uv = match uv {
                    Some(uv) => (uv + 1).to_string(),
                    None if new.is_some() => String::new(),
                    None => part(&corner.uv, 1),
                };
                let normal = part(&corner.normal, 2);
                match (uv.is_empty(), normal.is_empty(), new) {
                    (true, true, None) => vertex + &"/".repeat(corner.trailing),
                    (true, true, _) => vertex,
                    (false, true, None) => {
                        format!("{vertex}/{uv}{}", ["", "/"][corner.trailing % 2])
                    }
                    (false, true, _) => format!("{vertex}/{uv}"),
                    _ => format!("{vertex}/{uv}/{normal}"),
                }
            };
            let numbers = |numbers: &[Number]| numbers.iter().map(Number::text).collect();
            let (keyword, words): (&str, Vec<String>) = match &statement.content {
                Content::Vertex(position, more) => {
                    seen[0] += 1;
                    ("v", [numbers(position), numbers(more)].concat())
                }
                Content::Uv(uv) => {
                    seen[1] += 1;
                    if new.is_some() {
                        continue;
                    }
                    ("vt", numbers(uv))
                }
                Content::Normal(normal) => {
                    seen[2] += 1;
                    ("vn", numbers(normal))
                }
                Content::Face(keyword, corners) => match new {
                    Some(new) if corners.len() >= 3 => {
                        if are_uvs_due {
                            are_uvs_due = false;
                            for [u, v] in new.uvs() {
                                let line = format!("vt {u} {v}{}", self.line_end);
                                text.extend(line.as_bytes());
                            }
                        }
                        let (fan, rest) = triangles.split_at(corners.len() - 2);
                        triangles = rest;
                        let uv = |index: u32| new.uvs()[index as usize];
                        let is_whole = fan.windows(2).all(|two| {
                            uv(two[0][0]) == uv(two[1][0]) && uv(two[0][2]) == uv(two[1][1])
                        });
                        if !is_whole {
                            let faces = fan.iter().enumerate().map(|(k, uvs)| {
                                let fan = [&corners[0], &corners[k + 1], &corners[k + 2]];
                                let fan = [0, 1, 2].map(|k| written(fan[k], Some(uvs[k])));
                                fan.join(" ")
                            });
                            let faces: Vec<_> = faces.collect();
                            text.extend(keyword.as_bytes());
                            text.extend(blank(statement, 0, self.line_end).as_bytes());
                            let between = format!("{}f ", self.line_end);
                            text.extend(faces.join(&between).as_bytes());
                            text.extend(statement.tail.as_bytes());
                            text.extend(end.as_bytes());
                            continue;
                        }
                        let uvs = fan[0][..2].iter().copied();
                        let uvs = uvs.chain(fan.iter().map(|triangle| triangle[2]));
                        let words = corners.iter().zip(uvs);
                        (
                            *keyword,
                            words.map(|(c, uv)| written(c, Some(uv))).collect(),
                        )
                    }
                    _ => (*keyword, corners.iter().map(|c| written(c, None)).collect()),
                },
                Content::Line(corners) => ("l", corners.iter().map(|c| written(c, None)).collect()),
                Content::Name(keyword, name) => {
                    text.extend([keyword.as_bytes(), b" ", name, end.as_bytes()].concat());
                    continue;
                }
                Content::Other(line) => {
                    text.extend([line, end.as_bytes()].concat());
                    continue;
                }
            };
            text.extend(keyword.as_bytes());
            for (place, word) in words.iter().enumerate() {
                text.extend(blank(statement, place, self.line_end).as_bytes());
                text.extend(word.as_bytes());
            }
            text.extend(statement.tail.as_bytes());
            text.extend(end.as_bytes());
        }
        text
    }
}

/// Gives objects that share a vertex the lowest of their numbers; `objects` are those of the
/// triangles of the faces.
fn unite_at_vertices(objects: &mut [u32], faces: &[Vec<(usize, Option<usize>)>]) {
    let of_triangles: Vec<_> = faces
        .iter()
        .flat_map(|face| std::iter::repeat_n(face, face.len() - 2))
        .collect();
    let share = |a: usize, b: usize| {
        let mut corners = of_triangles[a].iter();
        corners.any(|&(vertex, _)| of_triangles[b].iter().any(|&(other, _)| other == vertex))
    };
    for a in 0..objects.len() {
        for b in 0..a {
            let (low, high) = (objects[a].min(objects[b]), objects[a].max(objects[b]));
            if low != high && share(a, b) {
                for object in objects.iter_mut().filter(|object| **object == high) {
                    *object = low;
                }
            }
        }
    }
}

/// What is before a word; a backslash continues on the next line.
fn blank(statement: &Statement, place: usize, line_end: &str) -> String {
    match statement.blanks.get(place) {
        Some(&"\\") => format!(" \\{line_end}"),
        Some(blank) => (*blank).to_owned(),
        None => " ".to_owned(),
    }
}

fn fan<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> {
    (2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]])
}

/// UVs of a mesh: those of each face agree on its diagonals, or not.
fn new_uvs(faces: &[Vec<(usize, Option<usize>)>], uvs: &[[f32; 2]], choices: &[u32]) -> UvMap {
    let mut choices = choices.iter().cycle();
    let mut choose = || *choices.next().unwrap();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for face in faces {
        let corners: Vec<u32> = face.iter().map(|_| choose() % uvs.len() as u32).collect();
        let is_torn = choose() % 4 == 0;
        triangles.extend(fan(&corners).map(|mut triangle| {
            if is_torn {
                triangle[choose() as usize % 3] = choose() % uvs.len() as u32;
            }
            triangle
        }));
    }
    UvMap::new(uvs.to_vec(), triangles).unwrap()
}

fn mesh(document: &Document) -> &TriangleMesh {
    match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(_) => panic!("a mesh was expected"),
    }
}

/// Position and UV of the corners of all faces, as `tobj` reads them.
fn faces_of_tobj(text: &[u8]) -> Vec<Vec<([f64; 3], [f64; 2])>> {
    let load = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let options = tobj::LoadOptions::default();
    let (models, _) = tobj::load_obj_buf(&mut &*text, &options, load).unwrap();
    let mut faces = Vec::new();
    for mesh in models.iter().map(|model| &model.mesh) {
        let corners = mesh.indices.iter().zip(&mesh.texcoord_indices);
        let mut corners = corners.map(|(&v, &vt)| {
            let position = mesh.positions.as_chunks().0[v as usize];
            (position, mesh.texcoords.as_chunks().0[vt as usize])
        });
        let arities = match mesh.face_arities.as_slice() {
            [] => vec![3; mesh.indices.len() / 3],
            arities => arities.to_vec(),
        };
        for arity in arities {
            let face: Vec<_> = corners.by_ref().take(arity as usize).collect();
            if arity > 2 {
                faces.push(face);
            }
        }
    }
    faces
}

fn check(file: &File, uvs: &[[f32; 2]], choices: &[u32], is_plain: bool) {
    let folder = Folder::new();
    let text = file.text(None);
    let expected = file.expected();
    let document = folder.read("a.obj", &text);
    let in_memory = Document::from_bytes(Format::Obj, text).unwrap();
    for document in [&document, &in_memory] {
        assert_eq!(document.surface().positions(), expected.positions);
        assert_eq!(document.labels(), &expected.labels);
    }
    assert_eq!(document.surface(), in_memory.surface());
    assert_eq!(document.uv_map(), in_memory.uv_map());
    assert_eq!(document.point_uvs(), in_memory.point_uvs());

    let options = WriteOptions::default();
    let mut written = Vec::new();
    if expected.faces.is_empty() {
        let uvs: Vec<_> = uvs
            .iter()
            .copied()
            .cycle()
            .take(expected.positions.len())
            .collect();
        let uvs = Uvs::Points(uvs);
        in_memory
            .write_to(&uvs, Format::Obj, &options, &mut written)
            .unwrap();
        let again = Document::from_bytes(Format::Obj, written).unwrap();
        assert_eq!(
            again.point_uvs().map(<[_]>::to_vec).map(Uvs::Points),
            Some(uvs)
        );
        assert_eq!(again.surface(), document.surface());
        return;
    }

    let triangles: Vec<_> = expected.faces.iter().flat_map(|face| fan(face)).collect();
    let vertices = triangles.iter().map(|t| t.map(|(vertex, _)| vertex as u32));
    assert_eq!(mesh(&document).triangles(), vertices.collect::<Vec<_>>());
    let corners = expected.faces.iter().flatten();
    let has_uvs = corners.clone().all(|(_, uv)| uv.is_some());
    let old = document.uv_map();
    assert_eq!(old.is_some(), has_uvs);
    for (t, triangle) in triangles.iter().enumerate().filter(|_| has_uvs) {
        assert_eq!(
            old.unwrap().corners(t),
            triangle.map(|(_, uv)| expected.uvs[uv.unwrap()])
        );
    }

    let uvs = new_uvs(&expected.faces, uvs, choices);
    let path = folder.path("b.obj");
    document.write_mesh_uvs(&uvs, &path, &options).unwrap();
    in_memory
        .write_to(&Uvs::Mesh(uvs.clone()), Format::Obj, &options, &mut written)
        .unwrap();
    assert_eq!(fs::read(&path).unwrap(), written);
    assert_eq!(
        String::from_utf8_lossy(&written),
        String::from_utf8_lossy(&file.text(Some(&uvs)))
    );

    let again = read_surface(&path).unwrap();
    assert_eq!(mesh(&again).positions(), mesh(&document).positions());
    assert_eq!(mesh(&again).triangles(), mesh(&document).triangles());
    assert_eq!(again.labels(), document.labels());
    let read = again.uv_map().unwrap();
    assert_eq!(read.uvs(), uvs.uvs());
    for t in 0..triangles.len() {
        assert_eq!(read.corners(t), uvs.corners(t));
    }

    // Onto itself, the file stays the same.
    again.write_mesh_uvs(read, &path, &options).unwrap();
    assert_eq!(fs::read(&path).unwrap(), written);

    if is_plain {
        let faces = faces_of_tobj(&written);
        let found = faces.iter().flat_map(|face| fan(face));
        let expected = mesh(&document)
            .triangles()
            .iter()
            .enumerate()
            .map(|(t, _)| {
                let corners = std::iter::zip(mesh(&document).corners(t), uvs.corners(t));
                let corners: Vec<_> = corners.map(|(p, uv)| (p, uv.map(f64::from))).collect();
                [corners[0], corners[1], corners[2]]
            });
        // `tobj` reads numbers in double precision.
        let narrow =
            |face: [([f64; 3], [f64; 2]); 3]| face.map(|(p, uv)| (p, uv.map(|c| c as f32)));
        assert_eq!(
            found.map(narrow).collect::<Vec<_>>(),
            expected.map(narrow).collect::<Vec<_>>()
        );
    }
}

fn uvs() -> impl Strategy<Value = Vec<[f32; 2]>> {
    use prop::num::f32::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    let exact = (0u8..9).prop_map(|n| f32::from(n) / 8.0);
    let number = prop_oneof![2 => exact, 1 => NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE];
    vec(prop::array::uniform2(number), 1..12)
}

fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    ProptestConfig {
        cases: default.cases / 3,
        failure_persistence: None,
        ..default
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn files_of_all_dialects_come_back(
        file in file(false),
        uvs in uvs(),
        choices in vec(0u32..1000, 50),
    ) {
        check(&file, &uvs, &choices, false);
    }

    #[test]
    fn others_read_what_is_written(
        file in file(true),
        uvs in uvs(),
        choices in vec(0u32..1000, 50),
    ) {
        check(&file, &uvs, &choices, true);
    }
}
