//! STL, stereolithography: ASCII and binary (little endian).
//!
//! - A binary file has 80 bytes of any content, the number of facets and 50 bytes for each
//!   facet; more bytes after them are not looked at. A file is binary if it has exactly this
//!   size, even if it starts with `solid`, or if it does not start with `solid`.
//! - An ASCII file has these statements, in upper or lower case: `solid`, `facet`,
//!   `outer loop`, three times `vertex`, `endloop`, `endfacet`, `endsolid`. The last three may
//!   be two words, as in `end loop`. Statements may share a line or go over several; only the
//!   name of a solid ends with its line, and may be missing. Coordinates are read in double
//!   precision.
//! - Facets have exactly three corners. Their normals and attributes are not looked at.
//!
//! Corners of exactly equal coordinates (−0 equals 0) are one vertex; vertices are in the order
//! of their first appearance. If several solids of an ASCII file have facets, each of these is
//! an object with vertices of its own.
//!
//! The format has no place for UVs, so such files are not written.

mod ascii;
mod facets;

use crate::error::ReadFault;
use crate::labels::Labels;
use crate::parsed::{Parsed, surface};
use crate::text::{is_blank, lines, words};
use facets::Facets;

const HEADER: usize = 84;
const FACET: usize = 50;

/// An STL file; nothing of it is written back.
#[derive(Debug, Clone)]
pub(crate) struct Source;

pub(crate) fn parse(bytes: &[u8]) -> Result<Parsed<Source>, ReadFault> {
    let mut facets = Facets::default();
    if is_ascii(bytes) {
        ascii::read(bytes, &mut facets)?;
    } else {
        read_binary(bytes, &mut facets)?;
    }
    let several = facets.solids.last().is_some_and(|&last| last > 0);
    let labels = Labels {
        objects: if several { facets.solids } else { Vec::new() },
        ..Labels::default()
    };
    Ok(Parsed {
        surface: surface(facets.positions, &facets.polygons, None)?,
        uvs: None,
        labels,
        diagonals: Vec::new(),
        warnings: Vec::new(),
        source: Source,
    })
}

/// Whether a file of so many bytes that starts with these has exactly the size of a binary one.
pub(crate) fn has_binary_size(start: &[u8], length: u64) -> bool {
    announced(start).is_some_and(|facets| length == (HEADER as u64) + (FACET as u64) * facets)
}

/// The number of facets by the header of a binary file.
fn announced(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER - 4..HEADER)?.try_into().ok()?;
    Some(u32::from_le_bytes(count).into())
}

fn is_ascii(bytes: &[u8]) -> bool {
    // A first facet is never without a zero byte in a binary file, and never with one in text.
    let is_text = !bytes[..bytes.len().min(HEADER + FACET)].contains(&0);
    is_text && !has_binary_size(bytes, bytes.len() as u64) && starts_with_solid(bytes)
}

fn starts_with_solid(bytes: &[u8]) -> bool {
    lines(bytes)
        .map(|line| words(bytes, line.text, is_blank))
        .find_map(|words| words.first().cloned())
        .is_some_and(|word| bytes[word].eq_ignore_ascii_case(b"solid"))
}

fn read_binary(bytes: &[u8], facets: &mut Facets) -> Result<(), ReadFault> {
    let announced = announced(bytes).ok_or_else(|| {
        let length = bytes.len();
        let problem = format!("a binary STL file has at least {HEADER} bytes, not {length}");
        ReadFault::Malformed(problem)
    })?;
    let (entries, _) = bytes[HEADER..].as_chunks::<FACET>();
    let found = entries.len() as u64;
    if announced > found {
        return Err(ReadFault::Truncated {
            element: "facets".to_owned(),
            announced,
            found,
        });
    }
    for (number, facet) in (1..=announced).zip(entries) {
        let corners = [12, 24, 36].map(|corner| {
            [0, 4, 8].map(|axis| {
                let at = corner + axis;
                let bytes = [facet[at], facet[at + 1], facet[at + 2], facet[at + 3]];
                f64::from(f32::from_le_bytes(bytes))
            })
        });
        if !corners.as_flattened().iter().all(|c| c.is_finite()) {
            let problem = format!("facet {number} has a coordinate that is not a finite number");
            return Err(ReadFault::Malformed(problem));
        }
        facets.push(corners);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use fam_surface::Surface;

    use super::*;

    fn binary(header: &[u8], announced: u32, facets: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(HEADER - 4, b' ');
        bytes.extend(announced.to_le_bytes());
        for facet in facets {
            bytes.extend([0xff; 12]);
            let corners = facet.as_flattened();
            bytes.extend(corners.iter().flat_map(|c| c.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn mesh(bytes: &[u8]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>, Vec<u32>) {
        let parsed = parse(bytes).unwrap();
        let Surface::Mesh(mesh) = parsed.surface else {
            panic!("a mesh was expected");
        };
        let triangles = mesh.triangles().to_vec();
        (mesh.positions().to_vec(), triangles, parsed.labels.objects)
    }

    fn fault(bytes: &[u8]) -> String {
        parse(bytes).err().unwrap().to_string()
    }

    const FACETS: [[[f32; 3]; 3]; 2] = [
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [0.0, 1.0, 0.0]],
        [[0.0, 1.0, -0.0], [1.0, 0.0, 0.1], [-0.0, 0.0, 5.0]],
    ];

    #[test]
    fn equal_corners_of_a_binary_file_are_one_vertex() {
        for header in [&b"solid by mistake"[..], b"", b"\0\0"] {
            let (positions, triangles, objects) = mesh(&binary(header, 2, &FACETS));
            let tenth = f64::from(0.1f32);
            let expected = [[0., 0., 0.], [1., 0., tenth], [0., 1., 0.], [0., 0., 5.]];
            assert_eq!(positions, expected);
            assert_eq!(triangles, [[0, 1, 2], [2, 1, 3]]);
            assert!(objects.is_empty());
        }
    }

    #[test]
    fn the_count_of_a_binary_file_must_fit_and_more_bytes_may_follow() {
        let mut bytes = binary(b"", 1, &FACETS);
        bytes.extend(b"more");
        assert_eq!(mesh(&bytes).1, [[0, 1, 2]]);
        let mut solid = binary(b"solid", 2, &FACETS);
        solid.push(0);
        assert_eq!(mesh(&solid).1.len(), 2);
        let announced = binary(b"", u32::MAX, &FACETS);
        let expected = "it announces 4294967295 entries of `facets`, but holds only 2";
        assert_eq!(fault(&announced), expected);
        let expected = "a binary STL file has at least 84 bytes, not 3";
        assert_eq!(fault(b"abc"), expected);
        assert_eq!(fault(&binary(b"", 0, &[])), "it has no vertices");
        let infinite = [FACETS[0], [[0.0, f32::INFINITY, 0.0]; 3]];
        let expected = "facet 2 has a coordinate that is not a finite number";
        assert_eq!(fault(&binary(b"", 2, &infinite)), expected);
    }

    const FACET_TEXT: &str = "facet normal nan 0 0\r\n outer loop\n  vertex 0 0 0\n\
        vertex 1.000000000001 .0 0\nVERTEX +1e0 -1 -0\n endloop\n EndFacet\n";

    #[test]
    fn solids_of_an_ascii_file_are_objects() {
        let one = format!("\n SOLID\n{FACET_TEXT}{FACET_TEXT}endsolid name\n");
        let (positions, triangles, objects) = mesh(one.as_bytes());
        let corners = [[0., 0., 0.], [1.000000000001, 0., 0.], [1., -1., 0.]];
        assert_eq!(positions, corners);
        assert_eq!(triangles, [[0, 1, 2]; 2]);
        assert!(objects.is_empty());

        let empty = "solid facet\nendsolid\n";
        let two = format!("{empty}{one}{empty}solid b\n{FACET_TEXT}endsolid");
        let (positions, triangles, objects) = mesh(two.as_bytes());
        assert_eq!(positions, [corners, corners].concat());
        assert_eq!(triangles, [[0, 1, 2], [0, 1, 2], [3, 4, 5]]);
        assert_eq!(objects, [0, 0, 1]);
        assert!(mesh(format!("{empty}{one}").as_bytes()).2.is_empty());
    }

    #[test]
    fn ascii_statements_are_told_by_words_and_not_by_lines() {
        let usual = format!("solid a\n{FACET_TEXT}endsolid\nsolid b\n{FACET_TEXT}endsolid\n");
        let expected = mesh(usual.as_bytes());
        let facet = "facet normal -1.#IND nan(ind) 0 outer\tloop vertex 0 0 0 vertex 1.000000000001 0\r0 \
                     vertex 1 -1 0 end\rloop END Facet";
        for text in [
            usual
                .replace("endloop", "end loop")
                .replace("EndFacet", "end facet"),
            usual
                .replace("endsolid", "\t End  Solid facet")
                .replace("solid a", "\n \tsolid a"),
            usual.replace("\r\n", "\n").replace('\n', "\r"),
            usual.replace("facet normal nan 0 0", "color 1 0 0\nfacet\nnormal\n0 0 1"),
            usual.replace("endloop", "endloop more"),
            format!("\u{feff}solid a\r{facet} endsolid\rsolid b\r{facet} {facet}\rendsolid")
                .replacen(&format!(" {facet}\rend"), "\rend", 1),
        ] {
            assert_eq!(mesh(text.as_bytes()), expected, "{text}");
        }
    }

    #[test]
    fn ascii_faults_name_the_line() {
        for (text, expected) in [
            ("solid a\nendsolid", "it has no vertices"),
            (
                "solid a\nfacet\nvertex 0 0\n",
                "line 3: a vertex has 3 coordinates, not 2",
            ),
            (
                "solid a\nfacet\nvertex 0 0 nan\n",
                "line 3: `nan` is not a finite number",
            ),
            (
                "solid a\nfacet\nvertex 0 0 0\nendfacet\n",
                "line 4: a facet has 3 vertices, not 1",
            ),
            (
                "solid a\nvertex 0 0 0\n",
                "line 2: `vertex` is not expected here",
            ),
            (
                "solid a\nfacet\nfacet\n",
                "line 3: `facet` is not expected here",
            ),
            (
                "solid a\nfacet\nendsolid\n",
                "line 3: `endsolid` is not expected here",
            ),
            (
                "solid a\nfacet\nvertex 1 2 3\n",
                "the file ends before the end of a solid",
            ),
            ("solid a\n", "the file ends before the end of a solid"),
            ("solid a\nend\n", "the file ends before the end of a solid"),
            ("solid a\nend x\n", "line 2: `x` is not expected here"),
            ("solid a\nface\n", "line 2: `face` is not expected here"),
            (
                "solid a\nfacet\nvertex 0 0 0 0\n",
                "line 3: a vertex has 3 coordinates, not 4",
            ),
        ] {
            assert_eq!(fault(text.as_bytes()), expected, "{text}");
        }
    }
}
