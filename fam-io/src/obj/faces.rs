//! The faces of an OBJ file, with what each of their corners refers to.

use fam_surface::polygons::Polygons;
use fam_surface::{UvMap, vector};

use crate::error::ReadFault;
use crate::text::{excerpt, syntax};
use crate::uvs::Uvs;

use super::corner::Corner;
use super::statements::Statement;

/// The faces of three corners or more.
#[derive(Default)]
pub(super) struct Faces {
    pub vertices: Polygons,
    pub normals: References,
    uvs: References,
    highest: u32,
    /// For every face left out, the number of those before it that were not.
    omitted: Vec<usize>,
    /// The first face with a vertex that never exists, and this vertex.
    fault: Option<(usize, i64)>,
}

impl Faces {
    /// Adds a face after so many `v`, `vt` and `vn`; one of less than three corners counts,
    /// but is left out. A reference to a vertex that does not exist is reported at the end.
    pub fn push(&mut self, statement: &Statement, seen: [usize; 3]) -> Result<(), ReadFault> {
        let corners = statement.arguments().len();
        if corners < 3 {
            self.omitted.push(self.vertices.len());
            return Ok(());
        }
        let first = self.vertices.corners().len();
        let mut vertices = Vec::with_capacity(corners);
        for (corner, word) in (first..).zip(statement.words()) {
            let bad = || {
                let problem = format!("`{}` is not the corner of a face", excerpt(word));
                syntax(statement.line, problem)
            };
            let [vertex, uv, normal] = Corner::split(word)
                .and_then(|corner| corner.references())
                .ok_or_else(bad)?;
            let written = vertex.ok_or_else(bad)?;
            match resolve(written, seen[0]) {
                Some(vertex) => vertices.push(vertex),
                None => {
                    let face = self.vertices.len() + self.omitted.len() + 1;
                    self.fault.get_or_insert((face, written));
                    vertices.push(0);
                }
            }
            self.uvs.set(corner, uv.and_then(|uv| resolve(uv, seen[1])));
            let normal = normal.and_then(|normal| resolve(normal, seen[2]));
            self.normals.set(corner, normal);
        }
        self.highest = vertices.iter().copied().fold(self.highest, u32::max);
        self.vertices.push(vertices);
        Ok(())
    }

    /// Checks that all vertices exist.
    pub fn check(&self, vertices: usize) -> Result<(), ReadFault> {
        let exists = |&vertex: &u32| (vertex as usize) < vertices;
        let too_high = || {
            let mut faces = self.vertices.iter().enumerate();
            let (polygon, vertex) =
                faces.find_map(|(at, face)| Some((at, *face.iter().find(|v| !exists(v))?)))?;
            let omitted = self.omitted.partition_point(|&before| before <= polygon);
            Some((polygon + omitted + 1, i64::from(vertex) + 1))
        };
        let missing = (!exists(&self.highest)).then(too_high).flatten();
        match missing
            .into_iter()
            .chain(self.fault)
            .min_by_key(|(face, _)| *face)
        {
            Some((face, index)) => Err(ReadFault::VertexOutOfRange {
                face,
                index,
                count: vertices,
                numbering: if index == 0 { ", numbered from 1" } else { "" },
            }),
            None => Ok(()),
        }
    }

    /// The normal of every vertex, zero where no corner gives one; `None` if none does. Several
    /// are averaged over the triangles of the faces, so that it does not matter whether a face
    /// is written as these.
    pub fn vertex_normals(&self, vertices: usize, normals: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
        let mut only: Vec<Option<u32>> = Vec::new();
        let mut sums = Vec::new();
        let mut differ = Vec::new();
        let mut first_corner = 0;
        for (polygon, division) in self.vertices.divided() {
            for place in division.corners().flatten() {
                let corner = first_corner + place;
                let Some(normal) = self.normals.get(corner, normals.len()) else {
                    continue;
                };
                if only.is_empty() {
                    only = vec![None; vertices];
                    sums = vec![[0.0; 3]; vertices];
                    differ = vec![false; vertices];
                }
                let vertex = polygon[place] as usize;
                let value = normals[normal as usize];
                let first = *only[vertex].get_or_insert(normal);
                differ[vertex] |= normals[first as usize] != value;
                sums[vertex] = vector::add(sums[vertex], vector::normalize(value));
            }
            first_corner += polygon.len();
        }
        if only.is_empty() {
            return None;
        }
        let means = only.into_iter().zip(sums).zip(differ);
        Some(
            means
                .map(|((only, sum), differ)| match only {
                    Some(normal) if !differ => normals[normal as usize],
                    _ => vector::normalize(sum),
                })
                .collect(),
        )
    }

    /// The UVs, if every corner has one.
    pub fn uv_map(&self, uvs: Vec<[f32; 2]>) -> Option<Uvs> {
        let corners = self.uvs.all(self.vertices.corners().len(), uvs.len())?;
        let mut rest = corners;
        let mut triangles = Vec::with_capacity(corners.len() - 2 * self.vertices.len());
        for (polygon, division) in self.vertices.divided() {
            let (corners, others) = rest.split_at(polygon.len());
            triangles.extend(division.of(corners));
            rest = others;
        }
        UvMap::new(uvs, triangles).ok().map(Uvs::Mesh)
    }
}

/// A zero-based index: positive ones count from 1, negative ones back from the `seen`-th.
/// Nothing if there can never be such an entry.
pub(super) fn resolve(written: i64, seen: usize) -> Option<u32> {
    let index = if written > 0 {
        written - 1
    } else if written < 0 {
        i64::try_from(seen).ok()?.checked_add(written)?
    } else {
        return None;
    };
    u32::try_from(index).ok().filter(|&index| index != MISSING)
}

const MISSING: u32 = u32::MAX;

/// What the corners refer to in a table; takes no memory as long as there is nothing.
#[derive(Default)]
pub(super) struct References {
    indices: Vec<u32>,
}

impl References {
    /// Corners are set in ascending order.
    fn set(&mut self, corner: usize, index: Option<u32>) {
        if let Some(index) = index {
            self.indices.resize(corner, MISSING);
            self.indices.push(index);
        }
    }

    /// What a corner refers to, if it exists in a table of `count` entries.
    pub fn get(&self, corner: usize, count: usize) -> Option<u32> {
        let index = self.indices.get(corner).copied();
        index.filter(|&index| (index as usize) < count && index != MISSING)
    }

    /// What all corners refer to, if it exists.
    fn all(&self, corners: usize, count: usize) -> Option<&[u32]> {
        let exist = (0..corners).all(|corner| self.get(corner, count).is_some());
        exist.then_some(&self.indices)
    }
}
