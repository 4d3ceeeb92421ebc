//! Edges of a mesh that somebody marked, in a file of their own: where to cut it, or where not
//! to.
//!
//! The content tells which of two kinds of file it is:
//!
//! - JSON as [`write_seams_json`](crate::seams::write_seams_json) writes it, whole or edited. Its
//!   `edges` count; they are pairs of vertices, in the order in which the file of the mesh has
//!   them.
//! - OBJ with lines (`l`) of two vertices or more. They are matched with the mesh by where they
//!   are: every vertex of a line stands for the nearest of the mesh, which must be no farther
//!   away than rounding explains. Faces and all else are passed over.
//!
//! A marked edge must be one of the mesh's triangles; a diagonal that a polygon got when it was
//! divided into triangles is one, too.

use std::collections::HashMap;

use fam_surface::{Edges, TriangleMesh};
use serde::Deserialize;

use crate::error::ReadFault;
use crate::obj::Lines;
use crate::text::utf16;

/// How far from a vertex of the mesh one of a line may be, as a share of the diagonal of the
/// mesh's bounding box: the six decimals that are usual in OBJ suffice down to sizes of a
/// hundredth.
const TOLERANCE: f64 = 1e-4;

/// The latest version of `seams.json` that is known.
const VERSION: u32 = 2;

/// The edges of a mesh that a file marks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MarkedEdges {
    /// Each by the first vertices at its ends, the smaller before the larger, in the order of the
    /// file.
    pub edges: Vec<[u32; 2]>,
    /// How many more are marked that are no edges of the mesh.
    pub unmatched: usize,
    /// Where the first of these is in the file.
    pub first_unmatched: Option<String>,
}

impl MarkedEdges {
    /// What a file marks on a mesh.
    ///
    /// # Errors
    /// The file breaks the rules of its format, it marks nothing, or nothing of what it marks
    /// is an edge of the mesh.
    pub fn from_bytes(bytes: &[u8], mesh: &TriangleMesh) -> Result<Self, ReadFault> {
        if utf16(bytes).is_some() {
            return Err(ReadFault::Utf16);
        }
        let edges = Edges::of(mesh);
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let marked = match text.trim_ascii_start().first() {
            Some(b'{') => in_json(text)?,
            _ => in_obj(bytes, mesh)?,
        };
        if marked.is_empty() {
            let reason = "it marks nothing: there are neither lines (OBJ) nor edges (JSON) in it";
            return Err(ReadFault::Malformed(reason.to_owned()));
        }
        let mut found = Self {
            edges: Vec::new(),
            unmatched: 0,
            first_unmatched: None,
        };
        for (place, ends) in marked {
            match ends.and_then(|ends| edges.find(ends)) {
                Some(edge) => found.edges.push(edge),
                None => {
                    found.unmatched += 1;
                    found
                        .first_unmatched
                        .get_or_insert_with(|| place.to_string());
                }
            }
        }
        if found.edges.is_empty() {
            let reason = "none of the edges that it marks is in the mesh";
            return Err(ReadFault::Malformed(reason.to_owned()));
        }
        Ok(found)
    }
}

/// Where something marked is in a file.
enum Place {
    Line(usize),
    Entry(usize),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Entry(entry) => write!(f, "edges[{entry}]"),
        }
    }
}

/// Something marked: two vertices of the mesh, if there are such.
type Marked = (Place, Option<[u32; 2]>);

fn in_json(text: &[u8]) -> Result<Vec<Marked>, ReadFault> {
    #[derive(Deserialize)]
    struct Json {
        #[serde(default)]
        version: Option<u32>,
        edges: Vec<[u32; 2]>,
    }
    let json: Json =
        serde_json::from_slice(text).map_err(|error| ReadFault::Malformed(error.to_string()))?;
    if let Some(version) = json.version.filter(|&version| version > VERSION) {
        return Err(ReadFault::Unsupported(format!("version {version} is")));
    }
    let places = (0..).map(Place::Entry);
    Ok(places.zip(json.edges.into_iter().map(Some)).collect())
}

fn in_obj(bytes: &[u8], mesh: &TriangleMesh) -> Result<Vec<Marked>, ReadFault> {
    let lines = Lines::read(bytes)?;
    let nearest = Nearest::of(mesh.positions());
    let of_line: Vec<Option<u32>> = lines.positions.iter().map(|p| nearest.to(p)).collect();
    let marked = |ends: [u32; 2]| {
        let [a, b] = ends.map(|v| of_line[v as usize]);
        Some([a?, b?])
    };
    let segments = lines.segments.iter();
    Ok(segments
        .map(|segment| (Place::Line(segment.line), marked(segment.ends)))
        .collect())
}

/// The vertices of a mesh by the cells of a grid that are as wide as what is near.
struct Nearest<'a> {
    positions: &'a [[f64; 3]],
    low: [f64; 3],
    reach: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Nearest<'a> {
    fn of(positions: &'a [[f64; 3]]) -> Self {
        let fold = |k: usize, f: fn(f64, f64) -> f64, start: f64| {
            positions.iter().map(|p| p[k]).fold(start, f)
        };
        let low = [0, 1, 2].map(|k| fold(k, f64::min, f64::INFINITY));
        let high = [0, 1, 2].map(|k| fold(k, f64::max, f64::NEG_INFINITY));
        let side = |k: usize| TOLERANCE * high[k] - TOLERANCE * low[k];
        let reach = side(0).hypot(side(1)).hypot(side(2));
        let mut nearest = Self {
            positions,
            low,
            reach,
            cells: HashMap::new(),
        };
        for (v, p) in (0..).zip(positions) {
            let cell = nearest.cell(p);
            nearest.cells.entry(cell).or_default().push(v);
        }
        nearest
    }

    /// Casts saturate: what is far out is in a cell of its own, or in no one's reach.
    fn cell(&self, p: &[f64; 3]) -> [i64; 3] {
        [0, 1, 2].map(|k| ((p[k] - self.low[k]) / self.reach).floor() as i64)
    }

    /// The nearest vertex within reach; of several as near the first.
    fn to(&self, p: &[f64; 3]) -> Option<u32> {
        let cell = self.cell(p);
        let around = (0..27).map(|i| [i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1]);
        around
            .filter_map(|step: [i64; 3]| {
                let at = [0, 1, 2].map(|k: usize| cell[k].saturating_add(step[k]));
                self.cells.get(&at)
            })
            .flatten()
            .map(|&v| {
                let q = &self.positions[v as usize];
                let apart = (0..3).map(|k| q[k] - p[k]).fold(0.0, f64::hypot);
                (apart, v)
            })
            .filter(|(apart, _)| *apart <= self.reach)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, v)| v)
    }
}

#[cfg(test)]
mod tests {
    use fam_surface::shapes;

    use super::*;

    /// Two squares, each of two triangles; vertices come in columns of two.
    fn sheet() -> TriangleMesh {
        shapes::rectangle(2.0, 1.0, 2, 1)
    }

    fn read(text: &str) -> Result<MarkedEdges, String> {
        MarkedEdges::from_bytes(text.as_bytes(), &sheet()).map_err(|fault| fault.to_string())
    }

    #[test]
    fn lines_are_matched_by_where_they_are() {
        let text = "v 0 -0.5 0\nv 0 0.5 0\nv 1 0.5 0\nl 2 1\nl 1 2 3\n";
        let found = read(text).unwrap();
        assert_eq!(found.edges, [[2, 3], [2, 3], [3, 5]]);
        assert_eq!((found.unmatched, found.first_unmatched), (0, None));
        // Rounded to four digits, and too far away.
        let near = "v 0.00008 -0.5 0\nv 0 0.49993 0.0001\nl 1 2\n";
        assert_eq!(read(near).unwrap().edges, [[2, 3]]);
        assert!(read("v 0 -0.5 0.001\nv 0 0.5 0\nl 1 2\n").is_err());
    }

    #[test]
    fn what_is_no_edge_is_counted() {
        let vertices = "v 0 -0.5 0\nv 0 0.5 0\nv 1 0.5 0\nv -1 0.5 0\nv 7 0 0\n";
        let found = read(&format!("{vertices}l 1 2\nl 3 4\nl 2 5\nl 1 1\n")).unwrap();
        assert_eq!(found.edges, [[2, 3]]);
        assert_eq!(found.unmatched, 3);
        assert_eq!(found.first_unmatched.as_deref(), Some("line 7"));
        let none = read(&format!("{vertices}l 3 4 5\n"));
        let reason = "none of the edges that it marks is in the mesh";
        assert_eq!(none, Err(reason.to_string()));
    }

    #[test]
    fn edges_of_a_seam_file_are_vertices_of_the_mesh() {
        let text =
            "\u{feff} {\"version\": 2, \"points\": [], \"edges\": [[3, 2], [0, 5], [2, 900]]}";
        let found = read(text).unwrap();
        assert_eq!((found.edges, found.unmatched), (vec![[2, 3]], 2));
        assert_eq!(found.first_unmatched.as_deref(), Some("edges[1]"));
        assert_eq!(read("{\"edges\":[[2,3]]}").unwrap().edges, [[2, 3]]);
        for (text, reason) in [
            ("{\"version\":3,\"edges\":[[2,3]]}", "version 3"),
            ("{\"version\":2}", "edges"),
            ("{\"edges\":[[2]]}", "length"),
            ("{\"edges\":[[2,-3]]}", "-3"),
            ("{\"edges\":[[2,3]]", "EOF"),
            ("{\"edges\":[]}", "marks nothing"),
            ("{\"edges\":[[0,5]]}", "none"),
        ] {
            let found = read(text).unwrap_err();
            assert!(found.contains(reason) && !found.contains('\n'), "{found}");
        }
    }

    #[test]
    fn a_file_without_marks_is_refused() {
        for text in [
            "",
            "v 0 0 0\n",
            "v 0 -0.5 0\nv 0 0.5 0\nf 1 2 2\nl 1\n",
            "\0\u{1}",
        ] {
            assert!(read(text).unwrap_err().contains("marks nothing"), "{text}");
        }
    }

    #[test]
    fn places_without_end_are_nowhere() {
        let huge = "v 1e308 -1e308 1e300\nv -1e308 0 0\nl 1 2\n";
        assert!(read(huge).is_err());
        let mesh = sheet();
        let far = |p: &[f64; 3]| p.map(|c| c * 1e308);
        let positions = mesh.positions().iter().map(far).collect();
        let mesh = TriangleMesh::new(positions, mesh.triangles().to_vec()).unwrap();
        let text = "v 0 -0.5e308 0\nv 0 0.5e308 0\nl 1 2\n";
        let found = MarkedEdges::from_bytes(text.as_bytes(), &mesh).unwrap();
        assert_eq!(found.edges, [[2, 3]]);
    }

    /// Those written for a mesh mark the same edges of it again.
    #[test]
    fn what_was_written_is_read_again() {
        let mesh = shapes::torus(1.0, 0.4, 9, 6);
        let [a, b, c] = mesh.triangles()[7];
        let mut edges = vec![[a.min(b), a.max(b)], [b.min(c), b.max(c)]];
        edges.sort_unstable();
        let folder = tempfile::tempdir().unwrap();
        let seams = crate::seams::Seams {
            positions: mesh.positions(),
            points: &[a, b, c],
            edges: &edges,
            thresholds: &[],
        };
        for name in ["s.json", "s.obj"] {
            let path = folder.path().join(name);
            match name {
                "s.json" => crate::seams::write_seams_json(&path, &seams).unwrap(),
                _ => crate::seams::write_seams_obj(&path, &seams).unwrap(),
            }
            let bytes = std::fs::read(&path).unwrap();
            let mut found = MarkedEdges::from_bytes(&bytes, &mesh).unwrap();
            found.edges.sort_unstable();
            assert_eq!(found.edges, edges, "{name}");
        }
    }
}
