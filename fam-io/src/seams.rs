//! The seams of a flattened surface: where it was cut, for other programs.
//!
//! JSON ([`write_seams_json`]), described in docs/seams.md:
//!
//! ```json
//! {
//!   "version": 2,
//!   "thresholds": [{"distance": 0.02, "spacing": 0.15}],
//!   "points": [{"index": 4, "position": [0.1, 0.2, 0.3]}],
//!   "edges": [[4, 7], [7, 9]],
//!   "polylines": [[4, 7, 9]]
//! }
//! ```
//!
//! OBJ ([`write_seams_obj`]): the polylines as `l` elements; where there are no cut edges,
//! the seam points as `p` elements. Only vertices that occur in them are written.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;

use crate::atomic::write_atomically;
use crate::error::{WriteError, WriteFault};

/// Where a surface was cut.
#[derive(Debug, Clone, Copy)]
pub struct Seams<'a> {
    /// All vertices or points of the surface.
    pub positions: &'a [[f64; 3]],
    /// The seam points, as indices of positions.
    pub points: &'a [u32],
    /// The cut edges of a mesh, as pairs of indices of positions; empty for a cloud.
    pub edges: &'a [[u32; 2]],
    /// For every component what counts as torn; none where it was not looked for.
    pub thresholds: &'a [Option<Threshold>],
}

/// From which UV distance on neighbours count as torn apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Threshold {
    /// The UV distance.
    pub distance: f64,
    /// The 3D distance of neighbours, in the units of the positions, that `distance` is meant
    /// for and scales with; without it `distance` holds for all.
    pub spacing: Option<f64>,
}

#[derive(Serialize)]
struct Json<'a> {
    version: u32,
    thresholds: &'a [Option<Threshold>],
    points: Vec<JsonPoint>,
    edges: &'a [[u32; 2]],
    polylines: Vec<Vec<u32>>,
}

#[derive(Serialize)]
struct JsonPoint {
    index: u32,
    position: [f64; 3],
}

/// Writes seams as JSON.
///
/// # Errors
/// An index is out of range, or the file cannot be written.
pub fn write_seams_json(path: impl AsRef<Path>, seams: &Seams) -> Result<(), WriteError> {
    let path = path.as_ref();
    check(seams).map_err(|fault| fault.at(path))?;
    let point = |&index: &u32| JsonPoint {
        index,
        position: seams.positions[index as usize],
    };
    let json = Json {
        version: 2,
        thresholds: seams.thresholds,
        points: seams.points.iter().map(point).collect(),
        edges: seams.edges,
        polylines: polylines(seams.edges),
    };
    write_atomically(path, |out| {
        serde_json::to_writer(&mut *out, &json)?;
        out.write_all(b"\n")
    })
}

/// Writes seams as an OBJ of lines or points.
///
/// # Errors
/// An index is out of range, or the file cannot be written.
pub fn write_seams_obj(path: impl AsRef<Path>, seams: &Seams) -> Result<(), WriteError> {
    let path = path.as_ref();
    check(seams).map_err(|fault| fault.at(path))?;
    let (keyword, elements) = if seams.edges.is_empty() {
        ('p', seams.points.iter().map(|&point| vec![point]).collect())
    } else {
        ('l', polylines(seams.edges))
    };
    let used: BTreeSet<u32> = elements.iter().flatten().copied().collect();
    let numbers: BTreeMap<u32, usize> = used.iter().copied().zip(1..).collect();
    write_atomically(path, |out| {
        for &vertex in &used {
            let [x, y, z] = seams.positions[vertex as usize];
            writeln!(out, "v {x} {y} {z}")?;
        }
        for element in &elements {
            write!(out, "{keyword}")?;
            for vertex in element {
                write!(out, " {}", numbers[vertex])?;
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

fn check(seams: &Seams) -> Result<(), WriteFault> {
    let count = seams.positions.len();
    let mut indices = seams.points.iter().chain(seams.edges.iter().flatten());
    match indices.find(|&&index| index as usize >= count) {
        Some(&index) => Err(WriteFault::SeamOutOfRange { index, count }),
        None => Ok(()),
    }
}

/// Chains edges into lines as long as possible; they pass only through vertices of exactly
/// two edges. Lines come first, then loops, each from their lowest vertex on.
fn polylines(edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut neighbors: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for &[a, b] in edges.iter().filter(|[a, b]| a != b) {
        neighbors.entry(a).or_default().insert(b);
        neighbors.entry(b).or_default().insert(a);
    }
    let passed_through = |vertex: u32| neighbors[&vertex].len() == 2;
    let mut used: BTreeSet<[u32; 2]> = BTreeSet::new();
    let mut lines = Vec::new();
    let mut follow = |start: u32| {
        for &second in &neighbors[&start] {
            if !used.insert([start.min(second), start.max(second)]) {
                continue;
            }
            let mut line = vec![start, second];
            let mut at = second;
            while at != start && passed_through(at) {
                let unused = |next: &&u32| used.insert([at.min(**next), at.max(**next)]);
                let Some(&next) = neighbors[&at].iter().find(unused) else {
                    break;
                };
                line.push(next);
                at = next;
            }
            lines.push(line);
        }
    };
    let (inner, ends): (Vec<u32>, Vec<u32>) = neighbors
        .keys()
        .partition(|&&vertex| passed_through(vertex));
    ends.into_iter().chain(inner).for_each(&mut follow);
    lines
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn edges_chain_into_lines_and_loops() {
        assert_eq!(polylines(&[[3, 1], [1, 2], [4, 3]]), [[2, 1, 3, 4]]);
        // A loop, and an edge that occurs twice.
        assert_eq!(polylines(&[[7, 5], [5, 6], [6, 7], [7, 6]]), [[5, 6, 7, 5]]);
        // A vertex of three edges ends lines.
        assert_eq!(
            polylines(&[[0, 1], [1, 2], [1, 3]]),
            [[0, 1], [1, 2], [1, 3]]
        );
        // A loop through a junction: a lasso.
        assert_eq!(
            polylines(&[[0, 1], [1, 2], [2, 3], [3, 1]]),
            [vec![0, 1], vec![1, 2, 3, 1]]
        );
        assert_eq!(polylines(&[[5, 5]]), Vec::<Vec<u32>>::new());
    }

    const POSITIONS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.5], [1e-3, 2.0, 0.0], [9.0; 3]];

    #[test]
    fn files_have_the_documented_form() {
        let folder = tempfile::tempdir().unwrap();
        let (json, obj) = (folder.path().join("s.json"), folder.path().join("s.obj"));
        let mesh = Seams {
            positions: &POSITIONS,
            points: &[1, 2, 3],
            edges: &[[1, 2], [3, 2]],
            thresholds: &[
                None,
                Some(Threshold {
                    distance: 0.25,
                    spacing: Some(0.5),
                }),
            ],
        };
        write_seams_json(&json, &mesh).unwrap();
        assert_eq!(
            fs::read_to_string(&json).unwrap(),
            "{\"version\":2,\"thresholds\":[null,{\"distance\":0.25,\"spacing\":0.5}],\"points\":[\
             {\"index\":1,\"position\":[1.0,0.0,0.5]},\
             {\"index\":2,\"position\":[0.001,2.0,0.0]},\
             {\"index\":3,\"position\":[9.0,9.0,9.0]}],\
             \"edges\":[[1,2],[3,2]],\"polylines\":[[1,2,3]]}\n"
        );
        write_seams_obj(&obj, &mesh).unwrap();
        let expected = "v 1 0 0.5\nv 0.001 2 0\nv 9 9 9\nl 1 2 3\n";
        assert_eq!(fs::read_to_string(&obj).unwrap(), expected);
        let cloud = Seams { edges: &[], ..mesh };
        write_seams_obj(&obj, &cloud).unwrap();
        let expected = "v 1 0 0.5\nv 0.001 2 0\nv 9 9 9\np 1\np 2\np 3\n";
        assert_eq!(fs::read_to_string(&obj).unwrap(), expected);
    }

    #[test]
    fn indices_out_of_range_are_errors() {
        let seams = Seams {
            positions: &POSITIONS,
            points: &[],
            edges: &[[0, 4]],
            thresholds: &[],
        };
        for error in [
            write_seams_json("s.json", &seams).unwrap_err(),
            write_seams_obj("s.obj", &seams).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(
                text.ends_with("a seam refers to vertex 4, but there are only 4"),
                "{text}"
            );
        }
    }
}
