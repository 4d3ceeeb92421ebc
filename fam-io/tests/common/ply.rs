//! PLY files as a reader sees them that is not ours.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::iter::zip;

use fam_io::Document;
use fam_surface::{Surface, UvMap};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

/// Checks that a file, whose lines do not end in `\r`, has the surface and the UVs of a document.
pub fn check(file: &[u8], document: &Document) {
    let parser = Parser::<DefaultElement>::new();
    let ply = parser.read_ply(&mut &*file).unwrap();
    let vertices = &ply.payload["vertex"];
    let positions = document.surface().positions();
    assert_eq!(vertices.len(), positions.len());
    for (vertex, position) in zip(vertices, positions) {
        for (name, &c) in zip(["x", "y", "z"], position) {
            // The text of a number of single precision is read as double by one of the two.
            let found = numbers(&vertex[name])[0];
            assert!(found == c || found == f64::from(c as f32), "{found} {c}");
        }
    }
    let mesh = match document.surface() {
        Surface::Mesh(mesh) => mesh,
        Surface::PointCloud(_) => {
            let uvs: Vec<_> = vertices.iter().map(|v| uv_of(v).unwrap()).collect();
            assert_eq!(document.point_uvs(), Some(&*uvs));
            return;
        }
    };
    let map: &UvMap = document.uv_map().unwrap();
    let mut triangles = zip(mesh.triangles(), (0..).map(|t| map.corners(t)));
    for face in &ply.payload["face"] {
        let corners = numbers(&face["vertex_indices"]);
        let of_corners = face.get("texcoord").map(numbers);
        let polygon: Vec<Corner> = (0..corners.len())
            .map(|at| {
                let of_vertex = uv_of(&vertices[corners[at] as usize]);
                let uv = of_vertex.unwrap_or_else(|| {
                    let uvs = of_corners.as_ref().unwrap();
                    [uvs[2 * at] as f32, uvs[2 * at + 1] as f32]
                });
                corner(corners[at] as u32, uv)
            })
            .collect();
        let division: Vec<[Corner; 3]> = triangles
            .by_ref()
            .take(polygon.len().saturating_sub(2))
            .map(|(vertices, uvs)| [0, 1, 2].map(|c| corner(vertices[c], uvs[c])))
            .collect();
        let whole = if polygon.len() < 3 { &[] } else { &polygon[..] };
        let divided = division.iter().flat_map(|triangle| sides(triangle));
        assert_eq!(boundary(divided), boundary(sides(whole)));
    }
    assert_eq!(triangles.next(), None);
}

/// A vertex with the bits of its UV.
type Corner = (u32, [u32; 2]);

fn corner(vertex: u32, uv: [f32; 2]) -> Corner {
    // Zero has two signs.
    (vertex, uv.map(|c| (c + 0.0).to_bits()))
}

/// The sides of a polygon, in its direction.
fn sides(polygon: &[Corner]) -> impl Iterator<Item = [Corner; 2]> {
    let next = |at: usize| polygon[(at + 1) % polygon.len()];
    (0..polygon.len()).map(move |at| [polygon[at], next(at)])
}

/// What is left of sides once those of opposite directions have cancelled. Triangles divide a polygon
/// if it is the same for both.
fn boundary(sides: impl Iterator<Item = [Corner; 2]>) -> BTreeMap<[Corner; 2], i32> {
    let mut counts = BTreeMap::new();
    for [from, to] in sides {
        *counts.entry([from.min(to), from.max(to)]).or_default() += match from.cmp(&to) {
            Ordering::Less => 1,
            Ordering::Equal => 0,
            Ordering::Greater => -1,
        };
    }
    counts.retain(|_, count| *count != 0);
    counts
}

fn uv_of(vertex: &DefaultElement) -> Option<[f32; 2]> {
    let number = |name: &str| Some(numbers(vertex.get(name)?)[0] as f32);
    Some([number("s")?, number("t")?])
}

fn numbers(property: &Property) -> Vec<f64> {
    fn all<T: Copy + Into<f64>>(list: &[T]) -> Vec<f64> {
        list.iter().map(|&number| number.into()).collect()
    }
    match property {
        Property::Char(number) => all(&[*number]),
        Property::UChar(number) => all(&[*number]),
        Property::Short(number) => all(&[*number]),
        Property::UShort(number) => all(&[*number]),
        Property::Int(number) => all(&[*number]),
        Property::UInt(number) => all(&[*number]),
        Property::Float(number) => all(&[*number]),
        Property::Double(number) => all(&[*number]),
        Property::ListChar(list) => all(list),
        Property::ListUChar(list) => all(list),
        Property::ListShort(list) => all(list),
        Property::ListUShort(list) => all(list),
        Property::ListInt(list) => all(list),
        Property::ListUInt(list) => all(list),
        Property::ListFloat(list) => all(list),
        Property::ListDouble(list) => all(list),
    }
}
