//! Which meshes are copies of each other: moved, turned and maybe mirrored.
//!
//! Meshes with as many vertices, triangles and open edges, and of about the same measures, are held
//! against each other. One triangle of the first, of a shape that is rare there, is laid on each of
//! the same shape in the second; from there the triangles follow from neighbour to neighbour. If that
//! meets no contradiction, three vertices far apart say how the first mesh is moved to the second,
//! and all others have to follow.

mod alignment;
mod shape;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use rayon::prelude::*;

use crate::TriangleMesh;

use shape::Shape;

/// How far a vertex of a copy may lie from its place, as a share of the mesh's size: the largest
/// distance of a vertex from the mean of all.
pub const TOLERANCE: f64 = 1e-5;

/// The same as a share of the largest coordinate: what rounding to `f32` does, with room for how it
/// adds up.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// The most that rounding may make of it, as a share of the size.
const MOST_TOLERANCE: f64 = 1e-3;

/// Meshes of the same measures that one is held against; with more, it counts as none's copy.
const MOST_ORIGINALS: usize = 32;

/// How a mesh is a copy of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Congruence {
    /// The mesh that it is a copy of, the first of its kind.
    pub original: usize,
    /// The original's vertex for every vertex.
    pub vertices: Vec<u32>,
    /// The original's triangle for every triangle.
    pub triangles: Vec<u32>,
    /// Whether it is mirrored. All its triangles run the other way round then, so that their outer
    /// sides are mirrored too.
    pub is_mirrored: bool,
}

/// Which meshes are copies of earlier ones: the same up to a rotation and a translation, or
/// `with_mirrored` ones a reflection too, whatever the order of vertices and triangles.
///
/// Vertices may be off by [`TOLERANCE`], and by what rounding to `f32` does to large coordinates. A
/// mesh that is like its own mirror image is a copy that is not mirrored. The outside stays the
/// outside: a copy that is turned inside out is none. Only meshes of the same kind, of which
/// `kinds` has one for each, are copies of each other, and only if `fits` agrees, which is given
/// the copy's number too.
///
/// Meshes are to be connected across edges of at most two triangles, as those of
/// [`Components`](crate::Components) are; others are nobody's copies, as are those without extent.
/// An original is no copy. The result is the same on any number of threads.
///
/// # Panics
/// If there are not as many `kinds` as meshes.
pub fn copies(
    meshes: &[&TriangleMesh],
    kinds: &[u32],
    with_mirrored: bool,
    fits: &(dyn Fn(usize, &Congruence) -> bool + Sync),
) -> Vec<Option<Congruence>> {
    assert_eq!(meshes.len(), kinds.len(), "every mesh has a kind");
    let mut groups: HashMap<[usize; 3], Vec<usize>> = HashMap::new();
    for (i, mesh) in meshes.iter().enumerate() {
        let key = [
            kinds[i] as usize,
            mesh.positions().len(),
            mesh.triangles().len(),
        ];
        groups.entry(key).or_default().push(i);
    }
    let unit = unit(meshes);
    let search = Search {
        meshes,
        unit,
        with_mirrored,
        fits,
    };
    let groups: Vec<Vec<usize>> = groups.into_values().filter(|g| g.len() > 1).collect();
    let found: Vec<Vec<(usize, Congruence)>> = groups
        .par_iter()
        .map(|members| search.among(members))
        .collect();
    let mut copies: Vec<Option<Congruence>> = meshes.iter().map(|_| None).collect();
    for (i, copy) in found.into_iter().flatten() {
        copies[i] = Some(copy);
    }
    copies
}

/// A power of two by which coordinates are multiplied, so that no product of theirs overflows.
fn unit(meshes: &[&TriangleMesh]) -> f64 {
    let all = meshes.iter().flat_map(|mesh| mesh.positions()).flatten();
    let largest = all.fold(0.0, |m: f64, c| m.max(c.abs()));
    // The lower bound keeps the factor finite.
    (-largest.log2().floor().max(-1000.0)).exp2()
}

struct Search<'a> {
    meshes: &'a [&'a TriangleMesh],
    unit: f64,
    with_mirrored: bool,
    fits: &'a (dyn Fn(usize, &Congruence) -> bool + Sync),
}

impl Search<'_> {
    /// The copies among meshes with as many vertices and triangles.
    fn among(&self, members: &[usize]) -> Vec<(usize, Congruence)> {
        let mut found = Vec::new();
        // Ascending by their first measure.
        let mut originals: Vec<(usize, Shape)> = Vec::new();
        for &i in members {
            let Some(shape) = Shape::new(self.meshes[i], self.unit) else {
                continue;
            };
            let reach = shape.reach();
            let measure = shape.measures[0];
            let first = originals.partition_point(|(_, one)| one.measures[0] < measure - reach);
            let near = originals[first..]
                .iter()
                .take_while(|(_, one)| one.measures[0] <= measure + reach)
                .filter(|(_, one)| one.is_like(&shape));
            let copy = near
                .take(MOST_ORIGINALS)
                .find_map(|(original, one)| self.copy(i, &shape, *original, one));
            match copy {
                Some(copy) => found.push((i, copy)),
                None => {
                    let at = originals.partition_point(|(_, one)| one.measures[0] <= measure);
                    originals.insert(at, (i, shape));
                }
            }
        }
        found
    }

    fn copy(&self, i: usize, shape: &Shape, original: usize, of: &Shape) -> Option<Congruence> {
        let turns: &[bool] = if self.with_mirrored {
            &[false, true]
        } else {
            &[false]
        };
        let fitting = |copy: &Congruence| (self.fits)(i, copy);
        turns.iter().find_map(|&is_mirrored| {
            let named = |(vertices, triangles)| Congruence {
                original,
                vertices,
                triangles,
                is_mirrored,
            };
            alignment::alignments(of, shape, is_mirrored)
                .map(named)
                .find(fitting)
        })
    }
}
